"""Drivers that begin before they are asked for."""

from __future__ import annotations

from tests.shell import python, works


def test_drivers_that_began_ahead_are_those_that_are_found() -> None:
    code = (
        "import os; from clfractal.device import ahead, select\n"
        "before = dict(os.environ)\n"
        "ahead.begin(); ahead.begin()\n"
        "found = select.devices()\n"
        "assert ahead.began() and dict(os.environ) == before\n"
        "print(*found, sep='\\n')"
    )
    plain = "from clfractal.device import select; print(*select.devices(), sep='\\n')"
    found = works(python(code)).out
    assert found
    assert found == works(python(plain)).out


def test_what_does_not_begin_ahead_fails_where_it_is_asked_for() -> None:
    """Here a process without the functions; and one that may not use OpenCL, which is told by who asks."""
    code = (
        "import ctypes; from clfractal.device import ahead, forked, select\n"
        "ctypes.CDLL = lambda name: object()\n"
        "ahead.begin(); assert not ahead.began()\n"
        "forked._lost = True\n"
        "ahead.begin()\n"
        "try: select.devices()\n"
        "except Exception as error: print(type(error).__name__)"
    )
    assert works(python(code)).out.split() == ["DeviceError"]
