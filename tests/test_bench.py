"""The speed table: its rows are the scenes that it promises, and its figures are those of the render."""

from __future__ import annotations

import json
import sys
from pathlib import Path
from unittest.mock import MagicMock

import pytest

import clfractal
from benchmarks import compare, growth
from benchmarks.ours import Ours
from benchmarks.rivals import base
from benchmarks.rivals.base import MissingError
from benchmarks.rivals.mandelbulber import Mandelbulber
from benchmarks.rivals.vtk_volume import VtkVolume
from benchmarks.runtimes import Runtime
from clfractal.cli import bench, bench_stages
from clfractal.cli.shell import Shell
from clfractal.device.select import Device, choose
from clfractal.formulas.opencl import operations_per_application
from clfractal.scene.surface import SurfaceRenderer


def scene_of(row: str, *changes: str) -> clfractal.Scene:
    text, own, _ = bench.ROWS[row]
    return clfractal.load_scene(text, overrides=(*own, *changes))


def test_rows_are_one_scene_each_but_for_what_they_measure() -> None:
    plain = scene_of("hast2-shadow")
    rows = [name for name, (text, _, _) in bench.ROWS.items() if text is bench.HAST]
    for name in rows:
        scene = scene_of(name)
        assert (scene.image.width, scene.image.height) == (1000, 1000)
        changed = scene.model_copy(update={"renderer": plain.renderer})
        assert changed == plain, name
    renderers = [scene_of(name).renderer for name in rows]
    assert len({renderer.model_dump_json() for renderer in renderers}) == len(rows)


def test_rows_of_volumes_and_planes() -> None:
    kinds = {
        name: scene_of(name)
        for name, (text, _, _) in bench.ROWS.items()
        if text in (bench.VOLUME, bench.PLANE)
    }
    assert {scene.renderer.type for scene in kinds.values()} == {"volume", "cut_plane"}
    for scene in kinds.values():
        assert scene.image.width * scene.image.height == 1_000_000
        assert scene.formula.name == "hast"


def test_every_normal_and_search_and_the_rivals_of_points_have_a_row() -> None:
    found = [scene_of(name).renderer for name in bench.ROWS]
    renderers = [renderer for renderer in found if isinstance(renderer, SurfaceRenderer)]
    with_points = {
        (renderer.normal, renderer.search) for renderer in renderers if renderer.used_points.count == 9
    }
    normals = (
        "gradient",
        "one_triangle",
        "eight_triangles_shading",
        "eight_triangles_normal",
        "least_squares",
    )
    assert with_points >= {(normal, "distance") for normal in normals}
    single = [renderer for renderer in renderers if renderer.used_points.count == 1]
    assert {renderer.search for renderer in single} == {"distance", "steps"}
    assert any(renderer.samples == 9 for renderer in single)
    assert any(renderer.ambient_occlusion and renderer.ambient_occlusion.rays == 8 for renderer in single)


@pytest.mark.parametrize("row", ["hast2-shadow", "hast2-samples9-shadow"])
def test_a_row_has_the_figures_of_its_renders(row: str) -> None:
    """A twentieth of its size. The peak is a number of our own, so that its part is known."""
    scene = scene_of(row, "image.width=50", "image.height=50")
    measured = bench._render_row(row, scene, choose(None), peak=100.0, repetitions=2)
    seconds = measured.ms / 1e3
    assert measured.wall_ms >= measured.ms > 0
    assert measured.rays_per_s is not None
    assert measured.rays_per_s == pytest.approx(2500 * scene.renderer.samples / seconds)
    assert measured.steps_per_ray is not None
    assert 2 < measured.steps_per_ray < 100
    assert measured.iterations_per_s is not None
    # Of a picture as small as this one all packets run out of rays.
    assert measured.waiting is None or 0 < measured.waiting < 0.5
    assert measured.fma_share is not None
    assert measured.iterations_per_s > measured.rays_per_s * measured.steps_per_ray
    done = measured.iterations_per_s * operations_per_application(scene.chain)
    assert measured.fma_share == pytest.approx(done / 100e9)


def test_the_table_has_a_line_for_each_row() -> None:
    rows = [
        {
            "name": "hast2-eight-shading",
            "ms": 1234.56,
            "wall_ms": 1300.0,
            "rays_per_s": 0.81e6,
            "iterations_per_s": 55.5e6,
            "steps_per_ray": 31.96,
            "waiting": 0.0812,
            "fma_share": 0.123,
            "lanes": 16,
        },
        {"name": "shell-to-png", "ms": 900.0, "wall_ms": 900.0}
        | dict.fromkeys(("rays_per_s", "iterations_per_s", "steps_per_ray", "waiting", "fma_share", "lanes")),
    ]
    report = {"device": "a device", "platform": "a platform", "peak_gflops_float32": 99.6, "rows": rows}
    head, titles, first, second = bench.table(report)
    assert "a device" in head
    assert "FMA peak 100 GFLOP/s" in head
    assert first.split() == [
        "hast2-eight-shading",
        "1234.6",
        "1300.0",
        "0.81",
        "55.5",
        "31.96",
        "8.1%",
        "12.3%",
        "16",
    ]
    assert second.split() == ["shell-to-png", "900.0", "900.0", "-", "-", "-", "-", "-", "-"]
    assert len(titles) == len(first) == len(second)


def test_only_the_wanted_rows_are_measured(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def row(name: str, *_: object) -> bench.Row:
        return bench.Row(name, 1.0, 2.0)

    monkeypatch.setattr(bench, "_render_row", row)
    monkeypatch.setattr(bench, "_grid_row", lambda device: row(bench.GRID_ROW))
    monkeypatch.setattr(bench, "_shell_row", lambda device: row(bench.SHELL_ROW))
    monkeypatch.setattr("clfractal.cli.bench_frames.frame_times", lambda name, device: (1.0, 2.0))
    monkeypatch.setattr(bench, "fma_peak", lambda device, precision: 100.0)
    report = tmp_path / "bench.json"
    shell = Shell(owns_process=False)
    shell.quiet = True
    for wanted in ((), ("hast2-plane256", "hast2-grid512")):
        bench.run(device=None, json_file=report, shell=shell, wanted=wanted)
        found = [one["name"] for one in json.loads(report.read_text())["rows"]]
        assert found == [name for name in bench.row_names() if name in wanted or not wanted]
    with pytest.raises(
        clfractal.ClfractalError, match="--row: unknown row 'hast3'; known: mandelbulb8-shadow"
    ):
        bench.run(device=None, json_file=None, shell=shell, wanted=("hast3",))


def test_rivals_take_part_in_their_rows() -> None:
    """Rows 4 to 6 have a rival each; who has none of the wanted rows stays at home."""
    runtime = Runtime("PoCL", Path("vendors"))
    everyone = compare.contestants([runtime], [], "")
    assert [type(one) for one in everyone] == [Ours, compare.NumbaRival, VtkVolume, Mandelbulber]
    rivals = {
        row: [type(one) for one in compare.contestants([runtime], [], "", [row])[1:]] for row in base.ROWS
    }
    assert rivals["hast2-grid512"] == rivals["hast2-plane256"] == [compare.NumbaRival]
    assert rivals["hast2-volume512"] == [VtkVolume]
    assert rivals["shell-to-png"] == [Mandelbulber]
    assert set(base.ROWS) <= set(bench.row_names())


@pytest.mark.parametrize("rival", [compare.NumbaRival, VtkVolume])
def test_a_rival_that_is_not_installed_says_so(
    rival: type[compare.NumbaRival | VtkVolume], monkeypatch: pytest.MonkeyPatch
) -> None:
    for module in ("numba", "vtk"):
        monkeypatch.setitem(sys.modules, module, None)
    entries = compare.play([rival()], 1)
    assert entries[0].missing is not None
    assert "is not installed (pip install" in entries[0].missing
    assert "| missing: " in compare.markdown(entries)


def test_vtk_without_a_display(monkeypatch: pytest.MonkeyPatch) -> None:
    """It would end the process."""
    for module in ("vtk", "vtk.util", "vtk.util.numpy_support"):
        monkeypatch.setitem(sys.modules, module, MagicMock())
    monkeypatch.delenv("DISPLAY", raising=False)
    monkeypatch.setattr(sys, "platform", "linux")
    with pytest.raises(MissingError, match=r"needs a display \(xvfb-run -a\)"):
        VtkVolume().prepare()


def test_the_table_of_growth(monkeypatch: pytest.MonkeyPatch) -> None:
    """Its smallest lines, in a picture and a grid that are quick."""
    monkeypatch.setattr(growth, "RESOLUTIONS", (24, 1024))
    monkeypatch.setattr(growth, "SHOWN", (24, 1024))
    monkeypatch.setattr(growth, "MEGAPIXELS", (0.01, 16))
    lines = list(growth.figures(clfractal.Engine(), 1, 24, 1))
    assert [(line.row, line.size) for line in lines] == [
        ("grid", "24^3"),
        ("volume, composited", "24^3, 0.01 MP"),
        ("volume, a surface", "24^3, 0.01 MP"),
        ("cut plane", "0.01 MP"),
    ]
    assert all(line.device_ms > 0 and line.processor_ms > 0 for line in lines)


def test_the_table_of_stages(device: Device) -> None:
    """A small picture's, as plain data and as text."""
    scene = scene_of("mandelbulb8-shadow", "image.width=64", "image.height=64")
    row = bench_stages.picture_row("mandelbulb8-shadow", scene, device, peak=100.0, repetitions=3)
    assert row.rays == 64 * 64
    assert row.ms == pytest.approx(sum(stage.ms for stage in row.stages) + row.between_ms)
    assert sum(stage.share for stage in row.stages) == pytest.approx(1.0 - row.between_ms / row.ms)
    assert row.applications_ms == pytest.approx(
        row.applications * operations_per_application(scene.chain) / 100e9 * 1e3
    )
    assert (row.busy_in_march is None) == (row.busy_in_orbits is None) == (row.lanes == 1)
    if row.busy_in_orbits is not None:
        assert 0 < row.busy_in_orbits < 1
        assert row.waited_ms / row.applications_ms == pytest.approx(1 / row.busy_in_orbits - 1)
    report = bench.report_of(device, 100.0, [row])
    assert json.loads(json.dumps(report))["rows"][0]["stages"][0]["name"] == row.stages[0].name
    lines = bench_stages.table(report)
    assert lines[0] == bench.headline(report)
    assert lines[2].split() == ["mandelbulb8-shadow", "launches", "ms", "share"]
    for stage, line in zip(row.stages, lines[3:], strict=False):
        assert line.startswith(f"{stage.name} ")
        assert line.split()[-3] == str(stage.launches)
    every = lines[4 + len(row.stages)].split()
    assert every == ["all", str(sum(stage.launches for stage in row.stages)), f"{row.ms:.2f}", "100.0%"]
    assert lines[-1] == (
        f"for a pixel {row.state_bytes} bytes of state, {row.queue_bytes} of rays and of what these met"
    )


def test_stages_of_wanted_rows(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def row(name: str, *_: object) -> bench_stages.PictureRow:
        stage = bench_stages.StageRow("cut_plane", 1, 2.0, 1.0)
        return bench_stages.PictureRow(name, 16, 2.0, 0.0, 9, 99, 1.0, 0.0, None, None, 0, 0, (stage,))

    monkeypatch.setattr(bench_stages, "picture_row", row)
    monkeypatch.setattr(bench, "fma_peak", lambda device, precision: 100.0)
    report = tmp_path / "stages.json"
    shell = Shell(owns_process=False)
    shell.quiet = True
    for wanted in ((), ("hast2-plane256",)):
        bench_stages.run(device=None, json_file=report, shell=shell, wanted=wanted)
        found = [one["name"] for one in json.loads(report.read_text())["rows"]]
        assert found == [name for name in bench.ROWS if name in wanted or not wanted]
    with pytest.raises(clfractal.ClfractalError, match="--row: unknown row 'shell-to-png'"):
        bench_stages.run(device=None, json_file=None, shell=shell, wanted=("shell-to-png",))
