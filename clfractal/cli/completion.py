"""Completion of command lines, done by Typer: which shells can have it, and words that stand for values."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from pathlib import Path

from clfractal.errors import ClfractalError, FileError, Where

SHELLS = ("bash", "zsh", "fish", "powershell", "pwsh")
OPTIONS = ("--install-completion", "--show-completion")
"""Typer's options, for the shell that the program was started from."""


def check_shell(arguments: Sequence[str]) -> None:
    """Makes sure that a shell whose completion is asked for is one that has it.

    Raises:
        FileError: it has none, or the program was not started from a shell.
    """
    if not arguments or arguments[0] not in OPTIONS:
        return
    import shellingham  # a part of Typer

    try:
        found = str(shellingham.detect_shell()[0])
    except shellingham.ShellDetectionFailure:
        found = ""
    if found not in SHELLS:
        here = f"this one is {found}" if found else "none was found that started the program"
        raise FileError(
            f"is for bash, zsh, fish and PowerShell; {here}. For another shell than the one that runs: "
            "_CLFRACTAL_COMPLETE=source_bash clfractal",
            Where(arguments[0]),
        )


def formula_names(incomplete: str) -> list[str]:
    """Formulas of the library and one's own whose names begin so."""
    from clfractal.formulas import catalog
    from clfractal.formulas.own import own_files

    try:
        own: Iterable[str] = own_files(Path())
    except ClfractalError:
        own = ()
    return _beginning(incomplete, (*catalog.names(), *own))


def scene_names(incomplete: str) -> list[str]:
    """Scenes that come with the program."""
    from clfractal.files import resources

    return _beginning(incomplete, sorted(path.stem for path in resources.folder("scenes").glob("*.yaml")))


def quality_presets(incomplete: str) -> list[str]:
    """Presets of quality."""
    from clfractal.engine.quality import PRESETS

    return _beginning(incomplete, PRESETS)


def precisions(incomplete: str) -> list[str]:
    """Number types."""
    return _beginning(incomplete, ("auto", "float32", "float64"))


def kinds_of_devices(incomplete: str) -> list[str]:
    """Words for devices that need no look at any."""
    return _beginning(incomplete, ("cpu", "gpu", "all"))


def _beginning(start: str, words: Iterable[str]) -> list[str]:
    return [word for word in words if word.startswith(start)]
