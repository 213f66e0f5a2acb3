"""Tyre models: one file each. A new model is a file here and a line in `MODELS`.

A model is a class from `TyreModel` with the next ``kind`` and three formulas, `load`, `relaxation` and `slip_forces`;
`tyre_model` says what they are. `forces.tyre` has the geometry of the contact and the transient slips.
"""

from ...compiler.formulas import dispatch_by_kind
from .fiala import FialaTyre as FialaTyre
from .linear import LinearTyre as LinearTyre
from .magic_formula import MagicFormula as MagicFormula
from .tyre_model import TyreModel as TyreModel

MODELS: tuple[type[TyreModel], ...] = (LinearTyre, FialaTyre, MagicFormula)
_NAN = "nan + 0.0 * data[at]"

load = dispatch_by_kind(
    __name__,
    "load",
    "data, at, deflection, rate, spin, camber",
    {m.kind: m.load for m in MODELS},
    f"({_NAN}, {_NAN})",
)
"""Load and effective rolling radius of a model."""

relaxation = dispatch_by_kind(
    __name__,
    "relaxation",
    "data, at, friction, load, camber",
    {m.kind: m.relaxation for m in MODELS},
    f"({', '.join([_NAN] * 4)})",
)
"""Relaxation lengths of a model, and slips beyond which the forces do not grow."""

slip_forces = dispatch_by_kind(
    __name__,
    "slip_forces",
    "data, at, friction, slip, tangent, camber, load, motion",
    {m.kind: m.slip_forces for m in MODELS},
    f"({', '.join([_NAN] * 5)})",
)
"""Forces and moments of a model in the W axes."""
