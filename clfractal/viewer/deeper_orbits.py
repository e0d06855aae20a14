"""Iterations follow the depth: details that are so many times smaller come so many applications later."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from itertools import pairwise
from math import isfinite, log10

import numpy as np

from clfractal.device.cancel import CancelToken
from clfractal.engine.local_executor import LocalExecutor
from clfractal.errors import ClfractalError
from clfractal.scene.deep import Deep
from clfractal.scene.model import Scene
from clfractal.viewer.history import History
from clfractal.viewer.studio import Studio

# As many of the place's own orbit are looked at; fewer than so many tell nothing.
_MOST, _LEAST = 400, 3
# Zooming out leaves so many.
_FEWEST = 4
# After so many decades another part of the orbit counts.
_STALE = 8.0


class DeeperOrbits:
    """Gives the studio's scene the iterations that it needs at its depth, as long as it shows a place of any depth.

    Where the scene went over to `deep`, or was opened, it has what its user gave it; deeper it has as many more as points
    there take to come apart as far. That is a part of the zoom and no step of undo; a number that is set by hand counts
    from then on. In a film it stays as it is.

    Attributes:
        follow: whether it does so.
    """

    def __init__(self, studio: Studio) -> None:
        self.studio, self.follow = studio, True
        self._history: History | None = None
        self._known: tuple[Deep | None, int] | None = None
        # Where it began, decades, with as many iterations.
        self._begun, self._own = 0.0, 0.0
        self._per_decade, self._asked_at = 0.0, 0.0
        self._rate: _Rate | None = None

    def switch(self) -> None:
        """Follows the depth from here on, or no more."""
        self.follow, self._history = not self.follow, None

    def look(self) -> None:
        """Called every turn."""
        studio, scene = self.studio, self.studio.scene
        told = self._rate is not None and self._rate.finished
        if self._rate is not None and told:
            self._per_decade, self._rate = self._rate.per_decade or self._per_decade, None
        deep, iterations = scene.deep, scene.formula.iterations
        known = self._known if studio.history is self._history else None
        if known == (deep, iterations) and not told:
            return
        depth = _depth(deep)
        if known is None or (known[0] is None and deep is not None):
            self._history = studio.history
            self._begun, self._own, self._per_decade = depth, float(iterations), 0.0
        elif known[1] != iterations:  # set by hand
            self._own = iterations - self._per_decade * self._beyond(deep)
        if deep is not None and self._rate is None and self._stale(depth):
            self._asked_at, self._rate = depth, _Rate(scene)
            studio.session.add(self._rate)
        self._fit(scene)
        self._known = (studio.scene.deep, studio.scene.formula.iterations)

    def _beyond(self, deep: Deep | None) -> float:
        """How much deeper the scene is now, decades; in the space itself it is as it was before."""
        return 0.0 if deep is None else _depth(deep) - self._begun

    def _stale(self, depth: float) -> bool:
        return self._per_decade == 0.0 or abs(depth - self._asked_at) > _STALE

    def _fit(self, scene: Scene) -> None:
        if not self.follow or scene.animation is not None:
            return
        iterations = scene.formula.iterations
        wanted = max(round(self._own + self._per_decade * self._beyond(scene.deep)), min(_FEWEST, iterations))
        if wanted != iterations:
            with self.studio.telling():
                self.studio.adjust({"formula.iterations": wanted})
                self.studio.refresh()


def _depth(deep: Deep | None) -> float:
    return 0.0 if deep is None else log10(deep.magnification)


class _Rate:
    """Finds in the background how many applications more a place needs that is ten times deeper.

    Attributes:
        per_decade: that number, in the mean over the orbit of the place; 0: it tells none.
    """

    finished, per_decade = False, 0.0

    def __init__(self, scene: Scene) -> None:
        self._scene = scene

    def work(self, executor: LocalExecutor, token: CancelToken, tell: Callable[[str], None]) -> None:
        """See `Task`."""
        from clfractal.formulas.deep import begun_orbits

        deep = self._scene.deep
        assert deep is not None
        chain = self._scene.chain
        begun = begun_orbits(replace(chain, place=deep.place(_MOST)))
        spreads = [(each.count, float(np.linalg.norm(each.slopes[: chain.size]))) for each in begun]
        grown = [(count, log10(spread)) for count, spread in spreads if isfinite(spread) and spread > 0]
        steps = [(after[0] - before[0], after[1] - before[1]) for before, after in pairwise(grown)]
        decades = sum(decade for _, decade in steps)
        if len(grown) >= _LEAST and decades > 0:
            self.per_decade = sum(count for count, _ in steps) / decades
        self.finished = True

    def failed(self, error: ClfractalError) -> None:
        """The picture tells it."""
        self.finished = True
