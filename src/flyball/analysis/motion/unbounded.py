"""Motions that grow beyond all bounds: of themselves, within a finite time, or as a fixed step is too long."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from ...equations.engine import MOTION, evaluate
from ...equations.rows import measured
from ...laws.evaluation import evaluate as evaluate_law
from ...model.force import Force
from ...model.grammar import written
from ...model.touch import Touch
from ...model.words import brief, shortened
from ...numerics.integrators import clock as ex
from ...numerics.integrators.tableaux import TABLEAUX, Tableau, tableau
from ...tables.branches import laws
from ...tables.system import RATE, VALUE, assign
from ..assembly.start import Assembly
from .undefined import inputs_of

BOUNDLESS = 1e30  # times what it began with, or a unit, that nothing comes to that is meant
ASTRAY = 1e3  # the same, of a motion that a fixed step may have led astray
ESCAPING = 1e-4  # part of itself by which a state changes within a step that is as narrow as times can be told apart
NARROW = 1e-13  # part of the largest time: such steps
MOST = 400  # coordinates, velocities and states whose eigenvalues are looked for
SMALL = 1e-7  # differences, as part of the state
FARTHEST, FINELY = 15.0, 3000  # h |lambda| up to which steps may be stable, and how finely that is looked at
GROWS = 1e-3  # part by which a step may make a mode grow that is still called stable
FOREIGN = 0.1  # a mode grows by itself whose real part is more than this part of its size

Named = Callable[[Assembly, int], str]


def too_long(a: Assembly, clock: ex.Clock, method: str) -> str:
    """That a fixed step is too long, and which would do; nothing if that is not the matter."""
    step = float(clock.real.step)
    if not step > 0.0 or method not in TABLEAUX:
        return ""
    grown = np.r_[_grown(a, clock.y[ex.NOW]), _grown(a, clock.y[ex.NEW])]
    if not len(grown) or not grown.max() > ASTRAY:
        return ""
    longest, rate = longest_stable(a, tableau(method))
    if not step > longest:
        return ""
    return (
        f"a step of {step:g} s is too long for {method}: what changes fastest where it begins does so at {rate:.3g} "
        f"1/s, which this method follows stably in steps of up to {longest:.2g} s. Give such a step, or leave step "
        f"out, and its width is chosen; or take method='radau'"
    )


def boundless(a: Assembly, clock: ex.Clock, named: Named) -> str:
    """What has grown beyond all bounds, if something has."""
    y, grown = clock.y[ex.NOW], _grown(a, clock.y[ex.NOW])
    if not len(grown) or not grown.max() > BOUNDLESS:
        return ""
    i = int(np.argmax(grown))
    return (
        f"the motion grows without bound: by t = {clock.real.t:.6g} s {_told(a, i, float(y[i]), named)}. "
        f"Look for what drives it: a gain, a damping or a stiffness of the wrong sign, a controller that is unstable"
    )


def escaping(a: Assembly, clock: ex.Clock, named: Named) -> str:
    """What runs off to infinity, or faster and faster, within a finite time, if something does.

    A force whose law does, the state of a controller, and where there are no rows, so that nothing can lock, a
    coordinate or velocity.
    """
    s, t = a.compiled.structure, float(clock.real.t)
    if not clock.real.h < NARROW * max(abs(t), clock.real.largest):
        return ""
    if text := _unbounded_law(a, clock):
        return text
    y, rate, n = clock.y[ex.NOW], clock.K[0], _length(a)
    first = s.nq + s.nv if s.rows else 0
    with np.errstate(all="ignore"):
        part = np.nan_to_num(np.abs(rate[first:n]) * clock.real.h / np.abs(y[first:n]))
    if not len(part) or not part.max() > ESCAPING:
        return ""
    i = first + int(np.argmax(part))
    return (
        f"at t = {t:.6g} s {_told(a, i, float(y[i]), named)} and changes by {rate[i]:.3g} in a second, faster and "
        f"faster: it has no value from there on. {_cause(a, i)}"
    )


def _unbounded_law(a: Assembly, clock: ex.Clock) -> str:
    """A force whose law has grown, and grows by more than `ESCAPING` of itself within such a step; else nothing."""
    c, t, h, y = a.compiled, float(clock.real.t), float(clock.real.h), clock.y[ex.NOW]
    if not np.isfinite(y).all():
        return ""
    s, S, begun, now = c.structure, c.values.system, c.again(), c.again()
    for other, at, state in ((begun, a.t, a.y), (now, t, y)):
        assign(other.work.modes, c.work.modes)
        other.z = state[s.nq + s.nv :].copy()
        other.at(at, state[: s.nq].copy(), state[s.nq : s.nq + s.nv].copy(), MOTION)
    W, stack, n = now.work, np.zeros_like(c.work.stack), measured(S)
    later = W.sensed.copy()
    later[VALUE, :n] += h * W.sensed[RATE, :n]
    for k, e in enumerate(s.forces):
        if isinstance(e, Touch):
            continue
        x, rate = inputs_of(now, k)
        for law in filter(lambda at: at >= 0, S.forces.laws[k].tolist()):
            before, here, then = (
                abs(evaluate_law(S.code, S.const, law, stack, *of))
                for of in (
                    ((a.t, *inputs_of(begun, k)), begun.work.sensed),
                    ((t, x, rate), W.sensed),
                    ((t, x + h * rate, rate), later),
                )
            )
            if here > ASTRAY * before and abs(then - here) > ESCAPING * here:
                given = ", ".join(f"{name} = {z:.3g}" for name, z in zip(e.outputs, (x, rate), strict=False))
                given = f" for {given}" if given else ""
                return (
                    f"at t = {t:.6g} s the law of {e.title} gives {here:.3g}{given} and grows without bound: the "
                    f"motion has no continuation. Where parts meet that attract each other as 1/r**2, give the law a "
                    f"bound, 1/(r**2 + a**2), or keep the parts apart by a stop (Limit, Touch)"
                )
    return ""


def _cause(a: Assembly, i: int) -> str:
    """Where to look for what makes component i run off."""
    s = a.compiled.structure
    if i >= s.nq + s.nv:
        x = s.controls[i - s.nq - s.nv]
        return f"Look at the law of its rate, {brief(written(x.law.tree))}"
    pushing = dict.fromkeys(e.title for e, _, _ in laws(s.model) if isinstance(e, Force))
    known = f"Look at the laws of {shortened(pushing)}, or for" if pushing else "Look for"
    return f"{known} a force that grows without bound where the motion ended, as 1/r**2 does towards r = 0"


def longest_stable(a: Assembly, R: Tableau) -> tuple[float, float]:
    """The longest step [s] in which a method follows stably all that does not grow by itself, where a motion begins.

    And the rate [1/s] that decides; infinite and 0 if nothing does, or there is too much to look at.

    By the stability function of the method (Hairer and Wanner 1996, section IV.2) at the eigenvalues of the derivatives
    of (q, v, x)' by these, x being states of controllers; modes of what holds at times are those of now.
    """
    n = _length(a)
    J = _jacobian(a, n) if 0 < n <= MOST else np.zeros((1, 1))
    if not np.isfinite(J).all():
        return np.inf, 0.0
    modes = np.linalg.eigvals(J)
    size = np.abs(modes)
    modes = modes[(size > SMALL * size.max(initial=0.0)) & (modes.real <= FOREIGN * size)]
    z = np.linspace(0.0, FARTHEST, FINELY)
    powers = _stability(R)
    longest, rate = np.inf, 0.0
    for w in modes:
        grows = np.abs(np.polynomial.polynomial.polyval(z * w / abs(w), powers)) > 1.0 + GROWS
        edge = float(z[np.argmax(grows)]) if grows.any() else FARTHEST
        if edge / abs(w) < longest:
            longest, rate = edge / abs(w), float(abs(w))
    return longest, rate


def _stability(R: Tableau) -> np.ndarray:
    """Coefficients of the stability function: 1 + z b.(1 + z A 1 + z^2 A^2 1 + ...)."""
    s = int(R.order_i[1])
    A, b, x, out = R.A[:s, :s], R.A[s, :s], np.ones(s), [1.0]
    for _ in range(s):
        out.append(float(b @ x))
        x = A @ x
    return np.array(out)


def _jacobian(a: Assembly, n: int) -> np.ndarray:
    """Derivatives of the first ``n`` rates by what they are the rates of, by differences; the run's scratch is left."""
    c, y = a.compiled, a.y
    other = c.again()
    assign(other.work.modes, c.work.modes)
    assign(other.work.options, c.work.options)
    other.work.sensed[VALUE] = c.work.sensed[VALUE]

    def rates(x: np.ndarray) -> np.ndarray:
        status, dy = evaluate(other.values.system, other.work, a.t, x, MOTION)
        return dy[:n].copy() if status == 0 else np.full(n, np.nan)

    here, out = rates(y.copy()), np.zeros((n, n))
    for k in range(n):
        x = y.copy()
        x[k] += SMALL * max(abs(x[k]), 1.0)
        out[:, k] = (rates(x) - here) / (x[k] - y[k])
    return out


def _grown(a: Assembly, y: np.ndarray) -> np.ndarray:
    """Coordinates, velocities and states over what they began with, or a unit; 0 for what is no number."""
    n = _length(a)
    return np.nan_to_num(np.abs(y[:n]), nan=0.0) / np.maximum(np.abs(a.y[:n]), 1.0)


def _length(a: Assembly) -> int:
    """How many coordinates, velocities and states of continuous controllers there are."""
    s = a.compiled.structure
    return s.nq + s.nv + len(s.controls) - len(s.sampled)


def _told(a: Assembly, i: int, value: float, named: Named) -> str:
    """A component and what it is."""
    s = a.compiled.structure
    if i >= s.nq + s.nv:
        return f"{named(a, i)} is {value:.3g}"
    return f"{'a coordinate' if i < s.nq else 'a velocity'} of {named(a, i)} is {value:.3g}"
