"""Small pictures that every implementation renders: `python -m tests.portability.pictures OUT KIND PART [LEFT_OUT ...]`.

KIND is `full`, `brief` or `tiny`, PART says which process of a kind's (`PARTS`) this is. They reach what
a compiler may get wrong: trigonometry and whole powers, folds, chains of branches, states of four numbers, the scalar
derivative and the full Jacobian, shadows of both kinds of light, several samples; what stills add: the points of a pixel,
the search by steps, every kind of ray, a lens and fog; a grid that is filled and shown as a cloud around a cut plane, and a
plane by itself.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from clfractal.device.select import Device, choose
from clfractal.device.structs import Precision
from clfractal.engine.job import Identity, Job
from clfractal.engine.local_executor import LocalExecutor
from clfractal.engine.run import run
from clfractal.images.framebuffer import Framebuffer
from clfractal.integrators.lanes import best_lanes
from clfractal.integrators.plan import PlannedView, make_plan
from clfractal.scene.load import load_scene
from clfractal.scene.model import Scene
from clfractal.scene.surface import SurfaceRenderer

CHANNELS = ("R", "G", "B", "A", "Z", "N.X", "N.Y", "N.Z", "P.X", "P.Y", "P.Z", "iterations", "steps")

_LIGHTS = """
lights:
  - {type: directional, direction: [-1, 1, -1]}
  - {type: point, position: %s, color: [0.3, 0.4, 0.6], intensity: 2, falloff: inverse_square}
"""

_SCENES: dict[str, str] = {
    "mandelbulb": "{name: mandelbulb, iterations: 10}",
    "trigonometric": "{name: mandelbulb, iterations: 8, parameters: {power: 2.5, theta_phase: 0.3}}",
    "hast": "{name: hast, iterations: 20}",
    "mandelbox": "{name: mandelbox, iterations: 10}",
    "quaternion": "{name: quaternion_julia, iterations: 12}",
    "kaleidoscope": "{name: kaleidoscopic_ifs, iterations: 10}",
    "still": "{name: hast, iterations: 8}",
    "paths": "{name: quaternion_julia, iterations: 9, julia: [-0.2, 0.68, 0.2, 0.1]}",
    "steps": "{name: mandelbulb, iterations: 5}",
    "joined": "{name: mandelbulb, iterations: 5}",
    "volumes": "{name: mandelbulb, iterations: 5}",
    "cloud": "{name: mandelbulb, iterations: 5}",
    "filled": "{name: mandelbulb, iterations: 5}",
    "counted": "{name: hast, iterations: 9}",
    "plane": "{name: hast, iterations: 60}",
    "glass": "{name: quaternion_julia, iterations: 9, julia: [-0.2, 0.68, 0.2, 0.1]}",
    "skin": "{name: quaternion_julia, iterations: 9, julia: [-0.2, 0.68, 0.2, 0.1]}",
    "inside": "{name: quaternion_julia, iterations: 11, julia: [-0.2, 0.68, 0.2, 0.1]}",
    "coverage": "{name: quaternion_julia, iterations: 11, julia: [-0.2, 0.68, 0.2, 0.1]}",
}
_RENDERERS = {
    "paths": "{samples: 3, filter: tent}",
    "glass": "{samples: 4}",
    "skin": "{samples: 4}",
    "still": "{samples: 2, points: {}, normal: least_squares, ambient_occlusion: {rays: 2}, bounces: 1,"
    " filter: tent}",
    "steps": "{samples: 2, search: steps, points: {pattern: stochastic, count: 4}, filter: blackman_harris}",
    "cloud": "{type: volume, resolution: 12, value: iterations, normals: exact,"
    " transfer: {opacity: [{at: 1, opacity: 0}, {at: 5, opacity: 0.1}]}}",
    "joined": "{samples: 2}",
    "volumes": "{samples: 4}",
    "inside": "{type: volume, resolution: 24, value: inside, normals: least_squares}",
    "coverage": "{type: volume, resolution: 24, value: coverage, shadows: true,"
    " transfer: {opacity: [{at: 0.05, opacity: 0}, {at: 1, opacity: 0.6}]}}",
    "filled": "{type: volume, resolution: 24, value: coverage, normals: least_squares}",
    "counted": "{type: volume, resolution: 16, value: iterations, normals: exact,"
    " transfer: {opacity: [{at: 2, opacity: 0}, {at: 9, opacity: 0.3}]}}",
    "plane": "{type: cut_plane, plane: {normal: [0.2, 0.3, 1], width: 3, height: 3}, samples: 2}",
}
_MORE = {
    "still": "material: {reflection: 0.3}\nenvironment: {name: studio, rays: 2}\n"
    "fog: {density: 0.05, height: 3, scattering: {anisotropy: 0.3}}\nglow: {by: trap, color: [1, 0.6, 0.3]}\n",
    "steps": "coloring: {by: trap, scale: 1, palette: opal}\nbackground: transparent\n"
    "environment: {sky: {sun_elevation: 20}, rays: 2}\n"
    "materials: {steel: {base: {metalness: 1}, specular: {roughness: 0.2}}}\n"
    "objects: {post: {type: cylinder, position: [0.4, -0.9, 0], rotation: [30, 10, 0], material: steel},"
    " box: {type: box, position: [-0.8, -0.8, 0.2], size: [0.4, 0.3, 0.5], rotation: [0, 0, 25]}}\n",
    "paths": "lighting: {mode: path, bounces: 3, roulette: 1}\nenvironment: {name: studio}\n"
    "materials: {clay: {base: {color: [0.8, 0.5, 0.3], diffuse_roughness: 0.5, metalness: 0.2}, coat: {weight: 0.3},"
    " fuzz: {weight: 0.2}, emission: {luminance: 0.05}}}\nmaterial: {name: clay}\n"
    "objects: {sea: {type: water, position: [0, 0, -0.7], material: clay}, floor: {type: plane, position: [0, 0, -1]},"
    " ball: {position: [0.6, -0.9, 0.2], radius: 0.3, scale: [1, 1, 2], material: clay},"
    " box: {type: box, position: [-0.6, -0.9, 0.5], size: [0.3, 0.2, 0.4], rotation: [20, 30, 0], material: clay},"
    " tube: {type: cylinder, position: [0, -1, -0.4], radius: 0.1, height: 0.8, rotation: [0, 70, 0], material: clay}}\n"
    "cut_planes: [{plane: {normal: [1, -1, 0.2], width: 2, height: 2}, cut: true, objects: [ball, tube], opacity: 0.3,"
    " iterations: 20}]\n",
    "glass": "lighting: {mode: path, bounces: 6}\nenvironment: {name: studio}\n"
    "materials: {glass: {specular: {roughness: 0.2}, coat: {weight: 0.2},"
    " transmission: {weight: 0.9, color: [0.6, 0.9, 0.8], depth: 1, dispersion_scale: 0.5},"
    " bump: {height: {by: iterations, range: [0, 9], curve: [[0, 0], [1, 0.1]]}, width: 0.1}},"
    " sea: {specular: {ior: 1.3}, transmission: {weight: 1, color: [0.5, 0.8, 0.9], depth: 2,"
    " scatter: [0.5, 0.6, 0.8], scatter_anisotropy: 0.4}}}\nmaterial: {name: glass}\n"
    "objects: {sea: {type: water, position: [0, 0, -0.7], material: sea}, floor: {type: plane, position: [0, 0, -1.2]},"
    " ball: {position: [0.5, -0.7, -0.4], radius: 0.5, material: glass}}\n",
    "skin": "lighting: {mode: path, bounces: 4}\nbackground: {top: [1, 1, 1], bottom: [0.5, 0.4, 0.3]}\n"
    "materials: {skin: {coat: {weight: 0.2}, subsurface: {weight: 0.8, color: [0.9, 0.6, 0.4], radius: 0.2}}}\n"
    "material: {name: skin}\n"
    "objects: {drop: {type: sphere, join: smooth_union, position: [0.6, -0.7, 0.2], radius: 0.3, material: skin},"
    " egg: {type: sphere, position: [-0.8, -0.9, 0.5], radius: 0.3, scale: [1, 0.7, 1.2], material: skin}}\n",
    "joined": "coloring: {by: trap, scale: 1, palette: opal}\n"
    "objects: {hole: {type: sphere, position: [0.3, -0.8, 0.3], radius: 0.4, join: cut},"
    " drop: {type: box, join: smooth_union, position: [-0.7, -0.6, 0.6], size: [0.4, 0.3, 0.5]},"
    " other: {type: formula, position: [0.9, -0.3, -0.4], scale: 0.05, formula: {name: mandelbox, iterations: 8}},"
    " slab: {type: plane, position: [0, 0, 0.9], join: intersection},"
    " mould: {type: formula, position: [-0.2, -0.9, -0.3], scale: 0.06, formula: {name: mandelbox, iterations: 8},"
    " join: cut}}\n"
    "cut_planes: [{plane: {normal: [1, -1, 0.2], width: 2, height: 2}, cut: true, opacity: 0.6}]\n",
    "volumes": "lighting: {mode: path, bounces: 3}\n"
    "objects: {core: {type: volume, file: ball.npy, level: 90, size: 0.9, position: [0.5, -0.9, 0.2]},"
    " cloud: {type: volume, file: ball.npy, size: 1.2, scale: [1, 0.7, 1.3], rotation: [20, 30, 0],"
    " position: [-0.6, -0.8, 0.3], anisotropy: 0.4, transfer: {opacity: [{at: 0, opacity: 0}, {at: 255, opacity: 0.8}],"
    " emission: [{at: 60, emission: [0, 0, 0]}, {at: 255, emission: [0.2, 0.1, 0]}]}},"
    " floor: {type: plane, position: [0, 0, -1]}}\n",
    "filled": "objects: {hole: {type: sphere, position: [0.3, -0.8, 0.3], radius: 0.4, join: cut},"
    " egg: {type: sphere, position: [-0.8, -0.7, 0.3], radius: 0.3, scale: [1, 0.7, 1.2], rotation: [0, 30, 0]},"
    " other: {type: formula, position: [0.9, -0.3, -0.4], scale: 0.05, formula: {name: mandelbox, iterations: 8}},"
    " slab: {type: plane, position: [0, 0, 0.9], join: intersection}}\n",
    "counted": "objects: {drop: {type: box, join: smooth_union, position: [-0.7, -0.6, 0.6], size: [0.4, 0.3, 0.5]},"
    " post: {type: cylinder, position: [0.6, -0.5, 0], rotation: [30, 10, 0]}}\n",
    "quaternion": "cut_planes: [{plane: {normal: [1, -1, 0.2], width: 2, height: 2}, cut: true}]\n",
    "cloud": "cut_planes: [{plane: {normal: [1, -1, 0.2], width: 2, height: 2}, opacity: 0.5}]\n",
}
_LENSES = {"still": ", f_number: 0.5"}
# Pictures with large programs.
LARGE = (
    "still",
    "paths",
    "glass",
    "skin",
    "steps",
    "joined",
    "volumes",
    "cloud",
    "inside",
    "coverage",
    "filled",
    "counted",
)
# Each adds something that the others do not have; the rest are more formulas.
_BRIEF = ("trigonometric", "mandelbox", *LARGE, "plane")
# Rendered in float64 too: small programs, as PoCL compiles wide doubles slowly.
_DOUBLE = ("mandelbulb", "mandelbox")
# (Oclgrind 21.10 crashes itself on the cloud when it looks for uses of what was never written.)
_TINY = ("mandelbulb", "hast", "mandelbox", "plane")

FOLDER = Path(__file__).parent
"""Where the grid is that objects show."""
SIZE, TINY_SIZE = (96, 72), (12, 8)
# Processes that share a kind's pictures: one for surfaces, which share the programs that know no formula, and two for the
# others. The simulator's checker of memory takes a second picture's for the first
# one's.
PARTS = {"full": 3, "brief": 3, "tiny": 4}


def cases(kind: str) -> Iterator[tuple[str, Precision]]:
    """Names and number types of the pictures."""
    chosen = {"full": tuple(_SCENES), "brief": _BRIEF, "tiny": _TINY}[kind]
    for name in chosen:
        yield name, "float32"
    for name in _DOUBLE:
        if name in chosen and kind != "tiny":
            yield name, "float64"


def cases_of(kind: str, part: int) -> list[tuple[str, Precision]]:
    """Those of a process."""
    every = list(cases(kind))
    if kind == "tiny":
        return every[part :: PARTS[kind]]
    surfaces = [each for each in every if "type:" not in _RENDERERS.get(each[0], "")]
    others = [each for each in every if each not in surfaces]
    return others[part - 1 :: PARTS[kind] - 1] if part else surfaces


def picture(
    device: Device, name: str, precision: Precision, size: tuple[int, int], lanes: int | None = None
) -> npt.NDArray[np.float32]:
    """All channels of a picture, shape (channels, height, width); with the best lane count if none is given."""
    scene = scene_of(name, size)
    plan = make_plan(
        scene, precision=precision, lanes=lanes or best_lanes(device, precision), channels=CHANNELS
    )
    framebuffer = Framebuffer(plan.channels, size, plan.region)
    job = Job(scene, (PlannedView(scene, plan),), Identity(0), plan.channels, device.info, "")
    run(job, [framebuffer], LocalExecutor(device))
    if isinstance(scene.renderer, SurfaceRenderer) and scene.renderer.search == "steps":
        # A binary search down to the last digit takes a step more or less where that digit differs.
        framebuffer["steps"][:] = 0
    return np.stack([framebuffer[channel] for channel in CHANNELS])


def scene_of(name: str, size: tuple[int, int]) -> Scene:
    """The scene of a picture."""
    # The formula's bounds say where the camera has to be for the picture to be filled.
    far = (0.0, -99.0, 0.0)
    bounds = load_scene(_scene_text(name, far, (0.0, 0.0, 0.0), far, size), folder=FOLDER).chain
    x, y, z = (float(value) for value in bounds.center)
    radius = float(bounds.radius)
    position = (x + 0.7 * radius, y - 2.1 * radius, z + 0.7 * radius)
    lamp = (x + radius, y - radius, z + 0.5 * radius)
    return load_scene(_scene_text(name, position, (x, y, z), lamp, size), folder=FOLDER)


def _scene_text(
    name: str,
    position: Sequence[float],
    target: Sequence[float],
    lamp: Sequence[float],
    size: tuple[int, int],
) -> str:
    width, height = size
    return (
        f"version: 1\nformula: {_SCENES[name]}\nimage: {{width: {width}, height: {height}}}\n"
        f"camera: {{position: {list(position)}, target: {list(target)}, fov: 45{_LENSES.get(name, '')}}}\n"
        f"renderer: {_RENDERERS.get(name, '{samples: 2}')}\n{_LIGHTS % list(lamp)}{_MORE.get(name, '')}"
    )


def main() -> None:
    """Render a part of the pictures on the device that the environment names."""
    kind, part, left_out = sys.argv[2], int(sys.argv[3]), sys.argv[4:]
    device = choose()
    print(device.info.name, "|", device.info.version, flush=True)
    rendered = {}
    for name, precision in cases_of(kind, part):
        if name in left_out:
            print("left out", name, precision, flush=True)
            continue
        rendered[f"{name} {precision}"] = picture(
            device, name, precision, TINY_SIZE if kind == "tiny" else SIZE
        )
        print("rendered", name, precision, flush=True)
    save: Any = np.savez  # its stubs know no arrays by name beside options
    save(Path(sys.argv[1]), **rendered)


if __name__ == "__main__":
    main()
