"""What wrong materials, media, layouts and shutters get: the exact line, and where the sign § stands the exact place."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.scene.errors import cases, error_of, marked

HEAD = "version: 1\nformula: {name: mandelbulb}\ncamera: {}\n"
STOPS = "opacity: [{at: 0, opacity: 0}, {at: 1, opacity: 0.5}]"
SHINES = "emission: [1, 1, 1]"
CASES = cases(
    """
# Blends and maps.
materials: {m: {blend: [a, m]}, a: {}} => materials.m.blend: is made of itself: m -> m
materials: {m: {blend: [a, b]}, a: {}, b: {blend: [m, a]}} => materials.m.blend: is made of itself: m -> b -> m
materials: {m: {blend: [rok, m]}, rock: {}} => blend.0: unknown material 'rok'; did you mean 'rock'?
materials: {m: {blend: [m]}} => materials.m.blend: must have at least 2 entries, got 1
materials: {m: {blend: [a, a], base: {weight: 0.5}}, a: {}} => m.base: cannot be combined with blend
materials: {m: {blend: [a, a], bump: §{height: 1}}, a: {}}
=> materials.m.bump: cannot be combined with blend: a blend takes its layers from others
materials: {m: {mask: 0.3}} => materials.m.mask: applies to a blend of two materials
materials: {m: {base: {weight: {}}}} => materials.m.base.weight: needs one of by or texture
materials: {m: {base: {weight: {by: normal, curve: [[0, 0], [1, 2]]}}}}
=> materials.m.base.weight.curve.1.1: must be at most 1, got 2
materials: {m: {specular: {ior: {by: normal}}}} => materials.m.specular.ior.curve.0.1: must be at least 1, got 0
materials: {m: {base: {color: {by: normal, palette: [[0, 0, 0], [0, 3, 0]]}}}}
=> materials.m.base.color.palette.1.color: must be at most 1, got 3
materials: {m: {base: {color: {by: normal, palette: virids}}}}
=> materials.m.base.color.palette: unknown palette 'virids'; did you mean 'viridis'?
materials: {m: {base: {weight: {by: normal, range: [1, 1]}}}}
=> materials.m.base.weight.range: must be two different numbers, got 1 twice
materials: {m: {base: {weight: {by: normal, curve: [[0.5, 0], [0.2, 1]]}}}}
=> curve.1.0: must be at least 0.5, the place of the point before, got 0.2
materials: {m: {base: {weight: {by: hight}}}} => did you mean 'height'?
materials: {m: {base: {weight: thick}}} => materials.m.base.weight: must be a number, got 'thick'
materials: {m: {base: {color: {texture: none.png}}}}
=> materials.m.base.color.texture: none.png cannot be read: No such file
materials: {m: {base: {color: {texture: text.png}}}}
=> materials.m.base.color.texture: text.png is not an EXR, HDR, PNG, JPEG, WebP
materials: {m: {base: {color: {texture: ../x.png}}}}
=> materials.m.base.color.texture: must be a path inside the scene's folder, got '../x.png'
# Reliefs.
materials: {m: {bump: {height: §2e6}}} => materials.m.bump.height: must be at most 1000000, got 2000000.0
materials: {m: {bump: {height: §tall}}} => materials.m.bump.height: must be a number, got 'tall'
materials: {m: {bump: {§hight: 1}}} => materials.m.bump: unknown key 'hight'; did you mean 'height'?
materials: {m: {bump: {width: §0}}} => materials.m.bump.width: must be above 0, got 0
materials: {m: {bump: {height: §{}}}} => materials.m.bump.height: needs one of by or texture
materials: {m: {bump: {height: {by: trap, curve: [[0, 0], [1, §-2e6]]}}}}
=> materials.m.bump.height.curve.1.1: must be at least -1e+06, got -2e+06
materials: {m: {bump: {height: {texture: §none.png}}}}
=> materials.m.bump.height.texture: none.png cannot be read: No such file or directory
materials: {m: {bump: {height: {by: trap}}}}
objects: {b: {material: m}}
=> objects.b.material: 'm' differs from place to place, which needs lighting.mode: path
# Light along paths.
material: {name: gold} => material.name: names 'gold', but the scene has no materials
material: {name: gold}
materials: {gould: {}}
=> material.name: unknown material 'gold'; did you mean 'gould'?
renderer: {points: {}}
lighting: {mode: path}
=> renderer.points: cannot be combined with lighting.mode path
renderer: {normal: least_squares}
lighting: {mode: path}
=> renderer.normal: cannot be combined with lighting.mode path
renderer: {type: volume}
lighting: {mode: path}
=> lighting.mode: must be direct for a volume's surface, got path
materials: {m: {specular: {ior: 0.9}}} => materials.m.specular.ior: must be at least 1, got 0.9
lighting: {mode: path, bounces: 257} => lighting.bounces: must be at most 256, got 257
lighting: {mode: direct, bounces: 3} => lighting
# Glass and media.
materials: {m: {transmission: {scatter: [0.5, 0.5, 0.5]}}}
=> materials.m.transmission.scatter: needs a depth above 0: scattering is told for the way through it
materials: {m: {transmission: {scater: [1, 1, 1]}}}
=> materials.m.transmission: unknown key 'scater'; did you mean 'scatter'?
materials: {m: {transmission: {wait: 1}}}
=> materials.m.transmission: unknown key 'wait'; did you mean 'weight'?
materials: {m: {transmission: {depth: 1, scatter: [2, 1, 1]}}}
=> materials.m.transmission.scatter.0: must be at most 1, got 2
materials: {m: {transmission: {depth: 1, scatter_anisotropy: 1}}}
=> materials.m.transmission.scatter_anisotropy: must be at most 0.99, got 1
materials: {m: {transmission: {weight: 1.5}}} => materials.m.transmission.weight: must be at most 1, got 1.5
materials: {m: {transmission: {depth: -1}}} => materials.m.transmission.depth: must be at least 0, got -1
materials: {m: {transmission: {dispersion_abbe_number: 0}}}
=> materials.m.transmission.dispersion_abbe_number: must be at least 1, got 0
materials: {m: {subsurface: {weigth: 1}}} => materials.m.subsurface: unknown key 'weigth'; did you mean 'weight'?
materials: {m: {subsurface: {weight: 2}}} => materials.m.subsurface.weight: must be at most 1, got 2
materials: {m: {subsurface: {radius: -1}}} => materials.m.subsurface.radius: must be at least 0, got -1
materials: {m: {subsurface: {radius_scale: [1, 2, 1]}}}
=> materials.m.subsurface.radius_scale.1: must be at most 1, got 2
lighting: {mode: path}
materials: {glass: {transmission: {weight: 1}}}
objects:
  bulb: {type: formula, formula: {name: hast}, material: glass}
  ball: {type: sphere, join: §smooth_union}
=> objects.ball.join: cannot be smooth_union where some formulas are of glass and others not: name one material for all
lighting: {mode: path}
materials: {glass: {transmission: {weight: 1}}, clay: {}}
objects:
  bulb: {type: formula, formula: {name: hast}, material: glass}
  ball: {type: sphere, join: cut, material: §clay}
=> objects.ball.material: is that of what is cut where some formulas are of glass and others not; remove it
lighting: {mode: path}
materials: {glass: {transmission: {weight: 1}}}
objects: {ball: {type: sphere, join: cut, material: glass}}
=> objects.ball.material: 'glass' is glass, which what is joined by cut can be only with all of the set
renderer: {type: volume, transfer: {«STOPS»}}
lighting: {mode: path}
fog: {density: 0.1}
=> fog: cannot be combined with lighting.mode path in a volume
renderer: {type: volume, transfer: {«STOPS»}}
lighting: {mode: path}
cut_planes: [{}]
=> cut_planes: cannot be combined with lighting.mode path in a volume
renderer: {type: volume, transfer: {emission: [{at: 0, «SHINES»}]}}
=> renderer.transfer.emission: needs opacity, since a surface at a level has no depth that shines
renderer: {type: volume, transfer: {«STOPS»}, anisotropy: 1.0}
=> renderer.anisotropy: must be at most 0.95, got 1
renderer: {type: volume, transfer: {«STOPS», emission: [{at: 1, «SHINES»}, {at: 0, «SHINES»}]}}
=> renderer.transfer.emission.1.at: must be at least 1, the value at the stop before, got 0
renderer: {type: volume, transfer: {«STOPS», emission: [{at: 1, emission: [1, -1, 1]}]}}
=> must be at least 0, got -1
# Layouts.
image: {width: 41, height: 8}
layout: {views: [{}, {}, {}], gap: 20}
=> layout.views.0: does not fit into a picture of 41 x 8 pixels
image: {width: 64, height: 8}
layout: {views: [{area: [0, 0, 1e-3, 1]}, {}]}
=> layout.views.0: does not fit into a picture of 64 x 8 pixels
layout: {views: [{area: [0.5, 0, 0.6, 1]}]}
=> layout.views.0.area: must lie within the picture, [0, 0, 1, 1], and not be empty
layout: {views: [{area: [0.5, 0, 0.0, 1]}]}
=> layout.views.0.area: must lie within the picture, [0, 0, 1, 1], and not be empty
layout: {views: [{area: [0.5, 0, -0.5, 1]}]} => layout.views.0.area.2: must be at least 0, got -0.5
layout: {views: [{area: [0.5, 0, 0.5]}]} => layout.views.0.area: must be a list of 4 numbers, got a list of 3
layout: {views: []} => layout.views: must not be empty
layout: {views: [«VIEWS»]} => layout.views: must have at most 16 entries, got 17
layout: {views: [{formula: {}}]} => layout.views.0: unknown key 'formula'
layout: {views: [{}], columns: 0} => layout.columns: must be at least 1, got 0
layout: {views: [{}], gap: -1} => layout.gap: must be at least 0, got -1
layout: {views: [{}, {renderer: {type: volume, zoom: [{center: [9, 0, 0], scale: 2}]}}]}
=> layout.views.1.renderer.zoom.0.center: the box must lie within the one before
layout: {views: [{}, {renderer: {type: cut_plane, colors: {palette: viridiss}}}]}
=> layout.views.1.renderer.colors.palette: unknown palette 'viridiss'; did you mean 'viridis'?
layout: {views: [{renderer: {type: volume, file: missing.nrrd}}]} => layout.views.0.renderer.file:
layout: {views: [{environment: {name: studoi}}]}
=> layout.views.0.environment.name: unknown environment 'studoi'; did you mean 'studio'?
# Shutters and files.
animation: {frames: 10, shutter: 1.5} => animation.shutter: must be at most 1, got 1.5
animation: {frames: 10, shutter: half} => must be a part of a frame, as 0.5, or '180 deg', got 'half'
animation: {frames: 10, shutter: 400 deg} => animation.shutter: must be at most 1, got 1.11
animation: {frames: 10, frame: 10} => must be one of the frames 0 to 9, got 10
output: {precision: {CryptoObject00.R: half}} => must be float: numbers of things are exact
""",
    STOPS=STOPS,
    SHINES=SHINES,
    VIEWS=", ".join(["{}"] * 17),
)


@pytest.mark.parametrize(("lines", "message"), CASES)
def test_wrong_pictures(lines: str, message: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    Path("text.png").write_text("no picture")
    text, place = marked(HEAD + lines)
    found = error_of(text)
    assert message in found
    assert found.startswith(f"{place}: " if "§" in lines else "scene:")
