"""One scene is one picture: what it shows depends neither on the samples of a pixel nor on the number of pixels."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import numpy.typing as npt
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from clfractal.api import load_scene, render
from clfractal.camera.views import seen_by
from clfractal.engine.engine import Engine
from clfractal.engine.prepare import with_size
from clfractal.errors import SceneError
from clfractal.geometry.fineness import NEAR, Fineness
from clfractal.images.framebuffer import Framebuffer
from clfractal.integrators.march import SHADOW_DETAIL, march_record
from clfractal.scene.load import dump_scene
from clfractal.scene.model import Scene
from clfractal.scene.parts import Image
from tests.render.bits import same_pictures

BLOCKS = 12
SCENE = """
version: 1
formula: {name: FORMULA, iterations: 24}
image: {width: 768, height: 432}
camera: {frame: all, orbit: {azimuth: 30, elevation: 25}}
lights: [{direction: [-1, 1, -1]}, {direction: [1, 0.3, -0.4], color: [0.3, 0.4, 0.7]}]
renderer: {samples: 4}
"""


@pytest.fixture(scope="module")
def engine() -> Iterator[Engine]:
    with Engine() as found:
        yield found


def scene_of(formula: str = "quaternion_julia", more: str = "") -> Scene:
    return load_scene(SCENE.replace("FORMULA", formula) + more)


def blocks(framebuffer: Framebuffer) -> npt.NDArray[np.float64]:
    """Mean light over BLOCKS x BLOCKS parts of a picture whose sides are multiples of BLOCKS."""
    light = np.asarray(framebuffer, np.float64)[..., :3]
    rows, columns = light.shape[0] // BLOCKS, light.shape[1] // BLOCKS
    return np.asarray(light.reshape(BLOCKS, rows, BLOCKS, columns, 3).mean(axis=(1, 3)))


def apart(one: Framebuffer, other: Framebuffer) -> float:
    """Mean difference of the blocks' light over its mean."""
    a, b = blocks(one), blocks(other)
    return float(np.abs(a - b).mean() / np.abs(b).mean())


# (hast's section was 107 % brighter with one sample, a Julia set's picture 49 %, a Mandelbulb's 37 %.)
@pytest.mark.parametrize("formula", ["quaternion_julia", "mandelbulb", "hast"])
def test_samples_and_pixels_leave_the_picture_as_it_is(engine: Engine, formula: str) -> None:
    scene = scene_of(formula)
    full = engine.render(scene, size=(192, 108), samples=64)
    few = [engine.render(scene, size=(192, 108), samples=n) for n in (1, 4)]
    small = engine.render(scene, size=(96, 48), samples=64)
    large = engine.render(scene, size=(384, 192), samples=16)
    assert apart(few[0], full) < 0.05  # of which noise is some 2 %
    assert apart(few[1], full) < 0.02
    assert apart(small, large) < 0.02


def test_a_thumbnail_holds_the_print(engine: Engine) -> None:
    """The scene of a small picture's header, rendered at the scene's own size, is the scene's own picture: to the bit."""
    scene = scene_of("mandelbulb").model_copy(update={"image": Image(width=96, height=54)})
    thumbnail = engine.render(scene, size=(32, 18))
    held = load_scene(str(thumbnail.header["scene"]))
    assert held.image == Image(width=32, height=18, reference_height=54)
    same_pictures(engine.render(held, size=(96, 54)), engine.render(scene))
    assert held.image.resized(96, 54) == scene.image


def test_a_larger_picture_shows_the_same_more_finely(engine: Engine) -> None:
    """Hits are exact to the pixels that are rendered; the height over them at which light is computed stays."""
    scene = scene_of("mandelbulb").model_copy(update={"image": Image(width=96, height=48)})
    large = engine.render(scene, size=(384, 192), samples=4)
    assert apart(large, engine.render(scene, samples=64)) < 0.02
    alone = scene.model_copy(update={"image": Image(width=384, height=192)})
    assert apart(engine.render(alone, samples=4), engine.render(scene, samples=64)) > 0.03


def test_the_level_is_measured_in_the_references_pixels() -> None:
    """In scene units the place of light is the same at any size; hits are found as exactly as the finer of both needs."""
    scene = scene_of()
    own = march_record(scene, "float64")
    for height in (54, 216, 432, 864, 4320):
        image = scene.image.resized(height * 16 // 9, height)
        found = march_record(scene.model_copy(update={"image": image}), "float64")
        assert found["near"] * found["detail"] == pytest.approx(own["near"] * own["detail"])
        assert found["shadow_lift"] == own["shadow_lift"]
        assert found["shadow_detail"] * found["detail"] == pytest.approx(SHADOW_DETAIL)
        assert found["detail"] == pytest.approx(min(1.0, 432 / height))
        assert Fineness.of(scene.model_copy(update={"image": image})).pixel == pytest.approx(432 / height)
    assert own["near"] == pytest.approx(NEAR * own["step_scale"])


@settings(max_examples=60, deadline=None)
@given(
    own=st.integers(1, 5000),
    reference=st.one_of(st.none(), st.floats(1, 60_000)),
    sizes=st.lists(st.tuples(st.integers(1, 5000), st.integers(1, 5000)), min_size=1, max_size=4),
)
def test_sizes_leave_no_trace(own: int, reference: float | None, sizes: list[tuple[int, int]]) -> None:
    """A picture that was resized again and again, and then to its own size, is the one that it was."""
    image = Image(width=320, height=own, reference_height=reference)
    found = image
    for size in sizes:
        found = found.resized(*size)
        assert found.reference == image.reference
    back = found.resized(320, own)
    assert back == image.resized(320, own)
    assert reference is not None or back == image
    assert load_scene(dump_scene(scene_of().model_copy(update={"image": found}))).image == found


def test_views_and_squeezed_eyes_have_the_reference_of_their_picture() -> None:
    halves = "stereo: {mode: over_under_half}\n"
    scene = scene_of(more=halves)
    large = with_size(scene, (1536, 864))
    eye = seen_by(large, "left")[0]
    assert eye.image == Image(width=1536, height=432, reference_height=216)
    two = "layout: {columns: 1, views: [{}, {camera: {position: [0, -4, 0]}}]}\n"
    for view, place in with_size(scene_of(more=two), (1536, 864)).views:
        assert (place.height, view.image.reference) == (432, 216)


@pytest.mark.parametrize("size", [(0, 9), (70_000, 9), (65_536, 65_536), (9, 9.5), (9,), "9x9"])
def test_a_size_that_is_none_is_told(engine: Engine, size: object) -> None:
    with pytest.raises(SceneError, match=r"size"):
        engine.prepare(scene_of(), size=size)  # type: ignore[arg-type]
    with pytest.raises(SceneError, match=r"^size: must be even"):
        engine.prepare(scene_of(more="stereo: {mode: over_under_half}\n"), size=(64, 33))


def test_engines_and_functions_take_a_size(engine: Engine) -> None:
    scene = scene_of("mandelbulb")
    framebuffer = engine.render(scene, size=(48, 27))
    assert framebuffer["R"].shape == (27, 48)
    same_pictures(framebuffer, render(scene, size=(48, 27)))
    last = list(engine.refine(scene, size=(48, 27)))[-1]
    same_pictures(framebuffer, last)
