"""What wrong objects get: the exact line, at the exact place; and how objects are placed."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from clfractal.elements.shapes.box import BoxObject
from clfractal.elements.shapes.cylinder import CylinderObject
from clfractal.elements.shapes.sphere import SphereObject
from clfractal.errors import ClfractalError
from clfractal.scene.checks import inside_solid
from clfractal.scene.load import dump_scene, load_scene
from clfractal.scene.movement import movement_of
from clfractal.scene.objects import KINDS, MAX_FORMULAS, MAX_OBJECTS, FormulaObject
from tests.render.objects_oracle import rotation_of
from tests.scene.errors import cases, error_of, marked
from tests.scenes import HEAD

STEEL = "materials: {steel: {}, clay: {}}\n"
MANY = ", ".join(f"b{n}: {{}}" for n in range(MAX_OBJECTS + 1))

OTHER = "type: formula, formula: {name: menger_sponge}"
CUTS = ", ".join(["{cut: true, set: false, objects: [b]}"] * 31)
FULL = ", ".join(f"f{n}: {{{OTHER}}}" for n in range(MAX_FORMULAS))

# In the texts below the sign § stands where the message must point to.
CASES = [
    *cases(
        """
objects: {ball: {radius: §0}} => objects.ball.radius: must be above 0, got 0
objects: {ball: {§size: 3}}
=> objects.ball: unknown key 'size'; known: join, material, position, radius, rotation, scale, smoothness, type
objects: {b: {type: box, size: §3}} => objects.b.size: must be a list of 3 numbers, got 3
objects: {b: {type: box, size: [1, §0, 1]}} => objects.b.size.1: must be above 0, got 0
objects: {p: {type: plane, normal: §[0, 0, 0]}} => objects.p.normal: must not be zero
objects: {p: {type: plane, §radius: 1}}
=> objects.p: unknown key 'radius'; known: join, material, normal, position, smoothness, type
objects: {sea: {type: water, waves: {direction: §[0, 0, 2]}}} => objects.sea.waves.direction: must not be along the normal
objects: {sea: {type: water, waves: {direction: §[0, 0, 0]}}} => objects.sea.waves.direction: must not be zero
objects: {sea: {type: water, waves: {choppiness: §2}}} => objects.sea.waves.choppiness: must be at most 1, got 2
objects: {ball: {material: §steel}} => objects.ball.material: names 'steel', but the scene has no materials
«STEEL»objects: {ball: {material: §stel}} => objects.ball.material: unknown material 'stel'; did you mean 'steel'?
objects: §[1] => objects: must be a mapping, got a list of 1
renderer: {type: cut_plane}
objects: {sea: {type: §water}}
=> objects.sea.type: cannot be water with renderer cut_plane: its waves have no end; {type: plane} can
lights: [{}, {type: point, position: §[0, 0, -2.1]}]
objects: {ball: {position: [0, 0, -2]}}
=> lights.1.position: must be outside the object 'ball', where its light reaches something, got [0, 0, -2.1]
objects: {ball: {}}
animation: {frames: 9, tracks: {objects.bal.radius: §{expression: 1 + t}}}
=> animation.tracks.objects.bal.radius: unknown object 'bal'; did you mean 'ball'?
objects: {b: §{type: formula}} => objects.b.formula: is missing
objects: {b: {type: formula, formula: {name: §mandelbul}}}
=> objects.b.formula.name: unknown formula 'mandelbul'; did you mean 'mandelbulb'?
objects: {b: {type: formula, formula: {name: mandelbulb, parameters: {§powr: 3}}}}
=> objects.b.formula.parameters.powr: unknown parameter 'powr'; did you mean 'power'?
objects: {b: {type: formula, formula: {file: §none.yaml}}}
=> objects.b.formula.file: none.yaml cannot be read: No such file or directory
objects: {b: {type: plane, join: §smooth_union}}
=> objects.b.join: cannot be smooth_union for a plane, which has no end; a flat box can
objects: {ball: {}}
cut_planes: [{cut: true, objects: [§bal]}] => cut_planes.0.objects.0: unknown object 'bal'; did you mean 'ball'?
cut_planes: [{cut: true, objects: [§ball]}] => cut_planes.0.objects.0: unknown object 'ball'; known: none
objects: {sea: {type: water}}
cut_planes: [{cut: true, objects: [§sea]}]
=> cut_planes.0.objects.0: 'sea' cannot be cut: a water surface has no end; a flat box can
objects: {b: {«OTHER»}}
cut_planes: [{cut: true, set: false, objects: [b], count: 2}, «CUTS», {cut: true, set: false, objects: [§b]}]
=> cut_planes.32.objects.0: at most 32 cuts of the set's parts, and this is one more
objects: {b: {type: plane, join: cut}}
cut_planes: [{cut: true, set: false, objects: [§b]}]
=> cut_planes.0.objects.0: 'b' cannot be cut: a plane surface has no end; a flat box can
renderer: {type: volume}
cut_planes: [{}, {cut: true, set: §false}]
=> cut_planes.1.set: is for surface renderers: in a volume all that there is belongs to the set; remove it
materials: {ice: {transmission: {weight: 1}}}
lighting: {mode: path}
cut_planes: [{cut: true}, {cut: true, material: §ice}]
=> cut_planes.1.material: 'ice' is glass, and a face is that only where what is cut is; name another material, or none
materials: {ice: {}}
lighting: {mode: path}
cut_planes: [{cut: true, material: §icy}] => cut_planes.0.material: unknown material 'icy'; did you mean 'ice'?
cut_planes: [{set: §1}] => cut_planes.0.set: must be true or false, got 1
renderer: {type: volume}
objects: {sea: {type: §water}}
=> objects.sea.type: cannot be water with renderer volume: its waves have no end; {type: plane} can
objects: {b: {join: §cutt}}
=> objects.b.join: must be union, smooth_union, cut or intersection, got 'cutt'; did you mean 'cut'?
objects: {b: {join: smooth_union, smoothness: §0}} => objects.b.smoothness: must be above 0, got 0
objects: {«FULL», last: {type: §formula, formula: {name: mandelbulb}}}
=> objects.last.type: at most «MAX_FORMULAS» objects can be formulas, and this is one more
materials: {ice: {transmission: {weight: 1}}, clay: {}}
lighting: {mode: path}
material: {name: ice}
objects: {b: {join: cut, material: §clay}}
=> objects.b.material: 'clay' is not the glass of the set, 'ice', to which it is joined
objects: {b: {«OTHER»}}
animation: {frames: 9, tracks: {objects.b.formula.parameters.powr: §{expression: 1 + t}}}
=> animation.tracks.objects.b.formula.parameters.powr: unknown parameter 'powr'; known: scale
""",
        FULL=FULL,
        MAX_FORMULAS=MAX_FORMULAS,
        OTHER=OTHER,
        CUTS=CUTS,
        STEEL=STEEL,
    ),
    (
        "objects: {ball: {type: §bal}}",
        "objects.ball.type: unknown type 'bal'; known: " + ", ".join(sorted(kind.tag for kind in KINDS)),
    ),
    (f"objects: §{{{MANY}}}", f"objects: must have at most {MAX_OBJECTS} entries, got {MAX_OBJECTS + 1}"),
]


@pytest.mark.parametrize(("text", "expected"), CASES, ids=[expected[:60] for _, expected in CASES])
def test_messages(text: str, expected: str) -> None:
    plain, place = marked(HEAD + text)
    assert error_of(plain) == f"{place}: {expected}"


def test_a_lamp_in_a_room_with_the_eye_is_allowed() -> None:
    lamp = "lights: [{type: point, position: [0, 0, 1.9]}]\n"
    scene = load_scene(HEAD + lamp + "objects: {room: {type: box, size: [20, 20, 4]}}")
    assert len(scene.objects) == 1


def test_solids_hold_what_is_inside() -> None:
    random = np.random.default_rng(5)
    points = random.uniform(-2, 2, (500, 3))
    place = {"rotation": [20, -35, 50], "scale": [0.5, 1.5, 1.2], "position": [0.3, -0.2, 0.1]}
    own = (points - np.array(place["position"])) @ rotation_of((20, -35, 50)) / np.array(place["scale"])
    across = np.hypot(own[:, 0], own[:, 1])
    cases = [
        (SphereObject.checked({"radius": 0.9, **place}), np.linalg.norm(own, axis=1) < 0.9),
        (
            BoxObject.checked({"type": "box", "size": [1, 2, 1.5], **place}),
            (np.abs(own) < [0.5, 1, 0.75]).all(1),
        ),
        (
            CylinderObject.checked({"type": "cylinder", "radius": 0.8, "height": 2, **place}),
            (across < 0.8) & (np.abs(own[:, 2]) < 1),
        ),
    ]
    for solid, expected in cases:
        found = [solid.holds((x, y, z)) for x, y, z in points]
        assert 20 < expected.sum() < 300
        np.testing.assert_array_equal(found, expected)


@pytest.mark.parametrize("radius", [1e-30, 3.7e-217, 5e-324])
def test_solids_of_any_size_hold_what_is_inside(radius: float) -> None:
    solid = SphereObject.checked({"radius": radius})
    assert not solid.holds((1.0, 0.0, 0.0))
    assert solid.holds((0.0, 0.0, 0.0))


def test_formulas_of_objects_are_written_and_read_again(tmp_path: Path) -> None:
    """Files that they name are read into the scene; their places and scales make the bounds."""
    (tmp_path / "own.yaml").write_text(
        "{variables: [x, y, z], map: [x, y, z], add: none, degree: 1, shape: 'sqrt(x*x + y*y + z*z) - 1',"
        " bounds: {center: [1, 0, 0], radius: 2}, bailout: 9}"
    )
    (tmp_path / "scene.yaml").write_text(
        HEAD + "objects:\n  own: {type: formula, formula: {file: own.yaml}, position: [10, 0, 0],"
        " rotation: [0, 0, 90], scale: 3}\n"
        "  hole: {join: cut, radius: 9}\n"
    )
    scene = load_scene(tmp_path / "scene.yaml")
    again = load_scene(dump_scene(scene))
    assert again == scene
    assert list(again.joined) == ["own", "hole"]
    center, radius = again.bounds
    # The ball of the object: its centre (1, 0, 0), turned to y, three times as far.
    assert radius >= 6
    assert np.linalg.norm(np.array(center) - [10, 3, 0]) <= radius - 6 + 1e-9
    assert np.linalg.norm(center) <= radius - again.chain.radius + 1e-9
    assert not again.model_copy(update={"renderer": {"type": "volume"}, "objects": {}}).joined


def test_a_parameter_of_an_object_moves() -> None:
    text = (
        "objects: {b: {type: formula, formula: {name: mandelbulb, live: [power]}}}\n"
        "animation: {frames: 9, tracks: {objects.b.formula.parameters.power:"
        " {keys: [{frame: 0, value: 6}, {frame: 8, value: 8}]},"
        " objects.b.scale: {keys: [{frame: 0, value: 1}, {frame: 8, value: 4}]}}}"
    )
    movement = movement_of(load_scene(HEAD + text))
    middle = movement.scene(4)
    assert middle.joined_chains["b"].first.values["power"] == pytest.approx(7)
    moved = middle.objects["b"]
    assert isinstance(moved, FormulaObject)
    assert moved.scale == pytest.approx(2)


def test_what_is_inside_of_what_is_joined() -> None:
    """Lights may stand in a cut, and must not stand in another formula."""
    ball = (
        "{variables: [x, y, z], map: [x, y, z], add: none, degree: 1, shape: 'sqrt(x*x + y*y + z*z) - 1',"
        " bounds: {radius: 2}}"
    )
    text = (
        "objects:\n"
        f"  twin: {{type: formula, formula: {{inline: {ball}}}, position: [5, 0, 0], rotation: [0, 0, 90], scale: 2}}\n"
        "  hole: {join: cut, position: [4, 0, 0], radius: 0.5}\n"
        "  below: {type: plane, join: intersection, position: [0, 0, 1], normal: [0, 0, 2]}\n"
        "  drop: {join: smooth_union, position: [5, 0, 1.5]}\n"
        f"  hollow: {{type: formula, formula: {{inline: {ball}}}, position: [6, 0, 0], scale: 0.5, join: cut}}\n"
    )
    scene = load_scene(HEAD + text)
    places = [
        (5, 1.9, 0),
        (5, 2.1, 0),
        (4, 0, 0.4),
        (4, 0, 0.6),
        (5, 0.8, 1.2),
        (5, 0.3, 1.4),
        (0, 0, 0),
        (0, 0, -1.3),
        (5.6, 0, 0.1),
        (5.4, 0, 0.1),
    ]
    found = inside_solid(scene, places)
    assert found == [True, False, False, True, False, True, True, False, False, True]
    lamp = "lights: [{type: point, position: [4, 0, 0.4]}]\n"
    assert load_scene(HEAD + lamp + text).lights
    assert load_scene(HEAD + lamp.replace("[4, 0, 0.4]", "[5.6, 0, 0.1]") + text).lights
    with pytest.raises(ClfractalError, match="outside the object"):
        load_scene(HEAD + lamp.replace("0.4]", "0.6]") + text)
