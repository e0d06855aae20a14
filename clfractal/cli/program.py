"""The shell's commands: arguments in, work out. The commands stand in the files `list_*.py`."""

from __future__ import annotations

import gc
import threading
from collections.abc import Sequence
from copy import copy
from typing import Annotated

import typer
from typer.models import CommandInfo

from clfractal.cli import list_facts, list_grids, list_pictures, list_proposals, list_scenes, list_window
from clfractal.cli.completion import check_shell
from clfractal.cli.options import app
from clfractal.cli.progress import Patience
from clfractal.cli.shell import Shell
from clfractal.errors import STATUS_BAD_INPUT, STATUS_INTERRUPTED
from clfractal.files import resources

__all__ = [
    "app",
    "call",
    "list_facts",
    "list_grids",
    "list_pictures",
    "list_proposals",
    "list_scenes",
    "list_window",
]

# As `clfractal --help` lists them; a command that is missing here comes last.
_ORDER = (
    "render",
    "animate",
    "sound",
    "view",
    "watch",
    "scenes",
    "new",
    "import",
    "vary",
    "find",
    "slices",
    "check",
    "probe",
    "formulas",
    "devices",
    "precompile",
    "bench",
    "voxelize",
    "mesh",
    "schema",
)

LOADED_AFTER_SECONDS = 2.0


def _name_of(command: CommandInfo) -> str:
    return str(command.name or getattr(command.callback, "__name__", ""))


_PLACES = {name: place for place, name in enumerate(_ORDER)}
app.registered_commands.sort(key=lambda command: _PLACES.get(_name_of(command), len(_ORDER)))


def call(arguments: Sequence[str], shell: Shell) -> int:
    """Runs the command that the arguments name; gives the exit status.

    Typer only reads the arguments and returns the work as a function, which runs outside Typer.

    Raises:
        ClfractalError: and whatever else a command raises.
    """
    check_shell(arguments)
    try:
        work = _application(arguments)(
            list(arguments), prog_name="clfractal", obj=shell, standalone_mode=False
        )
    except SystemExit as ended:  # Typer's answers to shells that complete a command line
        return ended.code if isinstance(ended.code, int) else STATUS_BAD_INPUT
    except Exception as error:
        # Typer's own errors: their classes differ between its versions, but all have this method.
        tell = getattr(error, "format_message", None)
        if tell is None:
            raise
        command = getattr(getattr(error, "ctx", None), "command_path", "clfractal")
        text = " ".join(str(tell()).split()).rstrip(".")
        shell.refuse(f"{command}: {text}; see {command} --help")
        return STATUS_BAD_INPUT
    if work == STATUS_INTERRUPTED:  # Typer's status for Ctrl-C
        raise KeyboardInterrupt
    if callable(work):
        if not gc.isenabled():
            # What the start has made stays until the end, so it is no garbage: only newer objects are searched, and these
            # from when the command has loaded what it needs.
            gc.freeze()
            later = threading.Timer(LOADED_AFTER_SECONDS, gc.enable)
            later.daemon = True
            later.start()
        shell.mute_drivers()
        with Patience(shell):
            work()
    return 0


def _application(arguments: Sequence[str]) -> typer.Typer:
    """The commands; only the one that comes first, if one does: Typer takes a millisecond to make each of them."""
    alone = copy(app)
    alone.registered_commands = [
        command for command in app.registered_commands if [_name_of(command)] == list(arguments[:1])
    ]
    return alone if alone.registered_commands else app


def _version(wanted: bool) -> None:
    if wanted:
        typer.echo(f"clfractal {resources.__version__}")
        raise typer.Exit


@app.callback()
def root(
    _version: Annotated[
        bool, typer.Option("--version", help="Show the version.", callback=_version, is_eager=True)
    ] = False,
) -> None:
    """Renders 3D fractals with OpenCL: YAML scenes in, finished pictures out."""
