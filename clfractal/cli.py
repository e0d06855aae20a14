"""The command `clfractal`: arguments in, an exit status out, one line for whatever goes wrong."""

from __future__ import annotations

import os
import sys
from collections.abc import Sequence

from clfractal.commands import interrupt
from clfractal.commands.shell import Shell
from clfractal.errors import STATUS_INTERRUPTED


def main() -> None:
    """Runs the program and ends the process.

    The process is ended at once, without a driver's cleaning up, which may take long, hang or crash.
    """
    shell = Shell(owns_process=True)
    try:
        interrupt.watch(shell.interrupted, STATUS_INTERRUPTED)
        status = run(sys.argv[1:], shell)
    except KeyboardInterrupt:
        # While this is handled the traceback keeps every object of the driver alive: none is waited for.
        shell.interrupted()
        os._exit(STATUS_INTERRUPTED)
    os._exit(status)


def run(arguments: Sequence[str], shell: Shell) -> int:
    """Runs a command and gives its exit status.

    Raises:
        KeyboardInterrupt: it was interrupted.
    """
    try:
        from clfractal.commands.app import call

        return call(arguments, shell)
    except Exception as error:
        return shell.fail(error)
