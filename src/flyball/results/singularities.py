"""Singular positions of a driven mechanism, with names."""

from __future__ import annotations

import math
import os
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np

from .wording import SELF_MOTION

NEGLIGIBLE_PART = 1e-7  # numbers below this part of the largest are printed as zero
MAX_COMPONENTS = 6  # number of printed coordinates of a vector


class Motion(NamedTuple):
    """Motion of one branch for a given driver motion: finite velocities and accelerations at the singular position."""

    branch: int
    rate: float  # a' of the driver's coordinate [1/s times its unit]
    acceleration: float  # a''
    velocities: dict[str, float]  # of coordinates and bodies [m/s, rad/s]
    accelerations: dict[str, float]  # [m/s^2, rad/s^2]


@dataclass(frozen=True)
class Branch:
    """One curve through a singular position; give it to ``singularities(branch=...)`` to follow it.

    Attributes
    ----------
    what : str
        ``"passes"``: the driver moves along it. ``"turns back"``: the driver has an extremum. ``"passes, unbounded"``:
        the driver passes, at velocities without bound. ``"self-motion"``: the driver does not move. ``"cusp"``: the
        driver moves in one direction only, on two halves with a common tangent.
    order : int
        Order of the driver's first nonzero derivative along it; 0 if there is none.
    side : int
        If the driver turns back: +1 if it has larger values only, -1 smaller values only; else 0.
    tangent : dict
        Rates of coordinates and bodies along it, for a' = 1 where the driver passes, else the largest one 1.
    """

    what: str
    order: int
    side: int
    tangent: dict[str, float]
    origin: Any = field(repr=False, compare=False, default=None)


@dataclass(frozen=True)
class Singularity:
    """A position in which the driven Jacobian loses rank.

    Attributes
    ----------
    a : float
        Value of the driver's coordinate [rad] or [m].
    kind : str
        ``"regular passage"``: one branch on which the driver moves. ``"bifurcation"``: several. ``"lock-up"``: none.
        ``"self-motion"``: none, and the mechanism can move while the driver stands still.
    isolated : bool
        Whether no branch leads away from it.
    self_motion : bool
        Whether the driver is at rest along some branch.
    lost : int
        Rank deficiency of the driven Jacobian.
    branch_point : bool
        Whether the Jacobian extended by the driver loses rank too; otherwise the curve has one tangent here.
    coordinates : dict
        Position: coordinates of joints and bodies [rad] or [m].
    null_vectors : list of dict
        Instantaneous motions with the driver held: rates, the largest one 1.
    left_null_vectors : list of dict
        Constraint rows of joints (and the driver) that become dependent, the largest factor 1.
    branches : list of Branch
    motions : list of Motion
        All finite motions for a' = 1 (a'' = 0), and for a' = 0 with a'' = 1 and -1.
    decided : bool
        False if derivatives of second order do not determine the branches; these were then found at small distances.
    endless : tuple of str
        Driver motions (``"a'"``, ``"a'' > 0"``, ``"a'' < 0"``) with infinitely many solutions: more degrees of freedom
        meet here.
    """

    a: float
    kind: str
    isolated: bool
    self_motion: bool
    lost: int
    branch_point: bool
    coordinates: dict[str, float]
    null_vectors: list[dict[str, float]]
    left_null_vectors: list[dict[str, float]]
    branches: list[Branch]
    motions: list[Motion]
    decided: bool = True
    endless: tuple[str, ...] = ()
    at: float = 0.0  # arc length from the start [1]
    outline: list[tuple[str, str, np.ndarray]] = field(default_factory=list, repr=False, compare=False)

    def count(self, rate: float = 0.0, acceleration: float = 0.0) -> float:
        """Number of finite motions if the driver moves with a' = ``rate`` (not 0), or from rest with a''.

        Infinite if infinitely many directions lead away.
        """
        if ("a'" if rate else "a'' > 0" if acceleration > 0.0 else "a'' < 0") in self.endless:
            return math.inf
        if rate:
            return sum(m.rate != 0.0 for m in self.motions)
        return sum(m.rate == 0.0 and m.acceleration * acceleration > 0.0 for m in self.motions)

    def lines(self, unit: str = "", order: list[str] | None = None) -> Iterator[tuple[str, str]]:
        """Return labels and texts of the summary."""
        counts = [self.count(rate=1.0), self.count(acceleration=1.0), self.count(acceleration=-1.0)]
        told = ", ".join(f"{n:g} for {w}" for n, w in zip(counts, ("a' = 1", "a'' = 1", "a'' = -1"), strict=True))
        more = "; self-motion while the driver is at rest" if self.self_motion and self.kind != SELF_MOTION else ""
        more += "; no branch leads away from here" if self.isolated else ""
        yield f"a = {coordinate_text(self.a, unit)}", f"{self.kind}{more}; motions: {told}"
        for n in self.null_vectors:
            yield "", f"free while the driver is at rest: {vector_text(n)}"
        for u in self.left_null_vectors:
            yield "", f"dependent rows: {vector_text(u)}"
        for k, b in enumerate(self.branches):
            side = {1: ", above a only", -1: ", below a only", 0: ""}[b.side]
            yield "", f"branch {k}, {b.what}{side}: {vector_text(b.tangent)}"
        for m in self.motions:
            if m.rate == 0.0 and any(abs(v) > 0.0 for v in m.velocities.values()):
                yield "", f"branch {m.branch}, a' = 0, a'' = {m.acceleration:g}: velocities {vector_text(m.velocities)}"
        if self.endless:
            yield "", "infinitely many directions lead away: more freedoms meet here"
        elif not self.decided:
            yield (
                "",
                "second derivatives do not determine the branches: those above were found at small distances",
            )

    def as_dict(self) -> dict[str, Any]:
        """Plain data."""
        own = ("a", "kind", "isolated", "self_motion", "lost", "branch_point", "coordinates", "decided", "endless")
        return {k: getattr(self, k) for k in own} | {
            "null_vectors": self.null_vectors,
            "left_null_vectors": self.left_null_vectors,
            "branches": [{k: getattr(b, k) for k in ("what", "order", "side", "tangent")} for b in self.branches],
            "motions": [m._asdict() for m in self.motions],
        }


@dataclass(frozen=True, repr=False)
class Singularities:
    """The driven motion over a range of the driver's coordinate, and the singular positions on it.

    Attributes
    ----------
    model, driver, coordinate, unit : str
    range : tuple
    points : list of Singularity
        In the order in which the curve meets them.
    s : ndarray (n,)
        Arc length along the curve from the start [1], lengths divided by the mechanism's.
    a : ndarray (n,)
        The driver's coordinate along the curve; not monotonic if the driver turns back.
    values : dict
        Every coordinate along the curve, (n,) [rad] or [m].
    distance : ndarray (n,)
        Smallest singular value of the driven Jacobian, without dimension: zero at the singular positions.
    ends : tuple
        Why the curve ends, backward and forward.
    """

    model: str
    driver: str
    coordinate: str
    unit: str
    range: tuple[float, float]
    points: list[Singularity]
    s: np.ndarray
    a: np.ndarray
    values: dict[str, np.ndarray]
    distance: np.ndarray
    ends: tuple[str, str] = ("", "")
    planar: bool = True

    def __len__(self) -> int:
        return len(self.points)

    def __getitem__(self, k: int) -> Singularity:
        return self.points[k]

    def __iter__(self) -> Iterator[Singularity]:
        return iter(self.points)

    @property
    def reached(self) -> tuple[float, float]:
        """Least and largest value of the driver's coordinate on the curve."""
        return float(self.a.min()), float(self.a.max())

    def lines(self) -> list[tuple[str, str]]:
        """Return labels and texts of the summary."""
        low, high = (coordinate_text(x, self.unit) for x in self.reached)
        out = [
            ("driver", f"{self.driver!r} of {self.coordinate}, of {self.model!r}"),
            ("curve", f"from {low} to {high}, {len(self.s)} positions; {self._ends()}"),
            ("singular positions", str(len(self.points)) if self.points else "none"),
        ]
        for p in self.points:
            out += p.lines(self.unit)
        return out

    def _ends(self) -> str:
        if "closed" in self.ends:
            return "closed: it comes back to where it starts"
        return "; ".join(dict.fromkeys(e for e in self.ends if e))

    def table(self) -> str:
        """Return one line for each singular position."""
        head = ("a", "kind", "lost", "a' = 1", "a'' = 1", "a'' = -1", "branches")
        rows = [
            (
                coordinate_text(p.a, self.unit),
                p.kind,
                str(p.lost),
                *(f"{p.count(**k):g}" for k in ({"rate": 1}, {"acceleration": 1}, {"acceleration": -1})),
                ", ".join(b.what for b in p.branches) or "none",
            )
            for p in self.points
        ]
        width = [max(len(r[k]) for r in [head, *rows]) for k in range(len(head))]
        return "\n".join("  ".join(x.ljust(w) for x, w in zip(r, width, strict=True)).rstrip() for r in [head, *rows])

    def as_dict(self) -> dict[str, Any]:
        """Plain data."""
        own = ("model", "driver", "coordinate", "unit", "range", "ends", "reached")
        return {k: getattr(self, k) for k in own} | {
            "points": [p.as_dict() for p in self.points],
            "curve": {"s": self.s.tolist(), "a": self.a.tolist(), "distance": self.distance.tolist()},
        }

    def plot(self, path: str | os.PathLike | None = None, coordinate: str | None = None) -> Any:
        """The singular positions as small pictures, a coordinate along the curve, and the distance from singular.

        Parameters
        ----------
        path : path, optional
            Write a PNG, SVG or PDF file, by the suffix, instead of returning the figure.
        coordinate : str, optional
            Coordinate drawn over the driver's; by default the one that moves most.
        """
        from ..view.singularity_plots import singularity_plot

        return singularity_plot(self, path, coordinate)

    def __repr__(self) -> str:
        width = max(len(k) for k, _ in self.lines())
        return "\n".join(f"{k:<{width}}  {v}" for k, v in self.lines())


def coordinate_text(x: float, unit: str) -> str:
    """Return a value with its unit; angles in degrees too."""
    x = 0.0 if abs(x) < 1e-12 else x
    return f"{x:.6g} rad ({math.degrees(x):.6g} deg)" if unit == "rad" else f"{x:.6g} {unit}"


def vector_text(numbers: Mapping[str, float]) -> str:
    """Return the largest components, by name."""
    largest = max((abs(x) for x in numbers.values()), default=0.0)
    shown = {k: x for k, x in numbers.items() if abs(x) > NEGLIGIBLE_PART * max(largest, 1e-300)}
    names = [k for k in shown if "." in k]
    if not names:
        return "none"
    kept = sorted(names, key=lambda k: -round(abs(shown[k]), 9))[:MAX_COMPONENTS]
    text = ", ".join(f"{k} {shown[k]:.6g}" for k in names if k in kept)
    return text + (f" and {len(names) - MAX_COMPONENTS} more" if len(names) > MAX_COMPONENTS else "")
