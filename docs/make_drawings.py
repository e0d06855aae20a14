"""Makes the drawings of docs/stereo.md, seen from above, and of docs/architecture.md: docs/pictures/*.png.

    python docs/make_drawings.py                    every drawing
    python docs/make_drawings.py stereo_parallax    one of them

Drawn four times as large and then reduced, so that edges are smooth; with the font that Pillow brings along. Eyes are
drawn much farther apart than they are.
"""

from __future__ import annotations

import math
import sys
from collections.abc import Callable, Sequence
from pathlib import Path

from PIL import Image, ImageDraw, ImageFont

PICTURES = Path(__file__).resolve().parent / "pictures"
FINE = 4  # times as large while it is drawn
LARGEST_FILE = 300_000  # bytes

Point = tuple[float, float]
Color = tuple[int, int, int]

PAPER: Color = (250, 249, 246)
INK: Color = (40, 42, 46)
PALE: Color = (150, 152, 156)
LEFT: Color = (30, 98, 170)
RIGHT: Color = (200, 82, 30)
SCREEN: Color = (40, 42, 46)
THING: Color = (60, 140, 90)


class Drawing:
    """A sheet of paper, in pixels of the finished picture."""

    def __init__(self, width: int, height: int) -> None:
        self.image = Image.new("RGB", (width * FINE, height * FINE), PAPER)
        self.pen = ImageDraw.Draw(self.image)

    def area(self, points: Sequence[Point], color: Color, opacity: float) -> None:
        """A polygon that what is below shines through."""
        mask = Image.new("L", self.image.size)
        ImageDraw.Draw(mask).polygon([_fine(point) for point in points], fill=round(255 * opacity))
        self.image.paste(color, mask=mask)

    def line(
        self, start: Point, end: Point, color: Color = INK, width: float = 1.5, dashed: bool = False
    ) -> None:
        """A straight line."""
        length = math.dist(start, end)
        parts = max(round(length / 6), 1) if dashed else 1
        for part in range(0, parts, 2):
            self.pen.line(
                [
                    _fine(_between(start, end, part / parts)),
                    _fine(_between(start, end, min((part + 1) / parts, 1))),
                ],
                fill=color,
                width=round(width * FINE),
            )

    def arrow(
        self, start: Point, end: Point, color: Color = INK, width: float = 1.5, both: bool = False
    ) -> None:
        """A line with a head at its end, or heads at both."""
        self.line(start, end, color, width)
        for tip, other in ((end, start), (start, end))[: 2 if both else 1]:
            angle = math.atan2(other[1] - tip[1], other[0] - tip[0])
            barbs = [
                (tip[0] + 9 * math.cos(angle + turn), tip[1] + 9 * math.sin(angle + turn))
                for turn in (-0.38, 0.38)
            ]
            self.pen.polygon([_fine(point) for point in (tip, *barbs)], fill=color)

    def dot(self, middle: Point, radius: float, color: Color, hollow: bool = False) -> None:
        """A disk, or its rim."""
        (x, y), size = _fine(middle), radius * FINE
        box = (x - size, y - size, x + size, y + size)
        self.pen.ellipse(box, fill=PAPER if hollow else color, outline=color, width=2 * FINE)

    def eye(self, middle: Point, color: Color, hollow: bool = False) -> None:
        """An eyeball that looks up the sheet."""
        self.dot(middle, 9, color, hollow=hollow)
        if not hollow:
            self.dot((middle[0], middle[1] - 4), 3.5, PAPER)

    def box(self, corner: Point, size: Point, color: Color, opacity: float = 0.15) -> None:
        """A rectangle with a tint in it."""
        (x, y), (width, height) = corner, size
        self.area([(x, y), (x + width, y), (x + width, y + height), (x, y + height)], color, opacity)
        self.pen.rectangle((*_fine(corner), *_fine((x + width, y + height))), outline=color, width=2 * FINE)

    def text(
        self, place: Point, words: str, color: Color = INK, anchor: str = "mm", size: float = 15
    ) -> None:
        """Words; `anchor` as Pillow's: horizontal l, m, r, then vertical a, m, d; several lines are spaced by hand."""
        font = ImageFont.load_default(size * FINE)
        lines = words.split("\n")
        for number, line in enumerate(lines):
            down = (number - (len(lines) - 1) / 2) * size * 1.3
            self.pen.text(_fine((place[0], place[1] + down)), line, fill=color, font=font, anchor=anchor)

    def save(self, name: str) -> None:
        """Writes the drawing.

        Raises:
            ValueError: the file is larger than LARGEST_FILE.
        """
        width, height = self.image.size
        small = self.image.resize((width // FINE, height // FINE), Image.Resampling.LANCZOS)
        target = PICTURES / f"{name}.png"
        small.quantize(256, dither=Image.Dither.NONE).save(target, optimize=True)
        size = target.stat().st_size
        print(f"{target.name}: {size // 1000} kB")
        if size > LARGEST_FILE:
            raise ValueError(f"{target.name} is larger than {LARGEST_FILE // 1000} kB")


def _fine(point: Point) -> Point:
    return point[0] * FINE, point[1] * FINE


def _between(start: Point, end: Point, part: float) -> Point:
    return start[0] + (end[0] - start[0]) * part, start[1] + (end[1] - start[1]) * part


def _at_height(start: Point, through: Point, y: float) -> Point:
    """Where the line from `start` through another point comes to a height on the sheet."""
    return _between(start, through, (y - start[1]) / (through[1] - start[1]))


def view() -> Drawing:
    """Screen, eyes, view plane and frusta, with the names of what is measured."""
    sheet = Drawing(860, 600)
    left_end, right_end, plane = (230.0, 240.0), (630.0, 240.0), 240.0
    far, near, eyes = 60.0, 350.0, 490.0
    middle = 430.0
    for x, color in ((middle - 50, LEFT), (middle + 50, RIGHT)):
        eye = (x, eyes)
        ends = [_at_height(eye, end, y) for y in (near, far) for end in (left_end, right_end)]
        sheet.area([ends[0], ends[1], ends[3], ends[2]], color, 0.13)
        for end in (left_end, right_end):
            sheet.line(eye, _at_height(eye, end, far), color, 1.5)
        for y in (near, far):
            sheet.line(_at_height(eye, left_end, y), _at_height(eye, right_end, y), color, 1.5, dashed=True)
    sheet.line(left_end, right_end, SCREEN, 5)
    sheet.text((middle, plane - 22), "view plane = screen: screen_width", size=16)
    sheet.dot((430, 140), 30, THING)
    sheet.text((430, 140), "scene", PAPER)
    for x, color, name, anchor, beside in (
        (middle - 50, LEFT, "left eye", "rm", -16),
        (middle + 50, RIGHT, "right eye", "lm", 16),
    ):
        sheet.eye((x, eyes), color)
        sheet.text((x + beside, eyes + 2), name, color, anchor)
    sheet.line((middle, plane + 4), (middle, eyes), PALE, 1.2, dashed=True)
    sheet.eye((middle, eyes), INK, hollow=True)
    sheet.arrow((middle - 50, eyes + 32), (middle + 50, eyes + 32), both=True)
    sheet.text((middle, eyes + 52), "interpupillary_distance")
    sheet.text(
        (middle, eyes + 80),
        "the cyclopean eye is half way between them, before the plane's middle",
        PALE,
        size=14,
    )
    sheet.arrow((760, eyes), (760, plane), both=True)
    sheet.line((645, plane), (775, plane), PALE, 1)
    sheet.line((570, eyes), (775, eyes), PALE, 1)
    sheet.text((752, (plane + eyes) / 2 + 40), "screen_\ndistance", anchor="rm")
    sheet.arrow((100, plane), (100, far), both=True)
    sheet.arrow((100, plane), (100, near), both=True)
    sheet.line((85, plane), (220, plane), PALE, 1)
    sheet.line((85, far), (120, far), PALE, 1)
    sheet.line((85, near), (285, near), PALE, 1)
    sheet.text((90, (plane + far) / 2), "back", anchor="rm")
    sheet.text((90, (plane + near) / 2), "front", anchor="rm")
    sheet.text((middle, 34), "far", PALE)
    sheet.text((577, near), "near", PALE, "lm")
    return sheet


def parallax() -> Drawing:
    """Where both eyes see a point before, on and behind the screen."""
    sheet = Drawing(900, 430)
    screen, eyes = 170.0, 345.0
    for number, (title, y, told) in enumerate(
        (
            ("before the screen", 252.0, "negative"),
            ("on the screen", screen, "0"),
            ("behind the screen", 72.0, "positive"),
        )
    ):
        middle = 150.0 + 300 * number
        point = (middle, y)
        sheet.line((middle - 110, screen), (middle + 110, screen), SCREEN, 4)
        for x, color, name in ((middle - 40, LEFT, "L"), (middle + 40, RIGHT, "R")):
            seen = _at_height((x, eyes), point, screen)
            sheet.line((x, eyes), min(seen, point, key=lambda end: end[1]), color, 1.5)
            if y == screen:
                continue
            sheet.dot(seen, 5, color)
            side = 1 if seen[0] > middle else -1
            sheet.text((seen[0] + 16 * side, screen - 14), name, color, size=16)
        sheet.dot(point, 7, THING)
        for x, color in ((middle - 40, LEFT), (middle + 40, RIGHT)):
            sheet.eye((x, eyes), color)
        sheet.text((middle, 24), title, size=17)
        sheet.text((middle, 392), f"parallax {told}", size=15)
    return sheet


def convergence() -> Drawing:
    """What both eyes look at by the three kinds of convergence."""
    sheet = Drawing(900, 400)
    screen, eyes, half, apart = 120.0, 320.0, 80.0, 44.0
    for number, (name, told) in enumerate(
        (
            ("off_axis", "one rectangle, no tilt"),
            ("toe_in", "tilted: corners apart"),
            ("parallel", "two rectangles"),
        )
    ):
        middle = 150.0 + 300 * number
        for sign, color in ((-1, LEFT), (1, RIGHT)):
            eye = (middle + sign * apart, eyes)
            if name == "off_axis":
                ends = [(middle - half, screen), (middle + half, screen)]
            elif name == "parallel":
                ends = [(eye[0] - half, screen + 4 * sign), (eye[0] + half, screen + 4 * sign)]
            else:
                angle = math.atan2(middle - eye[0], eyes - screen)
                ends = [
                    (middle + end * half * math.cos(angle), screen + end * half * math.sin(angle))
                    for end in (-1, 1)
                ]
            sheet.area([eye, *ends], color, 0.13)
            for end in ends:
                sheet.line(eye, end, color, 1.5)
            sheet.line(ends[0], ends[1], color if name != "off_axis" else SCREEN, 4)
        for sign, color in ((-1, LEFT), (1, RIGHT)):
            sheet.eye((middle + sign * apart, eyes), color)
        sheet.text((middle, 30), name, size=17)
        sheet.text((middle, 366), told)
    return sheet


def projectors() -> Drawing:
    """Two projectors on one screen, from one picture with its halves swapped."""
    sheet = Drawing(900, 640)
    screen, lens, middle = 60.0, 330.0, 330.0
    left_end, right_end = (130.0, screen), (530.0, screen)
    sheet.line(left_end, right_end, SCREEN, 6)
    sheet.text((middle, 30), "silver screen: screen_width", size=16)
    for x, color, number, eye in ((middle - 95, RIGHT, 1, "right eye"), (middle + 95, LEFT, 2, "left eye")):
        sheet.area([(x, lens), left_end, right_end], color, 0.10)
        for end in (left_end, right_end):
            sheet.line((x, lens), end, color, 1.2)
        sheet.line((x - 24, lens - 14), (x + 24, lens - 14), color, 5)
        sheet.box((x - 45, lens), (90, 54), color)
        sheet.text((x, lens + 27), f"projector {number}", color, size=14)
        half = (middle - 160 if number == 1 else middle, 500.0)
        sheet.box(half, (160, 90), color)
        sheet.text((half[0] + 80, 545), eye, color, size=17)
        sheet.arrow((half[0] + 80, 496), (x, lens + 58), color, 2)
    sheet.text((middle, 612), "the picture: mode split, swap true", size=16)
    sheet.text((middle, 448), "two outputs", PALE, size=14)
    sheet.text((middle, lens - 14), "filters", INK, size=14)
    viewer = 640.0
    for x, color in ((viewer - 26, LEFT), (viewer + 26, RIGHT)):
        sheet.eye((x, 330), color)
        sheet.line((x - 15, 312), (x + 15, 312), color, 5)
    sheet.line((viewer - 11, 312), (viewer + 11, 312), INK, 2)
    sheet.text((viewer, 372), "glasses: before each eye\nthe filter of its projector", size=14)
    sheet.arrow((780, 330), (780, screen), both=True)
    sheet.line((540, screen), (795, screen), PALE, 1)
    sheet.line((690, 330), (795, 330), PALE, 1)
    sheet.text((790, 190), "screen_\ndistance", anchor="lm")
    return sheet


# The rows of `stages`: each stage's kernel, with a question mark if only some scenes launch it, and what a march is after.
_PLAIN: tuple[tuple[str, tuple[str, ...]], ...] = (
    ("once for a block of pixels", ("send_cones?", "march_rays? cones")),
    ("each sample", ("begin_samples",)),
    (
        "each bounce: meet the surface",
        (
            "meet_objects?",
            "find_faces?",
            "march_rays surface",
            "march_inside?",
            "look_at_objects?",
            "find_interactions",
        ),
    ),
    (
        "or, by the points of a pixel",
        (
            "march_points? near",
            "send_points?",
            "meet_objects?",
            "march_points? surface",
            "look_at_objects?",
            "join_points?",
        ),
    ),
    (
        "what is seen there",
        ("send_to_lights?", "send_air?", "color_interactions?", "find_planes?", "add_glow?", "find_mist?"),
    ),
    (
        "direct light, mirrors",
        (
            "meet_objects?",
            "march_rays? lights",
            "gather_air?",
            "meet_lights?",
            "gather_light?",
            "light_interactions?",
        ),
    ),
    (
        "or light along paths",
        (
            "cross_media?",
            "find_materials?",
            "scatter_paths?",
            "walk_clouds? pass_clouds",
            "meet_objects?",
            "march_rays? lights",
            "gather_air?",
            "gather_paths?",
        ),
    ),
    (
        "after the last bounce of a path",
        ("meet_objects?", "march_rays? whether", "cross_media?", "end_paths?"),
    ),
)
# Kernels that stand in the place of one that is drawn, or beside it: for single lanes, the other search, glass, water.
_BESIDE = {
    "march_rays": ("look_at_surfaces", "step_rays", "look_where_steps_end"),
    "march_points": ("look_at_points",),
    "scatter_paths": ("scatter_costly", "bend_light", "bend_shapes"),
    "gather_paths": ("find_sought", "gather_sought"),
    "gather_air": ("gather_sought_air",),
    "end_paths": ("end_bent_light", "end_bent_shapes", "find_last", "end_sought"),
    "walk_clouds": ("pass_clouds",),
    "march_inside": ("look_inside_set", "walk_inside", "look_where_walks_end"),
}
_ASK_FORMULA = (
    "march_rays",
    "march_points",
    "march_inside",
    "color_interactions",
    "add_glow",
    "find_mist",
    "find_faces",
    "find_planes",
)


def drawn_kernels() -> set[str]:
    """Every kernel that `stages` shows."""
    drawn = {cell.split()[0].removesuffix("?") for _, row in _PLAIN for cell in row}
    return drawn | {name for each in drawn for name in _BESIDE.get(each, ())}


def stages() -> Drawing:
    """The stages of a surface, row by row, and what they hand to each other."""
    wide, tall, left, top, width, height = 1320, 892, 24.0, 66.0, 138.0, 40.0
    sheet = Drawing(wide, tall)
    sheet.text(
        (left, 28),
        "A launch of the surface renderer: rows from the top, stages from the left",
        anchor="lm",
        size=18,
    )
    for number, (title, cells) in enumerate(_PLAIN):
        y = top + number * 76
        sheet.text((left, y), title, PALE, anchor="lm", size=14)
        for place, cell in enumerate(cells):
            words = cell.split()
            name, goal = words[0].removesuffix("?"), " ".join(words[1:])
            x, color = left + place * (width + 22), THING if name in _ASK_FORMULA else LEFT
            always = not words[0].endswith("?")
            sheet.box((x, y + 13), (width, height), color, 0.30 if always else 0.08)
            sheet.text((x + width / 2, y + 13 + height / 2), f"{name}\n{goal}" if goal else name, size=14)
            if place:
                sheet.arrow((x - 22, y + 13 + height / 2), (x - 2, y + 13 + height / 2), PALE)
    # A path, or a mirror's ray, goes back to where surfaces are met.
    back, again = 1302.0, top + 2 * 76
    for row in (5, 6):
        end = left + len(_PLAIN[row][1]) * (width + 22) - 22
        sheet.line((end, top + row * 76 + 33), (back, top + row * 76 + 33), RIGHT)
    sheet.line((back, top + 6 * 76 + 33), (back, again), RIGHT)
    sheet.arrow((back, again), (left + 210, again), RIGHT)
    sheet.text((back - 8, again - 14), "next bounce", RIGHT, anchor="rm", size=14)
    low = top + len(_PLAIN) * 76 + 14
    legend = ((0, THING, 0.3, "knows the formula"), (190, LEFT, 0.3, "knows none: one text for all scenes"))
    for x, color, opacity, told in (*legend, (486, INK, 0.04, "pale: launched only by scenes that need it")):
        sheet.box((left + x, low - 9), (26, 18), color, opacity)
        sheet.text((left + x + 36, low), told, anchor="lm", size=14)
    told = (
        "where pixels have points march_points marches all rays, and the search by steps is step_rays;"
        " walk_inside is march_inside of glass that scatters, scatter_costly is scatter_paths with films and tangents"
    )
    sheet.text((left, low + 26), told, PALE, anchor="lm", size=14)
    _queues(sheet, (left, low + 72), width, height)
    return sheet


def _queues(sheet: Drawing, corner: Point, width: float, height: float) -> None:
    """What stages hand to each other: queues of rays and of what these met, and the state of each sample."""
    x, y = corner
    sheet.text((x, y - 18), "what they hand on", PALE, anchor="lm", size=14)
    row = (
        ("a stage sends", LEFT),
        ("queue: rays\none a pixel, turn", RIGHT),
        ("meet_objects\nends them there", LEFT),
        ("a march", THING),
        ("queue: what\nthey have met", RIGHT),
        ("the next reads", LEFT),
    )
    for place, (told, color) in enumerate(row):
        at = x + place * (width + 22)
        sheet.box((at, y), (width, height), color, 0.15)
        sheet.text((at + width / 2, y + height / 2), told, size=14)
        if place:
            sheet.arrow((at - 22, y + height / 2), (at - 2, y + height / 2), PALE)
    last, under = x + 5 * (width + 22) + width / 2, y + height + 26
    sheet.box((x + width / 2, under), (last - x - width / 2, 30), RIGHT, 0.15)
    told = "state of each sample, from stage to stage: sighting, interaction, path, counters, and what else the scene needs"
    sheet.text(((x + width / 2 + last) / 2, under + 15), told, size=14)
    for middle in (x + width / 2 + 12, last - 12):
        sheet.arrow((middle, y + height), (middle, under), PALE, both=True)


DRAWINGS: dict[str, Callable[[], Drawing]] = {
    "stereo_view": view,
    "stereo_parallax": parallax,
    "stereo_convergence": convergence,
    "stereo_projectors": projectors,
    "stages": stages,
}


def main(names: Sequence[str]) -> None:
    """Makes the named drawings, or all."""
    unknown = set(names) - set(DRAWINGS)
    if unknown:
        raise SystemExit(f"there is no drawing {', '.join(sorted(unknown))}")
    PICTURES.mkdir(exist_ok=True)
    for name in names or DRAWINGS:
        DRAWINGS[name]().save(name)


if __name__ == "__main__":
    main(sys.argv[1:])
