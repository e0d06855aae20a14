"""The mistakes themselves: small, each in one place, never in a comment, and every file of the program has tests."""

from __future__ import annotations

import sys
from importlib.util import find_spec
from pathlib import Path

import pytest

from tests.mutants.concerns import concerned
from tests.mutants.kernel_code import kernel_mutants
from tests.mutants.mutant import Mutant
from tests.mutants.sample import sample, sources
from tests.mutants.trial import Trial

CHECKOUT = Path(__file__).resolve().parents[2]
pytestmark = pytest.mark.skipif(
    not (CHECKOUT / "clfractal" / "api.py").exists(), reason="mistakes are put into a checkout"
)

needs_cosmic_ray = pytest.mark.skipif(
    find_spec("cosmic_ray") is None, reason="cosmic-ray comes with the extra `mutate`"
)

KERNEL = """\
// A comment with a + b, fmin(a, b) and 3.
#include "device/lanes.h"
#define SHARE R(0.5)   // of a + b
INLINE real twice(real a, __global const float *b) {
    real sum = a * R(2.0) - -b[1];
    sum += fmin(a, sum);
    if (a < b[0]) return pick(less(a, sum), sum, R(0.0));
    return sum;
}
"""


def changes(text: str) -> set[tuple[str, str]]:
    """What each mistake makes of its line."""
    found = set()
    for mutant in kernel_mutants("a.h", text):
        lines = zip(mutant.before.splitlines(), mutant.after.splitlines(), strict=True)
        ((_, after),) = [(before, after) for before, after in lines if before != after]
        found.add((mutant.what, after.strip()))
    return found


def test_mistakes_of_a_kernel() -> None:
    found = changes(KERNEL)
    assert {
        ("0.5 becomes 0.625", "#define SHARE R(0.625)   // of a + b"),
        ("* becomes /", "real sum = a / R(2.0) - -b[1];"),
        ("- becomes +", "real sum = a * R(2.0) + -b[1];"),
        ("- left out", "real sum = a * R(2.0) - b[1];"),
        ("1 becomes 2", "real sum = a * R(2.0) - -b[2];"),
        ("+= becomes -=", "sum -= fmin(a, sum);"),
        ("statement left out", ";"),
        ("fmin becomes fmax", "sum += fmax(a, sum);"),
        ("< becomes <=", "if (a <= b[0]) return pick(less(a, sum), sum, R(0.0));"),
        ("condition reversed", "if (!(a < b[0])) return pick(less(a, sum), sum, R(0.0));"),
        ("arguments of less swapped", "if (a < b[0]) return pick(less(sum, a), sum, R(0.0));"),
        ("arguments of pick swapped", "if (a < b[0]) return pick(less(a, sum), R(0.0), sum);"),
        ("0.0 becomes 1.0", "if (a < b[0]) return pick(less(a, sum), sum, R(1.0));"),
    } <= found
    # Nothing else but two numbers, and less_equal: no pointer, no comment, no arguments of one kind.
    assert len(found) == 16, found


@needs_cosmic_ray
def test_a_sample_is_the_same_for_a_seed_and_has_both_languages() -> None:
    first = list(sample(CHECKOUT, 12, 5))
    assert first == list(sample(CHECKOUT, 12, 5))
    assert first[:6] == list(sample(CHECKOUT, 6, 5))
    assert first != list(sample(CHECKOUT, 12, 6))
    assert len({(mutant.path, mutant.after) for mutant in first}) == 12
    names = sources(CHECKOUT)
    assert {Path(name).suffix for name in names} == {".py", ".cl", ".h"}
    assert all(name.startswith("kernels/") for name in sources(CHECKOUT, "kernels/*"))


@needs_cosmic_ray
def test_annotations_are_no_place_for_mistakes() -> None:
    from tests.mutants.python_code import python_mutant, python_places

    text = "from __future__ import annotations\n\ndef f(a: int | None, b: int = 3) -> int | str:\n    return b + 1\n"
    places = python_places(text)
    mutants = [mutant for place in places if (mutant := python_mutant("a.py", text, place)) is not None]
    assert {mutant.after.splitlines()[-1].strip() for mutant in mutants} >= {"return b - 1", "return b + 2"}
    assert all("int | None" in mutant.after for mutant in mutants)
    # Those of the annotations are places, too, and come to nothing.
    assert len(mutants) < len(places) or "BitOr" not in str(places)


def test_every_file_has_tests_that_are_there() -> None:
    for name in sources(CHECKOUT):
        tests = concerned(name, CHECKOUT)
        assert tests, name
        missing = [test for test in tests if not (CHECKOUT / test).exists()]
        assert not missing, (name, missing)
    assert concerned("clfractal/files/nrrd.py", CHECKOUT)[0].startswith("tests/files")
    assert concerned("kernels/integrators/march/queue.h", CHECKOUT)[0] == "tests/render/test_surface_rays.py"


@pytest.mark.skipif(sys.platform == "win32", reason="ends pytest by its process group")
def test_a_mistake_is_noticed_by_a_test_that_passes_without_it(tmp_path: Path) -> None:
    """In a checkout of a few files: a mistake that is noticed, though a test fails anyway, and one that is not."""
    before = "def twice(a):\n    return 2 * a + 0 * len(str(a))\n"
    for folder in ("clfractal", "kernels", "scenes", "tests", "docs", "benchmarks"):
        (tmp_path / "checkout" / folder).mkdir(parents=True)
    checkout = tmp_path / "checkout"
    for name in ("README.md", "CHANGELOG.md", "pyproject.toml", "Makefile"):
        (checkout / name).write_text("")
    (checkout / "clfractal" / "__init__.py").write_text("")
    for name in ("errors", "lone"):
        (checkout / "clfractal" / f"{name}.py").write_text(before)
    for name in ("cli", "api"):
        (checkout / "tests" / f"test_{name}.py").write_text("def test_nothing():\n    pass\n")
    (checkout / "tests" / "test_errors.py").write_text(
        "from clfractal.errors import twice\n"
        "def test_that_always_fails():\n    raise ValueError\n"
        "def test_twice():\n    assert twice(3) == 6\n"
    )
    trial = Trial(checkout, tmp_path / "trial", quick=False)
    noticed = trial.of(Mutant("clfractal/errors.py", "3", before, before.replace("2 * a", "3 * a")))
    assert (noticed.verdict, noticed.by) == ("killed", "tests/test_errors.py::test_twice")
    missed = trial.of(Mutant("clfractal/lone.py", "1", before, before.replace("len", "bool")))
    assert (missed.verdict, missed.by) == ("survived", "")
    assert "-    return 2 * a + 0 * len(str(a))" in missed.mutant.diff()
    for tree in (checkout, trial.tree):
        assert (tree / "clfractal" / "errors.py").read_text() == before
