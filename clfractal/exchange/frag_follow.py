"""A fragment's distance, followed from the code: an expression of a point, and of what its orbit leaves."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

from clfractal.errors import FileError, Where
from clfractal.exchange.glsl_orbit import Orbit, OrbitRun
from clfractal.exchange.glsl_run import FixError
from clfractal.exchange.glsl_symbols import GlslSymbols
from clfractal.exchange.glsl_tree import SIZES, Code, Function, Uniform
from clfractal.exchange.glsl_values import Variable
from clfractal.exchange.glsl_walk import orbit_loop
from clfractal.exchange.symbols import TooLargeError, Value

POINT = ("point x", "point y", "point z")
"""The names of the symbols of a point's coordinates."""
_TRIES = 300
_GIVEN = {
    "orbitTrap": ("vec4", [10000.0] * 4),
    "fractionalCount": ("float", 0.0),
    "minDist": ("float", 0.005),
}
_GIVEN |= {
    "time": ("float", 0.0),
    "subframe": ("int", 0.0),
    "iTime": ("float", 0.0),
    "colorBase": ("vec3", [0.0] * 3),
}
"""What files that render give to fragments."""


@dataclass(frozen=True, slots=True)
class Followed:
    """What was found.

    Attributes:
        distance: from the symbols of the point and of what the orbit leaves; None: it says what is inside only.
        parameters: of each symbol of a parameter its uniform, and which of its numbers it is.
        fixed: parameters that the formula has as numbers, as they say how often something is done.
    """

    symbols: GlslSymbols
    distance: Value
    orbit: Orbit | None
    parameters: dict[str, tuple[Uniform, int]]
    fixed: frozenset[str]


def follow(code: Code, file: str, values: Mapping[str, tuple[float, ...]]) -> Followed:
    """Follows `DE` of a fragment, behind what stands outside of functions and `init`.

    Args:
        values: those of its uniforms, and of what files that render have.

    Raises:
        FileError: it has no such function, or does something that our language has not, with its place.
    """
    function = _entry(code, file)
    fixed: set[str] = set()
    loop = orbit_loop(function, code, values)
    names = {name for name, uniform in code.uniforms.items() if uniform.values is not None}
    for _ in range(_TRIES):
        symbols = GlslSymbols()
        parameters = _parameters(code, names - fixed)
        run = OrbitRun(
            file,
            symbols,
            0,
            code,
            here=function.where,
            parameters=frozenset(parameters),
            loop=loop,
        )
        try:
            distance = _follow(run, code, function, values, fixed)
        except FixError as error:
            fixed |= {parameters[name][0].name for name in error.names}
            continue
        except RecursionError:
            raise FileError("is nested too deep", run.here) from None
        except TooLargeError as error:
            raise FileError(f"has no counterpart: {error}", run.here) from None
        return Followed(symbols, distance, run.orbit, parameters, frozenset(fixed))
    raise FileError("has too many parameters that say how often something is done", function.where)


def _entry(code: Code, file: str) -> Function:
    found = [
        each
        for each in code.functions.get("DE", ())
        if [argument.type for argument in each.arguments] == ["vec3"] and each.type in ("float", "double")
    ]
    if found:
        return found[0]
    if "inside" in code.functions:
        raise FileError(
            "tells what is inside, not a distance: a function float DE(vec3) is missing", Where(file)
        )
    if "color" in code.functions:
        raise FileError("computes colours, not a distance: a function float DE(vec3) is missing", Where(file))
    raise FileError("a function float DE(vec3) is missing", Where(file))


def _parameters(code: Code, names: set[str]) -> dict[str, tuple[Uniform, int]]:
    """The symbols of uniforms' numbers."""
    found = {}
    for name in sorted(names):
        uniform = code.uniforms[name]
        size = SIZES[uniform.type]
        for place in range(size):
            found[f"{name} of {place}"] = (uniform, place)
    return found


def _follow(
    run: OrbitRun,
    code: Code,
    function: Function,
    values: Mapping[str, tuple[float, ...]],
    fixed: set[str],
) -> Value:
    for name, (kind, given) in _GIVEN.items():
        run.outer[name] = Variable(kind, 0, given)
    for name, numbers in values.items():
        if name not in code.uniforms and 1 <= len(numbers) <= 4:
            kind = "float" if len(numbers) == 1 else f"vec{len(numbers)}"
            run.outer[name] = Variable(kind, 0, numbers[0] if len(numbers) == 1 else [*numbers])
    for name, uniform in code.uniforms.items():
        size = SIZES.get(uniform.type)
        if size is None:
            continue  # a texture
        if uniform.values is None or name in fixed:
            numbers = values.get(name) or uniform.values or (0.0,) * size
            parts: list[Value] = [*numbers[:size]]
            parts += [0.0] * (size - len(parts))
        else:
            parts = [run.symbols.name(f"{name} of {place}") for place in range(size)]
        run.outer[name] = Variable(uniform.type, 0, parts[0] if size == 1 else parts)
    broken: dict[str, FileError] = {}
    # No loop there is the orbit's.
    run.within += 1
    for statement in code.statements:
        try:
            run.follow([statement])
        except FileError as error:
            broken[statement.name] = error
    _guarded(run, broken, lambda: _call_init(run, code))
    run.within -= 1
    point: list[Value] = [run.symbols.name(name) for name in POINT]
    found: list[object] = []

    def go() -> None:
        run.scopes = [{}]
        run.declare(function.arguments[0].name, "vec3", 0, point)
        run.block(function.body)
        run.here = function.where
        found.append(run.flow.value)

    _guarded(run, broken, go)
    if found[0] is None:
        raise FileError("DE returns nothing", function.where)
    return run.plain(run.scalar_of(found[0]))


def _call_init(run: OrbitRun, code: Code) -> None:
    for each in code.functions.get("init", ()):
        if not each.arguments:
            run.scopes = [{}]
            run.block(each.body)
            run.scopes = []
            run.flow = type(run.flow)()


def _guarded(run: OrbitRun, broken: Mapping[str, FileError], work: Callable[[], None]) -> None:
    """Does something; where it asks for a variable whose value could not be found, that is told."""
    try:
        work()
    except FileError as error:
        for name, reason in broken.items():
            if f"unknown name '{name}'" in error.message or f'unknown name "{name}"' in error.message:
                raise reason from None
        raise
