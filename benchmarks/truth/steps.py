"""Steps per ray of the speed table's rows, beside those on record."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from clfractal.cli import bench
from clfractal.engine.engine import Engine
from clfractal.scene.load import load_scene
from clfractal.scene.surface import SurfaceRenderer

SHARE = 0.75
"""Of the steps on record, at most so many are to be taken."""
_RECORD = Path(__file__).with_name("baseline.json")


def record() -> dict[str, Any]:
    """The figures of the commit that targets refer to."""
    found: dict[str, Any] = json.loads(_RECORD.read_text(encoding="utf-8")) if _RECORD.exists() else {}
    return found


@dataclass(frozen=True, slots=True)
class Steps:
    """A row of the speed table.

    Attributes:
        row: its name.
        steps: distance evaluations per camera ray, with those of all rays that follow from it.
        before: the same on record; None if the row is not there.
        bad: steps that the distance called safe and that ended inside, per thousand camera rays.
        iterations: applications of the formula per camera ray.
    """

    row: str
    steps: float
    before: float | None
    bad: float
    iterations: float

    @property
    def met(self) -> bool:
        """Whether a quarter fewer steps are taken than on record."""
        return self.before is None or self.steps <= SHARE * self.before


def rows() -> list[str]:
    """The rows that march by distance."""
    return [name for name, (text, changes, _) in bench.ROWS.items() if _marches(text, changes)]


def _marches(text: str, changes: Sequence[str]) -> bool:
    renderer = load_scene(text, overrides=changes).renderer
    return isinstance(renderer, SurfaceRenderer) and renderer.search == "distance"


def measure_steps(
    engine: Engine, before: Mapping[str, float], overrides: Sequence[str] = ()
) -> Iterator[Steps]:
    """Renders every row that marches by distance once, in float32."""
    for row in rows():
        text, changes, _ = bench.ROWS[row]
        scene = load_scene(text, overrides=[*changes, *overrides])
        stats = engine.render(scene, precision="float32").stats
        yield Steps(
            row,
            float(stats["steps_per_ray"]),
            before.get(row),
            1e3 * stats["bad_distances"] / stats["rays"],
            stats["iterations"] / stats["rays"],
        )
