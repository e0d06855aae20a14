"""A frame's scene that stands alone: what its picture needs of tables is written into it."""

from collections.abc import Iterable, Mapping, Sequence
from itertools import pairwise
from math import floor

from clfractal.formulas.parser import MAX_TEXT
from clfractal.scene.animation import Animation, Track
from clfractal.scene.curves import Values
from clfractal.scene.model import Scene
from clfractal.scene.movement import Movement, movement_of
from clfractal.scene.movers import Mover

# The rows beside a frame that its shutter can need: it opens at most one frame before it, and closes at most one after it.
_BESIDE = range(-1, 3)
# Rows whose text is never too long, for values of 24 characters.
_MOST_ROWS = MAX_TEXT // 140


def standing_alone(scene: Scene) -> Animation | None:
    """The animation of a scene with a frame, with expressions in the place of tables, which need no file.

    They have the same values, to the last bit, while the frame's shutter is open. Elsewhere in the film they stay
    what they are at the nearest frame that is known. A scene without a frame keeps its tables: it is the whole film.
    So does a target whose camera flies through more keys than an expression has room for.

    Raises:
        SceneError, FormulaError, FileError: a track is wrong.
    """
    animation = scene.animation
    if animation is None or animation.frame is None:
        return animation
    if not any(track.file is not None for track in animation.tracks.values()):
        return animation
    movement = movement_of(scene)
    beside = [floor(animation.frame) + step for step in _BESIDE]
    found = dict(animation.tracks)
    for mover in movement.movers:
        if animation.tracks[mover.name].file is not None:
            rows = sorted(_rows(animation, [*beside, *_of_flight(movement, mover)]))
            if len(rows) <= _MOST_ROWS:
                found[mover.name] = Track(expression=_expressions(mover, rows))
    return animation.model_copy(update={"tracks": found})


def _rows(animation: Animation, frames: Iterable[int]) -> set[int]:
    """The rows of a table that frames show; those before the beginning and after the end are others in a loop."""
    count = animation.count
    if animation.loop:
        return {frame % count for frame in frames}
    return {min(max(frame, 0), count - 1) for frame in frames}


def _of_flight(movement: Movement, mover: Mover) -> list[int]:
    """The frames at which a camera that flies round its target, which the mover moves, has keys, and those after them."""
    path, animation = mover.target.path, movement.animation
    camera = path[:-1] if path[-1] == "target" else path[:-2] if path[-2:-1] == ("target",) else None
    names = {target.path: name for name, target in movement.targets.items()}
    place = names.get((*camera, "position")) if camera is not None else None
    keys = animation.tracks[place].keys or () if place is not None else ()
    return [floor(animation.frame_of(key)) + step for key in keys for step in (0, 1)]


def _expressions(mover: Mover, rows: Sequence[int]) -> str | tuple[str, ...]:
    """What a table says in some rows, and on the way from each of them to the next one, as a track has it."""
    # A table may be longer than its film: of a loop, the row after the last frame's is met on the way to the beginning.
    known = {row: mover.at(float(row)) for each in rows for row in (each, each + 1)}
    texts = tuple(_expression(rows, known, index) for index in range(len(known[rows[0]])))
    return texts if len(texts) > 1 else texts[0]


def _expression(rows: Sequence[int], known: Mapping[int, Values], index: int) -> str:
    first = rows[0]
    begins, ways = [first], [_way(first, known, index)]
    for before, row in pairwise(rows):
        if row > before + 1:  # what is between is not needed, and must have some value
            begins.append(before + 1)
            ways.append(repr(known[before + 1][index]))
        begins.append(row)
        ways.append(_way(row, known, index))
    begins.append(rows[-1] + 1)
    ways.append(repr(known[rows[-1] + 1][index]))
    return _chosen([first, *begins[1:]], [repr(known[first][index]), *ways])


def _way(row: int, known: Mapping[int, Values], index: int) -> str:
    """The value from a row to the next one, computed as that of a table is."""
    value, rise = known[row][index], known[row + 1][index] - known[row][index]
    return f"{value!r} + (frame - {row})*({rise!r})" if rise else repr(value)


def _chosen(begins: Sequence[int], ways: Sequence[str]) -> str:
    """One of the ways, by where the frame is among the beginnings of all but the first of them."""
    if not begins:
        return ways[0]
    middle = len(begins) // 2
    left, right = (
        _chosen(begins[:middle], ways[: middle + 1]),
        _chosen(begins[middle + 1 :], ways[middle + 1 :]),
    )
    return f"where(frame < {begins[middle]}, {left}, {right})"
