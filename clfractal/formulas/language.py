"""The formula language: every name that other parts of the program use, in one place."""

from clfractal.formulas.binding import bind
from clfractal.formulas.build import formula_from_mapping
from clfractal.formulas.chain import Chain, Link, single
from clfractal.formulas.definition import BoundFormula, Formula, Parameter, point_name
from clfractal.formulas.evaluate import MAX_EXPONENT, TINY, evaluate_constant, whole
from clfractal.formulas.nodes import (
    ARITHMETIC,
    COMPARISONS,
    FUNCTIONS,
    LOGIC,
    Call,
    Name,
    Node,
    Number,
    is_condition,
    names_in,
    substitute,
    to_text,
    walk,
)
from clfractal.formulas.parser import parse

__all__ = [
    "ARITHMETIC",
    "COMPARISONS",
    "FUNCTIONS",
    "LOGIC",
    "MAX_EXPONENT",
    "TINY",
    "BoundFormula",
    "Call",
    "Chain",
    "Formula",
    "Link",
    "Name",
    "Node",
    "Number",
    "Parameter",
    "bind",
    "evaluate_constant",
    "formula_from_mapping",
    "is_condition",
    "names_in",
    "parse",
    "point_name",
    "single",
    "substitute",
    "to_text",
    "walk",
    "whole",
]
