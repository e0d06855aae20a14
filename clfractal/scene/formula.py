"""The scene's `formula`: which formula is drawn, and the values of its parameters."""

from typing import Annotated, Any

from pydantic import Field

from clfractal.schema.base import Coordinate, Number, Section, check_one_of, problem, rule
from clfractal.schema.fields import PLACE, WHOLE, Usual
from clfractal.schema.hex_color import AlsoAs

_NONE = "none"
MAX_LINKS = 64
MAX_LIVE = 32
MOST_ITERATIONS = 1_000_000

Source = Annotated[str, Field(strict=True, min_length=1, max_length=1000)]
Bailout = Annotated[float, Field(strict=True, gt=0, le=1e9, allow_inf_nan=False)]
Julia = Annotated[tuple[Coordinate, ...], Field(strict=False, min_length=3, max_length=4)]
Live = Annotated[tuple[Source, ...], Field(strict=False, max_length=MAX_LIVE)]


class _Source(Section):
    name: Source | None = Field(None, description="a formula of the library, or of your own")
    file: Source | None = Field(None, description="a formula file, in the scene's folder or below")
    inline: dict[str, Any] | None = Field(None, description="a formula, written here")
    parameters: dict[str, Number] = Field({}, description="values of the formula's parameters")
    live: Live = Field(
        (), description="has no effect: the values of all parameters may change without compiling again"
    )
    julia: Annotated[Julia, PLACE] | None = Field(
        None, description="the constant to add instead of the point: one number for each variable"
    )


class ChainLink(_Source):
    """One member of a chain: a formula and how many times it is applied before the next one's turn."""

    count: Annotated[int, Usual(1, 10)] = Field(
        1, ge=1, le=1000, description="number of applications before the next formula's turn"
    )
    start: int = Field(
        0, ge=0, le=1_000_000, description="first application, counted from 0, in which it takes part"
    )
    stop: int | None = Field(
        None,
        ge=1,
        le=1_000_000,
        description="first application in which it no longer takes part; null: it goes on to the end",
    )

    @rule
    def _one_source(self) -> None:
        check_one_of(self, "name", "file", "inline")
        if self.stop is not None and self.stop <= self.start:
            raise problem(f"must be above start, {self.start}, got {self.stop}", "stop")


class FormulaSpec(_Source):
    """Which formula is drawn, and how far it is iterated; exactly one of name, file, inline, chain."""

    chain: (
        Annotated[tuple[ChainLink, ...], Field(strict=False, min_length=1, max_length=MAX_LINKS)] | None
    ) = Field(None, description="formulas applied in turn")
    iterations: Annotated[int, Usual(1, 1000), WHOLE] = Field(
        30, ge=1, le=MOST_ITERATIONS, description="maximum number of applications of the formula"
    )
    bailout: Annotated[Bailout, Usual(1, 1000)] | None = Field(
        None, description="escape radius for counts and inside tests; null: the formula's own"
    )
    distance_bailout: Annotated[Bailout, Usual(1, 1000000.0)] | None = Field(
        None, description="escape radius for distances; null: the formula's own, or 1000"
    )

    @rule
    def _one_source(self) -> None:
        check_one_of(self, "name", "file", "inline", "chain")
        for key in ("parameters", "live"):
            if self.chain is not None and getattr(self, key):
                raise problem("belongs to the members of a chain, not to the chain", key)

    def mapping(self) -> dict[str, Any]:
        """Plain data with the given keys only; it loads back to an equal FormulaSpec."""
        plain: dict[str, Any] = self.model_dump(mode="json", exclude_none=True)
        return _without_empty(plain)


def _word(value: Any) -> Any:
    """The word `none` stands for the formula of that name, which says by itself that it has no set."""
    return {"name": _NONE} if value == _NONE else value


Formula = Annotated[FormulaSpec, AlsoAs(_word, {"const": _NONE})]


def _without_empty(spec: dict[str, Any]) -> dict[str, Any]:
    if "chain" in spec:
        spec["chain"] = [_without_empty(link) for link in spec["chain"]]
    return {key: value for key, value in spec.items() if key not in ("parameters", "live") or value}
