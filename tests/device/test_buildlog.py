"""Logs of several compilers, reduced to the lines that matter, with the form each of them has."""

from __future__ import annotations

import pytest

from clfractal.device.buildlog import Diagnostic, build_error, diagnostics
from clfractal.device.source import SourceMap

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
