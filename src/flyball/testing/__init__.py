"""Contract tests for elements of a user's own: one call tests an instance in every way that flyball uses it."""

from __future__ import annotations

from .contract import CHECKS as CHECKS
from .contract import ContractError as ContractError
from .contract import check_element as check_element
