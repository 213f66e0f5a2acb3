"""Results of inverse dynamics: efforts of drives, reactions, and their determined components."""

from __future__ import annotations

import os
from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from ..errors import ModelError
from ..math.vec import cross, sub
from ..model.joint import Coupling, Joint
from ..model.model import listing, suggest
from .result_tables import write_table
from .wording import number_text, range_text, with_unit

if TYPE_CHECKING:
    from .result import Result

STRESS_TOLERANCE = 1e-6  # relative to the largest self-stress: smaller components are not affected
SINGULAR_TOLERANCE = 1e-4  # relative to the usual singular values: smaller ones belong to a singular position
SPATIAL, PLANE = ("fx", "fy", "fz", "tx", "ty", "tz"), ("fx", "fy", "torque")
COMPONENT_INDEX = {"fx": 0, "fy": 1, "fz": 2, "tx": 3, "ty": 4, "tz": 5, "torque": 5}


@dataclass(frozen=True)
class Drive:
    """The drive of a coordinate.

    Attributes
    ----------
    name, coordinate : str
        The driver and its coordinate.
    unit : str
        Of the effort, ``"N"`` or ``"N*m"``.
    effort : ndarray (n,)
        Force or torque along the coordinate.
    rate : ndarray (n,)
        Rate of the coordinate [m/s] or [rad/s].
    """

    name: str
    coordinate: str
    unit: str
    effort: np.ndarray
    rate: np.ndarray

    @property
    def power(self) -> np.ndarray:
        """Power supplied [W], (n,)."""
        return self.effort * self.rate


@dataclass(frozen=True)
class Wrench:
    """A reaction over time, without undetermined components.

    Attributes
    ----------
    force, torque : ndarray (n, 3) [N], [N m]
        nan if redundancy leaves a component undetermined.
    undetermined : ndarray (n, 6) of bool
        Components of force, then of torque.
    one : ndarray (n, 6)
        One of the possible reactions: the one with minimum-norm multipliers. It has no physical justification.
    """

    force: np.ndarray
    torque: np.ndarray
    undetermined: np.ndarray
    one: np.ndarray


@dataclass(frozen=True, repr=False)
class InverseDynamics:
    """Efforts and reactions of a motion; ``inverse["crank"]`` and the like read its `Result`.

    Attributes
    ----------
    result : Result
        The motion. If redundancy leaves its reactions undetermined, they are one possible choice; this object marks
        them instead.
    drives : dict
        Driver, or name in ``motion`` -> `Drive`.
    determinacy : Determinacy
        Self-stresses at every time.
    """

    result: Result
    drives: dict[str, Drive]
    determinacy: Any = field(repr=False)

    @property
    def t(self) -> np.ndarray:
        """Times [s], (n,)."""
        return self.result.t

    @property
    def efforts(self) -> dict[str, np.ndarray]:
        """Effort of every drive [N] or [N m], (n,); nan if undetermined (in singular positions)."""
        free = self.determinacy.efforts
        return {k: np.where(free.get(d.name, False), np.nan, d.effort) for k, d in self.drives.items()}

    def __getitem__(self, name: str) -> Any:
        """A part or a curve of the motion."""
        return self.result[name]

    def reaction(self, joint: str, *, axes: str = "world") -> Wrench:
        """Force and torque of a joint on its ``body_j``, about its point there.

        Parameters
        ----------
        joint : str
        axes : ``"world"``, ``"joint"`` or the name of one of its two bodies
            Axes of the components. Which components are determined depends on them.

        Raises
        ------
        ModelError
            If there is no such joint.
        """
        self._joint(joint)
        view = self.result[joint]
        one = np.hstack(view.reaction(axes=axes))
        stress = self._stress(joint)
        if axes != "world" and stress is not None:
            R = view.rotation(axes)
            stress = np.concatenate([np.einsum("nji,njk->nik", R, stress[:, i : i + 3]) for i in (0, 3)], axis=1)
        return self._unique_wrench(one, stress)

    def together(self, *joints: str, on: str) -> Wrench:
        """Return the sum of joint reactions on a body: force, and torque about its mass centre, world axes.

        Sums may be determined although their terms are not: two hinges of a door carry its weight together, for any
        distribution.

        Raises
        ------
        ModelError
            If a joint does not exist or is not on the body.
        """
        result, x = self.result, self.result.values
        centre = result.records.body(x.structure.place[result.model.body(on, result.model[joints[0]]).name])[0]
        total, stresses = np.zeros((len(self.t), 6)), None
        for name in joints:
            e = self._joint(name)
            ends = [result.model.carrier(n, e) for n in (e.body_i, e.body_j)]
            if on not in ends:
                raise ModelError(f"{e.title} joins {ends[0]!r} and {ends[1]!r}, it is not on {on!r}")
            sign = 1.0 if on == ends[1] else -1.0
            arm = sub(result.records.frame(x.structure.frame_at[name, "M", ""])[0], centre)
            r = np.stack([np.broadcast_to(c, len(self.t)) for c in arm], axis=1)
            force, torque = result[name].reaction()
            total += sign * np.hstack([force, torque + np.stack(cross(tuple(r.T), tuple(force.T)), axis=1)])
            if (stress := self._stress(name)) is not None:
                moved = stress.copy()
                moved[:, 3:] += np.cross(r[:, :, None] / x.length, stress[:, :3], axis=1)
                stresses = sign * moved + (0.0 if stresses is None else stresses)
        return self._unique_wrench(total, stresses)

    def _joint(self, name: str) -> Joint:
        model = self.result.model
        known = [j.name for j in model.joints]
        if name not in known:
            raise ModelError(f"{model.name!r} has no joint {name!r}{suggest(name, known)}; {listing(known)}")
        return model[name]

    def _stress(self, joint: str) -> np.ndarray | None:
        return self.determinacy.wrenches.get(joint)

    def _unique_wrench(self, one: np.ndarray, stress: np.ndarray | None) -> Wrench:
        free = np.zeros(one.shape, bool) if stress is None else np.abs(stress).max(axis=2) > STRESS_TOLERANCE
        if self.result.planar:
            free[:, 2:5] = False
        shown = np.where(free, np.nan, one)
        return Wrench(shown[:, :3], shown[:, 3:], free, one)

    def channels(self) -> dict[str, tuple[str, np.ndarray]]:
        """Efforts and reaction components by name: ``"A.angle"``, ``"B.fx"`` -> (unit, values); nan: undetermined."""
        out = {k: (self.drives[k].unit, x) for k, x in self.efforts.items()}
        for e in self.result.model.joints:
            w = self.reaction(e.name)
            both = np.hstack([w.force, w.torque])
            for what in PLANE if self.result.planar else SPATIAL:
                out[f"{e.name}.{what}"] = ("N" if what[0] == "f" else "N*m", both[:, COMPONENT_INDEX[what]])
        return out

    @property
    def undetermined(self) -> dict[str, np.ndarray]:
        """Return undetermined components: ``"upper.fz"`` -> times, (n,) of bool; of couplings too."""
        out = {k: np.isnan(x) for k, (_, x) in self.channels().items() if np.isnan(x).any()}
        couplings = {c.name for c in self.result.model.couplings if isinstance(c, Coupling)}
        return out | {k: free for k, free in self.determinacy.efforts.items() if k in couplings}

    def lines(self) -> list[tuple[str, str]]:
        """Label and text of what a reader wants to see first."""
        n = len(self.t)
        out = [("mechanism", f"{self.result.model.name}, {n} times from {self.t[0]:g} s to {self.t[-1]:g} s")]
        for name, d in self.drives.items():
            x, unit = self.efforts[name], d.unit.replace("*", " ")
            if np.isnan(x).all():
                out.append(("drive", f"{name}: undetermined"))
                continue
            size = self._size("t" if d.unit == "N*m" else "f")
            rms = number_text(float(np.sqrt(np.nanmean(x**2))), size, 4)
            power = range_text(d.power, size=size * np.abs(d.rate).max(initial=0.0))
            out.append(("drive", f"{name}: {range_text(x, size=size)} {unit}, rms {rms} {unit}, power {power} W"))
        for e in self.result.model.joints:
            out.append(("reaction", self._line(e.name)))
        if (near := self.near_singular).any():
            at = ", ".join(f"{t:g}" for t in self.t[near][:4])
            out.append(
                (
                    "warning",
                    (
                        f"singular position at or near t = {at} s: forces grow without bound there, or are rounding "
                        "errors"
                    ),
                )
            )
        return out

    @property
    def near_singular(self) -> np.ndarray:
        """Times at which constraints become (almost) dependent, unlike at other times; (n,) of bool."""
        d = self.determinacy
        usual = np.median(d.least) if len(d.least) else 1.0
        fewest = d.count.min(initial=np.iinfo(np.int64).max)
        return (d.count > fewest) | (d.least < SINGULAR_TOLERANCE * usual)

    def _size(self, kind: str) -> float:
        """The largest force (``"f"``) or torque (``"t"``) of any joint or drive, a torque divided by the length."""
        (force, torque), length = self._sizes, self.result.values.length
        return max(force, torque / length) if kind == "f" else max(torque, force * length)

    @cached_property
    def _sizes(self) -> tuple[float, float]:
        parts = [self.reaction(j.name).one for j in self.result.model.joints]
        out = [float(max((np.abs(w[:, k : k + 3]).max(initial=0.0) for w in parts), default=0.0)) for k in (0, 3)]
        for name, x in self.efforts.items():
            turning = self.drives[name].unit == "N*m"
            out[turning] = max(out[turning], float(np.nanmax(np.abs(x), initial=0.0)))
        return out[0], out[1]

    def _line(self, joint: str) -> str:
        w = self.reaction(joint)
        both, free = np.hstack([w.force, w.torque]), w.undetermined
        names = PLANE if self.result.planar else SPATIAL
        known = [(x, both[:, COMPONENT_INDEX[x]]) for x in names if not free[:, COMPONENT_INDEX[x]].all()]
        text = ", ".join(
            f"{x} {range_text(v, size=self._size(x[0]))} {'N' if x[0] == 'f' else 'N m'}" for x, v in known
        )
        never = [x for x in names if free[:, COMPONENT_INDEX[x]].all()]
        at_times = [x for x in names if free[:, COMPONENT_INDEX[x]].any() and x not in never]
        said = [text] if text else []
        said += [f"undetermined: {', '.join(never)}"] if never else []
        said += [f"undetermined at some times: {', '.join(at_times)}"] if at_times else []
        return f"{joint}: {'; '.join(said)}"

    def as_dict(self) -> dict[str, Any]:
        """Plain data; what is undetermined is None."""
        values = {k: (unit, [None if x != x else x for x in v.tolist()]) for k, (unit, v) in self.channels().items()}
        return {
            "name": self.result.model.name,
            "t": self.t.tolist(),
            "drives": {k: {"coordinate": d.coordinate, "unit": d.unit, "effort": values[k][1],
                           "power": d.power.tolist()} for k, d in self.drives.items()},
            "reactions": {k: {"unit": u, "values": x} for k, (u, x) in values.items() if k not in self.drives},
            "undetermined": {k: x.tolist() for k, x in self.undetermined.items()},
            "redundant": self.determinacy.count.tolist(),
        }  # fmt: skip

    def to_csv(self, path: str | os.PathLike) -> None:
        """Times, efforts and reactions as a table; the header holds names and units, undetermined cells are empty."""
        curves = self.channels()
        header = ["time [s]", *(with_unit(k, unit) for k, (unit, _) in curves.items())]
        write_table(path, header, [self.t, *(v for _, v in curves.values())], missing="")

    def plot(self, path: str | os.PathLike | None = None) -> Any:
        """Efforts and reactions over time; returns the Matplotlib figure, or writes it to ``path``."""
        from ..view.force_plots import plot_efforts

        return plot_efforts(self, path=path)

    def __repr__(self) -> str:
        return "\n".join(f"{k:<9}  {v}" for k, v in self.lines())
