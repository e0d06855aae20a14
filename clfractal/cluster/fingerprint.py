"""Which program this is: what workers are compared by, since they must compute the same bits."""

from __future__ import annotations

import hashlib
from functools import cache

from clfractal.files import resources

_LENGTH = 12


@cache
def fingerprint() -> str:
    """A text that differs for programs with other sources or kernels, also where the version is the same.

    Line ends do not count: a checkout on Windows may have others.
    """
    found = hashlib.sha256(resources.__version__.encode())
    for home, pattern in ((resources.PACKAGE, "*.py"), (resources.folder("kernels"), "*")):
        files = {path.relative_to(home).as_posix(): path for path in home.rglob(pattern) if path.is_file()}
        for name in sorted(files):
            found.update(f"\n{name}\n".encode())
            found.update(files[name].read_bytes().replace(b"\r\n", b"\n"))
    return found.hexdigest()[:_LENGTH]
