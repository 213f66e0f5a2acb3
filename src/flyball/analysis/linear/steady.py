"""Steady motions: whether a motion looks the same at all times from a frame that turns evenly, and seen from which.

Along such a motion the linear equations x' = A(t) x have coefficients that only turn: A(t) = T A(0) T^-1 with T =
exp(t H). In co-moving coordinates y = T^-1 x they are constant, y' = (A(0) - H) y; in any others their eigenvalues
mean nothing (a conical pendulum seen from the ground). H turns positions with the frame, and takes from the rotations,
which have components along the bodies' axes, the spin of each body against the frame: a wheel that spins about its axis
of symmetry is the same wheel.
"""

from __future__ import annotations

import numpy as np

from ...equations.tree import column, normalise, quaternion_at, rates
from ...errors import AnalysisError
from ...laws.opcodes import INPUT
from ...results.records import Records
from ...tables.names import velocity_names
from ...tables.system import FORCE_LAW, FREE, PLANAR, TREE, V0, System
from .balance import acting, at_rest, rounding
from .derivatives import Equations, State
from .free import Free
from .reduced import Frame, reduced

SWING = 0.1  # angle [rad] or part of the mechanism's length that it moves by between the instants compared
STEPS = 16
BALANCED = 1e-6  # unbalanced forces of an equilibrium, of those that act
NEAR = 1e-9  # step in radians, or parts of the mechanism's length, that an equilibrium may be off
SAME = 1e-5  # relative difference of linear equations that are the same
STILL = 1e-9  # speed below which nothing moves, of what gravity or the fastest body gives
UNDECIDED = 1e-9  # singular values below this part of the largest leave the frame's turning open


def kinematic(x: State) -> np.ndarray:
    """N of `Frame`: changes of rotations have components along axes that turn, (nv, nv)."""
    S = x.c.values.system
    N = np.zeros((len(x.v),) * 2)
    for b in range(len(S.body_i)):
        _, w0 = quaternion_at(S, b)
        if w0 >= 0:
            at = slice(w0, w0 + 3)
            N[at, at] = -_skew(x.v[at])
    return N


def frames(x: State) -> list[Frame]:
    """Frames from which the motion may look steady, the most likely first.

    All bodies' velocities and angular velocities then turn with the frame: a = W x v, alpha = W x w. What this leaves
    open is chosen so that the frame stands still, or so that it turns with one of the bodies.
    """
    c = x.c
    c.at(x.t, x.q, x.v)
    r = Records(c.values, x.q[None], x.v[None], x.vdot[None])
    kept = [np.array([r.body(b)[k] for b in c.structure.place.values() if b >= 0])[..., 0] for k in (2, 3, 4, 5)]
    w, v, alpha, a = kept
    length = c.values.length
    A = np.vstack([-_skew(u) for u in [*(v / length), *w]])
    right = np.r_[(a / length).ravel(), alpha.ravel()]
    U, d, Vt = np.linalg.svd(A)
    known = d > UNDECIDED * d[0]
    least = Vt[known].T @ ((U[:, : len(d)][:, known].T @ right) / d[known])
    open_ = Vt[~known]
    turns = [least]
    for spin in w:
        other = least + open_.T @ (open_ @ (spin - least))
        if min(np.abs(other - seen).max() for seen in turns) > UNDECIDED * (1.0 + np.abs(w).max()):
            turns.append(other)
    N = kinematic(x)
    return [Frame(turning, _generator(x, turning), N) for turning in turns]


def is_steady(x: State, e: Equations, f: Free, frame: Frame) -> bool:
    """Whether a moment later, moved on with the frame, the accelerations and linear equations are the same."""
    from scipy.linalg import expm

    size = np.abs(x.v / f.scale).max() ** 2 + np.abs(x.vdot / f.scale).max()
    if not np.abs((x.vdot - frame.H @ x.v) / f.scale).max() <= SAME * size:
        return False  # the velocities do more than turn with the frame
    tau, later = _later(x, frame)
    T = expm(tau * frame.H)
    if not np.abs((later.vdot - T @ x.vdot) / f.scale).max() <= SAME * size:
        return False
    then = Equations(later)
    g = f.turned(T, then)
    if np.abs(g.rows @ g.Zv).max(initial=0.0) > SAME * np.abs(g.rows).max(initial=0.0) * np.abs(g.Zv).max(initial=0.0):
        return False
    now = reduced(e, f, frame).A
    other = reduced(then, g, Frame(frame.turning, _generator(later, frame.turning), kinematic(later))).A
    return bool(np.abs(other - now).max(initial=0.0) <= SAME * np.abs(now).max(initial=0.0))


def seen_from(x: State, e: Equations, f: Free) -> Frame:
    """The frame from which the state is steady: the world at an equilibrium.

    Raises
    ------
    AnalysisError
        If the state is neither an equilibrium nor a steady motion; the message says what is accelerated.
    """
    still = np.zeros((len(x.v),) * 2)
    if not f.Zv.shape[1]:  # drivers leave no freedom: there is nothing to be steady
        return Frame(np.zeros(3), still, still)
    if not (np.abs(x.v) / f.scale).max(initial=0.0) > STILL * np.sqrt(1.0 + np.abs(x.vdot / f.scale).max(initial=0.0)):
        balanced(x, e)
        at_rest = Frame(np.zeros(3), still, still)
        if timed(x.c.values.system):
            _refuse_changing(x, e, f, at_rest)
        return at_rest
    for frame in frames(x):
        if is_steady(x, e, f, frame):
            return frame
    raise AnalysisError(
        f"the motion at t = {x.t:.6g} s is no steady one: from no evenly turning frame does it look the same a moment "
        f"later. Linearise about an equilibrium (about=m.equilibrium()) or a steady motion, or ask for the equations "
        f"of this very instant with frozen=True"
    )


def balanced(x: State, e: Equations) -> None:
    """Refuse a state at rest that does not stay there.

    Raises
    ------
    AnalysisError
        Naming what is accelerated most.
    """
    names = velocity_names(x.c.structure)
    rest = at_rest(e)
    left = np.abs(rest.block("r"))
    may = BALANCED * acting(rest) + NEAR * (abs(e.by_position[e.at["r"]]) @ x.c.sizes)
    if (left <= may).all() or (left <= may + rounding(rest)).all():
        return
    d = int(np.argmax(np.where(left > may, np.abs(x.vdot) * x.c.sizes, 0.0)))
    raise AnalysisError(
        f"the mechanism is not in equilibrium where it is: {names[d].name} is accelerated with "
        f"{names[d].sign * x.vdot[d]:.3g} {names[d].unit}/s^2. Find an equilibrium first and linearise about it: "
        f"about=m.equilibrium()"
    )


def timed(S: System) -> bool:
    """Whether a law of a force follows time."""
    for law in S.force_i[:, FORCE_LAW : FORCE_LAW + 3].ravel().tolist():
        if law >= 0:
            program = S.code[law + 2 : law + 2 + 2 * S.code[law]].reshape(-1, 2)
            if (program == (INPUT, 0)).all(axis=1).any():
                return True
    return False


def _refuse_changing(x: State, e: Equations, f: Free, frame: Frame) -> None:
    """Refuse linear equations that are others a moment later, though the mechanism rests."""
    now = reduced(e, f, frame).A
    fastest = float(np.sqrt(np.abs(now).max(initial=0.0))) or 1.0
    z = x.c.z.copy()
    then = reduced(Equations(State.moving(x.c, x.t + SWING / fastest, x.q, x.v)), f, frame).A
    x.c.at(x.t, x.q, x.v)
    x.c.z = z
    if np.abs(then - now).max(initial=0.0) > SAME * np.abs(now).max(initial=0.0):
        raise AnalysisError(
            "the mechanism rests, but laws of its forces change with time, and its linear equations with them; ask for "
            "those of this very instant with frozen=True"
        )


def moved_on(x: State, f: Free, frame: Frame) -> tuple[Equations, Free, Frame]:
    """The same equations a short while later, the bases turned with the frame."""
    from scipy.linalg import expm

    tau, later = _later(x, frame)
    then = Equations(later)
    own = Frame(frame.turning, _generator(later, frame.turning), kinematic(later))
    return then, f.turned(expm(tau * frame.H), then), own


def _later(x: State, frame: Frame) -> tuple[float, State]:
    """(time, state) a short while later if velocities turn with the frame: no forces are asked, so nothing is stiff."""
    from scipy.linalg import expm

    c, z, q = x.c, x.c.z.copy(), x.q.copy()
    c.at(x.t, x.q, x.v)
    S, W = c.values.system, c.work
    h = SWING / max(np.abs(W.BK[:, 12:15]).max(), np.abs(W.BK[:, 15:18]).max() / c.values.length) / STEPS
    half, v = expm(0.5 * h * frame.H), x.v

    def rate(q: np.ndarray, v: np.ndarray) -> np.ndarray:
        out = np.zeros_like(q)
        rates(S, q, v, out)
        return out

    for _ in range(STEPS):
        middle = half @ v
        end = half @ middle
        k1 = rate(q, v)
        k2 = rate(q + 0.5 * h * k1, middle)
        k3 = rate(q + 0.5 * h * k2, middle)
        k4 = rate(q + h * k3, end)
        q, v = q + h / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4), end
    normalise(S, q)
    later = State.moving(c, x.t + STEPS * h, q, v)
    c.z = z
    return STEPS * h, later


def _generator(x: State, turning: np.ndarray) -> np.ndarray:
    """H of `Frame`, at the poses that the mechanism was last evaluated at."""
    S, W = x.c.values.system, x.c.work
    H = np.zeros((len(x.v),) * 2)
    for b in range(len(S.body_i)):
        kind, v0 = int(S.body_i[b, TREE]), int(S.body_i[b, V0])
        if kind == PLANAR:
            H[v0 : v0 + 2, v0 : v0 + 2] = _skew(turning)[:2, :2]
        if kind == FREE:
            H[v0 : v0 + 3, v0 : v0 + 3] = _skew(turning)
        _, w0 = quaternion_at(S, b)
        if w0 >= 0:
            axes = np.array([column(S, W, b, w0 - v0 + k)[0] for k in range(3)])  # rows, along the world's
            H[w0 : w0 + 3, w0 : w0 + 3] = -_skew(axes @ (W.BK[b, 12:15] - turning))
    return H


def _skew(w: np.ndarray) -> np.ndarray:
    """Matrix of the cross product w x ."""
    return np.array([[0.0, -w[2], w[1]], [w[2], 0.0, -w[0]], [-w[1], w[0], 0.0]])
