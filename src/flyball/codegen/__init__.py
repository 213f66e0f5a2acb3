"""Code generated for one mechanism: the engine's computations as straight-line code, compiled and called by address.

``plan`` inspects a mechanism, ``code`` returns its code, ``GeneratedCode.system`` puts its addresses into
the tables of one run. `procedures` runs the engine's loops on expressions: entries of the tables are symbols, so the
same code serves other values; entries that are exactly 0, 1 or -1 are numbers and part of the key. `machine_code`
translates procedures to LLVM text and machine code, in some 50 us for each operation. Loads are placed next to the
store that needs them; vectorising neighbours and higher optimisation gained nothing. Above some 15,000 operations code
exceeds the processor's first-level cache, and the speed-up falls from 5 to 7 times to 3. Modes of switches are not
supported.

Imports the engine, `tables`, `laws` and the expression graph; nothing that simulates. A new procedure is a task in
`engine.calls` and its trace in `procedures`.
"""

from .machine_code import GeneratedCode, Plan, Refused, can_store, code, in_memory, known, plan, price, ready, refusal

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
