"""Fragments that mean harm, or are damaged: a scene, or one line with the place; and nothing else is read."""

from __future__ import annotations

import builtins
import os
import random
from pathlib import Path
from typing import Any

import pytest

from clfractal.errors import ClfractalError, FileError
from clfractal.exchange.frag_file import parse_fragment
from clfractal.exchange.fragm import import_fragment_text
from clfractal.scene.load import load_scene
from tests.exchange.files import check_line
from tests.exchange.fragments import HEAD, MEANINGS, fragment

MUTATIONS = 900
WORDS = (
    *(
        "0",
        "-1",
        "1e30",
        "1e-30",
        "1e999",
        "0x7fffffff",
        "99999999999",
        "1.0",
        ".5",
        "true",
        "nan",
        "{",
        "}",
        "(",
        ")",
    ),
    *(
        "[",
        "]",
        ";",
        ",",
        "=",
        "==",
        "++",
        "&&",
        "?",
        ":",
        "vec3",
        "vec4",
        "mat3",
        "mat4",
        "float",
        "int",
        "for",
        "while",
    ),
    *(
        "if",
        "else",
        "return",
        "break",
        "continue",
        "DE",
        "pos",
        "z",
        "p",
        "Iterations",
        "Scale",
        "x",
        ".x",
        ".xyzw",
        "do",
    ),
    *(
        "uniform",
        "slider[0,1,2]",
        "color[1,1,1]",
        "#define A A",
        "#if 1\n",
        "#endif\n",
        "/*",
        "*/",
        "//",
        "switch",
        "void",
    ),
    *(
        "inout",
        "const",
        '#include "/etc/passwd"\n',
        '#include "../a.frag"\n',
        "pow",
        "mod",
        "log",
        "sqrt",
        "é",
        "\\",
        "@",
    ),
)


@pytest.fixture
def opened(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """The names of files that are opened from here on."""
    names: list[str] = []
    real = builtins.open

    def watched(file: Any, *arguments: Any, **options: Any) -> Any:
        names.append(os.fsdecode(file) if not isinstance(file, int) else str(file))
        return real(file, *arguments, **options)

    monkeypatch.setattr(builtins, "open", watched)
    return names


def mutated(text: str, chance: random.Random) -> str:
    words = text.split(" ")
    for _ in range(chance.randint(1, 4)):
        place = chance.randrange(len(words))
        kind = chance.choice(("word", "drop", "twice", "letter", "exchange", "cut"))
        if kind == "word":
            words[place] = chance.choice(WORDS)
        elif kind == "drop":
            words[place] = ""
        elif kind == "twice":
            words.insert(place, words[place])
        elif kind == "letter" and words[place]:
            at = chance.randrange(len(words[place]))
            words[place] = words[place][:at] + chr(chance.randrange(1, 300)) + words[place][at + 1 :]
        elif kind == "exchange":
            other = chance.randrange(len(words))
            words[place], words[other] = words[other], words[place]
        elif kind == "cut" and chance.random() < 0.2:
            del words[place:]
            words.append("")
    return " ".join(words)


def test_mutations_end_in_a_scene_or_in_one_line(tmp_path: Path, opened: list[str]) -> None:
    chance = random.Random(34)
    texts = [meaning.text for meaning in MEANINGS.values()]
    scenes = 0
    for number in range(MUTATIONS):
        text = mutated(texts[number % len(texts)], chance)
        try:
            found = import_fragment_text(text, "x.frag", folder=tmp_path)
            assert "\n" not in "".join(found.remarks)
            if number % 5 == 0:
                load_scene(found.text("x.frag"))
            scenes += 1
        except ClfractalError as error:
            check_line(error)
    assert MUTATIONS / 20 < scenes < MUTATIONS * 19 / 20
    # A package's own files may be; nothing that a text names.
    assert not [name for name in opened if "passwd" in name or name.endswith(".frag")]


def body(code: str, before: str = "") -> str:
    return f"{before}float DE(vec3 p) {{ {code} }}"


DOUBLED = "".join(f"#define {a} {b} {b} {b}\n" for a, b in zip("ABCDEFGHIJKL", "BCDEFGHIJKLM", strict=True))
LOOPS = "for (int i = 0; i < 16; i++) for (int j = 0; j < 16; j++) for (int k = 0; k < 16; k++) s += p.x;"
CALLS = "float f(vec3 p) { return g(p) + g(p); }\nfloat g(vec3 p) { return f(p) + f(p); }\n"
LARGE = [
    (body("return A;", DOUBLED), "macros stand for too much"),
    (body("return F(1.0);", "#define F(x) F(x) + G(x)\n#define G(x) F(x) F(x)\n"), "missing"),
    (body("return " + "(" * 500 + "1.0" + ")" * 500 + ";"), "nested too deep"),
    (body("return " + "- " * 900 + "1.0;"), "nested too deep"),
    (body("{" * 500 + "}" * 500 + " return 1.0;"), "nested too deep"),
    (body("float a = p.x; " + "a = a*a + a; " * 4000 + "return a;"), "it has too many operations"),
    (
        body("float a = p.x; " + "if (a > 0.1) a = sin(a); else a += cos(a); " * 300 + "return a;"),
        "too large",
    ),
    (body("return " + " + ".join(["p.x"] * 5000) + ";"), "so deep"),
    (body(f"float s = 0.0; {LOOPS} return s;"), ""),
    (body("return f(p);", CALLS), "functions call each other too deep"),
    (body("float a[64]; a[70] = 1.0; return a[0];"), "the index 70 of 64 values"),
    (body("float a[1000]; return a[0];"), "an array must have 1 to 64 values"),
    ("#if 1\n" * 100 + body("return 1.0;"), "#if are within each other too deep"),
    (body("return A;", "uniform float A; slider[0,1,1e40]\n"), "is too large"),
    (body("return 1.0;") + "\n" * 60_000, "lines"),
    ("a " * 120_000, "too long"),
    ("#preset P\n#endpreset\n" * 10 + "#preset Q\n" + "k = 1\n" * 10, "a function float DE"),
]


@pytest.mark.parametrize(("code", "message"), LARGE, ids=[str(number) for number in range(len(LARGE))])
def test_what_is_too_much(code: str, message: str) -> None:
    text = fragment(code, head=HEAD)
    if not message:
        load_scene(import_fragment_text(text, "x.frag").scene)
        return
    with pytest.raises(ClfractalError) as caught:
        import_fragment_text(text, "x.frag")
    check_line(caught.value)
    assert message in str(caught.value)


def test_a_file_that_is_too_large(tmp_path: Path) -> None:
    path = tmp_path / "a.frag"
    path.write_bytes(b"// " + b"a" * 1_100_000)
    with pytest.raises(FileError, match="too large"):
        load_scene(path)


def test_any_bytes(tmp_path: Path) -> None:
    chance = random.Random(3)
    path = tmp_path / "a.frag"
    for _ in range(60):
        path.write_bytes(bytes(chance.randrange(256) for _ in range(chance.randrange(200))))
        with pytest.raises(ClfractalError) as caught:
            load_scene(path)
        check_line(caught.value)


def test_comments_and_ends_of_lines() -> None:
    text = "/* a\n#if none\n*/ float a; // b\r\n#define long 1 + \\\n 2\r\nfloat b = long;"
    words = [word.text for word in parse_fragment(text, "x.frag").words]
    assert words == ["float", "a", ";", "float", "b", "=", "1", "+", "2", ";"]
