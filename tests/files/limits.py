"""A disk that is nearly full, made without special rights; files replaced without waiting for the disk."""

from __future__ import annotations

import resource
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path


@contextmanager
def file_size_limit(size: int) -> Iterator[None]:
    """Writing beyond `size` bytes of any file fails, as on a full disk (told as: File too large)."""
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (size, hard))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))


def rewrite(path: Path, content: bytes) -> None:
    """Puts a new file in the place of an old one; some file systems are slow to overwrite one."""
    path.unlink(missing_ok=True)
    path.write_bytes(content)
