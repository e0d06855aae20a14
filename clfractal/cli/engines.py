"""The engine that an order asks for: of a device, or of a cluster."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

from clfractal.cli.order import Order
from clfractal.cli.shell import Shell
from clfractal.errors import FileError, SceneError, Where

if TYPE_CHECKING:
    from clfractal.engine.any_engine import AnyEngine


def drivers_ahead(order: Order) -> None:
    """Lets the drivers begin that an order will ask for, while what renders is loaded."""
    if order.cluster is None:
        from clfractal.device import ahead

        ahead.begin()


@contextmanager
def engine_of(order: Order, shell: Shell) -> Iterator[AnyEngine]:
    """The engine on which an order is rendered; of a cluster it is closed at the end.

    Raises:
        ClfractalError: there is no such device or cluster.
    """
    if order.cluster is None:
        drivers_ahead(order)
        from clfractal.engine.engine import Engine

        yield Engine(order.device, tell=shell.say)
        return
    try:
        from clfractal.cluster.cluster import Cluster

        cluster = Cluster(order.cluster, device=_of_worker(order), tell=shell.say)
    except (SceneError, FileError) as error:
        if error.where.path != "cluster":
            raise
        raise type(error)(error.message, Where("--cluster")) from error
    with cluster:
        yield cluster.engine()


def _of_worker(order: Order) -> str | None:
    """The device of each worker."""
    named = order.device or ()
    given = (named,) if isinstance(named, str) else tuple(named)
    if len(given) > 1 or given == ("all",) or any("+" in name for name in given):
        raise SceneError("must be one device, that of each worker, with --cluster", Where("--device"))
    return given[0] if given else None


def shares_of(engine: AnyEngine) -> list[dict[str, Any]] | None:
    """What each worker of a cluster has done, for `--stats`; None without a cluster."""
    from dataclasses import asdict

    shares = getattr(engine.executor, "shares", None)
    if shares is None:
        return None
    return [
        {
            name: round(value, 3) if isinstance(value, float) else value
            for name, value in asdict(share).items()
        }
        for share in shares()
    ]
