"""Which tests a mistake in a file concerns: those that are asked first."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from fnmatch import fnmatch
from functools import cache
from pathlib import Path

# The first row whose pattern fits a file names its tests, in the order in which they are asked: cheap ones first, without
# `tests/`, `test_` and `.py`. To them come the tests that bear the file's name, and for Python those that import it.
CONCERNS = """
kernels/formulas/numbers/*: numbers/ formulas/distance render/surface_analytic
kernels/*/show*: engine/show engine/canvas viewer/display
kernels/images/canvas.cl: engine/canvas viewer/session
kernels/integrators/cut_plane.cl: render/cut_plane
kernels/*/escape*.h: render/cut_plane formulas/distance
kernels/*planes*: render/planes_in_picture render/planes_in_fog
kernels/shading/environment.h: render/environment_kernel render/surface_rays
kernels/shading/sun.h: render/sun
kernels/integrators/march/normals.h: render/normals render/pixel_points
kernels/integrators/march/pixel_points.h: render/pixel_points render/normals
kernels/integrators/sampling.h: render/sampling render/reconstruction render/surface_rays render/lens_and_fog
kernels/*/color[_i]*: render/coloring render/surface_light
kernels/shading/color.h: render/coloring render/cut_plane render/reconstruction
kernels/integrators/camera.h: render/surface_analytic render/lens_and_fog render/stereo_views
kernels/integrators/interaction.h: render/coloring render/lens_and_fog render/normals render/surface_light
kernels/*/sh*.h: render/surface_light render/surface_rays render/lens_and_fog render/planes_in_fog
kernels/integrators/secondary.h: render/surface_rays render/surface_light
kernels/integrators/wide_lights.h: render/surface_rays render/surface_light
kernels/integrators/march/queue.h: render/surface_rays render/pixel_points
kernels/integrators/eye.h: render/surface_analytic render/lens_and_fog render/surface_rays
kernels/integrators/lit.h: render/surface_light render/surface_rays render/lens_and_fog render/planes_in_fog
kernels/*/st[ao]*: render/surface_rays render/pixel_points render/surface_light
kernels/*/surface*: render/surface_light render/surface_rays render/pixel_points
kernels/geometry/objects.h: render/objects render/objects_light
kernels/*/shape*: render/objects render/joined render/emitter_places
kernels/elements/shapes/*: render/objects render/joined render/emitter_places
kernels/elements/materials/*: render/materials render/layers render/glass render/furnaces
kernels/geometry/object_grids.h: render/object_grids render/turned_grids
kernels/geometry/clouds.h: render/clouds
kernels/integrators/*cloud*: render/clouds render/lane_shares
kernels/shading/medium_event.h: render/clouds render/volume_paths
kernels/integrators/volume/volume_bounds.h: render/volume_paths
clfractal/shading/transfer.py: render/clouds render/volume_paths voxels/lattice
kernels/*/emitter*.h: render/emitter_places render/emitters
kernels/geometry/rectangles.h: render/emitter_places render/surface_light
kernels/shading/light_sampling.h: render/emitters render/surface_light render/paths
kernels/shading/incidence.h: render/surface_light
kernels/shading/light_at.h: render/surface_light
kernels/elements/lights/*: render/surface_light render/emitter_places
kernels/shading/media.h: render/glass_objects render/furnaces
kernels/integrators/glass_paths.h: render/glass_objects render/furnaces
kernels/shading/participating_media.h: render/participating_media render/furnaces
kernels/shading/bump.h: render/bump render/furnaces
kernels/shading/bsdf_bumped.h: render/materials
kernels/integrators/events.h: render/clouds render/paths render/participating_media render/furnaces
kernels/geometry/water.h: render/objects
kernels/shading/phong_material.h: render/objects_light render/surface_light
kernels/integrators/march/march_steps.h: render/searches
kernels/*/march*: render/surface_analytic render/searches render/level_normals render/hast_above render/lanes_measured
kernels/*/solids*: render/joined
kernels/formulas/solid_inside.h: voxels/
kernels/formulas/node_proof.h: voxels/
kernels/voxels/bricks.h: voxels/
clfractal/geometry/solids.py: voxels/joined_voxels render/joined
kernels/*/trap*: render/coloring render/joined
kernels/*/orbit*: formulas/distance render/points render/surface_analytic render/joined
kernels/*/p[ar]*: render/reconstruction render/tiles_bits device/launch
kernels/integrators/pixel.h: render/reconstruction render/tiles_bits render/surface_light
kernels/formulas/points.cl: render/points formulas/distance
kernels/voxels/grid.h: render/volume_rays render/volume_surface voxels/grid_normals
kernels/device/gather.h: render/volume_rays render/volume_surface
kernels/*/volume*: render/volume_rays render/volume_surface render/planes_in_fog render/turned_grids
kernels/*/voxels*: voxels/ render/volume_surface render/turned_grids
kernels/integrators/tiles.h: render/tiles_bits render/reconstruction
kernels/*: numbers/ render/surface_analytic render/surface_light
clfractal/cli/*: cli bad_input exchange stereo_shell completion
clfractal/api.py: api stereo_python engine/engine
clfractal/device/c[ah]*: device/isolate device/cache engine/cancel
clfractal/device/*: device/ engine/cancel
clfractal/files/*: files/
clfractal/formulas/*: formulas/parser formulas/evaluate formulas/opencl formulas/catalog
clfractal/camera/*: render/view render/stereo_views render/surface_analytic
clfractal/images/*: render/framebuffer render/framebuffer_store render/compose render/anaglyph render/compose_files
clfractal/integrators/volume.py: render/volume_surface voxels/lattice render/turned_grids
clfractal/integrators/*: render/job_data render/few_programs render/points render/surface_light render/volume_surface
clfractal/scene/grid_place.py: render/turned_grids
clfractal/scene/given.py: render/turned_grids scene/volume_scenes
clfractal/scene/palette.py: scene/ bad_input render/planes_in_picture
clfractal/scene/*: scene/ bad_input
clfractal/voxels/*: voxels/ render/volume_rays render/turned_grids
clfractal/engine/var*: engine/variations vary_shell
clfractal/engine/*: engine/ render/tiles_bits resume comfort
clfractal/viewer/panels/*: viewer/panels viewer/widgets viewer/formula_panels viewer/golden_panels
clfractal/viewer/app.py: window/
clfractal/viewer/workspace.py: window/
clfractal/viewer/window.py: window/
clfractal/viewer/gl.py: window/
clfractal/viewer/window_picture.py: window/
clfractal/viewer/begin.py: window/
clfractal/viewer/input_events.py: window/
clfractal/viewer/ui_renderer.py: window/
clfractal/viewer/screens.py: window/
clfractal/viewer/operators.py: window/
clfractal/viewer/motion.py: window/
clfractal/viewer/session.py: viewer/session viewer/preparing viewer/drafts viewer/session_tasks
clfractal/viewer/*: viewer/studio viewer/session viewer/controls
clfractal/*: cli api
"""

# Asked of every mistake that its own tests did not notice: quick ones that go through the whole program.
QUICK = (
    "tests/test_cli.py",
    "tests/test_api.py",
    "tests/scene",
    "tests/render/test_framebuffer.py",
    "tests/render/test_reconstruction.py",
    "tests/render/test_stereo_pictures.py",
    "tests/render/test_volume_surface.py",
    "tests/test_scenes.py",
)

IMPORTERS = 5
"""Tests that import a file are asked if they are no more: else the file is everybody's, and its own row says enough."""


def concerned(path: str, root: Path) -> list[str]:
    """The tests that a mistake in a file concerns, in the order in which they are to be asked."""
    named = [test for test in _tests(root) if fnmatch(Path(test).name, f"test_{Path(path).stem}*.py")]
    importing = _importers(root).get(path, [])
    row = next(tests for pattern, tests in _rows() if fnmatch(path, pattern))
    tests = _once(named + (importing if len(importing) <= IMPORTERS else []) + row)
    return sorted(tests, key=lambda test: test.startswith("tests/window"))  # these take longest


def _rows() -> Iterator[tuple[str, list[str]]]:
    for line in CONCERNS.strip().splitlines():
        pattern, _, names = line.partition(": ")
        yield pattern, [_test(name) for name in names.split()]


def _test(name: str) -> str:
    """The file of a test, or the folder of those whose name ends in a slash."""
    folder, _, last = name.rpartition("/")
    return "/".join(filter(None, ["tests", folder, f"test_{last}.py" if last else ""]))


def _once(tests: list[str]) -> list[str]:
    """Without what an earlier folder or file covers already."""
    kept: list[str] = []
    for test in tests:
        if not any(test == other or test.startswith(f"{other}/") for other in kept):
            kept.append(test)
    return kept


@cache
def _tests(root: Path) -> list[str]:
    return sorted(path.relative_to(root).as_posix() for path in (root / "tests").rglob("test_*.py"))


@cache
def _importers(root: Path) -> dict[str, list[str]]:
    """For each module's file the tests that import it by name."""
    importers: dict[str, list[str]] = {}
    for test in _tests(root):
        for node in ast.walk(ast.parse((root / test).read_text(encoding="utf-8"))):
            names: list[str] = []
            if isinstance(node, ast.ImportFrom) and node.module:
                names = [node.module, *(f"{node.module}.{alias.name}" for alias in node.names)]
            elif isinstance(node, ast.Import):
                names = [alias.name for alias in node.names]
            for name in names:
                file = f"{name.replace('.', '/')}.py"
                if name.startswith("clfractal.") and test not in importers.setdefault(file, []):
                    importers[file].append(test)
    return importers
