"""Mistakes in Python, by cosmic-ray's operators."""

from __future__ import annotations

import ast

from cosmic_ray.ast import ast_nodes, get_ast
from cosmic_ray.mutating import mutate_code
from cosmic_ray.plugins import get_operator

from tests.mutants.mutant import Mutant

# Of cosmic-ray's operators those whose mistakes are small. An Add that becomes a LShift is noticed by any test, and a
# decorator that is left out (a dataclass, a property) mostly, too: they would only flatter the tests.
_BINARY = (
    "Add_Sub",
    "Sub_Add",
    "Mul_Div",
    "Div_Mul",
    "FloorDiv_Mul",
    "Mod_Mul",
    "Pow_Mul",
    "BitAnd_BitOr",
    "BitOr_BitAnd",
    "LShift_RShift",
    "RShift_LShift",
)
_COMPARISONS = (
    "Eq_NotEq",
    "NotEq_Eq",
    "Lt_LtE",
    "LtE_Lt",
    "Gt_GtE",
    "GtE_Gt",
    "Lt_GtE",
    "GtE_Lt",
    "Is_IsNot",
    "IsNot_Is",
)
_OTHERS = (
    "AddNot",
    "ExceptionReplacer",
    "NumberReplacer",
    "ReplaceAndWithOr",
    "ReplaceOrWithAnd",
    "ReplaceBreakWithContinue",
    "ReplaceContinueWithBreak",
    "ReplaceFalseWithTrue",
    "ReplaceTrueWithFalse",
    "ReplaceUnaryOperator_Delete_Invert",
    "ReplaceUnaryOperator_Delete_Not",
    "ReplaceUnaryOperator_Delete_USub",
    "ZeroIterationForLoop",
)
OPERATORS = tuple(
    f"core/{name}"
    for name in (
        *(f"ReplaceBinaryOperator_{pair}" for pair in _BINARY),
        *(f"ReplaceComparisonOperator_{pair}" for pair in _COMPARISONS),
        *_OTHERS,
    )
)


def python_places(text: str) -> list[tuple[str, int]]:
    """Every mistake that can be made in a Python file: the operator's name, and its number among that operator's."""
    nodes = list(ast_nodes(get_ast(text)))
    places = []
    for name in OPERATORS:
        operator = get_operator(name)()
        count = sum(len(list(operator.mutation_positions(node))) for node in nodes)
        places += [(name, number) for number in range(count)]
    return places


def python_mutant(path: str, text: str, place: tuple[str, int]) -> Mutant | None:
    """The mistake at a place, or None if it changes nothing that is ever evaluated: only annotations."""
    name, number = place
    after = mutate_code(text, get_operator(name)(), number)
    if after is None or _evaluated(after) == _evaluated(text):
        return None
    return Mutant(path, name.removeprefix("core/"), text, after)


class _WithoutAnnotations(ast.NodeTransformer):
    """Leaves out what `from __future__ import annotations` leaves as text. Fields of models have values, too."""

    def visit_arg(self, node: ast.arg) -> ast.arg:
        node.annotation = None
        return node

    def visit_FunctionDef(self, node: ast.FunctionDef) -> ast.FunctionDef:
        node.returns = None
        self.generic_visit(node)
        return node

    def visit_AnnAssign(self, node: ast.AnnAssign) -> ast.AnnAssign:
        node.annotation = ast.Constant(None)
        self.generic_visit(node)
        return node


def _evaluated(text: str) -> str | None:
    try:
        return ast.dump(_WithoutAnnotations().visit(ast.parse(text)))
    except SyntaxError:
        return None
