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
from pathlib import Path
from typing import Any

import pytest
import typer

import clfractal
from clfractal import api, errors
from clfractal.cli.program import app
from clfractal.device import cache, select
from clfractal.engine import frames
from clfractal.files import document, regular
from clfractal.files.channels import CHANNELS, DEFAULT_CHANNELS
from clfractal.files.exr import read_exr
from clfractal.files.png import read_texts
from clfractal.formulas import binding, build, catalog, chain, evaluate, nodes, own, parser, turns
from clfractal.formulas import definition as model
from clfractal.integrators import lanes
from clfractal.scene import environment, lighting, load, palettes, parts
from clfractal.viewer import settings
from clfractal.viewer.keys import KeyMap
from clfractal.viewer.settings import Settings
from tests.document import DOCS, PAGES, code, section, table, text
from tests.makers import maker
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
    assert {code(row[0]) for row in table("formulas.md", "Parameters")} == set(build._PARAMETER_KEYS)
    assert {code(row[0]) for row in table("formulas.md", "Chains")} == set(catalog._CHAIN_KEYS)


def test_every_function_of_the_language_is_described() -> None:
    told = [
        call for row in table("formulas.md", "Functions") for call in re.findall(r"`(\w+\(.*?\))`", row[0])
    ]
    arguments = {call.partition("(")[0]: call.count(",") + 1 for call in told}
    assert arguments == {**nodes.PARAMETER_FUNCTIONS, "min": 3, "max": 3}  # written with an ellipsis


def test_reserved_names_are_told() -> None:
    told = set(re.findall(r"`(\w+)`", section("formulas.md", "Names")))
    assert build._RESERVED - set(nodes.FUNCTIONS) <= told


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
        "parameters": build.MAX_PARAMETERS,
        "names in `let`": build.MAX_LETS,
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
