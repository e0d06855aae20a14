"""An engine that stays: equal pictures to those of one that is new, what it keeps, and how it refuses."""

from __future__ import annotations

import threading
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import clfractal
from clfractal.device import program
from clfractal.device.select import Device, choose
from clfractal.engine import local_executor
from clfractal.engine.drawing import Drawing
from clfractal.engine.local_executor import LocalExecutor
from clfractal.engine.prepare import prepare
from clfractal.voxels import fill
from tests.calls import counted, raising
from tests.engine.small_pictures import BULB, VOLUME, changed, equal

CHANGES: dict[str, tuple[str, ...]] = {
    "camera": ("camera.position=[0.5, -2.8, 0.4]",),
    "parameter": ("formula.parameters={theta_phase: 0.3}",),
    "light": ("lights.0.direction=[1, 1, -1]",),
    "another program": ("renderer.ambient_occlusion={rays: 2}",),
    "another formula": ("formula.name=mandelbox", "camera.position=[0, -9, 4]"),
    "a plane": ("renderer={type: cut_plane, plane: {width: 3, height: 2}}",),
    "a volume": ("renderer={type: volume, resolution: 24}",),
    "a palette": ("coloring={by: iterations, palette: amber}",),
    "an environment": ("environment={name: studio}",),
    "samples": ("renderer.samples=4",),
    "a larger picture": ("image.width=160", "image.height=96"),
    "channels": ("output.channels=[R, G, B, N.X]",),
    "float64": ("renderer.precision=float64",),
    "a pair": ("stereo={mode: split, screen_width: 0.5, screen_distance: 0.7}",),
}


def test_changes_leave_nothing_of_the_picture_before(device: Device) -> None:
    """One after the other, and back: each has the bits of an engine that knows nothing else."""
    scenes = [changed(BULB, *overrides) for overrides in CHANGES.values()]
    alone = [clfractal.render(scene) for scene in scenes]
    with clfractal.Engine(device) as engine:
        for round_trip in (scenes, scenes[::-1]):
            for scene in round_trip:
                equal(engine.render(scene), alone[scenes.index(scene)])


def test_what_is_equal_is_not_sent_again(device: Device, monkeypatch: pytest.MonkeyPatch) -> None:
    with clfractal.Engine(device) as engine:
        engine.render(changed(BULB))
        sent = counted(monkeypatch, Drawing, "_sent")
        loaded = counted(monkeypatch, program, "_compile")
        engine.render(changed(BULB))
        assert len(sent) == 0
        engine.render(changed(BULB, *CHANGES["camera"]))
        assert len(sent) == 1
        engine.render(changed(BULB, *CHANGES["camera"], *CHANGES["light"]))
        assert len(sent) == 2
        assert loaded == []


@pytest.mark.parametrize(
    "override",
    [
        "camera.position=[1, -2.5, 0.6]",
        "renderer.transfer={opacity: [{at: 0.2, opacity: 0}, {at: 0.9, opacity: 0.4}]}",
        "renderer.transfer={color: [{at: 0, color: [1, 0, 0]}, {at: 1, color: [0, 0, 1]}]}",
        "renderer.level=0.3",
        "renderer.samples=2",
        "lights.0.direction=[1, 1, -1]",
    ],
)
def test_a_grid_is_filled_once(override: str, device: Device, monkeypatch: pytest.MonkeyPatch) -> None:
    scenes = [changed(VOLUME), changed(VOLUME, override)]
    alone = [clfractal.render(scene) for scene in scenes]
    filled = counted(monkeypatch, fill._Filler, "run")
    with clfractal.Engine(device) as engine:
        for _ in range(2):
            for scene, expected in zip(scenes, alone, strict=True):
                equal(engine.render(scene), expected)
    assert len(filled) == 1


def test_a_grid_that_nobody_asks_for_is_dropped(device: Device, monkeypatch: pytest.MonkeyPatch) -> None:
    filled = counted(monkeypatch, fill._Filler, "run")
    with clfractal.Engine(device) as engine:
        engine.render(changed(VOLUME))
        for _ in range(3):
            engine.render(changed(BULB))
        assert isinstance(engine.executor, LocalExecutor)
        assert engine.executor.kept._things == {}
        engine.render(changed(VOLUME))
    assert len(filled) == 2


def test_one_thread_at_a_time(device: Device) -> None:
    with clfractal.Engine(device) as engine:
        inside, told = threading.Event(), []

        def other() -> None:
            inside.wait(60)
            try:
                engine.render(changed(BULB))
            except clfractal.ClfractalError as error:
                told.append(str(error))

        thread = threading.Thread(target=other)
        thread.start()

        def wait(_: object) -> None:
            inside.set()
            thread.join(60)

        framebuffer = engine.render(changed(BULB), wait)
        assert framebuffer.done.all()
        assert told == [
            "this engine is already in use; give each thread its own engine, or finish the refinement first"
        ]
        # And from one thread after the other as one likes.
        found: list[clfractal.Framebuffer] = []
        thread = threading.Thread(target=lambda: found.append(engine.render(changed(BULB))))
        thread.start()
        thread.join(120)
        equal(found[0], framebuffer)


def test_a_closed_engine_says_so(device: Device) -> None:
    engine = clfractal.Engine(device)
    engine.close()
    engine.close()  # as `with` does after it
    with pytest.raises(clfractal.ClfractalError, match=r"^this engine is closed$"):
        engine.render(changed(BULB))


def test_an_engine_goes_on_after_an_error(device: Device) -> None:
    with clfractal.Engine(device) as engine:
        with pytest.raises(clfractal.SceneError):
            engine.render(changed(BULB), region=(0, 0, 1000, 1))

        with pytest.raises(RuntimeError):
            engine.render(changed(BULB), raising(RuntimeError("a mistake of the caller")))
        equal(engine.render(changed(BULB)), clfractal.render(changed(BULB)))


def test_devices_with_contexts_of_their_own(device: Device) -> None:
    import pyopencl as cl

    assert choose() is choose()
    platform = (cl.context_properties.PLATFORM, device.cl_device.platform)
    assert device.reopened() is not device
    other = device.reopened()
    assert other.context != device.context
    assert device.reopened([]).properties == ()
    with clfractal.Engine(other) as own, clfractal.Engine(device) as shared:
        equal(own.render(changed(BULB)), shared.render(changed(BULB)))
    assert platform[1] == other.cl_device.platform


class TestRefinement:
    def test_it_ends_with_the_bits_of_a_render(self, device: Device) -> None:
        for overrides in ((), ("renderer.samples=6",), ("renderer.samples=16", "renderer.noise=0.05")):
            scene = changed(BULB, *overrides)
            with clfractal.Engine(device) as engine:
                framebuffers = list(engine.refine(scene))
                whole = engine.render(scene)
            equal(framebuffers[-1], whole)
            assert framebuffers[-1].stage == ""
            assert {framebuffer["R"].shape for framebuffer in framebuffers} == {whole["R"].shape}
            assert [framebuffer.stage for framebuffer in framebuffers[:3]] == [
                f"every {n} pixel" for n in ("8th", "4th", "2nd")
            ]

    def test_coarse_pictures_come_nearer(self, device: Device) -> None:
        with clfractal.Engine(device) as engine:
            framebuffers = list(engine.refine(changed(BULB, "image.width=160", "image.height=120")))
        errors = [
            float(np.abs(framebuffer["A"] - framebuffers[-1]["A"]).mean()) for framebuffer in framebuffers
        ]
        assert errors[0] > errors[1] > errors[2] > errors[3] == 0
        first = framebuffers[0]["A"]
        blocks = first.reshape(15, 8, 20, 8)
        assert (blocks == blocks[:, :1, :, :1]).all()

    @pytest.mark.parametrize("mode", ["split", "anaglyph", "rows"])
    def test_of_a_pair_and_a_layout(self, mode: str, device: Device) -> None:
        layout = "layout={gap: 3, views: [{renderer: {samples: 3}}, {camera: {position: [2, 1, 2]}}]}"
        stereo = f"stereo={{mode: {mode}, screen_width: 0.5, screen_distance: 0.7}}"
        scene = changed(BULB, layout, stereo)
        with clfractal.Engine(device) as engine:
            *_, last = engine.refine(scene)
            equal(last, engine.render(scene))

    def test_of_a_region(self, device: Device) -> None:
        scene, region = changed(BULB, "renderer.samples=2"), (13, 9, 40, 30)
        with clfractal.Engine(device) as engine:
            framebuffers = list(engine.refine(scene, region=region))
            equal(framebuffers[-1], engine.render(scene, region=region))

    def test_closing_one_frees_the_engine(self, device: Device) -> None:
        with clfractal.Engine(device) as engine:
            refinement = engine.refine(changed(BULB, "renderer.samples=64"))
            next(refinement)
            with pytest.raises(clfractal.ClfractalError, match="already in use"):
                engine.render(changed(BULB))
            refinement.close()
            engine.render(changed(BULB))

    def test_where_passes_do_not_fit_the_samples_are_made_at_once(
        self, device: Device, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        told: list[str] = []
        scene = changed(BULB, "renderer.samples=4")
        with clfractal.Engine(device, tell=told.append) as engine:
            whole = engine.render(scene)
            # A group of tiles keeps sums, too, but few.
            monkeypatch.setattr(local_executor, "pixels_at_a_time", lambda device, staged: 0)
            monkeypatch.setattr(Drawing, "kept_bytes", lambda self, tiles: 1 << 60)
            framebuffers = list(engine.refine(scene))
        equal(framebuffers[-1], whole)
        assert [framebuffer.stage for framebuffer in framebuffers[3:]] == [""]
        assert len(told) == 1
        assert told[0].startswith("a picture in passes needs ")
        assert told[0].endswith("; so all samples are made in one pass")

    def test_a_notebook_redraws_it(self, device: Device, monkeypatch: pytest.MonkeyPatch) -> None:
        import sys
        import types

        shown: list[str] = []

        class Handle:
            def update(self, framebuffer: clfractal.Framebuffer) -> None:
                shown.append(framebuffer.stage)

        def display(framebuffer: clfractal.Framebuffer, *, display_id: bool) -> Handle:
            assert display_id
            assert framebuffer._repr_png_() is not None
            shown.append(framebuffer.stage)
            return Handle()

        module = types.ModuleType("IPython.display")
        module.display = display  # type: ignore[attr-defined]
        monkeypatch.setitem(sys.modules, "IPython.display", module)
        with clfractal.Engine(device) as engine:
            engine.refine(changed(BULB))._ipython_display_()
        assert shown == ["every 8th pixel", "every 4th pixel", "every 2nd pixel", ""]

    def test_large_needs_are_told_first(self, device: Device, monkeypatch: pytest.MonkeyPatch) -> None:
        from clfractal.engine import local_executor as local

        told: list[str] = []
        monkeypatch.setattr(local, "_WORTH_TELLING", 1 << 10)
        with clfractal.Engine(device, tell=told.append) as engine:
            list(engine.refine(changed(BULB, "renderer.samples=2", "output.channels=[R, G, B]")))
        # Three colours and the number of samples, of 2 x 2 tiles.
        assert told == ["a picture in passes needs 0.1 MiB of device memory"]


def test_a_view_that_half_arrived_leaves_nothing(device: Device, monkeypatch: pytest.MonkeyPatch) -> None:
    """Out of memory after some of a new view's data were sent: the old view is complete again afterwards."""
    old, new = changed(BULB), changed(BULB, *CHANGES["camera"], *CHANGES["light"], *CHANGES["a palette"])
    with clfractal.Engine(device) as engine:
        expected = engine.render(old)
        sent, calls = Drawing._sent, []

        def failing(self: Drawing, *arguments: object) -> object:
            calls.append(arguments)
            if len(calls) == 2:
                raise clfractal.DeviceError("out of device memory")
            return sent(self, *arguments)  # type: ignore[arg-type]

        monkeypatch.setattr(Drawing, "_sent", failing)
        with pytest.raises(clfractal.DeviceError):
            engine.render(new)
        monkeypatch.setattr(Drawing, "_sent", sent)
        equal(engine.render(old), expected)
        equal(engine.render(new), clfractal.render(new))


def test_flags_follow_the_number_type_where_the_text_does_not(
    device: Device, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A volume's rays are float32 in both, and the program's text is the same."""
    flags: list[tuple[str, ...]] = []
    build = program.build

    def noted(*arguments: Any, **settings: Any) -> program.Program:
        if "volume" in settings["warm"][0].kernel:
            flags.append(settings["flags"])
        return build(*arguments, **settings)

    monkeypatch.setattr(program, "build", noted)
    monkeypatch.setattr(program, "loaded", lambda *_, **__: None)
    with clfractal.Engine(device) as engine:
        for precision in ("float32", "float64", "float64"):
            engine.render(changed(VOLUME), precision=precision)
    assert flags == [program.math_flags("float32"), program.math_flags("float64")]


# --- bookmarks change no picture ---


PLAIN = """\
version: 1
formula: {name: mandelbulb, iterations: 5}
camera: {position: [0, -3, 0]}
image: {width: 24, height: 16}
"""
MARKED = (
    PLAIN
    + "bookmarks: {front: {fov: 20}, top: {projection: orthographic, position: [0, 0, 3], up: [0, 1, 0]}}\n"
)


@pytest.mark.parametrize("rest", ["", "stereo: {}\n", "layout: {views: [{}, {fog: {}}]}\n"])
def test_unfinished_work_goes_on_with_other_bookmarks(device: Device, rest: str) -> None:
    plain, marked = (prepare(clfractal.load_scene(text + rest), device) for text in (PLAIN, MARKED))
    assert "bookmarks" not in plain.identity(0)["scene"]
    for number in range(len(plain.views)):
        assert plain.identity(number) == marked.identity(number)
    other = prepare(clfractal.load_scene(PLAIN.replace("-3", "-4") + rest), device)
    assert plain.identity(0) != other.identity(0)


def test_the_picture_is_the_same_and_keeps_them(device: Device, tmp_path: Path) -> None:
    plain, marked = (clfractal.render(clfractal.load_scene(text)) for text in (PLAIN, MARKED))
    for name in plain.channels:
        np.testing.assert_array_equal(plain[name], marked[name])
    marked.save(tmp_path / "marked.exr")
    kept = clfractal.load_scene(tmp_path / "marked.exr")
    assert isinstance(kept, clfractal.Scene)
    assert list(kept.bookmarks) == ["front", "top"]
