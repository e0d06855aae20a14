"""Where a cluster is: the address of a scheduler, or so many workers on this machine."""

from __future__ import annotations

import re
import ssl
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from clfractal.errors import DeviceError, FileError, SceneError, Where

_MOST_LOCAL = 256
_LEAST_PORT = 1023
_TLS = "distributed.comm.tls"
_PROTOCOLS = ("tcp", "tls", "ws", "wss", "ucx", "ucxx", "inproc")


@dataclass(frozen=True, slots=True)
class Place:
    """Where a cluster is.

    Attributes:
        address: of its scheduler; empty for workers of this machine's.
        workers: how many of those are started.
    """

    address: str
    workers: int = 0

    @classmethod
    def of(cls, text: str) -> Place:
        """The place that `local:4` or `tcp://host:8786` names.

        Raises:
            SceneError: it names none.
        """
        text = text.strip()
        local = re.fullmatch(r"local:(\d{1,6})", text, re.ASCII)
        if local is not None:
            count = int(local[1])
            if not 1 <= count <= _MOST_LOCAL:
                raise SceneError(
                    f"must be local:1 to local:{_MOST_LOCAL}, got {text!r}", Where(path="cluster")
                )
            return cls("", count)
        found = re.fullmatch(r"(?:([a-z]+)://)?([^\s/:]+|\[[0-9a-fA-F:.]+\]):(\d{1,5})", text, re.ASCII)
        if (
            found is None
            or found[2] == "local"
            or (found[1] or "tcp") not in _PROTOCOLS
            # Small numbers are those of `local`, with a letter wrong: schedulers have none, unless it is said in full.
            or not (0 if found[1] else _LEAST_PORT) < int(found[3]) < 65536
        ):
            raise SceneError(
                f"must be a scheduler such as tcp://HOST:8786, or local:N for N workers here; got {text[:60]!r}",
                Where(path="cluster"),
            )
        return cls(f"{found[1] or 'tcp'}://{found[2]}:{found[3]}")

    def __str__(self) -> str:
        return self.address or f"local:{self.workers}"


def library() -> Any:
    """The package `distributed`; FileError if it is not there."""
    try:
        import distributed
    except ImportError:
        where = Where(path="cluster")
        raise FileError("needs the package distributed: pip install 'clfractal[cluster]'", where) from None
    return distributed


def check_certificates(place: Place, security: Any) -> None:
    """Makes sure that an address of `tls://` comes with certificates, which Dask asks for only while it connects.

    Raises:
        SceneError: there are none.
        FileError: one is not there, cannot be read, or is none.
    """
    if not place.address.startswith(("tls:", "wss:")):
        return
    used = security if security is not None else library().Security()
    authority, own, key = used.tls_ca_file, used.tls_client_cert, used.tls_client_key
    for option, file in (("ca-file", authority), ("client.cert", own), ("client.key", key)):
        if file:
            _check_readable(file, f"{_TLS}.{option}")
        elif option != "client.key":  # the key may stand in the certificate's file
            raise SceneError(
                f"{place} needs certificates: Dask's configuration has no {_TLS}.{option}",
                Where(path="cluster"),
            )
    with _located(authority, "holds no certificate of an authority"):
        given = {"cadata": authority} if _is_text(authority) else {"cafile": authority}
        ssl.create_default_context(**given)
    what = "has no key, which Dask's configuration does not name" if not key else "does not go with its key"
    with _located(own, f"{what}, or is no certificate"):
        used.get_connection_args("client")


def _is_text(file: str) -> bool:
    """Whether it is a certificate itself, and no name of a file: Dask takes both."""
    return "\n" in file


def _check_readable(file: str, option: str) -> None:
    if _is_text(file):
        return
    try:
        Path(file).open("rb").close()
    except FileNotFoundError:
        raise FileError(f"is not there; it is {option} of Dask's configuration", Where(file)) from None
    except OSError as error:
        raise FileError(
            f"cannot be read: {error.strerror}; it is {option} of Dask's configuration", Where(file)
        ) from error


@contextmanager
def _located(file: str, problem: str) -> Iterator[None]:
    """Tells of a certificate that cannot be used."""
    try:
        yield
    except OSError as error:  # those of `ssl` are some, too
        where = Where(path="cluster") if _is_text(file) else Where(file)
        raise FileError(problem, where, details=str(error)) from error


async def start(workers: int) -> Any:
    """A scheduler and its workers, processes of one thread each, on this machine.

    Raises:
        DeviceError: status 3, they cannot be started.
    """
    from dask import config

    # A worker that is killed is not the work's fault here; nor is there anybody to look at a dashboard.
    try:
        with config.set({"distributed.scheduler.allowed-failures": 100}):
            return await library().LocalCluster(
                n_workers=workers,
                threads_per_worker=1,
                processes=True,
                dashboard_address=None,
                memory_limit=0,
                asynchronous=True,
                silence_logs=False,
            )
    except (OSError, RuntimeError, TimeoutError) as error:
        raise DeviceError(f"local:{workers}: the workers cannot be started: {error}") from error
