"""Code generated for one mechanism: the engine's computations as straight-line code, compiled and called by address.

``plan`` inspects a mechanism, ``code`` returns its code, ``GeneratedCode.system`` puts its addresses into the tables.
`procedures` runs the engine's loops on expressions, `machine_code` translates them to machine code, `store` caches it.
Imports the engine, `tables` and the expression graph; nothing that simulates.
"""

from .machine_code import GeneratedCode, Refused
from .store import Plan, can_store, code, in_memory, known, plan, price, ready, refusal

__all__ = [
    "GeneratedCode",
    "Plan",
    "Refused",
    "can_store",
    "code",
    "in_memory",
    "known",
    "plan",
    "price",
    "ready",
    "refusal",
]
