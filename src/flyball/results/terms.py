"""Terms of rows and of measured quantities over time: the formulas that the compiled loops use, on arrays."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from ..equations.rows import COEFFICIENT, parameters
from ..math.vec import neg, scale
from ..model.joint import Joint
from .records import Record, Records, coordinate_frames, turned

if TYPE_CHECKING:
    from .result import Result

Wrench = tuple[tuple, tuple]


def term(result: Result, k: int) -> tuple[Record, Record, tuple]:
    """Records of frames F and M of term k, and what its formula says of them.

    That is value, force on M at M's origin (the reverse acts at F's on F's body), torque on M's body, torque on F's
    body, acceleration bias; without its coefficient. The records have no accelerations but those with every vdot zero.
    """
    x = result.values
    t = x.structure.terms[k]
    F, M = result.motions.frame(t.F), result.motions.frame(t.M)
    hint: Any = result.states[:, t.hint] if t.hint >= 0 else 0.0
    kind, par = t.formula.of_kind, parameters(x.system.term_parameters, k)
    if kind.single:
        return F, M, _one_by_one(kind.row, par, (F, M, hint + result.motions.zeros()), x.system.const)
    return F, M, kind.row(par, F, M, hint, x.system.const)


def _one_by_one(row: Any, par: tuple, over: tuple[Record, Record, np.ndarray], const: np.ndarray) -> tuple:
    """What a formula gives at one time after another, as arrays over time."""
    F, M, hint = over
    n = len(hint)
    sides = [[tuple(np.broadcast_to(np.stack(np.broadcast_arrays(*x), -1), (n, len(x)))) for x in r] for r in (F, M)]
    one = [row(par, *(tuple(tuple(x[i]) for x in r) for r in sides), hint[i], const) for i in range(n)]
    parts = zip(*one, strict=True) if one else ((), (), (), (), ())
    value, force, on_M, on_F, bias = (np.array(x, hint.dtype) for x in parts)
    return value, *(tuple(x.reshape(n, 3).T) for x in (force, on_M, on_F)), bias


def coefficient(result: Result, k: int) -> float:
    """What term k counts in its row or measured quantity."""
    return result.values.system.term_parameters[k, COEFFICIENT]


def along(result: Result, joint: Joint, what: str) -> Wrench:
    """Force and torque on ``body_j``, about M's origin, of a unit effort along a joint's coordinate."""
    (i, turn_i), (j, turn_j), c = coordinate_frames(result.values, joint, what)
    F, M = turned(result.motions.frame(i), turn_i), turned(result.motions.frame(j), turn_j)
    par = (*c.row.par[:6], 0.0, 0.0)
    _, f, tM, tF, _ = c.row.of_kind.row(par, F, M, 0.0, result.values.system.const)
    force, torque = (f, tM) if c.frames[1] == "M" else (neg(f), tF)
    return scale(c.sign, force), scale(c.sign, torque)


def nothing(records: Records) -> Wrench:
    """No wrench at all, at every time."""
    zero = records.zeros()
    return (zero,) * 3, (zero,) * 3
