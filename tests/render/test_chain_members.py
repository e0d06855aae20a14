"""Chains whose members start and stop, on the device, against NumPy: counts, distances, live parameters, periods."""

from __future__ import annotations

from functools import lru_cache
from typing import Any

import numpy as np
import pytest

from clfractal.device.select import Device
from clfractal.formulas import catalog, reference
from clfractal.formulas.chain import Chain
from clfractal.formulas.opencl import FormulaText, write_formula
from tests.devices import check_usable, device
from tests.formulas.opencl_batch import at_points, batch_text, formula_kernels, orbit_files
from tests.render.planes import plane_scene
from tests.render.point_checks import agree, orbit_bytes
from tests.render.shots import Floats, shoot
from tests.small_kernels import SmallKernels
from tests.voxels.grids import filled, volume_scene

BULB = {"name": "mandelbulb", "parameters": {"power": 2.5}}
CHAINS: dict[str, list[dict[str, Any]]] = {
    # The member that is applied first has another number than 0; turns are cut; the degree is that of the bulb.
    "three": [
        {"name": "burning_ship", "start": 3, "stop": 8},
        {"name": "mandelbox", "count": 3, "stop": 4},
        {**BULB, "live": ["power"]},
    ],
    # The bulb alone at first, then folds for ever: degree 1, and the shape is the cross's.
    "folds": [{"name": "vicsek_cross", "start": 1}, {**BULB, "stop": 1}],
    # A shape that is not used, because the degree is above 1.
    "bulb and sponge": [BULB, {"name": "menger_sponge", "count": 2}],
    "boxes": [{"name": "mandelbox", "live": ["scale"]}, {"name": "twisted_box", "start": 2, "count": 2}],
}
ITERATIONS = 7


def chain_of(name: str) -> Chain:
    return catalog.load_chain({"chain": CHAINS[name], "bailout": 12})


@lru_cache
def program() -> SmallKernels:
    tail = orbit_files("formulas/points.cl")
    return formula_kernels(
        device(), batch_text([write_formula(chain_of(n)) for n in CHAINS], tail), "float64", 1
    )


def launched(kernel: str, name: str, chain: Chain, at: Floats, planes: int) -> Floats:
    """A kernel's planes; those of counts are whole numbers."""
    formula: FormulaText = write_formula(chain)
    orbit = orbit_bytes(chain, ITERATIONS, "float64", None)
    constants = np.array(formula.constants, "float64")
    number = list(CHAINS).index(name)
    kind = "int32" if kernel == "escape_counts" else "float64"
    out = at_points(program(), f"{kernel}_f{number}", at, planes, orbit, constants, kind=kind)
    return out.astype(np.float64)


def points_of(chain: Chain) -> Floats:
    return np.random.default_rng(21).uniform(-0.7, 0.7, (400, 3)) * min(chain.radius, 8) + chain.center


def compare(name: str, chain: Chain) -> None:
    at = points_of(chain)
    count, inside = launched("escape_counts", name, chain, at, 2)
    expected, stays = reference.escape(chain, at, ITERATIONS)
    # An orbit beside a fold may go the other way.
    assert (count == expected).mean() >= 0.99
    assert ((inside == 1) == stays).mean() >= 0.99
    assert len(np.unique(expected)) > 2
    _, full, *rest = launched("distances", name, chain, at, 7)
    agree(full, np.array(rest[:3]).T, *reference.distance(chain, at, ITERATIONS))


@pytest.mark.parametrize("name", CHAINS)
def test_counts_and_distances_against_numpy(name: str) -> None:
    check_usable("float64")
    compare(name, chain_of(name))


@pytest.mark.parametrize(
    ("name", "member", "parameters"),
    [("three", 2, {"power": 4}), ("three", 2, {"power": 3.2}), ("boxes", 0, {"scale": 2.6})],
)
def test_a_live_parameter_of_a_member_needs_no_other_program(
    name: str, member: int, parameters: dict[str, float]
) -> None:
    check_usable("float64")
    members = [dict(each) for each in CHAINS[name]]
    members[member]["parameters"] = parameters
    moved = catalog.load_chain({"chain": members, "bailout": 12})
    assert write_formula(moved).text is write_formula(chain_of(name)).text
    assert moved.degree != chain_of(name).degree or name == "boxes"
    compare(name, moved)


# z stays where it is for 90 applications, and only then leaves: it must not be taken for an orbit that repeats itself.
STILL = {
    "variables": ["x", "y", "z"],
    "map": ["x", "y", "z"],
    "add": "none",
    "degree": 1,
    "bounds": {"radius": 1.5},
    "bailout": 4,
}
SQUARED = {
    **STILL,
    "let": {"r": "sqrt(x*x + y*y + z*z)"},
    "map": ["4*x*r", "4*y*r", "4*z*r"],
    "degree": 2,
}
LATE = {"chain": [{"inline": STILL, "stop": 90}, {"inline": SQUARED, "start": 90}]}


def test_a_volume_takes_no_early_rest_for_a_period() -> None:
    # |z| becomes 4 |z|^2 from application 90 on: what is beyond 1/4 leaves.
    scene = volume_scene(LATE, 110, resolution=24, box={"size": 1.2}, fill="brute")
    inside = filled(scene, lanes=1).dense() > 0
    assert 0.02 < inside.mean() < 0.1  # a ball of radius 1/4 in a cube of side 1.2: 0.038


def test_a_plane_takes_no_early_rest_for_a_period(device: Device) -> None:
    keys: dict[str, Any] = {"iterations": 110, "plane": {"width": 1.2, "height": 1.2}, "samples": 1}
    framebuffer = shoot(plane_scene(LATE, (48, 48), colors={"mode": "stepped"}, **keys), device)
    radius = np.hypot(framebuffer["P.X"].astype(float), framebuffer["P.Y"].astype(float))
    np.testing.assert_array_equal(framebuffer["iterations"] == 110, radius < 0.25)
