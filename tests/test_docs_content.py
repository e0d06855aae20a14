"""What docs/ says is compared with the program: keys, defaults, ranges, options, channels, names, messages.

A table of the documentation is found by its heading, and read as lists of cells. That the code in the pages
runs is the matter of `test_docs.py`.
"""

from __future__ import annotations

import inspect
import json
import os
import posixpath
import re
import shlex
from dataclasses import fields
from fractions import Fraction
from pathlib import Path
from typing import Any, cast, get_args

import numpy as np
import pytest
import typer
from PIL import Image

import clfractal
from clfractal import api, errors
from clfractal.cli.program import app
from clfractal.device import cache, select
from clfractal.engine import frames
from clfractal.files import document, regular
from clfractal.files.channels import CHANNELS, DEFAULT_CHANNELS
from clfractal.files.exr import read_exr
from clfractal.files.png import read_texts
from clfractal.formulas import (
    binding,
    build,
    build_blocks,
    build_orbit,
    build_parameters,
    catalog,
    chain,
    evaluate,
    names,
    nodes,
    own,
    parser,
    turns,
)
from clfractal.formulas import definition as model
from clfractal.images.anaglyph import IDEAL, Filter, Floats, Glasses, Method, matrices, mix
from clfractal.images.modes import eye_size, picture_size
from clfractal.images.outputs import output_files
from clfractal.integrators import lanes
from clfractal.scene import environment, lighting, load, palettes, parts
from clfractal.scene.stereo import Mode, Stereo
from clfractal.stereo.eyes import degrees
from clfractal.viewer import settings
from clfractal.viewer.keys import KeyMap
from clfractal.viewer.settings import Settings
from tests.document import DOCS, PAGES, code, section, table, text
from tests.ghosting import REAL_RED_CYAN, ghosting, leaking
from tests.makers import maker, pictured
from tests.shell import SCENE, InProcess, process, works

PACKAGE = Path(clfractal.__file__).resolve().parent


# --- scenes ---


def test_every_part_of_a_scene_is_described() -> None:
    told = [name for page in PAGES for name in maker("make_reference").sections_of(text(page))]
    assert sorted(told) == sorted(load.schema()["$defs"])
    keys = {code(row[0]) for row in table("scenes.md", "The top level")}
    assert keys == set(load.schema()["properties"])
    required = {code(row[0]) for row in table("scenes.md", "The top level") if row[1] == "required"}
    assert required == set(load.schema()["required"])


@pytest.mark.parametrize("page", PAGES)
def test_keys_defaults_and_ranges_are_those_of_the_schema(page: str) -> None:
    assert maker("make_reference").made(text(page)) == text(page), "run docs/make_reference.py"


def test_limits_of_scene_files() -> None:
    limits = {
        "pixels": parts.MAX_PIXELS,
        "lights": lighting.MAX_LIGHTS,
        "bytes of a text file": regular.MAX_BYTES,
        "values in a file": document.MAX_NODES,
        "levels of nesting": document.MAX_DEPTH,
    }
    assert {row[0]: int(row[1].replace(",", "")) for row in table("scenes.md", "Limits")} == limits


def test_maps_and_palettes_of_the_program() -> None:
    assert [code(row[0]) for row in table("light.md", "An environment")] == list(environment.names())
    for row, periodic in zip(table("coloring.md", "Palettes"), (False, True), strict=True):
        own = [name for name, palette in palettes.PALETTES.items() if palette.periodic is periodic]
        assert re.findall(r"`(\w+)`", row[1]) == own


# --- formulas ---


def test_every_key_of_a_formula_is_described() -> None:
    rows = table("formulas.md", "The keys")
    assert {code(row[0]) for row in rows} == set(build._KEYS)
    assert {code(row[0]) for row in rows if row[1] == "required"} == set(build._REQUIRED)
    assert {code(row[0]) for row in table("formulas.md", "Parameters")} == set(
        build_parameters._PARAMETER_KEYS
    )
    assert {code(row[0]) for row in table("formulas.md", "Chains")} == set(catalog._CHAIN_KEYS)


def test_every_function_of_the_language_is_described() -> None:
    told = [
        call for row in table("formulas.md", "Functions") for call in re.findall(r"`(\w+\(.*?\))`", row[0])
    ]
    arguments = {call.partition("(")[0]: call.count(",") + 1 for call in told}
    assert arguments == {**nodes.PARAMETER_FUNCTIONS, "min": 3, "max": 3}  # written with an ellipsis


def test_reserved_names_are_told() -> None:
    told = set(re.findall(r"`(\w+)`", section("formulas.md", "Names")))
    assert names._RESERVED - set(nodes.FUNCTIONS) <= told


def test_the_message_about_the_formula_of_the_tutorial(here: Path, clf: InProcess) -> None:
    page = section("formulas.md", "A formula of one's own")
    for name, content in re.findall(r"^cat > (\S+) <<'END'\n(.*?)^END$", page, re.M | re.S):
        (here / name).write_text(content.replace("re*cos(turn) - im", "re*cos(trn) - im"))
    told = re.search(r"`(tricorn\.yaml:.*)`\.", page)
    assert told
    assert clf("check", "scene.yaml").err == told[1] + "\n"


def test_limits_of_formulas() -> None:
    limits = {
        "characters of an expression": parser.MAX_TEXT,
        "numbers, names and operations of an expression": parser.MAX_NODES,
        "levels of nesting": parser.MAX_DEPTH,
        "constant exponents": evaluate.MAX_EXPONENT,
        "numbers, names and operations of an expression, functions and vectors written in": parser.MAX_EXPANDED,
        "parameters": build_parameters.MAX_PARAMETERS,
        "names in `let`": build_orbit.MAX_LETS,
        "numbers in `state`": build_orbit.MAX_STATE,
        "`functions`": build_orbit.MAX_FUNCTIONS,
        "statements": build_blocks.MAX_STATEMENTS,
        "conditions and loops within each other": build_blocks.MAX_BLOCKS,
        "turns of a loop": build_blocks.MAX_TURNS,
        "numbers, names and operations of all statements": build_blocks.MAX_WRITTEN,
        "the same, each turn of a loop counted": build_blocks.MAX_DONE,
        "`repeat`": model.MAX_REPEAT,
        "formulas in a chain": chain.MAX_LINKS,
        "`count` of a formula in a chain": chain.MAX_COUNT,
        "`start`, `stop` of a formula in a chain": turns.MAX_START,
        "`bounds.radius`": binding.MAX_RADIUS,
        "`bailout`, `distance_bailout`": binding.MAX_BAILOUT,
    }
    assert {row[0]: float(row[1].replace(",", "")) for row in table("formulas.md", "Limits")} == limits


def library_row(name: str) -> list[str]:
    """Name, title and parameters of a formula of the library."""
    title = str(catalog.description(name)["title"])
    if catalog.is_chain(name):
        links = (f"{link['name']} x {link['count']}" for link in catalog.description(name)["chain"])
        return [f"`{name}`", title, "a chain: " + ", ".join(links)]
    parameters = (f"`{each.name}` {each.default:.4g}" for each in catalog.load(name).parameters)
    return [f"`{name}`", title, ", ".join(parameters) or "none"]


def test_the_library_is_told_in_full() -> None:
    assert table("formulas.md", "The library") == [library_row(name) for name in catalog.names()]


# --- the command line ---


def commands() -> dict[str, Any]:
    return dict(vars(typer.main.get_command(app))["commands"])


def test_every_command_and_option_is_described() -> None:
    assert {code(row[0]).split()[1] for row in table("command-line.md", "Commands")} == set(commands())
    for name, command in commands().items():
        known = {
            option
            for each in command.params
            for option in (*each.opts, *each.secondary_opts)
            if option.startswith("-")
        }
        told = set(re.findall(r"(?<![\w-])--?[a-z][a-z-]*", section("command-line.md", f"clfractal {name}")))
        assert told == known, name


def test_exit_statuses() -> None:
    told = {int(row[0]) for row in table("command-line.md", "Exit status")}
    signals = {errors.STATUS_INTERRUPTED, *(errors.STATUS_SIGNALLED + number for number in (1, 2, 15))}
    assert told == {0, errors.STATUS_BAD_INPUT, errors.STATUS_DEVICE_FAILED, *signals}


def test_environment_variables() -> None:
    told = {code(row[0]) for row in table("command-line.md", "Environment variables")}
    ours = {select.ENVIRONMENT_VARIABLE, lanes.LANES_VARIABLE, cache.ENVIRONMENT_VARIABLE}
    ours |= {settings.ENVIRONMENT_VARIABLE, own.FOLDERS_VARIABLE, cache.SIZE_VARIABLE}
    assert ours == {name for name in told if name.startswith("CLFRACTAL_")}
    sources = "\n".join(path.read_text(encoding="utf-8") for path in PACKAGE.rglob("*.py"))
    assert set(re.findall(r'"(CLFRACTAL_\w+)"', sources)) == ours | {"CLFRACTAL_TEST_ABORT"}


@pytest.mark.parametrize("row", table("command-line.md", "Messages"), ids=lambda row: str(row[0]))
def test_messages(row: list[str], here: Path, clf: InProcess) -> None:
    """Each mistake of the table, tried; the scene is in `scene.yaml`."""
    (here / "scene.yaml").write_text(section("command-line.md", "Messages").split("```")[1].split("\n", 1)[1])
    ended = clf(*shlex.split(code(row[0]))[1:])
    assert ended.err == code(row[1]) + "\n"
    assert ended.status == errors.STATUS_BAD_INPUT


# --- a render, and what it leaves ---


@pytest.fixture(scope="module")
def rendered(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with a.exr, a.png and stats.json."""
    folder = tmp_path_factory.mktemp("rendered")
    (folder / "scene.yaml").write_text(SCENE)
    outputs = ("-o", "a.exr", "-o", "a.png", "--stats", "stats.json")
    works(process(["render", "scene.yaml", "--quiet", *outputs], folder))
    return folder


def test_keys_of_the_statistics(rendered: Path) -> None:
    told = [code(row[0]) for row in table("command-line.md", "Statistics")]
    assert told == list(json.loads((rendered / "stats.json").read_text()))


def test_attributes_of_pictures(rendered: Path) -> None:
    usual = section("pictures-and-channels.md", "Attributes of an EXR").partition("|")[0]
    told = {code(row[0]) for row in table("pictures-and-channels.md", "Attributes of an EXR")}
    _, header = read_exr(rendered / "a.exr")
    assert told | set(re.findall(r"`(\w+)`", usual)) == set(header)
    chunks = {code(row[0]) for row in table("pictures-and-channels.md", "Text chunks of a PNG")}
    assert chunks == set(read_texts(rendered / "a.png"))


def test_channels() -> None:
    told = [row[:4] for row in table("pictures-and-channels.md", "Channels")]
    by_default = {name: "yes" if name in DEFAULT_CHANNELS else "no" for name in CHANNELS}
    assert told == [[f"`{c.name}`", by_default[c.name], c.precision, c.kind] for c in CHANNELS.values()]


# --- Python ---


def test_the_python_api_is_described() -> None:
    page = text("python.md")
    missing = [
        name for name in dir(clfractal) if not name.startswith("__") and f"`clfractal.{name}" not in page
    ]
    assert missing == []
    for function in (api.render, api.render_pair, api.escape, frames.frames):
        told = {code(row[0]) for row in table("python.md", f"clfractal.{function.__name__}")}
        assert told == set(inspect.signature(function).parameters)


# --- all pages ---


@pytest.mark.parametrize("page", PAGES)
def test_files_that_a_page_names_exist(page: str) -> None:
    """`clfractal/camera/views.py`, `march.h`: a page for engineers outlives its files only too easily."""
    named = set(re.findall(r"`((?:clfractal|kernels|tests|benchmarks|scenes)/[\w./]+\.\w+)`", text(page)))
    assert [name for name in sorted(named) if not os.path.exists(DOCS.parent / name)] == []


def anchors(page: str) -> set[str]:
    """The anchors of a page's headings, as the usual hosts make them."""
    headings = re.findall(r"^#+ (.+)$", re.sub(r"^```.*?^```$", "", text(page), flags=re.M | re.S), re.M)
    return {re.sub(r"[^\w -]", "", heading).strip().lower().replace(" ", "-") for heading in headings}


@pytest.mark.parametrize("page", PAGES)
def test_links_to_pages_and_headings(page: str) -> None:
    for name, heading in re.findall(r"\]\(([\w./-]+\.md)?(?:#([^)]+))?\)", text(page)):
        linked = posixpath.normpath(posixpath.join(posixpath.dirname(page), name)) if name else page
        assert (DOCS / linked).is_file(), linked
        assert not heading or heading in anchors(linked), (linked, heading)


# --- what files say of themselves ---


def test_the_map_stays_a_map() -> None:
    assert len(text("architecture.md").splitlines()) <= 250
    assert len(text("glossary.md").splitlines()) <= 40
    missing = [
        page for page in PAGES if page.startswith("engineering/") and page not in text("architecture.md")
    ]
    assert missing == []
    folders = {path.parent.name for path in PACKAGE.glob("*/__init__.py")}
    assert folders <= {
        name for row in table("architecture.md", "Folders") for name in re.findall(r"`(\w+)`", row[0])
    }


def test_the_list_of_modules_is_what_the_files_say() -> None:
    made = maker("make_modules").page()
    assert (DOCS / "engineering" / "modules.md").read_text("utf-8") == made, "run docs/make_modules.py"
    files = [path for path in PACKAGE.rglob("*.py") if path.name not in ("__init__.py", "__main__.py")]
    files += [path for path in (DOCS.parent / "kernels").rglob("*") if path.is_file()]
    assert [path.name for path in files if f"| `{path.name}` |" not in made] == []


def test_every_file_says_in_one_breath_what_it_is_for() -> None:
    purpose = maker("make_modules").purpose
    for path in PACKAGE.rglob("*.py"):
        assert len(path.read_text("utf-8").partition("\n")[0]) <= 110, path
        assert purpose(path).endswith("."), path
    for path in (DOCS.parent / "kernels").rglob("*.[ch]*"):
        assert purpose(path), path


# --- the window ---


def test_the_table_of_keys() -> None:
    told = [tuple(row) for row in table("window.md", "Keys")]
    assert told == KeyMap.defaults().help_rows()


def shown(value: Any) -> str:
    if isinstance(value, bool):
        return str(value).lower()
    return f"{value:g}" if isinstance(value, int | float) else str(value)


def test_the_table_of_settings() -> None:
    expected = []
    for field in fields(Settings):
        rules = field.metadata
        if field.name == "keys":
            expected.append([f"`{field.name}`", "`{}`", "actions and keys", rules["told"]])
            continue
        bounds = f"{rules['least']:g} to {rules['most']:g}" if "least" in rules else ""
        words = bounds or " or ".join(rules.get("words") or ()) or "true or false"
        expected.append([f"`{field.name}`", f"`{shown(field.default)}`", words, rules["told"]])
    assert table("window.md", "Settings") == expected


def test_every_gesture_of_the_help_is_told() -> None:
    from clfractal.viewer.panels.help import POINTER_ROWS

    page = (DOCS / "window.md").read_text(encoding="utf-8").lower()
    for gesture, _ in POINTER_ROWS:
        first = gesture.split(":")[0].split("+")[0].split()[-1].lower()
        assert first in page, gesture


# --- tables, numbers, drawings and scenes of docs/stereo.md ---


WIDTH, HEIGHT = 640, 360


def stereo_of(**keys: object) -> Stereo:
    """A section with these keys, and the defaults."""
    return Stereo.model_validate(keys)


def size(cell: str) -> tuple[int, int]:
    """The pixels that `2W x H` or `W/2 x H` stand for."""
    parts = re.fullmatch(r"(\d*)W(/\d+)? x (\d*)H(/\d+)?", cell)
    assert parts, cell
    wide, narrow, high, low = parts.groups()
    across = Fraction(WIDTH * int(wide or 1), int((narrow or "/1")[1:]))
    down = Fraction(HEIGHT * int(high or 1), int((low or "/1")[1:]))
    return int(across), int(down)


def test_modes_and_their_sizes() -> None:
    rows = table("stereo.md", "Ways to show")
    assert {code(row[0]) for row in rows} == set(get_args(Mode))
    for row in rows:
        stereo = stereo_of(mode=code(row[0]))
        assert size(row[1]) == eye_size(stereo, (WIDTH, HEIGHT)), row[0]
        assert size(row[2]) == picture_size(stereo, (WIDTH, HEIGHT)), row[0]


def test_files_of_a_mode() -> None:
    *apart, others = table("stereo.md", "Files")
    assert others[0] == "others"
    told = {code(row[0]): row for row in apart}
    for mode in get_args(Mode):
        for column, suffix in ((1, "exr"), (2, "png")):
            files = re.findall(r"`([\w.]+)`", told.get(mode, others)[column])
            assert [str(path) for path in output_files(stereo_of(mode=mode), f"out.{suffix}")] == files


def test_measures_of_a_screen() -> None:
    for width, distance, nearest, farthest, infinity in table("stereo.md", "Comfort"):
        screen, place = float(width.partition(",")[0]), float(distance)
        stereo = stereo_of(screen_width=screen, screen_distance=place)
        apart = stereo.interpupillary_distance
        # A point at depth z before the eyes: e (1 - d / z).
        assert degrees(stereo, apart * (1 - place / float(nearest))) == pytest.approx(-1, abs=0.07)
        if farthest == "no limit":
            assert degrees(stereo, apart) < 1
        else:
            assert degrees(stereo, apart * (1 - place / float(farthest))) == pytest.approx(1, abs=0.07)
        assert infinity == f"{float(degrees(stereo, apart)):+.2f} degrees"


def chart() -> tuple[Floats, Floats]:
    """Squares of all four combinations of black and white; shape (1, 4, 3) for each eye."""
    left, right = (
        np.array([[[value] * 3 for value in row]], np.float32) for row in ([0, 0, 1, 1], [0, 1, 0, 1])
    )
    return left, right


def percent(method: Method, glasses: Glasses, filters: tuple[Filter, Filter]) -> str:
    by = matrices(method, glasses)
    found = ghosting(lambda left, right: mix(left, right, by), *chart(), glasses, filters)
    return ", ".join(f"{100 * share:.1f}" for share in found).replace("0.0, 0.0", "0, 0")


def test_ghosting() -> None:
    rows = table("stereo.md", "Ghosting")
    assert len(rows) == 2 * len(IDEAL)
    for row in rows:
        names = re.findall(r"`(\w+)`", row[0])
        glasses, method = cast("Glasses", names[0]), cast("Method", names[1])
        as_this: tuple[Method, ...] = ("color", "half_color", "gray") if method == "color" else (method,)
        for same in as_this:
            assert percent(same, glasses, IDEAL[glasses]) == row[1]
            assert percent(same, glasses, leaking(glasses, 0.05)) == row[2]
            assert row[3] == (percent(same, glasses, REAL_RED_CYAN) if glasses == "red_cyan" else "")


def test_glasses() -> None:
    primaries = ("red", "green", "blue")
    for row in table("stereo.md", "Anaglyphs"):
        told = [tuple(float(name in cell) for name in primaries) for cell in row[1:]]
        assert told == list(IDEAL[cast("Glasses", code(row[0]))])


def test_the_angle_that_keeps_the_camera() -> None:
    told = re.search(r"screen's angle:\n?\s*([\d.]+) degrees for the defaults and 16 : 9", text("stereo.md"))
    assert told
    stereo = stereo_of()
    high = stereo.screen_width * 9 / 16
    assert float(told[1]) == round(2 * np.degrees(np.arctan(high / 2 / stereo.screen_distance)), 1)


@pictured
def test_drawings_are_there_and_as_they_are_made(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    drawings = maker("make_drawings")
    monkeypatch.setattr(drawings, "PICTURES", tmp_path)
    drawings.main([])
    for name in drawings.DRAWINGS:
        kept = DOCS / "pictures" / f"{name}.png"
        assert kept.stat().st_size <= drawings.LARGEST_FILE
        assert f"](pictures/{name}.png)" in text("stereo.md") + text("architecture.md")
        with Image.open(kept) as there, Image.open(tmp_path / f"{name}.png") as made:
            assert there.size == made.size
            # Fonts are drawn a little differently by other versions of their library.
            difference = np.asarray(there.convert("RGB"), float) - np.asarray(made.convert("RGB"), float)
            assert np.abs(difference).mean() < 2


def stereo_scenes() -> list[clfractal.Scene]:
    return [clfractal.load_scene(path) for path in sorted((DOCS.parent / "scenes").glob("stereo_*.yaml"))]


def test_there_are_stereo_scenes_of_three_formulas_and_a_volume() -> None:
    scenes = stereo_scenes()
    assert all(scene.stereo is not None for scene in scenes)
    assert len({scene.formula.name for scene in scenes}) >= 3
    assert {"surface", "volume"} <= {scene.renderer.type for scene in scenes}
    assert any(scene.cut_planes for scene in scenes)
    assert any(scene.stereo and scene.stereo.mode == "split" and scene.stereo.swap for scene in scenes)
