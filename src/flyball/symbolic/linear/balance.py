"""Multipliers that balance the forces at a point, and what of the forces has to balance by itself."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from ...errors import AnalysisError, ModelError
from ...graph.arrays import zeros
from ...graph.derivative import jacobian, replaced
from ...graph.node import SYMBOL, Node
from ...graph.values import reached
from .free import Free
from .point import Point
from .size import sizes, vanishing
from .solve import Dependent, numbers, product, solved
from .traced import Mechanics

BALANCED = 1e-6  # of the terms that cancel, and of the largest force anywhere: what is left at an equilibrium
NEAR = 1e-9  # step in radians, or parts of the mechanism's length, that an equilibrium may be off


def multipliers(m: Mechanics, point: Point, f: Free) -> np.ndarray:
    """Multipliers (rows,) under which r = 0; those of rows that depend on others are 0.

    Raises
    ------
    ModelError
        If friction follows them: they are then no solution of linear equations.
    """
    lam = zeros(len(m.multipliers))
    if not len(f.rows_v):
        return lam
    r, R = _forces(m, point)
    if any(x in m.multipliers for x in reached(list(R.ravel()))):
        names = ", ".join(repr(e.name) for e in m.model.forces if hasattr(e, "load"))
        raise ModelError(
            f"friction of {names} follows the reactions, which at this point are no solution of linear equations; "
            f"linearize takes it, in numbers"
        )
    others = np.setdiff1d(np.arange(len(r)), np.r_[f.chosen_v, f.held])
    lam[f.rows_v] = solved(R[np.ix_(others, f.rows_v)], -r[others, None])[:, 0]
    return lam


def _forces(m: Mechanics, point: Point) -> tuple[np.ndarray, np.ndarray]:
    """R without multipliers, and its derivatives by them."""
    by = jacobian(list(m.r), m.multipliers)
    flat = replaced([*m.r, *by.ravel()], point.replacing(m))
    nv = len(m.r)
    r = zeros(nv)
    r[:] = replaced(flat[:nv], [(s, 0.0) for s in m.multipliers])
    R = zeros(*by.shape)
    R.ravel()[:] = flat[nv:]
    return r, R


def conditions(m: Mechanics, point: Point, lam: np.ndarray, f: Free) -> list[Node]:
    """Forces along the free coordinates, which vanish at an equilibrium; those that always do are left out."""
    r = zeros(len(m.r), 1)
    r[:, 0] = replaced(list(m.r), [*point.replacing(m), *zip(m.multipliers, lam, strict=True)])
    found = replaced(list(product(f.Zv.T, r)[:, 0]), [(s, 0.0) for s in m.added])
    return varying(found)


def varying(nodes: Sequence[Any]) -> list[Node]:
    """Those that do not vanish for all parameters; what is a number is rounding, or refused."""
    told = [x for x, none in zip(nodes, vanishing(nodes), strict=True) if isinstance(x, Node) and not none]
    return [x for x in told if not x.known]


def refuse_unbalanced(m: Mechanics, f: Free, stiffness: np.ndarray, at: dict[str, float]) -> None:
    """Refuse a point that is no equilibrium with the parameters' own values.

    Parameters
    ----------
    m : Mechanics
    f : Free
    stiffness : ndarray
        Derivatives of r by positions there.
    at : dict
        Values of all symbols there that are no parameters with their own values.

    Raises
    ------
    AnalysisError
        If the velocities do not stay what they are.
    ModelError
        With what is left unbalanced.
    """
    moving = any(at[s.data.name] for s in m.x.v)
    if moving and m.x.lam:
        terms = np.array(sizes(list(m.x.gamma), at))
        if (np.abs(terms[:, 0]) > BALANCED * (terms[:, 1] + terms[:, 1].max())).any():
            raise unsteady(m)
    r = np.array(sizes(list(m.r), at)) * m.scale[:, None]
    Z = numbers(f.Zv) / m.scale[:, None] * m.scale[f.chosen_v]
    left, terms = Z.T @ r[:, 0], np.abs(Z).T @ r[:, 1]
    near = np.abs(numbers(stiffness) * m.scale * m.scale[:, None]).sum(axis=1) * m.values.length
    for d, x, own in zip(f.chosen_v, left, terms, strict=True):
        if abs(x) > BALANCED * (own + 1e-3 * r[:, 1].max()) + NEAR * near[d]:
            name = m.names[d]
            others = "; other steady motions than of joints' coordinates linearize takes, in numbers" if moving else ""
            raise ModelError(
                f"{m.model.name!r} is in no equilibrium there: {x / m.scale[d]:.6g} "
                f"{'N' if name.unit == 'm' else 'N m'} are left along {name.name}. Give another point, for instance "
                f"at=m.equilibrium(), or name a parameter that has the value which balances it: "
                f"balanced_by=[...]{others}"
            )


def unsteady(m: Mechanics) -> AnalysisError:
    """The error for a motion that does not stay what it is."""
    return AnalysisError(
        f"{m.model.name!r} does not stay there as it is: its velocities change, or its linear equations do. Symbolic "
        f"ones are about equilibria, and about motions in which coordinates of joints turn or slide evenly while all "
        f"others stand still (coordinates='joint'); linearize takes other steady motions, in numbers"
    )


def balanced(m: Mechanics, at: Sequence[Node], names: Sequence[str]) -> list[tuple[Node, Node]]:
    """Parameters as the conditions of equilibrium ask for: (symbol, expression of the others).

    Parameters
    ----------
    m : Mechanics
    at : sequence of Node
        The conditions.
    names : sequence of str
        As many parameters, in which these are linear.

    Raises
    ------
    ModelError
        If they do not tell these parameters, or not linearly.
    """
    for name in names:
        if name not in m.given:
            raise ModelError(
                f"{m.model.name!r} has no parameter {name!r} with a value of its own to balance by; where an input is "
                f"to balance, give the force or torque beside it a parameter: torque='tau'"
            )
    if len(at) != len(names):
        raise ModelError(
            f"{len(at)} conditions of equilibrium tell {len(at)} parameters, not {len(names)} ({', '.join(names)})"
        )
    symbols = [m.given[k] for k in names]
    J = jacobian(at, symbols)
    if any(x.op == SYMBOL and x in symbols for x in reached(list(J.ravel()))):
        raise ModelError(f"the conditions of equilibrium are not linear in {', '.join(names)}; take other parameters")
    rest = zeros(len(at), 1)
    rest[:, 0] = replaced(list(at), [(s, 0.0) for s in symbols])
    try:
        found = solved(J, -rest)[:, 0]
    except Dependent:
        raise ModelError(f"equilibrium does not tell {', '.join(names)}: take other parameters") from None
    return [(s, m.graph.node(x)) for s, x in zip(symbols, found, strict=True)]
