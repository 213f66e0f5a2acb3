"""States of controllers: where laws read them, and their rates.

    z' = f(t, z, what is measured),  f being laws in which all signals of controllers stand written out

They are the first of the states z. What is measured is known once rows are, so that rates need no accelerations.
"""

from __future__ import annotations

from ..compiler.formulas import formula
from ..laws.evaluation import evaluate
from ..tables.system import RATE, VALUE


@formula
def column_of(S, W, c):
    """Column of W.sensed in which state c of a controller stands."""
    return W.sensed.shape[1] - S.switches.row.shape[0] - S.control_laws.shape[0] + c


@formula
def control(S, W, t, z, dz):
    """Show the states z to the laws; their rates into ``dz``, and where laws' derivatives look for them."""
    for c in range(S.control_laws.shape[0]):
        W.sensed[VALUE, column_of(S, W, c)] = z[c]
    for c in range(S.control_laws.shape[0]):
        law = S.control_laws[c]
        o = 0.0 * t
        rate = evaluate(S.code, S.const, law, W.stack, (t, o, o), W.sensed) if law >= 0 else o
        W.sensed[RATE, column_of(S, W, c)] = rate
        dz[c] = rate
