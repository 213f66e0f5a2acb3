"""User-defined formulas at frames on point masses: they must make no torque there and not depend on the orientation.

A `TwoPointForce`, and a row whose class declares `points`, may act on a point mass, which has neither orientation nor
angular velocity: a torque on it would be lost.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from ..errors import ModelError
from ..model.force import CoordinateForce
from ..model.joint import Joint
from .reference_configuration import Poses
from .structure_definition import Structure

if TYPE_CHECKING:
    from ..constraints.blocks import ConstraintRow
    from ..model.force import Force

Record = tuple[tuple[float, ...], ...]
"""Kinematic record of a frame: position, rotation, angular velocity, velocity, angular acceleration, acceleration."""
Wrench = tuple[np.ndarray, np.ndarray, np.ndarray]
"""Force on M, and torques on the bodies of M and F about the origins of M and F."""
ROUNDING = 1e-9  # relative to the torques and the force times its lever: a torque that is only rounding
LAWS = (1.0, -2.0, 0.5)  # ordinary values of laws
REMEDIES = ("derive the class from TwoFrameForce", "leave the frame out of the row's 'points'")  # of a force, a joint
SEEDS = range(3)
SPREAD = 0.1  # relative to the typical length: how far frames are moved from the reference configuration


def orientation_need(formula: Callable[[Record, Record], Wrench], F: Record, M: Record, role: str) -> str:
    """Return why the body that carries a frame needs an orientation; "" if it does not.

    Parameters
    ----------
    formula : function
        Force and torques for two kinematic records.
    F, M : tuple
    role : ``"F"`` or ``"M"``
        The frame in question.
    """
    force, on_M, on_F = formula(F, M)
    lever = np.linalg.norm(np.subtract(M[0], F[0]))
    size = np.abs(on_M).max() + np.abs(on_F).max() + lever * np.abs(force).max()
    if np.abs(on_M if role == "M" else on_F).max() > ROUNDING * size:
        return f"exerts a torque about the origin of frame {role}"
    rng = np.random.default_rng(1)
    p, R, _, v, _, a = F if role == "F" else M
    spin, spin_rate = (tuple(x) for x in rng.normal(size=(2, 3)))
    turned = p, tuple((_rotation(rng) @ np.reshape(R, (3, 3))).ravel()), spin, v, spin_rate, a
    other = formula(turned, M) if role == "F" else formula(F, turned)
    there, here = np.concatenate(other), np.concatenate((force, on_M, on_F))
    if np.abs(there - here).max() > ROUNDING * max(np.abs(there).max(), np.abs(here).max()):
        return f"depends on the orientation or angular velocity of frame {role}"
    return ""


def law_values(e: Force) -> tuple[float, ...]:
    """Return ordinary values of the laws of a force; 0 where it has none."""
    given = (*e.laws(), None, None, None)
    return tuple(0.0 if law is None else x for x, law in zip(LAWS, given, strict=False))


def force_wrench(e: Force, par: tuple[float, ...], laws: tuple[float, ...]) -> Callable[[Record, Record], Wrench]:
    """Return the force of an element and its torques on both bodies, as a function of two kinematic records."""
    cls: Any = type(e)

    def wrench(F: Record, M: Record) -> Wrench:
        force, torque = (np.array(x) for x in cls.wrench(par, F, M, laws, cls.inputs(par, F, M)))
        return force, torque, -torque - np.cross(np.subtract(M[0], F[0]), force)

    return wrench


def row_wrench(row: ConstraintRow, par: tuple[float, ...]) -> Callable[[Record, Record], Wrench]:
    """Return the force of a constraint row and its torques for a multiplier of 1, in the same way."""

    def wrench(F: Record, M: Record) -> Wrench:
        _, force, torque_M, torque_F, _ = type(row).row(par, F, M)
        return np.array(force), np.array(torque_M), np.array(torque_F)

    return wrench


def check_point_formulas(s: Structure, pose: Poses, forces: np.ndarray, terms: np.ndarray, length: float) -> None:
    """Refuse user-defined forces and rows that would lose a torque on a point mass.

    Raises
    ------
    ModelError
        With the names of the element and the body.
    """
    names: Mapping[int, str] = {s.place[name]: name for name in s.points}
    for e, what, formula, F, M in _user_formulas(s, forces, terms):
        for role, frame in (("F", F), ("M", M)):
            name = names.get(s.frames[frame].body)
            if name is not None and (why := _need_nearby(pose, s, formula, (F, M), role, SPREAD * length)):
                raise ModelError(
                    f"{e.title}: {what} {why}, but {s.model[name].title} has no inertia and is a point mass, which "
                    f"has no orientation: {REMEDIES[isinstance(e, Joint)]}, and give the body an inertia"
                )


def _need_nearby(pose: Poses, s: Structure, formula: Any, frames: tuple[int, int], role: str, spread: float) -> str:
    """Return why a formula needs an orientation near the reference configuration."""
    for k in SEEDS:
        rng = np.random.default_rng(k)
        F, M = (_record(pose.world(s.frames[frame])[0] + spread * rng.normal(size=3), rng) for frame in frames)
        try:
            found = orientation_need(formula, F, M, role)
        except Exception:  # a formula that fails is refused by name when it is compiled
            continue
        if found:
            return found
    return ""


def _user_formulas(s: Structure, forces: np.ndarray, terms: np.ndarray) -> Iterator[tuple[Any, str, Any, int, int]]:
    """User-defined formulas between two frames: element, name of the formula, the formula, frames F and M."""
    table = s.tables["forces"]
    for k, e in enumerate(s.forces):
        if s.force_code[k] is not None and not isinstance(e, CoordinateForce):
            laws = tuple(
                x if law is not None else 0.0 for x, law in zip(LAWS, (*e.laws(), None, None, None), strict=False)
            )
            yield e, "its wrench", force_wrench(e, tuple(forces[k]), laws), int(table.F[k]), int(table.M[k])
    for k, t in enumerate(s.terms):
        if s.term_code[k] is not None:
            row: Any = t.formula
            yield t.element, f"row {type(row).__name__}", row_wrench(row, tuple(terms[k, :6])), t.F, t.M


def _record(p: np.ndarray, rng: np.random.Generator) -> Record:
    """Return the kinematic record of a frame at a place, with any orientation and motion."""
    return tuple(p), tuple(_rotation(rng).ravel()), *(tuple(x) for x in rng.normal(size=(4, 3)))


def _rotation(rng: np.random.Generator) -> np.ndarray:
    """Return any rotation matrix."""
    Q = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    return Q * np.linalg.det(Q)  # type: ignore[no-any-return]
