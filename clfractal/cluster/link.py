"""A connection to a scheduler, and the workers there that take part; it runs in one event loop."""

from __future__ import annotations

import asyncio
import itertools
import os
import signal
import time
from collections import Counter
from collections.abc import Awaitable, Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, TypeVar
from uuid import uuid4

from clfractal.cluster.fingerprint import fingerprint
from clfractal.device.select import DeviceInfo, has_float64
from clfractal.files import resources

if TYPE_CHECKING:
    from clfractal.cluster.tasks import Seat

ANSWER_SECONDS = 10.0
"""How long a scheduler may take to answer."""
SILENT_SECONDS = 20.0
"""A worker that Dask has not heard of for so long has its work done by others."""
_LOOK_SECONDS = 0.5
_ENLIST_SECONDS = 120.0
_DIRECT_SECONDS = 2.0
_DOUBTS = 6

Tell = Callable[[str], None]
T = TypeVar("T")


class Lost(Exception):  # noqa: N818
    """The scheduler is gone, or no worker is left: what was under way has to be done again."""


@dataclass(frozen=True, slots=True)
class Member:
    """A worker that takes part.

    Attributes:
        address: where it is.
        name: what Dask calls it.
        device: what it renders with.
        pid: its process.
    """

    address: str
    name: str
    device: DeviceInfo
    pid: int


@dataclass(slots=True)
class Heard:
    """When Dask last heard of a worker, by its own clock, and when that was seen here."""

    last_seen: float
    at: float = field(default_factory=time.monotonic)


class Link:
    """One connection. It ends with its scheduler; `over` is then set, and a new one has to be made.

    Args:
        client: of Dask, asynchronous.
        seat: who asks, for which device.
        tell: told who is left out, and why.
        local: how many workers share this machine; None: they are elsewhere.
    """

    def __init__(self, client: Any, seat: Seat, tell: Tell, local: int | None) -> None:
        self.client, self._seat, self._tell, self._local = client, seat, tell, local
        self.members: dict[str, Member] = {}
        self.roll: tuple[Member, ...] = ()
        """The members that get work. Other threads may read it, since it is replaced and never changed."""
        self.refused: set[str] = set()
        self.reason = ""
        """Why the last one was refused."""
        self.has_lost = False
        """Whether a worker that was fit is gone: it may return."""
        self.left_out: set[str] = set()
        self.over = False
        """Whether the scheduler is gone."""
        self.news = asyncio.Event()
        """Set, and replaced by another one, whenever who takes part has changed."""
        self.on_news: Callable[[], None] = lambda: None
        self.direct = False
        self._scheduler: str | None = None
        self.under_way: dict[str, Any] = {}
        """Futures that somebody waits for, by key."""
        self._stuck: set[str] = set()
        self._doubts = 0  # looks until it is believed that no task is stuck
        self._unseen: set[str] = set()
        self._heard: dict[str, Heard] = {}
        self._enlisting: dict[str, asyncio.Task[None]] = {}

    async def watch(self) -> None:
        """Looks after the workers until the scheduler is gone."""
        try:
            for count in itertools.count():
                info = await asyncio.wait_for(self.client.scheduler.identity(), ANSWER_SECONDS)
                if self.client.status != "running" or self._scheduler not in (None, info["id"]):
                    break  # (Dask's client may have found another scheduler at this address by itself)
                self._scheduler = info["id"]
                await self._look(info["workers"])
                await self._find_stuck()
                # A large cluster tells much: it is asked less often.
                await asyncio.sleep((_LOOK_SECONDS if count else 0.1) * (1 + len(info["workers"]) / 100))
        except (OSError, TimeoutError, ValueError):
            pass
        finally:
            self.over = True
            self._changed()
            for task in self._enlisting.values():
                task.cancel()

    async def while_alive(
        self,
        awaited: Awaitable[T],
        future: Any,
        among: Sequence[str] | None = None,
        *,
        float64: bool = False,
    ) -> T:
        """What is awaited of a future, as long as there is somebody who can bring it.

        Args:
            among: the workers that can; None: any.
            float64: only those that have it can.

        Raises:
            Lost: there is nobody any more.
        """
        task = asyncio.ensure_future(awaited)
        self.under_way[future.key] = future
        try:
            while not task.done():
                fit = self.fit(float64)
                alive = not self.over and fit and future.key not in self._stuck
                if not alive or (among and not set(among) & set(fit)):
                    raise Lost
                news = asyncio.ensure_future(self.news.wait())
                try:
                    await asyncio.wait((task, news), return_when=asyncio.FIRST_COMPLETED)
                finally:
                    news.cancel()
            if task.cancelled():  # as Dask calls what is lost with a connection
                raise Lost
            return task.result()
        except OSError as error:
            # Of the connection: what a task has raised comes in another way.
            raise Lost from error
        finally:
            task.cancel()
            self.under_way.pop(future.key, None)
            self._stuck.discard(future.key)

    def _changed(self) -> None:
        self.roll = tuple(member for address, member in self.members.items() if address not in self.left_out)
        self.news.set()
        self.news = asyncio.Event()
        self.on_news()

    @property
    def joining(self) -> bool:
        """Whether a worker is being asked to take part."""
        return bool(self._enlisting)

    async def _look(self, workers: Mapping[str, Mapping[str, Any]]) -> None:
        for address in [address for address in (*self.members, *self._enlisting) if address not in workers]:
            self._gone(address)
        now = time.monotonic()
        for address, about in workers.items():
            heard = self._heard.get(address)
            if heard is None or heard.last_seen != about["last_seen"]:
                self._heard[address] = Heard(about["last_seen"])
            elif now - heard.at > SILENT_SECONDS + len(workers) / 20:
                if (
                    address in self.members or address in self._enlisting
                ):  # others' workers are not ours to judge
                    await self._dismiss(address)
                continue
            known = self.members.keys() | self.refused | self._enlisting.keys()
            if address not in known and about.get("status", "running") == "running":
                self._enlisting[address] = asyncio.create_task(self._enlist(address, about["name"]))
        for address in [address for address in self._heard if address not in workers]:
            del self._heard[address]
            # It may return, or another one may come to its place: then it is asked again.
            self.left_out.discard(address)
            self.refused.discard(address)

    def _gone(self, address: str) -> None:
        # A reading from a worker that is silent would not end: with its connections closed, Dask asks others.
        self.client.rpc.remove(address)
        task = self._enlisting.pop(address, None)
        if task is not None:
            task.cancel()
        if self.members.pop(address, None) is not None:
            self.has_lost = self.has_lost or address not in self.left_out
            self._doubts = _DOUBTS
            self._changed()

    async def _find_stuck(self) -> None:
        """After a loss: finds tasks that no worker has.

        Where the last worker is gone before the next one has offered what our tasks ask for, Dask puts them aside, and does
        not look at them again when it offers that.
        """
        if not self._doubts:
            return
        self._doubts -= 1
        processing = await asyncio.wait_for(self.client.scheduler.processing(workers=None), ANSWER_SECONDS)
        somewhere = {key for keys in processing.values() for key in keys}
        unseen = {
            key
            for key, future in self.under_way.items()
            if future.status == "pending" and key not in somewhere
        }
        # (Once may be while Dask moves them.)
        found = unseen & self._unseen
        self._unseen = unseen
        if found:
            self._stuck |= found
            self._doubts = _DOUBTS
            self._changed()

    async def _dismiss(self, address: str) -> None:
        """Takes a worker that is silent off the scheduler, which gives its work to others."""
        member = self.members.get(address)
        await self.client.scheduler.unregister(address=address, stimulus_id=f"clfractal-silent-{time.time()}")
        name = member.name if member is not None else address
        self._tell(f"worker {name} ({address}) does not answer; its work goes to others")
        self._gone(address)
        self._heard.pop(address, None)
        if self._local is not None and member is not None and hasattr(signal, "SIGKILL"):
            with suppress(OSError):  # its nanny then starts another
                os.kill(member.pid, signal.SIGKILL)

    async def _enlist(self, address: str, name: object) -> None:
        """Asks a worker to take part."""
        from clfractal.cluster import tasks

        share = None
        if self._local is not None and isinstance(name, int):
            share = (name % self._local, self._local)
        future = self.client.submit(
            tasks.enlist,
            fingerprint(),
            self._seat.device,
            share,
            key=f"clfractal-enlist-{uuid4().hex}",
            workers=[address],
            allow_other_workers=False,
            priority=1_000_000,
            pure=False,
        )
        try:
            report = await asyncio.wait_for(future, _ENLIST_SECONDS)
        except Exception as error:  # whatever another installation raises
            if type(error).__name__.endswith("CancelledError") or isinstance(error, OSError):
                return
            words = " ".join(f"{type(error).__name__}: {error}".split())[:200]
            self._refuse(address, name, f"it cannot run this program ({words})")
            return
        finally:
            self._enlisting.pop(address, None)
        if "device" in report:
            if not self.members:
                self.direct = self._local is not None or await _answers(address)
            self.members[address] = Member(address, str(name), report["device"], report["pid"])
            self._changed()
        elif "fault" in report:
            self._refuse(address, name, report["fault"])
        else:
            theirs = f"clfractal {report['version']} ({report['fingerprint']})"
            own = f"clfractal {resources.__version__} ({fingerprint()})"
            self._refuse(address, name, f"it has {theirs}, and this is {own}")

    def _refuse(self, address: str, name: object, reason: str) -> None:
        self.refused.add(address)
        self.reason = reason
        self._tell(f"worker {name} ({address}) is left out: {reason}")
        self._changed()

    def leave_out(self, address: str, reason: str) -> None:
        """Gives a worker whose device failed no more work."""
        member = self.members.get(address)
        if member is not None and address not in self.left_out:
            self.left_out.add(address)
            self._refuse(address, member.name, reason)

    @property
    def serving(self) -> list[str]:
        """The workers that get work."""
        return [member.address for member in self.roll]

    def fit(self, float64: bool) -> list[str]:
        """Those of them that can do work which needs float64, or any work."""
        return [member.address for member in self.roll if has_float64(member.device) or not float64]

    def with_key(self, key: str) -> list[str]:
        """The workers with such a device."""
        return [member.address for member in self.roll if member.device.key == key]


def usual_key(roll: Sequence[Member], *, float64: bool = False) -> str | None:
    """The key of the device that most workers have, the first by name if several have equally many.

    Args:
        float64: only devices with float64 count, if there are any.
    """
    able = [member for member in roll if has_float64(member.device)] if float64 else []
    keys = Counter(member.device.key for member in able or roll)
    return min(keys, key=lambda key: (-keys[key], key)) if keys else None


async def _answers(address: str) -> bool:
    """Whether this machine reaches a worker itself; what it has rendered need not pass through the scheduler then."""
    host, _, port = address.rpartition("://")[2].rpartition(":")
    try:
        _, writer = await asyncio.wait_for(
            asyncio.open_connection(host.strip("[]"), int(port)), _DIRECT_SECONDS
        )
    except (TimeoutError, OSError, ValueError):
        return False
    writer.close()
    return True
