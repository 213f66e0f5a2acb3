"""What carries a mechanism at rest: reactions of joints and forces of contacts that balance what acts."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from ...numerics.cone.static import Balance, Cones, balance
from ...results.contacts import Contacts
from ...results.sides import OPEN, SLIP, STICK, Sides
from ..linear.balance import acting
from ..linear.derivatives import Equations, State
from ..linear.rest import Rest
from .closed import Place, rows

LIMIT = 1e-6  # a friction force that lacks less than this part is at its limit
PARTING = 1e-6  # a normal force below this part of the largest is none


@dataclass(frozen=True)
class Carried:
    """Reactions and contact forces.

    Attributes
    ----------
    lam : ndarray
        Multipliers of the joints' rows.
    force : ndarray (n, 3) [N]
        Of the contacts, along their frames, on the second side.
    unbalanced : float
        The largest force or torque left, in parts of the largest that acts.
    unique : bool
        Whether no other forces would carry it too.
    """

    lam: np.ndarray
    force: np.ndarray
    unbalanced: float
    unique: bool


def carried(place: Place, x: Rest, signs: Mapping[str, float], bears: Mapping[str, float] | None = None) -> Carried:
    """Forces that balance what acts, of those that contacts can bear.

    Parameters
    ----------
    place : Place
    x : Rest
        There, of the model with stops that touch as drivers.
    signs : mapping
        Name of a stop -> +1 if its effort may push upwards only, -1 downwards, 0 either way.
    bears : mapping, optional
        Name of what sticks -> the most that it bears [N] or [N m].
    """
    c = x.c
    r = Equations(State.resting(c, x.t, x.q)).block("r")
    n = len(place.contacts)
    J = (rows(place) * c.sizes).T / c.values.length
    G = (x.G.toarray()).T
    stop = np.zeros(G.shape[1])
    for name, sign in signs.items():
        stop[c.structure.slices[name]] = sign
    most = np.full(G.shape[1], np.inf)
    for name, bound in (bears or {}).items():
        most[c.structure.slices[name]] = bound / x.per_row[c.structure.slices[name]]
    free, signed, sticks = (np.flatnonzero(k) for k in ((stop == 0.0) & (most == np.inf), stop, most < np.inf))
    order = np.r_[free, signed]
    used = J.reshape(len(r), n, 3).copy()
    mu = np.array([k.friction for k in place.contacts])
    used[:, mu == 0.0, 1:] = 0.0
    if c.structure.model.planar:
        used[:, :, 2] = 0.0
    b = c.sizes * r
    columns = np.hstack([G[:, order], used.reshape(len(r), -1), G[:, sticks]])
    found = balance(columns, b, Cones(len(free), stop[signed], mu, most[sticks]))
    lam, last = np.zeros(G.shape[1]), len(found.x) - len(sticks)
    lam[order], lam[sticks] = found.x[: len(order)], found.x[last:]
    force = found.x[len(order) : last].reshape(n, 3) / c.values.length
    return Carried(x.per_row * lam, force, _left(x, r, found), _unique(used, G, found))


def _left(x: Rest, r: np.ndarray, found: Balance) -> float:
    """What is left, in parts of the largest that acts."""
    acts = np.abs(x.scale * acting(Equations(State.resting(x.c, x.t, x.q)))).max(initial=0.0)
    most = max(acts, float(np.abs(x.scale * r).max(initial=0.0)))
    return float(np.abs(found.left).max(initial=0.0)) / most if most > 0.0 else 0.0


def _unique(used: np.ndarray, G: np.ndarray, found: Balance) -> bool:
    """Whether the columns that are there are independent."""
    A = np.hstack([G, used.reshape(len(G), -1)])
    A = A[:, np.abs(A).max(axis=0, initial=0.0) > 0.0]
    return bool(np.linalg.matrix_rank(A, tol=1e-10 * max(np.abs(A).max(initial=0.0), 1e-300)) == A.shape[1])


def as_contacts(place: Place, force: np.ndarray) -> Contacts:
    """The contacts of the place as a table of one time."""
    scene, n = place.scene, len(place.contacts)
    names = [*scene.carriers.names, "ground"]
    number = {name: k for k, name in enumerate(names)}
    normal = force[:, 0]
    most = normal.max(initial=0.0)
    tangential = np.hypot(force[:, 1], force[:, 2])
    mu = np.array([c.friction for c in place.contacts])
    state = np.where(tangential >= (1.0 - LIMIT) * mu * normal, SLIP, STICK)
    state = np.where(normal <= PARTING * most, OPEN, state)
    frames = np.array([c.frame for c in place.contacts]).reshape(n, 3, 3)
    return Contacts(
        t=np.array([place.at.t]),
        sides=Sides(names, [-1] * len(names)),
        begin=np.array([0, n]),
        pair=np.array([[number[a] for a in c.bodies] for c in place.contacts], np.int64).reshape(n, 2),
        point=np.array([c.point for c in place.contacts]).reshape(n, 3),
        normal=np.array([c.normal for c in place.contacts]).reshape(n, 3),
        gap=np.array([c.gap for c in place.contacts]),
        force=np.einsum("ki,kij->kj", force, frames),
        state=state.astype(np.int64),
        friction=mu,
        planar=place.at.compiled.structure.model.planar,
    )
