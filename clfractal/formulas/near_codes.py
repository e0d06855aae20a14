"""What an application is made of where it is followed operation by operation (`kernels/formulas/near.h`)."""

_SMOOTH = ("sqrt", "exp", "log", "sin", "cos", "tan", "asin", "acos", "atan", "atan2", "pow")
CODES = (
    *("const", "add", "sub", "mul", "div", "neg"),
    *_SMOOTH,
    *("floor", "sign", "lt", "le", "eq", "and", "not", "where"),
)
"""What an operation may be, by its number: NEAR_CONST and so on in kernels."""
MOST_SLOTS = 40
"""Numbers that a kernel keeps while it follows one (`NEAR_SLOTS`)."""
