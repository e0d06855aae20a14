"""One flat text, with every line's origin; and logs of several compilers, reduced to the lines that matter."""

from __future__ import annotations

from pathlib import Path

import pytest

from clfractal.device.buildlog import Diagnostic, build_error, diagnostics
from clfractal.device.source import SourceMap, flatten, origin
from clfractal.errors import KernelBuildError


@pytest.fixture
def kernels(tmp_path: Path) -> Path:
    (tmp_path / "numbers").mkdir()
    (tmp_path / "main.cl").write_text('#include "a.h"\n#include "numbers/n.h"\nmain\n')
    (tmp_path / "a.h").write_text("a1\na2\n")
    (tmp_path / "numbers" / "n.h").write_text('n1\n# include "m.h"\n#include "a.h"\nn4\n')
    (tmp_path / "numbers" / "m.h").write_text("m1\n")
    return tmp_path


def test_every_text_is_taken_in_once_and_lines_keep_their_origin(kernels: Path) -> None:
    flat = flatten("main.cl", kernels=kernels)
    assert flat.text.splitlines() == [
        '#line 1 "kernels/main.cl"',
        '#line 1 "kernels/a.h"',
        "a1",
        "a2",
        '#line 2 "kernels/main.cl"',
        '#line 1 "kernels/numbers/n.h"',
        "n1",
        '#line 1 "kernels/numbers/m.h"',
        "m1",
        '#line 3 "kernels/numbers/n.h"',
        '#line 4 "kernels/numbers/n.h"',
        "n4",
        '#line 3 "kernels/main.cl"',
        "main",
    ]
    assert sorted(flat.sources.texts) == [
        "kernels/a.h",
        "kernels/main.cl",
        "kernels/numbers/m.h",
        "kernels/numbers/n.h",
    ]


def test_the_origin_of_every_line_is_right(kernels: Path) -> None:
    flat = flatten("main.cl", kernels=kernels, generated={"a.h": "g1\ng2"}, defines={"LANES": 8})
    for number, line in enumerate(flat.text.splitlines(), start=1):
        if line.startswith("#"):
            continue
        place = origin(flat.text, number)
        assert place is not None
        name, original = place
        assert flat.sources.texts[name].splitlines()[original - 1] == line
    assert origin(flat.text, 1) is None


def test_generated_texts_and_defines(kernels: Path) -> None:
    flat = flatten(
        "entry",
        kernels=kernels,
        generated={"entry": '#include "a.h"\n', "a.h": "mine[LANES]"},
        defines={"LANES": 8, "NEVER_NAMED": 1},
        user=["a.h"],
    )
    assert flat.text.splitlines()[0] == "#define LANES 8"
    assert "mine[LANES]" in flat.text.splitlines()
    # It would make another program of the same text.
    assert "NEVER_NAMED" not in flat.text
    assert flat.sources.texts["generated/a.h"] == "mine[LANES]"
    assert flat.sources.user == {"a.h"}


@pytest.mark.parametrize(
    ("line", "message"),
    [
        ('#include "aa.h"', r"^generated/entry:2: there is no kernel file 'aa.h'; did you mean 'a.h'\?$"),
        ('#include "../outside.h"', "^generated/entry:2: there is no kernel file"),
        ('#include "/etc/passwd"', "^generated/entry:2: there is no kernel file"),
        ("#include <math.h>", "^generated/entry:2: only #include \"...\" is possible, got '<math.h>'$"),
    ],
)
def test_includes_that_cannot_be(kernels: Path, line: str, message: str) -> None:
    (kernels.parent / "outside.h").write_text("outside")
    with pytest.raises(KernelBuildError, match=message) as caught:
        flatten("entry", kernels=kernels, generated={"entry": "first\n" + line})
    assert caught.value.status == 3


def test_an_excerpt_shows_the_line_between_its_neighbours() -> None:
    sources = SourceMap({"f": "one\n\ttwo = x;\nthree\nfour"})
    assert sources.excerpt("f", 2, 8) == (
        "    1 | one\n    2 |     two = x;\n      |           ^\n    3 | three"
    )
    assert sources.excerpt("f", 1) == "    1 | one\n    2 |     two = x;"
    assert sources.excerpt("f", 9) == ""
    assert sources.excerpt("g", 1) == ""


# --- logs of compilers ---


_TEXT = '#define LANES 8\n#line 1 "kernels/march.h"\nreal a;\nreal b = undeclared;\nreal c;\n'
_SOURCES = SourceMap({"kernels/march.h": "real a;\nreal b = undeclared;\nreal c;\n"})
_LOGS = {
    "PoCL": "error: kernels/march.h:2:10: use of undeclared identifier 'undeclared'\nDevice cpu failed",
    "Clang": "warning: x\nkernels/march.h:2:10: error: use of undeclared identifier 'undeclared'\n real b",
    "Intel": "Started\nkernels/march.h:2:10: error: use of undeclared identifier 'undeclared'\nfailed",
    "Oclgrind": "input.cl:4:10: error: use of undeclared identifier 'undeclared'\nreal b = undeclared;\n ^",
    "NVIDIA": "<kernel>:4:10: error: use of undeclared identifier 'undeclared'\nreal b = undeclared;\n",
}


@pytest.mark.parametrize("compiler", sorted(_LOGS))
def test_the_place_and_an_excerpt(compiler: str) -> None:
    error = build_error(_LOGS[compiler], _TEXT, _SOURCES, "a device")
    assert str(error) == (
        "kernels/march.h:2:10: the kernel does not build on a device: "
        "use of undeclared identifier 'undeclared'"
    )
    assert error.details.startswith(
        "    1 | real a;\n    2 | real b = undeclared;\n      |          ^\n    3 | real c;\n\n"
    )
    assert error.details.endswith(_LOGS[compiler])
    assert error.status == 3


def test_other_forms() -> None:
    assert diagnostics('"kernels/a.h", line 7: error: expected a ";"') == [
        Diagnostic("kernels/a.h", 7, None, 'expected a ";"')
    ]
    assert diagnostics("kernels/a.h(7): error C1234: no") == [Diagnostic("kernels/a.h", 7, None, "no")]
    assert diagnostics("kernels/a.h:7:1: fatal error: no") == [Diagnostic("kernels/a.h", 7, 1, "no")]


def test_warnings_and_notes_are_no_errors() -> None:
    log = "warning: kernels/a.h:1:2: unused\nkernels/a.h:1:2: warning: unused\nkernels/a.h:3:1: note: here\n"
    assert diagnostics(log) == []


def test_an_error_in_our_files_goes_before_one_elsewhere() -> None:
    log = "builtins.h:9:9: error: in a header of the driver\nkernels/march.h:2:1: error: called here"
    assert str(build_error(log, "", _SOURCES, "d")).startswith("kernels/march.h:2:1: ")


def test_a_users_formula_is_status_2() -> None:
    sources = SourceMap({"generated/formula.h": "x"}, frozenset({"formula.h"}))
    error = build_error("generated/formula.h:1:1: error: no", "", sources, "d")
    assert error.status == 2


@pytest.mark.parametrize(("log", "reason"), [("", "no reason given"), ("\nlink failed\nmore", "link failed")])
def test_a_log_of_unknown_form_is_still_one_line(log: str, reason: str) -> None:
    error = build_error(log, _TEXT, _SOURCES, "d")
    assert str(error) == f"the kernel does not build on d: {reason}"
    assert error.details == log
