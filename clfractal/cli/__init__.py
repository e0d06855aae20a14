"""The command `clfractal`: arguments in, an exit status out, one line for whatever goes wrong.

Imports almost nothing, because Ctrl-C has to work from the first moment on; each command imports
what it needs.
"""

from __future__ import annotations

import gc
import os
import sys
from collections.abc import Sequence
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from clfractal.cli.shell import Shell


def main() -> None:
    """Runs the program and ends the process.

    The process ends at once: a driver's clean-up is skipped, because it may take long, hang or crash.
    """
    _fill_descriptors()
    _start_fast()
    from clfractal.cli import interrupt

    shell: Shell | None = None

    def last_words() -> None:
        if shell is not None:
            shell.interrupted()
        else:
            os.write(2, b"clfractal: interrupted\n")

    def forced() -> None:
        last_words()
        _clear_away(in_order=False)

    try:
        interrupt.watch(forced)
        from clfractal.cli.shell import Shell

        shell = Shell(owns_process=True)
        shell.tell_warnings()
        status = run(sys.argv[1:], shell)
        _clear_away()
    except KeyboardInterrupt:
        # While this is handled the traceback keeps every object of the driver alive: none is waited for.
        last_words()
        _clear_away()
        os._exit(interrupt.status())
    os._exit(status)


def _clear_away(*, in_order: bool = True) -> None:
    """Removes the folder that drivers write into, if one was made. Out of order nothing is waited for."""
    folder = sys.modules.get("clfractal.device.drivers_folder")
    if folder is not None:
        folder.remove(in_order=in_order)


def _start_fast() -> None:
    """Leaves out what the start of this program does not need: it is most of the time of a small picture.

    Searches for garbage find none among what modules leave behind, and take a tenth of the start: see `app.call`. The
    others are settings of libraries, which the user's own come before: plug-ins are looked for in every installed package,
    and a pool of threads for matrices, which are all small here, is made by the import of NumPy.
    """
    gc.disable()
    os.environ.setdefault("PYDANTIC_DISABLE_PLUGINS", "__all__")
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")


def _fill_descriptors() -> None:
    """Opens the standard streams that whoever started the program has closed.

    The next files that are opened would get their numbers, and what is written to a stream would go into them.
    """
    for number in range(3):
        try:
            os.fstat(number)
        except OSError:
            os.open(os.devnull, os.O_RDWR)  # takes the lowest number that is free


def run(arguments: Sequence[str], shell: Shell) -> int:
    """Runs a command and gives its exit status.

    Raises:
        KeyboardInterrupt: it was interrupted.
    """
    try:
        from clfractal.cli.program import call

        return call(arguments, shell)
    except Exception as error:
        from clfractal.cli import interrupt

        if interrupt.came():
            # Its KeyboardInterrupt became something else on the way: where it met a lock that was just being waited for,
            # that is released twice; and the thread that ends by force may have closed a file under the clean-up.
            raise KeyboardInterrupt from error
        return shell.fail(error)
