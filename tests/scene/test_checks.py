"""What the parts of a scene demand of each other, and what the schema leaves to other settings."""

from __future__ import annotations

import math
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import pytest
import yaml

from clfractal.errors import SceneError
from clfractal.formulas import catalog
from clfractal.formulas.reference import mp_escape
from clfractal.scene.load import dump_scene, load_scene
from clfractal.scene.model import Scene
from tests.scenes import scene_of

# A ball of radius 0.5 about the origin: z stays where it is and escapes beyond 0.5.
BALL: dict[str, Any] = {
    "variables": ["x", "y", "z"],
    "map": ["x", "y", "z"],
    "add": "none",
    "degree": 1,
    "bailout": 0.5,
    "bounds": {"radius": 2},
}
# A cube of half side 0.5 in a bailout's ball that is much larger.
CUBE = {**BALL, "bailout": 10, "shape": "max(abs(x), abs(y), abs(z)) - 0.5"}


def scene(formula: dict[str, Any], **rest: Any) -> Scene:
    return scene_of(formula, size=None, **rest)


def lit(formula: dict[str, Any], *positions: Sequence[float], **rest: Any) -> Scene:
    lights = [{"type": "point", "position": list(position)} for position in positions]
    return scene(formula, lights=lights, **rest)


def refused(formula: dict[str, Any], *positions: Sequence[float], **rest: Any) -> str | None:
    with pytest.raises(SceneError, match="must be outside the object") as caught:
        lit(formula, *positions, **rest)
    return caught.value.where.path


class TestLights:
    def test_a_ball(self) -> None:
        assert refused({"inline": BALL}, (0, 0, 0.499)) == "lights.0.position"
        assert lit({"inline": BALL}, (0, 0, 0.501)).lights

    def test_the_first_of_several(self) -> None:
        assert refused({"inline": BALL}, (1, 0, 0), (0.1, 0, 0), (0, 0, 0)) == "lights.1.position"

    def test_the_last_solid_is_the_shape(self) -> None:
        corner = 0.49
        assert refused({"inline": CUBE}, (corner, corner, corner)) == "lights.0.position"
        assert lit({"inline": CUBE}, (0.51, 0, 0)).lights

    def test_outside_of_the_bounds_there_is_no_object(self) -> None:
        everything = {**BALL, "bailout": 100}
        assert refused({"inline": everything}, (1.99, 0, 0)) == "lights.0.position"
        assert lit({"inline": everything}, (2.01, 0, 0)).lights
        near = {"bounds": {"center": [0, 0, 0], "radius": 1}}
        assert lit({"inline": everything}, (1.99, 0, 0), renderer=near).lights

    def test_fewer_iterations_are_a_larger_object(self) -> None:
        """With 40 digits this point is inside after 2 applications, and not after 12."""
        point = (0.55, 0.55, 0.55)
        chain = scene({"name": "mandelbulb"}).chain
        assert mp_escape(chain, point, 2)[1]
        assert not mp_escape(chain, point, 12)[1]
        assert refused({"name": "mandelbulb", "iterations": 2}, point) == "lights.0.position"
        assert lit({"name": "mandelbulb", "iterations": 12}, point).lights

    def test_a_directional_light_is_nowhere(self) -> None:
        assert scene({"inline": BALL}, lights=[{"type": "directional", "direction": [0, 0, 0.1]}]).lights

    def test_a_million_iterations_do_not_keep_one_waiting(self) -> None:
        start = time.perf_counter()
        assert refused({"name": "mandelbulb", "iterations": 1_000_000}, (0, 0, 0.1)) is not None
        assert time.perf_counter() - start < 20


def test_a_camera_may_stand_in_the_object() -> None:
    camera = {"position": [0, 0, 0], "target": [0, 1, 0]}
    assert load_scene({"version": 1, "formula": {"inline": BALL}, "camera": camera})


@pytest.mark.parametrize("name", catalog.names())
def test_steps_at_their_limits(name: str) -> None:
    """A step through the whole bounds, and a millionth of it, with every formula; beyond both is refused."""
    radius = scene({"name": name}).bounds[1]
    for key in ("renderer", "coloring"):
        for step in (2 * radius, 2.001e-6 * radius):
            assert scene({"name": name}, **{key: {"step": step}})
        for step in (2.001 * radius, 1.999e-6 * radius):
            with pytest.raises(SceneError, match=rf"^{key}\.step: must be at (most|least)"):
                scene({"name": name}, **{key: {"step": step}})


def test_a_residual_needs_more_points_than_a_plane() -> None:
    by = {"by": "residual"}
    for points in ({"count": 4}, {"pattern": "stochastic", "count": 4}):
        assert scene({"inline": BALL}, coloring=by, renderer={"points": points})
    assert scene({"inline": BALL}, coloring=by, renderer={"normal": "least_squares"})
    with pytest.raises(SceneError, match=r"^coloring\.by: residual needs at least 4 points"):
        scene({"inline": BALL}, coloring=by)


class TestWhatIsLeftOpen:
    """`null` takes its value from other settings."""

    def test_points(self) -> None:
        def count(**renderer: Any) -> int:
            return scene({"inline": BALL}, renderer=renderer).surface.used_points.count

        assert count() == 1
        assert count(normal="one_triangle") == 9
        assert count(normal="least_squares", points={"count": 25}) == 25
        assert count(points={}) == 9

    def test_min_samples(self) -> None:
        def fewest(**renderer: Any) -> int:
            return scene({"inline": BALL}, renderer={"noise": 0.01, **renderer}).renderer.used_min_samples

        assert fewest(samples=64) == 16
        assert fewest(samples=3) == 3
        assert fewest(samples=64, min_samples=5) == 5

    def test_rays_of_a_light(self) -> None:
        def rays(**light: Any) -> int:
            return scene({"inline": BALL}, lights=[light]).lights[0].used_rays

        assert rays() == 1
        assert rays(rays=40) == 1  # a hard shadow's rays are all the same
        assert rays(angular_size=2) == 8
        assert rays(angular_size=2, rays=3) == 3

    def test_the_lens(self) -> None:
        """fov 90 and a sensor of 2: the focal length is 1 (tan 45 degrees), so at f/2 the lens is 0.5 wide."""
        lens = {"fov": 90, "sensor_height": 2, "f_number": 2, "position": [0, -3, 4]}
        camera = load_scene({"version": 1, "formula": {"inline": BALL}, "camera": lens}).camera
        assert camera.projection == "perspective"
        assert math.isclose(camera.lens_radius, 0.25)
        assert math.isclose(camera.used_focus_distance, 5)
        assert camera.model_copy(update={"focus_distance": 2}).used_focus_distance == 2
        assert camera.model_copy(update={"f_number": None}).lens_radius == 0


def test_a_wrong_scene_file_is_told_with_line_and_column(tmp_path: Path) -> None:
    path = tmp_path / "scene.yaml"
    path.write_text(
        "version: 1\nformula: {name: hast, iterations: 20}\ncamera: {}\nlights:\n  - type: point\n"
        "    position: [-0.1, 0, 0]\n"
    )
    with pytest.raises(SceneError) as caught:
        load_scene(path)
    assert (
        str(caught.value).removeprefix(f"{tmp_path}/").startswith("scene.yaml:6:15: lights.0.position: must ")
    )


def test_a_resolved_scene_holds_every_new_key() -> None:
    plain = yaml.safe_load(dump_scene(scene({"name": "hast"})))
    assert plain["environment"] is None
    assert plain["fog"] is None
    assert plain["renderer"]["points"] is None
    assert plain["coloring"]["trap"]["shape"] == "point"
