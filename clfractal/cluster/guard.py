"""Whether a program may start processes, each of which runs the program's file again."""

from __future__ import annotations

import ast
import multiprocessing
import sys
from pathlib import Path
from types import FrameType

from clfractal.errors import SceneError, Where

_NAME = "__name__"


def check_main(what: str) -> None:
    """Makes sure that the processes of a cluster of this machine do not begin with making one themselves.

    Args:
        what: is being made, such as `local:2`.

    Raises:
        SceneError: the program's file makes it wherever it is imported; or this is a process that imports it.
    """
    if getattr(multiprocessing.current_process(), "_inheriting", False) or _runs_everywhere():
        raise SceneError(
            f"{what} starts processes, and each runs the program's file again: put what makes the cluster below"
            ' `if __name__ == "__main__":`',
            Where(path="cluster"),
        )


def _runs_everywhere() -> bool:
    """Whether a line of the main module, in no function, runs now, and nothing before it in its file asks for the name."""
    main = sys.modules.get("__main__")
    spec, file = getattr(main, "__spec__", None), getattr(main, "__file__", None)
    # What `python -m PACKAGE` runs is not run again; neither is what was typed.
    if main is None or file is None or (spec is not None and str(spec.name).endswith("__main__")):
        return False
    frame: FrameType | None = sys._getframe()
    while frame is not None and not (frame.f_globals is main.__dict__ and frame.f_code.co_name == "<module>"):
        frame = frame.f_back
    if frame is None:
        return False
    try:
        module = ast.parse(Path(file).read_bytes())
    except (OSError, SyntaxError, ValueError):
        return False
    # (One may stand within a `try` or a `with`.)
    before = [each for each in ast.walk(module) if isinstance(each, ast.If) and each.lineno <= frame.f_lineno]
    return not any(
        isinstance(part, ast.Name) and part.id == _NAME for each in before for part in ast.walk(each.test)
    )
