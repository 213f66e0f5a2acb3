"""Whether an equilibrium is stable: by the constrained stiffness, and where forces have no potential by the motion."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...results.equilibrium import MARGINAL, STABLE, UNSTABLE
from ...results.growth import growth
from .derivatives import Equations
from .free import Free, free
from .kinks import kinks, refuse_kinks
from .reduced import Frame, reduced
from .rest import Rest
from .sides import from_all_sides
from .spectrum import Spectrum, spectrum
from .stiffness import NEUTRAL, stiffness

DRIVEN = 1e-12  # of the largest damping: what is negative beyond is no rounding


@dataclass
class Stability:
    """What the stiffness says.

    Attributes
    ----------
    kind : str
        ``"stable"``, ``"marginal"`` or ``"unstable"``.
    free : Free
    stiffness : ndarray (f, f)
        Of the freedoms; at a kink on the side where least of it is.
    direction : ndarray (nv,)
        Of least stiffness, in scaled velocities.
    least : float
        That stiffness, as part of what springs, weights and reactions do along it by themselves.
    kinks : tuple of str
        Forces with another slope on the other side of this place, in words.
    """

    kind: str
    free: Free
    stiffness: np.ndarray
    direction: np.ndarray
    least: float
    kinks: tuple[str, ...] = ()


def stability(x: Rest) -> Stability:
    """Stability of an equilibrium; where forces have kinks there, from all sides of them.

    Raises
    ------
    SingularityError
        If a force jumps there, or the sides of its kinks leave stability open.
    """
    if x.verdict is None:
        x.verdict = _judged(x)
    return x.verdict


def _judged(x: Rest) -> Stability:
    e = x.equations
    f = free(e)
    if not f.Zv.shape[1]:
        return Stability(STABLE, f, np.zeros((0, 0)), np.zeros(len(x.scale)), np.inf)
    still = 0.0 * f.Zv
    found = [k for k in kinks(e) if k.felt(f.Zv * f.scale[f.chosen_v], still)]
    if found:
        kind, s = from_all_sides(x, f, found)
        k = int(np.argmin(s.parts))
        texts = tuple(dict.fromkeys(k.text for k in found))
        return Stability(kind, f, s.matrix, s.along[:, k], float(s.parts[k]), texts)
    s = stiffness(x, f)
    k = int(np.argmin(s.parts))
    kind = UNSTABLE if s.parts[k] < -NEUTRAL else MARGINAL if s.parts[k] <= NEUTRAL else STABLE
    if not s.potential:  # flutter shows in the motion
        refuse_kinks(e, still, f.Zv)
        kind = _by_motion(e, f)
    elif kind == STABLE and _drives(e, f) and _by_motion(e, f) == UNSTABLE:
        kind = UNSTABLE
    return Stability(kind, f, s.matrix, s.along[:, k], float(s.parts[k]))


def _drives(e: Equations, f: Free) -> bool:
    """Whether forces that follow velocities give energy to some motion: a negative damper."""
    D = f.Zv.T @ e.by_velocity[e.at["r"]] @ f.Zv
    d = np.linalg.eigvalsh(0.5 * (D + D.T))
    return bool(len(d) and d[0] < -DRIVEN * np.abs(d).max())


def by_eigenvalues(own: Spectrum, *, discrete: bool = False) -> str:
    """Stability by the motion, each eigenvalue judged by what it is uncertain by itself.

    Parameters
    ----------
    own : Spectrum
    discrete : bool
        Whether they are multipliers from one instant to the next, which must not exceed 1 in size.
    """
    most = growth(own.values, own.blur, discrete=discrete)
    return UNSTABLE if most > 0.0 else MARGINAL if most == 0.0 else STABLE


def _by_motion(e: Equations, f: Free) -> str:
    """Stability by the eigenvalues, damping included."""
    none = np.zeros((len(f.scale),) * 2)
    r = reduced(e, f, Frame(np.zeros(3), none, none))
    return by_eigenvalues(spectrum(r.A, r.doubt))
