"""Contract tests for elements of a user's own: one call tests an instance in every way that flyball uses it.

`contract.check_element` runs the checks of `CHECKS`, `formula_checks` runs formulas on every kind of number. A new
requirement on elements is a function in `CHECKS`. Imports `mechanism`, `expression_graph` and what these import.
"""

from __future__ import annotations

from .contract import CHECKS as CHECKS
from .contract import ContractError as ContractError
from .contract import check_element as check_element
