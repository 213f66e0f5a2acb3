"""Root loci: eigenvalues over a parameter of the model, and the values at which stability changes."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from ..errors import AnalysisError, ModelError
from ..model.model import Model
from ..results.equilibrium import Equilibrium
from ..results.linear import follow
from ..results.root_locus import Crossing, RootLocus
from .equilibria import EquilibriaOptions, checked, equilibria, stopped
from .linearize import InstantOptions, LinearizeOptions, linearize
from .progress import shown

TOUCHING = 1e-6  # real parts below this part of the largest eigenvalue are none
EXACT = 1e-12  # of the stretch between two values


@dataclass(frozen=True, kw_only=True)
class RootLocusOptions(InstantOptions):
    """What `Mechanism.root_locus` is asked."""

    parameter: str
    values: Sequence[float] | np.ndarray
    equilibrium: bool
    progress: bool | Callable[[float], None]

    def __post_init__(self) -> None:
        super().__post_init__()
        if isinstance(self.about, Equilibrium):
            raise ModelError("root_locus: an equilibrium is one of its own parameters; say equilibrium=True instead")
        if self.about is not None and self.equilibrium:
            raise ModelError("root_locus: say either about or equilibrium=True, which places the mechanism itself")

    def linear(self, value: float, about: Equilibrium | None) -> LinearizeOptions:
        """What is asked at a value: linear equations there, about an equilibrium if that is given."""
        t, parameters = self.t, dict(self.parameters or {})
        if self.parameter == "t":
            t = value
        else:
            parameters[self.parameter] = float(value)
        return LinearizeOptions(
            inputs=(),
            outputs=(),
            about=self.about if about is None else about,
            t=t if about is None else None,
            parameters=parameters,
            coordinates=self.coordinates,
            frozen=self.frozen,
        )

    def rest(self, values: Sequence[float] | np.ndarray, start: Equilibrium | None = None) -> EquilibriaOptions:
        """What is asked for the equilibria at values."""
        return EquilibriaOptions(
            parameter=self.parameter,
            values=values,
            t=self.t or 0.0,
            parameters=self.parameters,
            start=start,
            stable=False,
            progress=False,
        )


def root_locus(model: Model, o: RootLocusOptions) -> RootLocus:
    """Eigenvalues over values of a parameter, as branches: see `Mechanism.root_locus`."""
    points = checked(model, o.parameter, o.values)
    along = equilibria(model, o.rest(points)) if o.equilibrium else None

    def at(value: float, near: int) -> np.ndarray:
        about = None
        if along is not None:
            about = along[near]
            if along.values[near] != value:  # between those of the series
                about = equilibria(model, o.rest([along.values[near], value], about))[1]
        return np.linalg.eigvals(linearize(model, o.linear(value, about)).A)

    done = RootLocus(model.name, o.parameter, points[:0], np.zeros((0, 0), complex))
    with shown(o.progress, f"eigenvalues over {o.parameter}") as tell:
        for k, value in enumerate(points):
            try:
                w = at(value, k)
                if k and len(w) != done.eigenvalues.shape[1]:
                    raise AnalysisError(
                        f"there are {len(w)} states, and {done.eigenvalues.shape[1]} at the values before"
                    )
            except AnalysisError as error:
                raise stopped(done, value, error) from error
            rows = [*done.eigenvalues, w] if k else [w[np.lexsort((w.real, w.imag))]]
            done.eigenvalues, done.values = follow(np.array(rows)), points[: k + 1]
            tell((k + 1) / len(points), f"{value:.6g}")
        done.crossings = _crossings(done, at)
    return done


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
