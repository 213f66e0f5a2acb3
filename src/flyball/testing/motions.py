"""Checks of an element in a mechanism that moves."""

from __future__ import annotations

import tempfile
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from ..files import load
from .frames import random_rotation

if TYPE_CHECKING:
    from ..results.result import Result
    from .contract import Subject

SPAN, OUTPUTS = 0.3, 301  # [s]: a part of a swing of the sample mechanism
TIGHT = {"rtol": 1e-10, "atol": 1e-12}
DRIFT = 1e-7  # of the energies that change: a thousand times what the tolerance leaves
BOOKS = 1e-3  # of the largest work: power is summed over outputs by trapezoids
ALIKE = 1e-7  # of a metre: two ways of computing one motion at that tolerance
SHIFT = np.array([5.0, -2.0, 3.0])


def _motion(s: Subject, **more: object) -> Result:
    return s.mechanism.simulate(SPAN, outputs=OUTPUTS, specialize=False, **TIGHT, **more)  # type: ignore[arg-type]


def _places(r: Result) -> np.ndarray:
    return np.stack([r[b.name].position for b in r.model.bodies])


def _apart(a: np.ndarray, b: np.ndarray) -> str:
    """How far two motions are apart; "" if no more than rounding and tolerance explain."""
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
    turned_over = max(np.ptp(r.energy.kinetic), np.ptp(r.energy.potential), 1e-3)
    if not r.energy.drift <= DRIFT * turned_over:
        return f"the energy balance is off by {r.energy.drift:.3g} J, while {turned_over:.3g} J are exchanged"
    name = s.element.name
    if name in r.energy.work and not s.element.conservative():
        power, work = r[name].power, r[name].work
        moved = np.r_[0.0, np.cumsum((power[1:] + power[:-1]) / 2 * np.diff(r.t))]
        wrong = np.abs(work - moved).max()
        if not wrong <= BOOKS * max(1e-9, np.abs(work).max()):
            return f"its work differs from the sum of its power by {wrong:.3g} J of {np.abs(work).max():.3g} J"
    return ""


def layers(s: Subject) -> str:
    """Coordinates of joints and absolute coordinates give one motion."""
    return _apart(*(_places(_motion(s, coordinates=c)) for c in ("joint", "absolute")))


def made(s: Subject) -> str:
    """Code made for the mechanism gives the same motion; none is made where rows hold at times."""
    if s.element.switches():
        return ""
    other = s.mechanism.simulate(SPAN, outputs=OUTPUTS, specialize=True, **TIGHT)  # type: ignore[arg-type]
    return _apart(_places(_motion(s)), _places(other))


def turned(s: Subject) -> str:
    """The whole mechanism turned and shifted moves as before."""
    if not s.turns:
        return ""
    Q = random_rotation(7)
    r = s.make(Q, SHIFT).simulate(SPAN, outputs=OUTPUTS, specialize=False, **TIGHT)  # type: ignore[arg-type]
    wrong = _apart(_places(_motion(s)) @ Q.T + SHIFT, _places(r))
    return wrong and f"the whole mechanism turned and shifted moves otherwise: {wrong}. It depends on the world's axes"


def linear(s: Subject) -> str:
    """The equations of motion where it starts can be made linear."""
    if np.isfinite(s.mechanism.linearize(frozen=True).eigenvalues).all():
        return ""
    return "linearize(frozen=True) gives eigenvalues that are not finite: the formula has no derivatives"
