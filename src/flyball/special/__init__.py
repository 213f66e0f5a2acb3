"""Code made for one mechanism: what the engine does for it, written out, compiled and called by address.

``plan`` looks at a mechanism, ``code`` has its code, ``Made.system`` puts its addresses into the tables.
"""

from .keeping import code, in_memory, kept, known, price, ready, refusal
from .made import Made
from .plan import Plan, plan
from .trace import Refused

__all__ = ["Made", "Plan", "Refused", "code", "in_memory", "kept", "known", "plan", "price", "ready", "refusal"]
