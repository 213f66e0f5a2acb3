"""Checks of an element in a mechanism that is simulated."""

from __future__ import annotations

import tempfile
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from ..files import load
from ..model.force import Force
from .frames import random_rotation

if TYPE_CHECKING:
    from ..results.result import Result
    from .contract import Subject

SPAN, OUTPUTS = 0.3, 301  # [s]: part of a period of the sample mechanism
TIGHT = {"rtol": 1e-10, "atol": 1e-12}
DRIFT = 1e-7  # of the energies that change: a thousand times what the tolerance leaves
BOOKS = 1e-3  # of the largest work: power is summed over outputs by trapezoids
ALIKE = 1e-7  # of a metre: two ways of computing one motion at that tolerance
SHIFT = np.array([5.0, -2.0, 3.0])


def _motion(s: Subject, **more: object) -> Result:
    return s.mechanism.simulate(SPAN, outputs=OUTPUTS, specialize=False, **TIGHT, **more)  # type: ignore[arg-type]


def _positions(r: Result) -> np.ndarray:
    return np.stack([r[b.name].position for b in r.model.bodies])


def _difference(a: np.ndarray, b: np.ndarray) -> str:
    """How far two motions differ; "" if no more than rounding and tolerance explain."""
    apart, size = np.abs(a - b).max(), max(1.0, np.abs(a).max())
    return "" if apart <= ALIKE * size else f"positions of bodies differ by {apart:.3g} m after {SPAN} s"


def file(s: Subject) -> str:
    """Saved and loaded again it is the same."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "saved.toml"
        s.mechanism.save(path)
        again = load(path)
    if again != s.mechanism:
        return f"saved and loaded again it is {again[s.element.name]}, and was {s.element}"
    return ""


def books(s: Subject) -> str:
    """Energy is balanced, and the work of the element is the sum of its power."""
    r = _motion(s)
    exchanged = max(np.ptp(r.energy.kinetic), np.ptp(r.energy.potential), 1e-3)
    if not r.energy.drift <= DRIFT * exchanged:
        return f"the energy balance is off by {r.energy.drift:.3g} J, while {exchanged:.3g} J are exchanged"
    name = s.element.name
    if name in r.energy.work and isinstance(s.element, Force) and not s.element.conservative():
        power, work = r[name].power, r[name].work
        moved = np.r_[0.0, np.cumsum((power[1:] + power[:-1]) / 2 * np.diff(r.t))]
        wrong = np.abs(work - moved).max()
        if not wrong <= BOOKS * max(1e-9, np.abs(work).max()):
            return f"its work differs from the sum of its power by {wrong:.3g} J of {np.abs(work).max():.3g} J"
    return ""


def layers(s: Subject) -> str:
    """Joint coordinates and absolute coordinates give the same motion."""
    return _difference(*(_positions(_motion(s, coordinates=c)) for c in ("joint", "absolute")))


def made(s: Subject) -> str:
    """Code made for this mechanism gives the same motion; there is none where constraints open and close."""
    if isinstance(s.element, Force) and s.element.switches():
        return ""
    other = s.mechanism.simulate(SPAN, outputs=OUTPUTS, specialize=True, **TIGHT)  # type: ignore[arg-type]
    return _difference(_positions(_motion(s)), _positions(other))


def turned(s: Subject) -> str:
    """The whole mechanism rotated and shifted has the same motion, rotated and shifted."""
    if not s.turns:
        return ""
    Q = random_rotation(7)
    r = s.make(Q, SHIFT).simulate(SPAN, outputs=OUTPUTS, specialize=False, **TIGHT)  # type: ignore[arg-type]
    wrong = _difference(_positions(_motion(s)) @ Q.T + SHIFT, _positions(r))
    return (
        wrong and f"the whole mechanism rotated and shifted has another motion: {wrong}. It depends on the world's axes"
    )


def linear(s: Subject) -> str:
    """The equations of motion at the start can be linearised."""
    if np.isfinite(s.mechanism.linearize(frozen=True).eigenvalues).all():
        return ""
    return "linearize(frozen=True) gives eigenvalues that are not finite: the formula has no derivatives"
