"""`clfractal new`: a scene file to start from, with comments, that shows all of a formula in a good light."""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from clfractal.cli.shell import Shell
from clfractal.errors import ClfractalError, FileError, Where
from clfractal.files.atomic import atomic_writer, check_output
from clfractal.files.fragments import flow_text
from clfractal.formulas.catalog import check_has_set
from clfractal.scene.load import load_scene

if TYPE_CHECKING:
    from clfractal.engine.framing import Framing

EXTENSIONS = (".yaml", ".yml")

_TEXT = """\
# {title}
# `clfractal render {file}` makes a picture, `clfractal watch {file}` shows every change that is saved here, and
# `clfractal view {file}` opens a window to explore it.
version: 1

# `clfractal formulas {formula_name}` tells the formula's parameters; they are given as parameters: {{NAME: VALUE}}.
# More iterations show finer details.
formula: {formula}

image: {image}

# The angles are degrees round the target: azimuth 0 is in front, 90 on the right; elevation 90 is above.
# A smaller fov brings it nearer. With f_number: 8 and focus: auto only what lies in the middle is sharp.
camera:
  orbit: {orbit}
  target: {target}
  fov: {fov}

# `direction` is where light travels to. angular_size: 3 makes soft shadows.
lights:
{lights}
material: {material}

# The colour follows how near the orbit of a point comes to the origin. Scale and offset spread the palette over what
# is seen here.
# A palette is a name, or a list of colours such as ["#1b1213", "#d95a1f", "#fdeabc"].
coloring: {coloring}

# More samples are smoother; `clfractal render --quality final` chooses them for you.
renderer: {renderer}

background: {background}
{fog}
# Stops: 1 is twice as bright.
output: {output}
"""


def new_scene(name: str, formula: str | None, device: str | None, shell: Shell) -> None:
    """Writes a scene file that shows all of a formula. A file that exists is never replaced.

    Args:
        name: of the file, with or without `.yaml`.
        formula: a name that scenes may use, or a formula file in the scene's folder or below; None: mandelbulb.

    Raises:
        ClfractalError: the file exists or cannot be written, the formula is wrong or shows nothing, or the device failed.
    """
    path = Path(name)
    if path.name in ("", ".."):
        raise FileError("must name a file", Where("NAME"))
    if path.suffix.lower() not in EXTENSIONS:
        path = path.with_name(f"{path.name}.yaml")
    check_output(path, EXTENSIONS)
    _check_new(path)
    section = _formula(formula or "mandelbulb", path.parent)
    try:
        scene = load_scene({"version": 1, "formula": section, "camera": {}}, folder=path.parent)
        check_has_set(scene.chain, Where("--formula"))
    except ClfractalError as error:
        if error.where.file is not None:
            raise
        raise type(error)(error.message, Where("--formula"), details=error.details) from error
    # Imported only now: mistakes in the input are reported without waiting for OpenCL.
    from clfractal.engine.engine import Engine
    from clfractal.engine.framing import framed

    shell.state = lambda: "clfractal: interrupted; nothing was written"
    shell.say("looking at the formula from all sides")
    with Engine(device, tell=shell.say) as engine:
        found = framed(section, path.parent, engine, name=Path(formula or "mandelbulb").stem)
    text = scene_text(path.name, section, found)
    _check_new(path)
    with atomic_writer(path) as beside:
        beside.write_text(text, encoding="utf-8")
    shell.state = lambda: "clfractal: interrupted"
    shell.say(
        f"{path}: {found.iterations} iterations, seen from {found.azimuth:g}° round and {found.elevation:g}° up"
    )


def scene_text(file: str, formula: Mapping[str, Any], found: Framing) -> str:
    """The text of a scene file, with comments.

    Args:
        file: its name.
        formula: the section without `iterations`.
    """
    sections = found.sections()
    camera = sections.pop("camera")
    fog = sections.pop("fog", None)
    lights = "".join(f"  - {flow_text(light)}\n" for light in sections.pop("lights"))
    kind, source = next(iter(formula.items()))
    title = Path(file).stem.replace("_", " ").replace("-", " ")
    return _TEXT.format(
        title=title[:1].upper() + title[1:],
        file=f'"{file}"' if " " in file else file,
        formula_name=source if kind == "name" else "NAME",
        formula=flow_text({**formula, "iterations": found.iterations}),
        lights=lights,
        fog=""
        if fog is None
        else f"# The set goes on beyond what is rendered of it; fog hides that end.\nfog: {flow_text(fog)}\n",
        orbit=flow_text(camera["orbit"]),
        target=flow_text(camera["target"]),
        fov=flow_text(camera["fov"]),
        **{name: flow_text(section) for name, section in sections.items()},
    )


def _formula(wanted: str, folder: Path) -> dict[str, Any]:
    """The section of a scene in a folder that names a formula, or a file."""
    if Path(wanted).suffix.lower() not in EXTENSIONS:
        return {"name": wanted}
    try:
        relative = Path(os.path.relpath(wanted, folder)).as_posix()
    except ValueError:  # on another drive
        relative = wanted
    if relative.startswith("../") or os.path.isabs(relative):
        raise FileError(
            f"must lie in the folder of the scene, {str(folder)!r}, or below, got {wanted[:80]!r}",
            Where("--formula"),
        )
    return {"file": relative}


def _check_new(path: Path) -> None:
    if os.path.lexists(path):
        raise FileError("exists already and is not replaced; choose another name", Where(str(path)))
