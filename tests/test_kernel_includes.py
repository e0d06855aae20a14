"""No kernel file needs another one that needs it: by its includes, or by the functions, types and macros that it uses.

A name that a file declares and another one defines (`INLINE real part_through(real value, world w);`) is that file's own:
so it says what is asked of those who include it. Names that macros put together (`box_span` of a shape) are not seen.

And kernels stay readable: no function above 80 lines (of files `test_layers.py` counts the lines).
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from graphlib import CycleError, TopologicalSorter
from pathlib import PurePosixPath

from clfractal.device.orbit import SHAPE_KINDS
from clfractal.device.source import kinds
from clfractal.files.resources import folder
from clfractal.schema.kinds import members
from clfractal.schema.light import SingleLight
from clfractal.shading.light_records import LIGHT_KINDS

Graph = dict[str, set[str]]

_COMMENT = re.compile(r"//[^\n]*|/\*.*?\*/", re.DOTALL)
_INCLUDE = re.compile(r'^[ \t]*#[ \t]*include[ \t]*"([^"]*)"', re.MULTILINE)
_DIRECTIVE = re.compile(r"^[ \t]*#(?:\\\n|[^\n])*", re.MULTILINE)
_MACRO = re.compile(r"[ \t]*#[ \t]*define[ \t]+(\w+)(?:\(([^)]*)\))?")
_BRACES = re.compile(r"\{[^{}]*\}")
_FUNCTION = re.compile(
    r"\b(?:INLINE|CALLED|DIRECT|__kernel)\b[^;@(]*?(?:__attribute__\(\(\w+\)\)[^;@(]*?)?(\w+)\((?:[^()]|\([^()]*\))*\)\s*[@;]"
    r"|\bSTAGE\((\w+)"
)
_OTHER = re.compile(
    r"\btypedef\b[^;]*?(\w+)(?:\[[^;]*\])?\s*(?:__attribute__[^;]*)?;|\b__constant\b[^;=@()]*?(\w+)(?:\[\w*\])*\s*="
)
_ENUM = re.compile(r"\benum\s*\{([^}]*)\}")
# What stands between a type and an equals sign, a comma or the like.
_LOCAL = re.compile(
    r"\b(?!(?:return|else|case|goto)\b)[A-Za-z_]\w*[ *]+(?:const )?(\w+)(?=\s*[=;,)\[:])|,\s*\*?(\w+)(?=\s*=[^=])"
)
# A member of a struct is no name of a file.
_NAME = re.compile(r"(?<![\w.])(?<!->)([A-Za-z_]\w*)(\s*\()?")


def texts() -> dict[str, str]:
    """The text of each file, without comments, by its path in the folder of kernels."""
    root = folder("kernels")
    return {
        path.relative_to(root).as_posix(): _COMMENT.sub(" ", path.read_text("utf-8"))
        for path in root.rglob("*.[ch]*")
    }


def included(name: str, files: Mapping[str, str]) -> set[str]:
    """The files that a file includes: a path beside it or from the folder of kernels, or all files of a folder."""
    found: set[str] = set()
    for path in _INCLUDE.findall(files[name]):
        beside = (PurePosixPath(name).parent / path).as_posix()
        found |= {one for one in (beside, path) if one in files}
        found |= {one for one in files if PurePosixPath(one).parent.as_posix() == path}
    return found


def declared(text: str) -> dict[str, bool]:
    """The names that a text declares or defines; whether each is a function, of which only calls count."""
    names = {found[1]: False for found in map(_MACRO.match, _DIRECTIVE.findall(text)) if found}
    code = _DIRECTIVE.sub("", text)
    for listed in _ENUM.findall(code):
        names |= dict.fromkeys(re.findall(r"\b[A-Z]\w+", listed), False)
    while (outer := _BRACES.sub("@", code)) != code:
        code = outer
    for pattern, is_function in ((_OTHER, False), (_FUNCTION, True)):
        names |= {name: is_function for found in pattern.findall(code) for name in found if name}
    return names


def scopes(text: str) -> Iterator[tuple[str, set[str]]]:
    """The functions and macros of a text, with the names that each has for itself."""
    lines = _DIRECTIVE.findall(_INCLUDE.sub("", text))
    for part in (*lines, *re.split(r"(?<=\n\})", _DIRECTIVE.sub("", text))):
        macro = _MACRO.match(part)
        own = set(re.findall(r"\w+", macro[2] or "")) if macro else set[str]()
        yield part, own | {name for found in _LOCAL.findall(part) for name in found if name}


def used(text: str) -> Iterator[tuple[str, bool]]:
    """The names that a text uses, and whether it calls them."""
    for scope, own in scopes(text):
        yield from ((name, bool(call)) for name, call in _NAME.findall(scope) if name not in own)


def needs(files: Mapping[str, str]) -> Graph:
    """Which files each file needs in any program: those that it includes, and those there that have the names it uses."""
    includes = {name: included(name, files) for name in files}
    names = {name: declared(text) for name, text in files.items()}
    uses = {name: set(used(text)) for name, text in files.items()}
    graph = {name: set(those) for name, those in includes.items()}
    for entry in (name for name in files if name.endswith(".cl")):
        program, new = set[str](), {entry}
        while new:
            program |= new
            new = set().union(*(includes[name] for name in new)) - program
        where: Graph = {}
        for name in program:
            for word in names[name]:
                where.setdefault(word, set()).add(name)
        for name in program:
            for word, call in uses[name]:
                if word not in names[name]:
                    graph[name] |= {other for other in where.get(word, ()) if call or not names[other][word]}
    return graph


def circle(graph: Graph) -> list[str]:
    try:
        TopologicalSorter(graph).prepare()
    except CycleError as error:
        return list(reversed(error.args[1]))
    return []


def test_no_kernel_file_needs_one_that_needs_it() -> None:
    files = texts()
    graph = needs(files)
    assert circle(graph) == []
    # Most of what a file uses, somebody else has included.
    assert sum(map(len, graph.values())) > 4 * sum(len(included(name, files)) for name in files)


def test_names_are_found() -> None:
    text = """
#define LINES(a, b) \\
    both(a, b)
enum { KIND_ONE, KIND_TWO };
typedef struct { real x; } point;
INLINE real asked(point p);
CALLED void told(const point *p) { if (p) { later(p->x); } }
STAGE(meet) { return; }
"""
    assert declared(text) == {
        "LINES": False,
        "KIND_ONE": False,
        "KIND_TWO": False,
        "point": False,
        "asked": True,
        "told": True,
        "meet": True,
    }
    assert {("both", True), ("later", True), ("real", False)} <= set(used(text))
    assert not {"a", "p", "x"} & {name for name, _ in used(text)}


def test_circles_are_found() -> None:
    """One file includes the other, which uses what the first one has said before."""
    files = {
        "one.cl": '#include "first.h"\n',
        "first.h": 'typedef int thing;\n#include "second.h"\nINLINE int use(thing a) { return helped(a); }\n',
        "second.h": "INLINE int helped(thing a) { return a; }\n",
    }
    assert set(circle(needs(files))) == {"first.h", "second.h"}
    assert circle(needs({**files, "second.h": "INLINE int helped(int thing) { return thing; }\n"})) == []


def test_what_a_file_declares_is_its_own() -> None:
    """Who includes a file that asks for a function may define it behind the include."""
    files = {
        "one.cl": '#include "asks.h"\nINLINE int answer(int a) { return a; }\n__kernel void k(int a) { ask(a); }\n',
        "asks.h": "INLINE int ask(int a) { return answer(a); }\n",
    }
    assert set(circle(needs(files))) == {"one.cl", "asks.h"}
    assert circle(needs({**files, "asks.h": "INLINE int answer(int a);\n" + files["asks.h"]})) == []


# --- files of kernels: short functions, and all that is asked of a kind ---


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
    """Shapes of scenes and of kernels are the same, and each has what is asked of it, and what paths ask for."""
    assert SHAPE_KINDS.keys() == {kind.tag for kind in members("shapes")}
    assert kinds("elements/shapes/emitters").keys() == kinds("elements/shapes").keys()
    check_functions("geometry/shapes.h", "elements/shapes", 6)
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
    check_functions("shading/light_places.h", "elements/lights/area_lights", 5)


def check_functions(interface: str, family: str, count: int) -> None:
    """Each kind of a family has the functions that its interface says."""
    kernels = folder("kernels")
    asked = re.findall(r"^//   \w+ NAME_(\w+)\(", (kernels / interface).read_text("utf-8"), re.MULTILINE)
    assert len(asked) == count
    for name in kinds(family):
        found = dict(functions((kernels / family / f"{name}.h").read_text("utf-8")))
        assert {f"{name}_{function}" for function in asked} <= set(found)
