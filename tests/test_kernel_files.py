"""Kernels stay readable: no function above 80 lines (of files `test_layers.py` counts the lines)."""

from __future__ import annotations

import re
from collections.abc import Iterator

from clfractal.device.orbit import SHAPE_KINDS
from clfractal.device.source import kinds
from clfractal.files.resources import folder
from clfractal.schema.kinds import members
from clfractal.schema.light import SingleLight
from clfractal.schema.shape import solids
from clfractal.shading.light_records import LIGHT_KINDS

MOST_LINES = 80
# A function's or a kernel's name, at the left; its body begins on the same line or a few lines below.
_HEAD = re.compile(
    r"^(?:(?:INLINE|CALLED|static inline|__kernel)\b[^;{]*?(?=\b\w+\()|STAGE\()(\w+)", re.MULTILINE
)


def functions(text: str) -> Iterator[tuple[str, int]]:
    """Names of the functions of a file, and their lines from the first of the head to the closing brace."""
    lines = text.splitlines()
    for head in _HEAD.finditer(text):
        first = text.count("\n", 0, head.start())
        if lines[first].rstrip().endswith("}"):
            yield head[1], 1
            continue
        end = next(number for number in range(first, len(lines)) if lines[number].startswith("}"))
        yield head[1], end - first + 1


def test_no_function_of_a_kernel_is_long() -> None:
    found = {
        f"{path.name}: {name}": count
        for path in folder("kernels").rglob("*.[ch]*")
        for name, count in functions(path.read_text("utf-8"))
    }
    assert len(found) > 300
    assert {name: count for name, count in found.items() if count > MOST_LINES} == {}


def test_functions_are_counted() -> None:
    text = "INLINE int one(int a) { return a; }\n\n__kernel void two(\n    int a) {\n    a = 1;\n}\n"
    assert list(functions(text)) == [("one", 1), ("two", 4)]


def test_each_shape_is_a_file_with_all_functions() -> None:
    """Shapes of scenes and of kernels are the same, and each has what is asked of it; solids, what paths ask for too."""
    assert SHAPE_KINDS.keys() == {kind.tag for kind in members("shapes")}
    assert kinds("elements/shapes/emitters").keys() == {kind.tag for kind in solids()}
    check_functions("geometry/shapes.h", "elements/shapes", 5)
    check_functions("shading/emitter_places.h", "elements/shapes/emitters", 2)
    for name in SHAPE_KINDS:
        # How its span is found is said by a constant, so that a loop over objects has no others' code.
        text = (folder("kernels") / f"elements/shapes/{name}.h").read_text("utf-8")
        assert re.search(rf"^enum {{ {name}_turn = (EQUATION|SEARCH) }};$", text, re.MULTILINE), name


def test_each_light_is_a_file_with_all_functions() -> None:
    """Lights with records, of scenes and of kernels; those that rays can meet have all that is asked of these."""
    single = [kind for kind in members("lights") if issubclass(kind, SingleLight)]
    assert LIGHT_KINDS.keys() == {kind.tag for kind in single}
    assert kinds("elements/lights/area_lights").keys() == {kind.tag for kind in single if kind.is_seen}
    check_functions("shading/light_at.h", "elements/lights", 1)
    check_functions("shading/light_places.h", "elements/lights/area_lights", 4)


def check_functions(interface: str, family: str, count: int) -> None:
    """Each kind of a family has the functions that its interface says."""
    kernels = folder("kernels")
    asked = re.findall(r"^//   \w+ NAME_(\w+)\(", (kernels / interface).read_text("utf-8"), re.MULTILINE)
    assert len(asked) == count
    for name in kinds(family):
        found = dict(functions((kernels / family / f"{name}.h").read_text("utf-8")))
        assert {f"{name}_{function}" for function in asked} <= set(found)
