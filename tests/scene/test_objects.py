"""What wrong objects get: the exact line, at the exact place; and how objects are placed."""

from __future__ import annotations

import numpy as np
import pytest

from clfractal.errors import ClfractalError
from clfractal.scene.load import dump_scene, load_scene
from clfractal.scene.objects import MAX_OBJECTS, BoxObject, CylinderObject, SphereObject
from tests.render.objects_oracle import rotation_of

HEAD = "version: 1\nformula: {name: mandelbulb}\ncamera: {}\n"
STEEL = "materials: {steel: {}, clay: {}}\n"
MANY = ", ".join(f"b{n}: {{}}" for n in range(MAX_OBJECTS + 1))

# In the texts below the sign § stands where the message must point to.
CASES = [
    ("objects: {ball: {radius: §0}}", "objects.ball.radius: must be above 0, got 0"),
    (
        "objects: {ball: {type: §bal}}",
        "objects.ball.type: unknown type 'bal'; known: box, cylinder, plane, sphere, water",
    ),
    (
        "objects: {ball: {§size: 3}}",
        "objects.ball: unknown key 'size'; known: material, position, radius, rotation, scale, type",
    ),
    ("objects: {b: {type: box, size: §3}}", "objects.b.size: must be a list of 3 numbers, got 3"),
    ("objects: {b: {type: box, size: [1, §0, 1]}}", "objects.b.size.1: must be above 0, got 0"),
    ("objects: {p: {type: plane, normal: §[0, 0, 0]}}", "objects.p.normal: must not be zero"),
    (
        "objects: {p: {type: plane, §radius: 1}}",
        "objects.p: unknown key 'radius'; known: material, normal, position, type",
    ),
    (
        "objects: {sea: {type: water, waves: {direction: §[0, 0, 2]}}}",
        "objects.sea.waves.direction: must not be along the normal",
    ),
    (
        "objects: {sea: {type: water, waves: {direction: §[0, 0, 0]}}}",
        "objects.sea.waves.direction: must not be zero",
    ),
    (
        "objects: {sea: {type: water, waves: {choppiness: §2}}}",
        "objects.sea.waves.choppiness: must be at most 1, got 2",
    ),
    (
        "objects: {ball: {material: §steel}}",
        "objects.ball.material: names 'steel', but the scene has no materials",
    ),
    (
        STEEL + "objects: {ball: {material: §stel}}",
        "objects.ball.material: unknown material 'stel'; did you mean 'steel'?",
    ),
    (f"objects: §{{{MANY}}}", f"objects: must have at most {MAX_OBJECTS} entries, got {MAX_OBJECTS + 1}"),
    ("objects: §[1]", "objects: must be a mapping, got a list of 1"),
    (
        "renderer: {type: volume, resolution: 16}\nobjects: §{ball: {}}",
        "objects: are shown by renderer surface, not by volume; remove them",
    ),
    (
        "renderer: {type: cut_plane}\nobjects: §{ball: {}}",
        "objects: are shown by renderer surface, not by cut_plane; remove them",
    ),
    (
        "lights: [{}, {type: point, position: §[0, 0, -2.1]}]\nobjects: {ball: {position: [0, 0, -2]}}",
        "lights.1.position: must be outside the object 'ball', where its light reaches something, got [0, 0, -2.1]",
    ),
    (
        "objects: {ball: {}}\nanimation: {frames: 9, tracks: {objects.bal.radius: §{expression: 1 + t}}}",
        "animation.tracks.objects.bal.radius: unknown object 'bal'; did you mean 'ball'?",
    ),
]


@pytest.mark.parametrize(("text", "expected"), CASES, ids=[expected[:60] for _, expected in CASES])
def test_messages(text: str, expected: str) -> None:
    whole = HEAD + text
    before, _, after = whole.partition("§")
    with pytest.raises(ClfractalError) as caught:
        load_scene(before + after)
    line, column = before.count("\n") + 1, len(before.rsplit("\n", 1)[-1]) + 1
    assert str(caught.value) == f"scene:{line}:{column}: {expected}"
    assert caught.value.status == 2


def test_a_scene_with_objects_is_written_and_read_again() -> None:
    text = (
        STEEL
        + "objects: {b: {type: box, material: clay}, sea: {type: water, position: [0, 0, -2]}, ball: {}}"
    )
    scene = load_scene(HEAD + text)
    again = load_scene(dump_scene(scene))
    assert again == scene
    assert list(again.objects) == ["b", "sea", "ball"]


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
