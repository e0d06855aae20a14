"""Every two values of features meet in a picture: the same in parts, and what is switched off leaves no trace."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from clfractal.device.select import Device
from clfractal.device.structs import Precision
from clfractal.engine import drawing
from clfractal.files.channels import ID_CHANNELS, SURFACE_LAYERS
from clfractal.images.framebuffer import Framebuffer
from clfractal.scene.load import load_scene
from clfractal.scene.model import Scene
from tests.devices import check_usable
from tests.features import APART, CUT_PLANE, OF_MEDIA, SURFACE, VOLUME, Values, put_together
from tests.gpu.pairs import covering
from tests.portability.pictures import FOLDER
from tests.render.shots import CHANNELS, plan_of, render_planned, shoot, stacked
from tests.variants import combinations, every

SIZE = (44, 26)  # two tiles, neither of them whole
PLAIN: dict[str, Any] = {
    "version": 1,
    "image": {"width": SIZE[0], "height": SIZE[1]},
    "camera": {"position": [1.5, -3.4, 1.4], "target": [0, 0, 0], "fov": 42},
}
# Formulas differ in their own text alone, so three are enough: a scalar rule, the Jacobian, and one with a shape.
FORMULAS: Values = {
    name: {"formula": {"name": name, "iterations": 4}}
    for name in ("mandelbulb", "hast", "sierpinski_tetrahedron")
}
# Pixels that are done after four samples, after twelve, and between; more only take longer.
NOISE: Values = {"": {}, "noise": {"renderer": {"noise": 0.02, "min_samples": 4, "samples": 12}}}
OF_SURFACES: Mapping[str, Values] = {
    **SURFACE,
    "formula": FORMULAS,
    "noise": NOISE,
    "light": {
        **SURFACE["light"],
        "small": {"lights": [{"type": "point", "position": [0, -9, 9], "angular_size": 3}]},
        "set": {"lights": [{"type": "set", "trap": {"shape": "point"}, "threshold": 0.9, "radius": 0.02}]},
    },
    "mirror": {"": {}, "mirror": {"material": {"reflection": 0.5}}},
    "layers": {"": {}, "layers": {}},
}
OF_VOLUMES: Mapping[str, Values] = {
    **VOLUME,
    "formula": FORMULAS,
    "noise": NOISE,
    **{
        key: {value: {"renderer": {key: value}} for value in values}
        for key, values in {
            "value": ("inside", "coverage"),
            "store": ("byte", "float"),
            "normals": ("gradient", "least_squares", "exact"),
            "fill": ("octree", "brute"),
        }.items()
    },
}
FEATURES: Mapping[str, Mapping[str, Values]] = {
    "surface": OF_SURFACES,
    "volume": OF_VOLUMES,
    "cut_plane": {**CUT_PLANE, "formula": FORMULAS, "noise": NOISE},
}
_NUMBERS = st.floats(-1, 1, width=32)
# What random scenes say beside their features.
SECTIONS: dict[str, st.SearchStrategy[dict[str, Any]]] = {
    "camera": st.builds(lambda x, y, z: {"position": [x, y - 3.2, z]}, _NUMBERS, _NUMBERS, _NUMBERS),
    "renderer": st.builds(lambda count: {"samples": count, "min_samples": None}, st.integers(1, 3)),
    "fog": st.builds(lambda part: {"density": abs(part) / 4}, _NUMBERS),
    "glow": st.builds(lambda part: {"intensity": abs(part)}, _NUMBERS),
    "mist": st.builds(lambda part: {"density": abs(part)}, _NUMBERS),
}
NEVER = {"surface": APART, "volume": OF_MEDIA, "cut_plane": frozenset()}
CHOICES = [(kind, chosen) for kind, each in FEATURES.items() for chosen in covering(each, NEVER[kind])]


def of(kind: str, chosen: Mapping[str, str]) -> dict[str, Any]:
    more: dict[str, Any] = {"resolution": 24} if kind == "volume" else {}
    plain = {
        **PLAIN,
        "renderer": {"type": kind, **more} if kind == "cut_plane" else {"type": kind, "samples": 2, **more},
    }
    return put_together(plain, FEATURES[kind], chosen)


def read(scene: Mapping[str, Any]) -> Scene:
    return load_scene(dict(scene), folder=FOLDER)


def with_nothing(kind: str, scene: Mapping[str, Any]) -> dict[str, Any]:
    """A scene and what shines not or lets all light through: features that are switched off."""
    dark = {"type": "point", "position": [0, 9, 9], "intensity": 0}
    off: dict[str, dict[str, Any]] = {
        "surface": {"fog": {"density": 0}, "glow": {"intensity": 0}, "mist": {"density": 0}}
    }
    return {**off.get(kind, {}), **scene, "lights": [*scene.get("lights", [{}]), dark]}


def channels(chosen: Mapping[str, str]) -> tuple[str, ...]:
    return (
        tuple(dict.fromkeys((*CHANNELS, *SURFACE_LAYERS, *ID_CHANNELS))) if chosen.get("layers") else CHANNELS
    )


def same(framebuffer: Framebuffer, other: Framebuffer, name: str) -> bool:
    """Equal bits, which tells 0 from -0."""
    return framebuffer[name].tobytes() == other[name].tobytes()


# Every program that asks the formula is one of its own: those of the third take as long as the others' pairs.
THIRD = "sierpinski_tetrahedron"
OFTEN, SELDOM = (
    [choice for choice in CHOICES if (choice[1]["formula"] == THIRD) is is_third]
    for is_third in (False, True)
)


@pytest.mark.parametrize(
    ("kind", "chosen"),
    [*every(2, OFTEN), *combinations(SELDOM)],
    ids=[" ".join(filter(None, (kind, *each.values()))) for kind, each in (*OFTEN, *SELDOM)],
)
def test_a_pair(
    kind: str, chosen: Mapping[str, str], device: Device, monkeypatch: pytest.MonkeyPatch
) -> None:
    holds(kind, chosen, device, monkeypatch)


@given(st.data())
@settings(max_examples=15)
def test_random_scenes(device: Device, data: st.DataObject) -> None:
    """Of surfaces, with many features at once, seen from anywhere, in lights and fog of any strength."""
    chosen: dict[str, str] = {}
    for name, values in OF_SURFACES.items():
        fitting = [
            value
            for value in sorted({*values} - {THIRD})
            if not any(frozenset({(name, value), other}) in APART for other in chosen.items())
        ]
        chosen[name] = data.draw(st.sampled_from(fitting), name)
    more = data.draw(st.fixed_dictionaries({}, optional=SECTIONS), "more")
    with pytest.MonkeyPatch.context() as patch:
        holds("surface", chosen, device, patch, more)


MILK = {"milk": {"transmission": {"weight": 1, "depth": 0.3, "scatter": [0.9, 0.8, 0.7]}}}
# Each feature alone, and one that has no pair.
ALONE = [
    (kind, name, value)
    for kind, each in FEATURES.items()
    for name, values in each.items()
    for value in values
]
# What a feature needs that is alone.
NEEDS: dict[tuple[str, str], dict[str, str]] = {
    ("surface", "residual"): {"points": "grid"},
    ("surface", "clouds"): {"lighting": "path"},
    ("surface", "layers"): {"lighting": "path"},
    ("volume", "path"): {"transfer": "opacity"},
}
# The share of the pixels that are the same, and by how much the mean colour differs, where paths go through a
# set, and so small differences send them other ways: measured are 0.91, 0.47, 0.96, 0.66 and 0.94.
STIRRED = {
    ("glass", "float32"): (0.88, 0.003),
    ("glass", "float64"): (0.4, 0.03),
    ("milk", "float32"): (0.94, 0.003),
    ("milk", "float64"): (0.6, 0.01),
    ("skin", "float64"): (0.92, 0.003),
}
VARIANTS = [("float32", 1), ("float32", 4), ("float32", 8), ("float32", 16), ("float64", 1), ("float64", 4)]


@pytest.mark.combination
@pytest.mark.parametrize(("precision", "lanes"), VARIANTS)
@pytest.mark.parametrize(("kind", "feature", "value"), [*ALONE, ("surface", "lighting", "milk")])
def test_lanes_and_number_types_show_the_same(
    kind: str, feature: str, value: str, precision: Precision, lanes: int, device: Device
) -> None:
    """Packets of another width are another program, whose last bits differ, and with them what decides at a rim, or which
    way a path goes."""
    check_usable(precision, lanes)
    chosen = {"formula": "mandelbulb", **NEEDS.get((kind, value), {}), feature: value}
    asked = of(kind, {} if value == "milk" else chosen)
    if value == "milk":
        asked |= {**FORMULAS["mandelbulb"], "materials": MILK, "material": {"name": "milk"}}
        asked |= {"lighting": {"mode": "path"}}
    scene, names = read(asked), [name for name in channels(chosen) if name != "steps"]
    variant: dict[str, Any] = {"precision": precision, "lanes": lanes}
    usual, other = (stacked(shoot(scene, device, channels=names, **way), names) for way in ({}, variant))
    same = np.asarray(np.isclose(usual, other, rtol=1e-3, atol=1e-3).all(axis=-1))
    share, apart = STIRRED.get((value, precision), (0.98 if precision == "float32" else 0.97, 0.003))
    # Where something is seen, and beside it: most of a picture is background, which is always the same.
    seen = (usual[..., names.index("A")] > 0) | (other[..., names.index("A")] > 0)
    assert same[seen].mean() > share
    assert same[~seen].sum() > 0.98 * (~seen).sum() - 1
    colors = [names.index(name) for name in "RGB"]
    assert usual[seen][:, colors].mean() == pytest.approx(other[seen][:, colors].mean(), abs=apart)


def holds(
    kind: str,
    chosen: Mapping[str, str],
    device: Device,
    monkeypatch: pytest.MonkeyPatch,
    more: Mapping[str, Mapping[str, Any]] | None = None,
) -> None:
    """A picture has the same bits in parts, in a region with fewer channels, and beside what is switched off."""
    asked = of(kind, chosen)
    for section, content in (more or {}).items():
        asked[section] = {**asked.get(section, {}), **content}
    names = channels(chosen)
    scene = read(asked)
    whole = shoot(scene, device, channels=names)
    assert all(np.isfinite(whole[name]).all() for name in names if name != "Z")
    assert more or whole["A"].max() > 0

    plan = plan_of(scene, device, channels=names)
    parts = Framebuffer(plan.channels, SIZE, plan.region)
    monkeypatch.setattr(drawing, "CAPACITY", 1)
    render_planned(scene, plan, device, parts, budget_seconds=2e-3)
    assert [name for name in names if not same(whole, parts, name)] == []

    few = shoot(scene, device, channels=("R", "N.Y"), region=(20, 7, 24, 12))
    for name in few.channels:
        assert np.array_equal(few[name], whole[name][7:19, 20:44]), name

    # A light that shines not is asked for in vain.
    less = shoot(read(with_nothing(kind, asked)), device, channels=names)
    assert [name for name in names if name != "steps" and not same(whole, less, name)] == []


def test_neighbours_that_flow_together_leave_no_trace(device: Device) -> None:
    """Beside them a material is no blend of itself: that is not the same to the last bit."""
    objects = {"drop": {"type": "box", "position": [1, 0, 0], "join": "smooth_union"}}
    asked = {
        **PLAIN,
        "formula": {"name": "mandelbulb", "iterations": 4},
        "renderer": {"type": "surface", "samples": 4},
        "lighting": {"mode": "path"},
        "materials": {"skin": {"subsurface": {"weight": 0.8}}},
        "material": {"name": "skin"},
        "objects": objects,
        "lights": [{"type": "sphere", "position": [9, 0, 9], "radius": 1}],
    }
    scene = read(asked)
    whole = shoot(scene, device, channels=("R", "G", "B"))
    few = shoot(scene, device, channels=("R", "G", "B"), region=(20, 7, 24, 12))
    for name in few.channels:
        np.testing.assert_array_equal(few[name], whole[name][7:19, 20:44])
