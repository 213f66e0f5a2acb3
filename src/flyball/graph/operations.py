"""What a node may be of: its operations by name, and what each does with numbers of any kind."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from ..math import scalar

NUMBER, SYMBOL, ADD, MULTIPLY, DIVIDE, POWER, CALL = "number", "symbol", "add", "multiply", "divide", "power", "call"

FUNCTIONS: dict[str, Callable[..., Any]] = {
    f.__name__: f
    for f in (
        scalar.sqrt, scalar.sin, scalar.cos, scalar.tan, scalar.asin, scalar.acos, scalar.atan, scalar.exp, scalar.log,
        scalar.sinh, scalar.cosh, scalar.tanh, scalar.atan2, scalar.absolute, scalar.sign, scalar.rounded,
        scalar.minimum, scalar.maximum, scalar.choose,
    )
}  # fmt: skip
"""Every function that a node may be of, by its name in `math/scalar.py`."""

ODD = ("sin", "tan", "asin", "atan", "sinh", "tanh", "sign")
EVEN = ("cos", "cosh", "absolute")

PARTIAL = (DIVIDE, POWER, CALL, "sqrt", "tan", "asin", "acos", "exp", "log", "sinh", "cosh")
"""Operations that have no finite value for some finite arguments."""

OPERATIONS: dict[str, Callable[..., Any]] = {
    ADD: lambda a, b: a + b,
    MULTIPLY: lambda a, b: a * b,
    DIVIDE: scalar.divide,
    POWER: scalar.power,
    **FUNCTIONS,
}
"""What an operation does with numbers of any kind."""
