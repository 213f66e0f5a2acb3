"""Where rounding was the limit of a motion, in words."""

from __future__ import annotations

import math

import numpy as np

from ...numerics.integrators import clock as ex
from ..assembly.start import Assembly

NOTABLE = 10.0  # times the tolerance: an error of a step from rounding that is told
LATELY = 1e-3  # part of the time span within which rounding found to decide is why a run stopped


def remarkable(worst: np.ndarray, far: np.ndarray, atol: np.ndarray, relative: np.ndarray) -> np.ndarray:
    """In which of several motions `excess` or `far_off` have something to say.

    Parameters
    ----------
    worst, far : (n,) ndarray
        The clock's EXCESS; how far the farthest frame is from the origin [m].
    atol, relative : (n,) ndarray
        Tolerance of positions [m]: the absolute one, and rtol times the mechanism's length.
    """
    return (worst > NOTABLE) | (np.spacing(far) > atol + relative)


def excess(clock: ex.Clock) -> str:
    """The largest error of a step that rounding made and that was accepted; nothing where it is not notable."""
    size = clock.real.excess
    if not size > NOTABLE:
        return ""
    return (
        f"rounding is the limit: near t = {clock.real.excess_at:.6g} s, where the mechanism is close to a singular "
        f"position, the last digits of the state alone change a step by up to {size:.2g} times what "
        f"rtol = {clock.real.rtol:g} allows. The step was accepted so; a larger rtol asks for what can be had"
    )


def far_off(a: Assembly, clock: ex.Clock) -> str:
    """How far from the origin it is, where positions are not known there to the tolerance."""
    length = a.compiled.values.length
    far = float(np.abs(a.compiled.array("FK")[:, :3]).max(initial=0.0))
    digit = math.ulp(far)
    if not digit > clock.real.atol + clock.real.rtol * length:
        return ""
    return (
        f"rounding is the limit: positions {far:.3g} m from the origin are known to {digit:.1g} m, which is more than "
        f"rtol = {clock.real.rtol:g} of the mechanism's length of {length:.3g} m; describe it near the origin"
    )


def rounded(clock: ex.Clock) -> str:
    """What is to be said of a run that stopped, if rounding was found to decide shortly before."""
    if clock.real.t - clock.real.blurred_at > LATELY * clock.real.span:
        return ""
    return (
        f". Rounding is the limit there: the last digits of the state change the error of a step by a tenth of it and "
        f"more, as they do close to a singular position; rtol = {clock.real.rtol:g} asks for more than can be had"
    )
