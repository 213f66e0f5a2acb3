"""Every kind of constraint term, found in the files of this folder.

A file defines ``KIND``, its number (or ``ROWS``, several numbers and their formulas), and ``row``. It may also define

- ``OFTEN = True``: the kind is so frequent that compiled code has a loop for it alone; such kinds are the first;
- ``TURNS = True``: its value is an angle, of which full turns are counted (if parameter 0 says so);
- ``POINTS``: the frames, ``"F"``, ``"M"`` or both, of which it reads the origin only and on which it makes no torque;
- ``SINGLE = True``: its formula branches on its numbers, so results evaluate it for one time after another;
- ``foot`` and ``progress``: it depends on a point of a curve, or of another body: its parameter, and the rate of that;
- ``offset``: that of a curve of the joint: the vector from the curve's point, and the curve's derivative;
- ``SPLINES = True``, or ``offset``: parameters 1 and 2 are the positions of the joint's first two splines in ``data``;
  more may follow at equal distances.
"""

from __future__ import annotations

import importlib
import itertools
import pkgutil
from collections.abc import Callable
from dataclasses import dataclass
from types import ModuleType

from ..compiler.formulas import formula
from ..compiler.kernels import Signature

FRAME = (3, 9, 3, 3, 3, 3)
"""Lengths of a kinematic record: position, rotation, angular velocity, velocity, angular acceleration, acceleration."""
SIGNATURES = (
    Signature(
        "row",
        "par, F, M",
        (6, FRAME, FRAME),
        (0, 3, 3, 3, 0),
        "(value, force on M, torque on M, torque on F, bias): a number, three tuples of three, a number",
    ),
)
"""The formula of a user-defined constraint row: `blocks.ConstraintRow`."""


@formula
def no_inputs(par, F, M):
    """Return zeros: the laws of a force between frames F and M have no inputs."""
    return 0.0 * M[0][0], 0.0 * M[0][0]


@dataclass(frozen=True)
class Kind:
    """A kind of constraint term."""

    number: int
    row: Callable
    """``row(par, F, M, hint, data)`` -> value, force on M, torque on M, torque on F, acceleration bias."""
    often: bool = False
    turns: bool = False
    points: str = ""
    foot: Callable | None = None
    progress: Callable | None = None
    offset: Callable | None = None
    single: bool = False
    splines: bool = False

    @property
    def place(self) -> bool:
        """Return whether the row depends on a point of a curve."""
        return self.foot is not None


def _kinds_of(module: ModuleType) -> list[Kind]:
    rows = getattr(module, "ROWS", {module.KIND: module.row} if hasattr(module, "KIND") else {})
    often, turns = getattr(module, "OFTEN", False), getattr(module, "TURNS", False)
    points = getattr(module, "POINTS", "")
    foot = getattr(module, "foot", None)
    progress, offset = (module.progress if foot is not None else None), getattr(module, "offset", None)
    splines = offset is not None or getattr(module, "SPLINES", False)
    single = getattr(module, "SINGLE", False)
    return [
        Kind(number, row, often, turns, points, foot, progress, offset, single, splines) for number, row in rows.items()
    ]


def ordered(found: list[Kind]) -> tuple[Kind, ...]:
    """Return the kinds sorted by number.

    Raises
    ------
    RuntimeError
        If a number is taken twice, one is left out, or a frequent kind comes after one that is not.
    """
    kinds = sorted(found, key=lambda k: k.number)
    for a, b in itertools.pairwise(kinds):
        if a.number == b.number:
            raise RuntimeError(
                f"KIND {a.number} is taken twice: by {a.row.__module__} and {b.row.__module__}; the next free is "
                f"{1 + max(k.number for k in kinds)}"
            )
        if b.often and not a.often:
            raise RuntimeError(f"{b.row.__module__}: OFTEN is for the first kinds; {a.row.__module__} comes before it")
    if [k.number for k in kinds] != list(range(len(kinds))):
        raise RuntimeError(f"the KINDs of constraints/ must be 0, 1, 2, ...; there are {[k.number for k in kinds]}")
    return tuple(kinds)


def _modules() -> list[ModuleType]:
    package = __name__.rpartition(".")[0]
    path = importlib.import_module(package).__path__
    names = [info.name for info in pkgutil.iter_modules(path) if info.name not in ("registry", "blocks")]
    return [importlib.import_module(f"{package}.{name}") for name in names]


KINDS = ordered([k for module in _modules() for k in _kinds_of(module)])
RARE = sum(k.often for k in KINDS)
"""Kinds from this number on share one loop: almost as fast, and much less to compile."""
BY_ADDRESS = len(KINDS)
"""The number of user-defined rows, whose formulas are called by address."""
