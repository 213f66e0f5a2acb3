"""Steady motions: whether a motion looks the same at all times from a frame that turns evenly, and seen from which.

Along such a motion the linear equations x' = A(t) x have coefficients that only turn: A(t) = T A(0) T^-1 with T =
exp(t H). In co-moving coordinates y = T^-1 x they are constant, y' = (A(0) - H) y; in any others their eigenvalues
mean nothing (a conical pendulum seen from the ground). H turns positions with the frame, and takes from the rotations,
which have components along the bodies' axes, the spin of each body against the frame: a wheel that spins about its axis
of symmetry is the same wheel. Where a motion is steady from several frames, that which stands still or turns least is
taken (see ``frames``).
"""

from __future__ import annotations

import numpy as np

from ...equations.tree import normalise, rates
from ...errors import AnalysisError
from ...laws.opcodes import INPUT
from ...tables.names import velocity_names
from ...tables.system import System
from .balance import acting, at_rest, rounding
from .derivatives import Equations, State
from .frames import frames, generator, kinematic
from .free import Free
from .reduced import Frame, reduced

SWING = 0.1  # angle [rad] or part of the mechanism's length that it moves by between the instants compared
STEPS = 16
BALANCED = 1e-6  # unbalanced forces of an equilibrium, of those that act
NEAR = 1e-9  # step in radians, or parts of the mechanism's length, that an equilibrium may be off
SAME = 1e-5  # relative difference of linear equations that are the same
STILL = 1e-9  # speed below which nothing moves, of what gravity or the fastest body gives


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
    other = reduced(then, g, Frame(frame.turning, generator(later, frame.turning), kinematic(later))).A
    return bool(np.abs(other - now).max(initial=0.0) <= SAME * np.abs(now).max(initial=0.0))


def still(x: State) -> bool:
    """Whether nothing moves, compared with the mechanism's own rate, or with what forces give."""
    scale, pace = x.c.sizes / x.c.values.length, float(x.c.values.system.scales.rate.real)
    given = np.sqrt(pace**2 + np.abs(x.vdot / scale).max(initial=0.0))
    return not (np.abs(x.v) / scale).max(initial=0.0) > STILL * given


def seen_from(x: State, e: Equations, f: Free, off: np.ndarray | None = None) -> Frame:
    """The frame from which the state is steady: the world at an equilibrium; ``off`` is as in `balanced`.

    Raises
    ------
    AnalysisError
        If the state is neither an equilibrium nor a steady motion; the message says what is accelerated.
    """
    none = np.zeros((len(x.v),) * 2)
    if not f.Zv.shape[1]:  # drivers leave no freedom: there is nothing to be steady
        return Frame(np.zeros(3), none, none)
    if still(x):
        balanced(x, e, off)
        at_rest = Frame(np.zeros(3), none, none)
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


def balanced(x: State, e: Equations, off: np.ndarray | None = None) -> None:
    """Refuse a state at rest that does not stay there.

    Parameters
    ----------
    x : State
    e : Equations
        There.
    off : ndarray (nv,), optional
        Speeds of which the equilibrium may be off by a part, because they stand for something else.

    Raises
    ------
    AnalysisError
        Naming what is accelerated most.
    """
    left = left_over(x, e, off)
    if not left.any():
        return
    names, d = velocity_names(x.c.structure), int(np.argmax(left))
    raise AnalysisError(
        f"the mechanism is not in equilibrium where it is: {names[d].name} is accelerated with "
        f"{x.vdot[d]:.3g} {names[d].unit}/s^2. Find an equilibrium first and linearise about it: "
        f"about=m.equilibrium()"
    )


def left_over(x: State, e: Equations, off: np.ndarray | None = None) -> np.ndarray:
    """Accelerations (nv,) in natural units of what does not stay at rest, zero elsewhere; arguments of `balanced`."""
    rest = at_rest(e)
    left = np.abs(rest.block("r"))
    may = BALANCED * acting(rest) + NEAR * (abs(e.by_position[e.at["r"]]) @ x.c.sizes)
    if off is not None:
        may += NEAR * (abs(e.by_velocity[e.at["r"]]) @ off)
    if (left <= may).all() or (left <= may + rounding(rest)).all():
        return np.zeros(len(left))
    return np.where(left > may, np.abs(x.vdot) * x.c.sizes, 0.0)


def timed(S: System) -> bool:
    """Whether a law of a force follows time."""
    for law in S.forces.laws.ravel().tolist():
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
        raise changing()


def changing() -> AnalysisError:
    """The error for linear equations that are others a moment later."""
    return AnalysisError(
        "the mechanism rests, but laws of its forces change with time, and its linear equations with them; ask for "
        "those of this very instant with frozen=True"
    )


def moved_on(x: State, f: Free, frame: Frame) -> tuple[Equations, Free, Frame]:
    """The same equations a short while later, the bases turned with the frame."""
    from scipy.linalg import expm

    tau, later = _later(x, frame)
    then = Equations(later)
    own = Frame(frame.turning, generator(later, frame.turning), kinematic(later))
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
