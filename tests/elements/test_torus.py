"""The torus by its equation, (sqrt(x^2 + y^2) - radius)^2 + z^2 = tube^2: alone, joined, of glass, as a light."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from clfractal.device.structs import Precision
from clfractal.elements.shapes.torus import TorusObject
from clfractal.errors import SceneError
from tests.devices import device
from tests.elements import solids
from tests.render.joined_oracle import Distance, Floats
from tests.render.shots import CAMERAS
from tests.variants import one_of


def torus(radius: float, tube: float, **placed: Any) -> solids.Known:
    def distance(p: Floats) -> Floats:
        found: Floats = np.hypot(np.hypot(p[..., 0], p[..., 1]) - radius, p[..., 2]) - tube
        return found

    own: Distance = distance
    return solids.Known({"type": "torus", "radius": radius, "tube": tube}, own, **placed)


KINDS = {
    "tyre": torus(0.6, 0.35),
    "ring": torus(0.8, 0.06),
    "horn": torus(0.5, 0.5),
    "uneven": torus(0.5, 0.2, scale=[1.6, 1.0, 0.6]),
}


@pytest.mark.parametrize("kind", KINDS)
def test_what_it_holds(kind: str) -> None:
    solids.check_inside(KINDS[kind])


@pytest.mark.parametrize("camera", CAMERAS)
@pytest.mark.parametrize(("precision", "lanes"), one_of(("float32", None), ("float32", 1), ("float64", 4)))
@pytest.mark.parametrize("kind", KINDS)
def test_it_is_where_its_equation_is_zero(
    kind: str, camera: str, precision: Precision, lanes: int | None
) -> None:
    solids.check_alone(KINDS[kind], device(), camera, precision, lanes)


def test_a_ray_through_its_middle_and_along_its_plane() -> None:
    """Along the axis nothing is met."""
    known = torus(0.8, 0.2, rotation=[0, 0, 0], position=[0, 0, 0])
    solids.check_alone(known, device(), "perspective", "float32", None)
    solids.check_walls(known, device(), [0.8, 0, 0])


@pytest.mark.parametrize("kind", KINDS)
def test_a_plane_opens_it(kind: str) -> None:
    """Also where the first part of a ray within is taken away, and the second is not."""
    solids.check_opened(KINDS[kind], device())


@pytest.mark.parametrize("join", ["cut", "intersection"])
@pytest.mark.parametrize(
    "known", [KINDS["tyre"], torus(0.6, 0.4, scale=[1.5, 1.0, 0.8])], ids=["tyre", "uneven"]
)
def test_it_is_joined_to_the_set(known: solids.Known, join: str) -> None:
    solids.check_joined(known, device(), join)


@pytest.mark.parametrize("join", ["union", "cut", "intersection"])
def test_its_voxels(join: str) -> None:
    solids.check_voxels(KINDS["tyre"], join)


@pytest.mark.parametrize(
    ("kind", "roughness"), one_of(("tyre", 0.0), ("ring", 0.0), ("tyre", 0.5), ("ring", 0.5))
)
def test_glass_is_not_seen_before_white(kind: str, roughness: float) -> None:
    solids.check_glass(KINDS[kind], roughness)


# Of its half axes: over it, beside it, in the middle of its hole, close to the tube, and far.
POINTS = ([0.2, 0.1, 6.0], [-2.5, 0.4, 0.2], [0.05, -0.03, 0.1], [0.8, 0.2, 1.4], [20.0, -30.0, 25.0])


@pytest.mark.parametrize(("precision", "lanes"), one_of(("float32", 8), ("float32", 1), ("float64", 8)))
@pytest.mark.parametrize("point", POINTS, ids=["over", "beside", "in the hole", "close", "far"])
@pytest.mark.parametrize("kind", ["tyre", "ring", "uneven"])
def test_even_light_is_found_in_all_directions(
    kind: str, point: list[float], precision: Precision, lanes: int
) -> None:
    solids.check_choices(KINDS[kind], point, precision, lanes)


def test_a_tube_that_leaves_no_ring_is_refused() -> None:
    with pytest.raises(SceneError, match=r"must be at most the ring's radius, 0\.2, got 0\.3"):
        TorusObject.checked({"radius": 0.2, "tube": 0.3, "type": "torus"})
