"""Root loci: eigenvalues over a parameter of the model, and the values at which stability changes."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from itertools import pairwise
from typing import Any

import numpy as np

from ..errors import AnalysisError, ModelError
from ..model.model import Model
from ..results.linear import follow
from ..results.root_locus import Crossing, RootLocus
from .linearize import linearize
from .series import checked, equilibria, stopped

TOUCHING = 1e-6  # real parts below this part of the largest eigenvalue are none
EXACT = 1e-12  # of the stretch between two values


def root_locus(
    model: Model,
    parameter: str,
    values: Sequence[float],
    *,
    equilibrium: bool = False,
    parameters: Mapping[str, float] | None = None,
    **options: Any,
) -> RootLocus:
    """Eigenvalues over values of a parameter, as branches.

    Parameters
    ----------
    model : Model
    parameter : str
    values : sequence of float
        In SI units.
    equilibrium : bool
        About the equilibrium at each value, each following from the one before; else as described at each value.
    parameters : mapping, optional
        Values in SI units in place of the model's.
    **options
        As for `flyball.analysis.linearize.linearize`: ``t``, ``coordinates``, ``frozen``; ``about`` may be a result.

    Returns
    -------
    RootLocus

    Raises
    ------
    NotConverged
        If the mechanism cannot be linearised at a value; ``series`` holds what was found before.
    ModelError
        If there is no such parameter, or ``about`` is an equilibrium, which is one of other values.
    """
    if options.get("about") is not None and hasattr(options["about"], "stability"):
        raise ModelError("root_locus: an equilibrium is one of its own parameters; say equilibrium=True instead")
    points = checked(model, parameter, values)
    base = dict(parameters or {})
    times = {"t": options.pop("t", 0.0)}
    along = equilibria(model, parameter, points, parameters=base, **times) if equilibrium else None

    def at(value: float, near: int) -> np.ndarray:
        given = dict(times, parameters=base)
        if parameter == "t":
            given["t"] = value
        else:
            given["parameters"] = {**base, parameter: float(value)}
        own = dict(options)
        if along is not None:
            same = along.values[near] == value
            own["about"] = along[near] if same else _near(model, parameter, value, along, near, base, times)
        return np.linalg.eigvals(linearize(model, **given, **own).A)

    done = RootLocus(model.name, parameter, points[:0], np.zeros((0, 0), complex))
    for k, value in enumerate(points):
        try:
            w = at(value, k)
            if k and len(w) != done.eigenvalues.shape[1]:
                raise AnalysisError(f"there are {len(w)} states, and {done.eigenvalues.shape[1]} at the values before")
        except AnalysisError as error:
            raise stopped(done, value, error) from error
        rows = [*done.eigenvalues, w] if k else [w[np.lexsort((w.real, w.imag))]]
        done.eigenvalues, done.values = follow(np.array(rows)), points[: k + 1]
    done.crossings = _crossings(done, at)
    return done


def _near(model: Model, parameter: str, value: float, along: Any, k: int, base: dict, times: dict) -> Any:
    """The equilibrium at a value between those of a series."""
    return equilibria(model, parameter, [along.values[k], value], parameters=base, start=along[k], **times)[1]


def _crossings(locus: RootLocus, at: Callable[[float, int], np.ndarray]) -> list[Crossing]:
    """Values where branches pass through the imaginary axis."""
    least = TOUCHING * np.abs(locus.eigenvalues).max(initial=0.0)
    found: list[Crossing] = []
    for branch in locus.eigenvalues.T:
        off = np.flatnonzero(np.abs(branch.real) > least)
        for i, j in pairwise(off):
            if branch[i].real * branch[j].real > 0.0 or max(branch[i].imag, branch[j].imag) < -least:
                continue
            c = _crossed(locus, branch, int(i), int(j), at)
            if not any(abs(c.eigenvalue - f.eigenvalue) + abs(c.value - f.value) <= least for f in found):
                found.append(c)
    return sorted(found)


def _crossed(locus: RootLocus, branch: np.ndarray, i: int, j: int, at: Callable[[float, int], np.ndarray]) -> Crossing:
    """Between two values: the zero of the real part of the eigenvalue that lies between those on both sides."""
    from scipy.optimize import brentq

    known = {float(locus.values[k]): complex(branch[k]) for k in (i, j)}

    def real(value: float) -> float:
        if value not in known:
            low, high = max(k for k in known if k < value), min(k for k in known if k > value)
            guess = known[low] + (value - low) / (high - low) * (known[high] - known[low])
            w = at(value, i)
            known[value] = complex(w[np.argmin(np.abs(w - guess))])
        return known[value].real

    ends = float(locus.values[i]), float(locus.values[j])
    value = float(brentq(real, *ends, xtol=EXACT * (abs(ends[0]) + abs(ends[1])), rtol=EXACT))
    real(value)
    return Crossing(value, complex(0.0, abs(known[value].imag)))
