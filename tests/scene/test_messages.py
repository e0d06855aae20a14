"""What a wrong scene gets: the exact line, at the exact place."""

from __future__ import annotations

from pathlib import Path

import pytest

from clfractal.errors import ClfractalError, SceneError
from clfractal.scene.load import load_scene
from tests.scene.errors import cases, error_of, marked

HEAD = "version: 1\nformula: {name: mandelbulb}\n"


COLOR = "must be a list of 3 numbers, or a colour as '#ff8800' or '#f80'"

# In the texts below the sign § stands where the message must point to.
CASES = [
    *cases(
        """
# The camera.
camera:
  fov: §400 => camera.fov: must be below 180, got 400
camera: {fov: §0} => camera.fov: must be at least 1e-06, got 0
camera: {fov: §wide} => camera.fov: must be a number, got 'wide'
camera: {fov: §true} => camera.fov: must be a number, got true
camera: {fov: §.nan} => camera.fov: must be a finite number, got .nan
camera: {§fow: 40} => camera: unknown key 'fow'; did you mean 'fov'?
camera: {position: §[0, 1]} => camera.position: must be a list of 3 numbers, got a list of 2
camera: {position: §[0, 1, 2, 3]} => camera.position: must be a list of 3 numbers, got a list of 4
camera: {position: [0, 1, §a]} => camera.position.2: must be a number, got 'a'
camera: {position: [0, 1, §1e7]} => camera.position.2: must be at most 1000000, got 10000000.0
camera: {position: §3} => camera.position: must be a list of 3 numbers, got 3
camera: {target: §[0, -3, 0]} => camera.target: must differ from camera.position
camera: {up: §[0, 0, 0]} => camera.up: must not be zero
camera: {up: §[0, 5, 0]} => camera.up: must not be parallel to the view, from camera.position to camera.target
camera: {projection: §ortographic} => camera.projection: unknown projection 'ortographic'; did you mean 'orthographic'?
camera: {projection: §3} => camera.projection: must be perspective or orthographic, got 3
camera: {projection: orthographic, §fov: 45}
=> camera: unknown key 'fov'; known: frame, height, orbit, position, projection, roll, shift, target, up
camera: §3 => camera: must be a mapping, got 3
camera:§ => camera: must be a mapping, got nothing
§camra: {} => unknown key 'camra'; did you mean 'camera'?
# A place of any depth.
camera: {}
deep: §3 => deep: must be a mapping, got 3
camera: {}
deep: {§centre: [0, 0, 0]} => deep: unknown key 'centre'; did you mean 'center'?
camera: {}
deep: {center: §[0, 1]} => deep.center: must be a list of 3 numbers, got a list of 2
camera: {}
deep: {center: ["0.1", §0.1.2, 0]} => deep.center.1: must be a decimal number of at most 1000 digits, got '0.1.2'
camera: {}
deep: {center: [0, §"1e7", 0]} => deep.center.1: must be from -1,000,000 to 1,000,000, got 1e7
camera: {}
deep: {center: [0, §true, 0]} => deep.center.1: must be a number, or one in quotes
camera: {}
deep: {magnification: §0.5} => deep.magnification: must be at least 1, got 0.5
camera: {}
deep: {magnification: §1e121} => deep.magnification: must be at most 1e+120, got 1e+121
camera: {frame: §seen}
deep: {} => camera.frame: seen cannot be combined with deep; use all
camera: {}
deep: {}
objects: {a: {type: §formula, formula: {name: hast}}}
=> objects.a.type: formula cannot be combined with deep; remove one of them
camera: {}
deep: {}
objects: {a: {type: sphere, join: §cut}} => objects.a.join: cut cannot be combined with deep; remove one of them
camera: {}
deep: {}
renderer: {type: volume}
objects: {a: §{type: sphere}} => objects.a: an object in a volume cannot be combined with deep; remove one of them
camera: {}
deep: {}
lights: [{type: §set}] => lights.0.type: set cannot be combined with deep; remove one of them
# The rest.
image: {width: §0} => image.width: must be at least 1, got 0
image: {width: §1.5} => image.width: must be a whole number, got 1.5
image: {width: §1000000} => image.width: must be at most 65536, got 1000000
image: §{width: 65536, height: 65536} => image: must be at most 1,073,741,824 pixels, got 65536 x 65536
renderer: {type: §surfase} => renderer.type: unknown type 'surfase'; did you mean 'surface'?
renderer: {samples: §0} => renderer.samples: must be at least 1, got 0
renderer: {bounds: §{center: [0, 0, 0]}} => renderer.bounds.radius: is missing
lights:
  - {type: §pont} => lights.0.type: unknown type 'pont'; did you mean 'point'?
lights: [{}, §{type: point}] => lights.1.position: is missing
lights: [{direction: §[0, 0, 0]}] => lights.0.direction: must not be zero
lights: [{shadow: §yes}] => lights.0.shadow: must be true or false, got 'yes'
lights: §bright => lights: must be a list, got 'bright'
lights: [§bright] => lights.0: must be a mapping, got 'bright'
material: {color: [1, §2, 3]} => material.color.1: must be at most 1, got 2
material: {color: [1, §.inf, 3]} => material.color.1: must be a finite number, got .inf
background: §black => background: must be transparent, a colour, or a mapping with top and bottom, got 'black'
background: §'#33669' => background: «COLOR», got '#33669'
background: §[1, 2, x] => background.top.2: must be a number, got 'x'
background:§  #336699 => background: «COLOR», got nothing; a # needs quotes
material: {color: §'#12345g'} => material.color: «COLOR», got '#12345g'
material: {color: §3} => material.color: «COLOR», got 3
material: {color: §[1, 2]} => material.color: must be a list of 3 numbers, got a list of 2
stereo: {colors: ['#f00', §'#0fff']} => stereo.colors.1: «COLOR», got '#0fff'
coloring: {palette: ['#000', §'#f8', '#fff']}
=> coloring.palette.1: must be a stop, or a colour as '#ff8800' or '#f80', got '#f8'
background: {§tpo: 1} => background: unknown key 'tpo'; did you mean 'top'?
coloring: {by: §depth}
=> coloring.by: must be solid, normal, iterations, residual, thickness, layer_distance, trap or carried, got 'depth'
coloring: {by: §carried}
=> coloring.by: carried needs a formula with numbers that are carried, and the scene's have no `state`
coloring: {by: iterations, palette: §viridiss} => coloring.palette: unknown palette 'viridiss'; did you mean 'viridis'?
coloring: {palette: §[]} => coloring.palette: must not be empty
coloring: {palette: §7} => coloring.palette: must be text or a list, got 7
coloring: {palette: [{at: 1, color: [0, 0, 0]}, {at: §0.5, color: [0, 0, 0]}]}
=> coloring.palette.1.at: must be at least 1, the value at the stop before, got 0.5
coloring: {palette: §[{at: 0, color: [0, 0, 0]}]} => coloring.palette: must have at least 2 entries, got 1
coloring: {by: trap, palette: §viridiss} => coloring.palette: unknown palette 'viridiss'; did you mean 'viridis'?
coloring: {by: thickness, along: §reflection} => coloring.along: must be view or normal for thickness, got reflection
coloring: {layer: §0} => coloring.layer: must be at least 1, got 0
coloring: {step: §0} => coloring.step: must be above 0, got 0
coloring: {step: §100} => coloring.step: must be at most the diameter of the bounds, 2.208, got 100
coloring: {by: §residual} => coloring.by: residual needs at least 4 points per pixel (renderer.points), got 1
coloring: {trap: {shape: §cube}} => coloring.trap.shape: must be point, axis, plane or sphere, got 'cube'
coloring: {trap: {direction: §[0, 0, 0]}} => coloring.trap.direction: must not be zero
coloring: {trap: {radius: §-1}} => coloring.trap.radius: must be above 0, got -1
coloring: {trap: {§centre: [0, 0, 0]}} => coloring.trap: unknown key 'centre'; did you mean 'center'?
# How the surface is searched, and a pixel's points.
renderer: {search: §stepps} => renderer.search: must be distance or steps, got 'stepps'
renderer: {step: §0} => renderer.step: must be above 0, got 0
renderer: {step: §-0.1} => renderer.step: must be above 0, got -0.1
renderer: {step: §.nan} => renderer.step: must be a finite number, got .nan
renderer: {step: §2.5} => renderer.step: must be at most the diameter of the bounds, 2.208, got 2.5
renderer: {step: §1e-7} => renderer.step: must be at least 2.208e-06, 1,000,000 steps through the bounds, got 1e-07
renderer: {step: §2.5, bounds: {radius: 1}} => renderer.step: must be at most the diameter of the bounds, 2, got 2.5
renderer: {points: §9} => renderer.points: must be a mapping, got 9
renderer: {points: {count: §0}} => renderer.points.count: must be at least 1, got 0
renderer: {points: {count: §81}} => renderer.points.count: must be at most 64, got 81
renderer: {points: {count: §9.5}} => renderer.points.count: must be a whole number, got 9.5
renderer: {points: {count: §8}} => renderer.points.count: must be a square for a grid (1, 4, 9, 16, 25, 36, 49, 64), got 8
renderer: {points: {pattern: stochastic, count: §3}}
=> renderer.points.count: must be from 4 to 64 for stochastic points, got 3
renderer: {points: {pattern: §hex}} => renderer.points.pattern: must be grid or stochastic, got 'hex'
renderer: {normal: §one_triangle, points: {count: 16}}
=> renderer.normal: one_triangle needs points in a grid of 9, 25 or 49, got grid 16
renderer: {points: {pattern: stochastic, count: 9}, normal: §eight_triangles_normal}
=> renderer.normal: eight_triangles_normal needs points in a grid of 9, 25 or 49, got stochastic 9
renderer: {normal: §least_squares, points: {count: 1}} => renderer.normal: least_squares needs at least 4 points, got 1
# Samples.
renderer: {samples: 8, noise: 0.01, min_samples: §16} => renderer.min_samples: must be at most samples (8), got 16
renderer: {min_samples: §3} => renderer.min_samples: must be at least 4, got 3
renderer: {noise: §0} => renderer.noise: must be above 0, got 0
renderer: {filter: §gauss} => renderer.filter: must be box, tent or blackman_harris, got 'gauss'
renderer: {filter_width: §0} => renderer.filter_width: must be at least 0.1, got 0
renderer: {firefly_limit: §0} => renderer.firefly_limit: must be above 0, got 0
# Light.
renderer: {bounces: §17} => renderer.bounces: must be at most 16, got 17
renderer: {ambient_occlusion: {rays: §0}} => renderer.ambient_occlusion.rays: must be at least 1, got 0
renderer: {ambient_occlusion: {distance: §0}} => renderer.ambient_occlusion.distance: must be above 0, got 0
lights: [{angular_size: §180}] => lights.0.angular_size: must be at most 170, got 180
lights: [{type: sphere, position: [0, 0, 3], radius: §0}] => lights.0.radius: must be above 0, got 0
lights: [{type: rectangle, position: [0, 0, 3], direction: §[0, 0, 0]}] => lights.0.direction: must not be zero
lights: [{type: rectangle, position: [0, 0, 3], direction: [0, 0, 1], up: §[0, 0, 2]}]
=> lights.0.up: must not be along direction
lights: [{temperature: §900}] => lights.0.temperature: must be at least 1000, got 900
lights: [{type: spot, position: [0, 0, 3], angle: §200}] => lights.0.angle: must be at most 180, got 200
lights: [{type: §sfere}] => lights.0.type: unknown type 'sfere'; did you mean 'sphere'?
lights: [{type: set, count: §20001}] => lights.0.count: must be at most 20000, got 20001
lights: [{type: set, trap: {shape: §cube}}] => lights.0.trap.shape: must be point, axis, plane or sphere, got 'cube'
lights: [{type: set, threshold: 1, palette: §viridas}]
=> lights.0.palette: unknown palette 'viridas'; did you mean 'viridis'?
lights: [{type: set, trap: {center: [9, 9, 9]}, threshold: §0.5}]
=> lights.0.threshold: no place of the set is that near to the trap: the nearest is 1.25 away, got 0.5
renderer: {type: cut_plane}
lights: [{type: §set, threshold: 1}] => lights.0.type: set is for surface renderers, got a cut_plane; remove this light
renderer: {type: cut_plane}
glow: §{} => glow: is for surface renderers, got a cut_plane; remove it
renderer: {type: cut_plane}
mist: §{} => mist: is for surface renderers, got a cut_plane; remove it
fog: {height: 1, up: §[0, 0, 0]} => fog.up: must not be zero
fog: {scattering: {anisotropy: §1}} => fog.scattering.anisotropy: must be at most 0.95, got 1
lights: [{rays: §0}] => lights.0.rays: must be at least 1, got 0
lights: [{}, {type: point, position: §[0, 0.1, 0]}]
=> lights.1.position: must be outside the object, where its light reaches something, got [0, 0.1, 0]
material: {reflection: §1.5} => material.reflection: must be at most 1, got 1.5
environment: §{intensity: 2} => environment: needs one of name, file or sky
environment: {name: a, file: §b.exr} => environment.file: cannot be combined with name: give one of name, file or sky
environment: {sky: {}, up: §[0, 1, 0]} => environment.up: must be [0, 0, 1] with sky: its ground is level
environment: {sky: {}, mirrored: §true} => environment.mirrored: cannot be combined with sky: turn that by sun_azimuth
environment: {name: studio, stretch: §true} => environment.stretch: needs a file
environment: {file: b.exr, sky: §{}} => environment.sky: cannot be combined with file: give one of name, file or sky
environment: {sky: {turbidity: §0.5}} => environment.sky.turbidity: must be at least 1, got 0.5
environment: {sky: {§sun_azimut: 3}} => environment.sky: unknown key 'sun_azimut'; did you mean 'sun_azimuth'?
environment: §sky => environment: must be a mapping, got 'sky'
environment: {name: §studoi} => environment.name: unknown environment 'studoi'; did you mean 'studio'?
environment: {name: §''} => environment.name: must not be empty, got ''
environment: {name: a, rotation: §400} => environment.rotation: must be at most 360, got 400
environment: {name: a, rays: §-1} => environment.rays: must be at least 0, got -1
glow: {by: §nearness} => glow.by: must be closeness or trap, got 'nearness'
glow: {§witdh: 1} => glow: unknown key 'witdh'; did you mean 'width'?
glow: {width: §0} => glow.width: must be above 0, got 0
mist: {by: §nearness} => mist.by: must be closeness or iterations, got 'nearness'
mist: {§densty: 1} => mist: unknown key 'densty'; did you mean 'density'?
mist: {by: iterations, start: 5, end: §4} => mist.end: must be above start, 5, got 4
mist: {colors: §[]} => mist.colors: must not be empty
mist: {colors: [{at: 1, color: [1, 1, 1]}, {at: §0.5, color: [1, 1, 1]}]}
=> mist.colors.1.at: must be at least 1, the value at the stop before, got 0.5
fog: {density: §-1} => fog.density: must be at least 0, got -1
fog: {§colour: [1, 1, 1]} => fog: unknown key 'colour'; did you mean 'color'?
# The lens.
camera: {f_number: §0} => camera.f_number: must be at least 0.01, got 0
camera: {focus_distance: §-2} => camera.focus_distance: must be in front of the camera: above 0, got -2
camera: {focus_distance: §0} => camera.focus_distance: must be in front of the camera: above 0, got 0
camera: {sensor_height: §0} => camera.sensor_height: must be above 0, got 0
camera: {projection: orthographic, §f_number: 2}
=> camera: unknown key 'f_number'; known: frame, height, orbit, position, projection, roll, shift, target, up
output: {channels: [R, §Zed]} => output.channels.1: unknown channel 'Zed'; did you mean 'Z'?
output: {channels: [R, §R]} => output.channels.1: channel 'R' is given twice
output: {channels: §[]} => output.channels: must not be empty
output: {precision: {§P: float}} => output.precision: 'P' is a layer; name its channels, P.X, P.Y, P.Z
output: {precision: {§Zed: half}} => output.precision: unknown channel 'Zed'; did you mean 'Z'?
output: {precision: {R: §quarter}} => output.precision.R: must be half or float, got 'quarter'
output: {png_bits: §12} => output.png_bits: must be 8 or 16, got 12
§backgruond: {} => unknown key 'backgruond'; did you mean 'background'?
# The first one in the text, whatever the order of the schema.
lights: §3
image: {width: 0} => lights: must be a list, got 3
camera: {up: §1, fov: 400, fow: 1} => camera.up: must be a list of 3 numbers, got 1
""",
        COLOR=COLOR,
    ),
    ("lights: §[" + "{}, " * 4097 + "]", "lights: must have at most 4096 entries, got 4097"),
    (
        "lights: §[" + "{}, " * 65 + "]",
        "lights: must have at most 64 entries with lighting.mode direct, where every place asks all of them, got 65;"
        " use lighting: {mode: path}",
    ),
    (
        "lighting: {mode: path}\nlights: §[" + "{}, " * 65 + "]",
        "lights: must have at most 64 entries without a position, all of which are asked everywhere, got 65",
    ),
    (
        "lighting: {mode: path}\nlights: §[" + "{type: set, trap: {}}, " * 65 + "]",
        "lights: must have at most 64 entries of type set, each of which has many balls, got 65",
    ),
]


@pytest.mark.parametrize(("lines", "message"), CASES)
def test_scene(lines: str, message: str) -> None:
    whole = HEAD + lines + ("" if "cam" in lines else "\ncamera: {}")
    text, place = marked(whole)
    assert error_of(text) == f"{place}: {message}"


def test_a_missing_key_is_reported_after_what_is_wrong_in_the_text() -> None:
    assert error_of(HEAD) == "scene:1:1: camera: is missing"
    assert error_of("formula: {name: hast}\ncamera: {fow: 1}\n").startswith("scene:2:10: camera: unknown key")


@pytest.mark.parametrize(
    ("formula", "message"),
    cases(
        """
§{} => formula: needs one of name, file, inline or chain
§mandelbulb => formula: must be a mapping, got 'mandelbulb'
{name: §mandelbul} => formula.name: unknown formula 'mandelbul'; did you mean 'mandelbulb'?
{name: hast, inline: §{}} => formula.inline: cannot be combined with name
{name: hast, iterations: §0} => formula.iterations: must be at least 1, got 0
{name: hast, iterations: §2000000} => formula.iterations: must be at most 1000000, got 2000000
{name: hast, parameters: {§powr: 2}} => formula.parameters.powr: unknown parameter 'powr'
{name: hast, parameters: {power: §3}} => formula.parameters.power: must be one of
{name: hast, parameters: {power: §many}} => formula.parameters.power: must be a number, got 'many'
{name: hast, julia: §[1, 2]} => formula.julia: must have at least 3 entries, got 2
{name: hast, julia: §[1, 2, 3, 4]} => formula.julia: must have 3 numbers
{name: hast, bailout: §0} => formula.bailout: must be above 0, got 0
{chain: §[]} => formula.chain: must not be empty
{chain: [{name: hast}, {§nme: hast}]} => formula.chain.1: unknown key 'nme'; did you mean 'name'?
{chain: [{name: hast}, {name: §hats}]} => formula.chain.1.name: unknown formula 'hats'
{chain: [{name: hast, count: §0}]} => formula.chain.0.count: must be at least 1, got 0
{chain: [{name: hast}], parameters: §{a: 1}} => formula.parameters: belongs to the members
{file: §''} => formula.file: must not be empty
"""
    ),
)
def test_formula(formula: str, message: str) -> None:
    text, place = marked(f"version: 1\nformula: {formula}\ncamera: {{}}\n")
    assert error_of(text).startswith(f"{place}: {message}")


INLINE = """version: 1
formula:
  inline:
    variables: [x, y, z]
    let: {r: "sqrt(x*x + y*y)"}
    map:
      - x*x - y*y
      - "2*x*y"
      - z*r
    degree: 2
    bounds: {radius: 2}
camera: {}
"""


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("x*x - y*y", "x*x - §q*y", "formula.inline.map.0: unknown name 'q'"),
        ('"2*x*y"', '"2*x*§yy"', "formula.inline.map.1: unknown name 'yy'; did you mean 'y'?"),
        ("z*r", "z*r/§0", "formula.inline.map.2: division by zero"),
        ("z*r", "z*§sine(r)", "formula.inline.map.2: unknown function 'sine'"),
        ("sqrt(x*x + y*y)", "sqrt(x*x + §r)", "formula.inline.let.r: 'r' uses itself"),
        ("- x*x - y*y\n      - z*r\n", "§- x*x\n", "formula.inline.map: must have 3 expressions"),
        ("degree: 2", "§degre: 2", "formula.inline: unknown key 'degre'; did you mean 'degree'?"),
        ("z*r", "§" + "(" * 10_000 + "z" + ")" * 10_000, "formula.inline.map.2: is too long"),
        ("z*r", "(" * 100 + "§" + "(" * 900 + "z" + ")" * 1000, "formula.inline.map.2: nested more than 100"),
        ("z*r", "__import__(§'os').system('ls')", "formula.inline.map.2: unexpected character"),
    ],
)
def test_inline_formula(old: str, new: str, message: str) -> None:
    whole = INLINE.replace('      - "2*x*y"\n', "") if "\n" in old else INLINE
    assert old in whole
    text, place = marked(whole.replace(old, new))
    assert error_of(text).startswith(f"{place}: {message}")


@pytest.mark.parametrize(
    ("override", "message"),
    cases(
        """
camera.fov=400 => --set camera.fov: must be below 180, got 400
camera.fow=40 => --set camera.fow: unknown key 'fow'; did you mean 'fov'?
camera={fov: 400} => --set camera: fov: must be below 180, got 400
camera.fov=.inf => --set camera.fov: must be a finite number, got .inf
camera.fov= => --set camera.fov: is empty
camera.fov=[1 => --set camera.fov: not valid YAML: did not find expected ',' or ']'
camera.fov => --set camera.fov: must be KEY=VALUE, such as camera.fov=30
camera..fov=3 => --set camera..fov=3: must be KEY=VALUE, such as camera.fov=30
version.x=1 => --set version.x: version is a single value, so it has no key 'x'
lights.1.color=2 => --set lights.1.color: lights.1 does not exist: the list has entries 0 to 0
lights.0.intensty=2 => --set lights.0.intensty: unknown key 'intensty'; did you mean 'intensity'?
formula.parameters.powr=2 => --set formula.parameters.powr: unknown parameter 'powr'
formula.name=hats => --set formula.name: unknown formula 'hats'; did you mean 'hast'?
camera.up=[0, 1, 0] => --set camera.up: must not be parallel to the view
"""
    ),
)
def test_override(override: str, message: str) -> None:
    assert error_of(HEAD + "camera: {}\n", override).startswith(message)


def test_overrides_replace_values() -> None:
    scene = load_scene(
        HEAD + "camera: {}\n",
        overrides=[
            "camera.fov=30",
            "camera.position.0=0.5",
            "lights.0.intensity=2",
            "formula.parameters.power=4",
            "background=transparent",
            "renderer.bounds.radius=3",
        ],
    )
    assert scene.camera.projection == "perspective"
    assert scene.camera.fov == 30
    assert scene.camera.position == (0.5, -3, 0)
    assert scene.lights[0].intensity == 2
    assert scene.formula.parameters == {"power": 4}
    assert scene.background == "transparent"
    assert scene.surface.bounds is not None
    assert scene.surface.bounds.radius == 3
    again = load_scene(scene.resolved(), overrides=["camera.fov=45"])
    assert again.camera == scene.camera.model_copy(update={"fov": 45})


def test_an_override_does_not_reach_through_an_alias() -> None:
    text = HEAD + "camera: {}\nbackground: {top: &c [1, 1, 1], bottom: *c}\n"
    scene = load_scene(text, overrides=["background.top.0=0.5"])
    assert scene.background != "transparent"
    assert scene.background.top == (0.5, 1, 1)
    assert scene.background.bottom == (1, 1, 1)


def test_the_file_is_named_as_it_was_given(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    Path("scene.yaml").write_text("\n" * 11 + "version: 1\nformula: {name: hast}\ncamera: {fov: 400}\n")
    with pytest.raises(SceneError) as caught:
        load_scene("scene.yaml")
    assert str(caught.value) == "scene.yaml:14:15: camera.fov: must be below 180, got 400"


def test_every_error_is_one_of_ours() -> None:
    with pytest.raises(ClfractalError):
        load_scene({"version": 1, "formula": {"name": "hast"}, "camera": {"fov": float("nan")}})
