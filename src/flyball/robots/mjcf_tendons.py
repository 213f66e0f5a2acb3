"""Tendons of MJCF: fixed ones are weighted sums of coordinates, spatial ones are paths over sites.

Springs, dampers, stops, friction, actuators and equalities of tendons become elements along these sums or paths.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from ..forces.clutch import Brake
from ..forces.coordinate_spring import CoordinateSpring
from ..forces.limit import Limit
from ..forces.motor import Actuator
from ..forces.path_spring import PathSpring
from ..forces.rope import Rope
from ..forces.rotor_inertia import RotorInertia
from ..joints.coupler import Coupler
from ..model.body import Driver
from ..model.element import Element
from .robot_file import ROUNDING, stops

if TYPE_CHECKING:
    from .mjcf import Reader

JOINT, PULLEY, SITE, SPHERE, CYLINDER = range(1, 6)
"""What a tendon runs over (mjtWrap)."""
NO_PATH = {
    PULLEY: "pulleys divide it, and the parts of a path have no ratios here",
    SPHERE: "it wraps around a geom, and paths are straight from point to point here",
    CYLINDER: "it wraps around a geom, and paths are straight from point to point here",
}


@dataclass(frozen=True)
class LinearSum:
    """A weighted sum of coordinates: name of coordinate -> weight."""

    weights: dict[str, float]

    @property
    def fields(self) -> dict[str, Any]:
        """The fields of an element along it."""
        return {"coordinate": tuple(self.weights), "weights": tuple(self.weights.values())}


@dataclass(frozen=True)
class Path:
    """A path over frames."""

    frames: tuple[str, ...]


class Tendons:
    """The tendons of one model; those that cannot be read are listed with the reason."""

    def __init__(self, reader: Reader) -> None:
        self.reader = reader
        M = reader.M
        self.names = {k: reader.given_name("TENDON", k) or f"tendon{k}" for k in range(M.ntendon)}
        self.read: dict[int, LinearSum | Path] = {}
        self.out_of_range: list[str] = []
        for k in self.names:
            self._read(k)

    def _read(self, k: int) -> None:
        M = self.reader.M
        over = range(M.tendon_adr[k], M.tendon_adr[k] + M.tendon_num[k])
        kinds = [int(M.wrap_type[i]) for i in over]
        if kinds[0] == JOINT:
            names = [self.reader.coordinates[int(M.wrap_objid[i])] for i in over]
            weights = dict(zip(names, M.wrap_prm[over].tolist(), strict=True))
            self.read[k] = LinearSum({name: w for name, w in weights.items() if w})
            if not any(weights.values()):
                self._leave_out(k, "its coefficients are 0")
        elif reason := next((NO_PATH[kind] for kind in kinds if kind in NO_PATH), ""):
            self._leave_out(k, reason)
        elif len({self.reader.bodies[M.site_bodyid[M.wrap_objid[i]]] for i in over}) == 1:
            self._leave_out(k, "all its sites are on one body")
        else:
            self.read[k] = Path(tuple(self.reader.sites[int(M.wrap_objid[i])] for i in over))

    def _leave_out(self, k: int, reason: str) -> None:
        self.read.pop(k, None)
        self.reader.unused.append(f"tendon {self.names[k]} ({reason})")

    def elements(self) -> Iterator[Element]:
        """Springs, dampers, stops and friction of tendons."""
        M = self.reader.M
        self._check_ranges()
        for k, tendon in self.read.items():
            name = self.names[k]
            for what in ("tendon_stiffnesspoly", "tendon_dampingpoly", "tendon_springyield"):
                if np.any(getattr(M, what, np.zeros((k + 1, 1)))[k]):  # of MuJoCo 3.5 and later
                    self.reader.unused.append(f"{what} of tendon {name} (springs and dampers are linear)")
            yield from self._armature(k, tendon)
            yield from self._along_sum(k, tendon) if isinstance(tendon, LinearSum) else self._along_path(k, tendon)

    def _check_ranges(self) -> None:
        """Note tendons that begin outside their ranges, where a motion cannot begin."""
        mujoco, M = self.reader.mujoco, self.reader.M
        D = mujoco.MjData(M)
        D.qpos[:] = self.reader.start
        for compute in (mujoco.mj_kinematics, mujoco.mj_comPos, mujoco.mj_tendon):
            compute(M, D)
        for k, tendon in self.read.items():
            lower, upper = M.tendon_range[k].tolist()
            lower = lower if isinstance(tendon, LinearSum) else 0.0  # a path has no stop at a least length
            value, margin = float(D.ten_length[k]), ROUNDING * (upper - lower)
            if M.tendon_limited[k] and not lower - margin <= value <= upper + margin:
                self.out_of_range.append(
                    f"tendon {self.names[k]} begins at {value:.6g}, outside {lower:g} to {upper:g}"
                )

    def _armature(self, k: int, tendon: LinearSum | Path) -> Iterator[Element]:
        """Armature along one coordinate, of which the tendon's length is a multiple."""
        inertia, name = float(getattr(self.reader.M, "tendon_armature", np.zeros(k + 1))[k]), self.names[k]
        if not inertia:
            return
        if isinstance(tendon, LinearSum) and len(tendon.weights) == 1:
            ((along, ratio),) = tendon.weights.items()
            yield RotorInertia(self.reader.free_name(f"{name}_rotor"), along, inertia=inertia, ratio=ratio)
        else:
            self.reader.unused.append(f"armature of tendon {name} (inertia is read along one coordinate)")

    def _spring(self, k: int) -> tuple[float, float, float, float]:
        """Stiffness, damping, and least and greatest length without force of the spring."""
        M = self.reader.M
        lower, upper = M.tendon_lengthspring[k].tolist()
        return float(M.tendon_stiffness[k]), float(M.tendon_damping[k]), lower, upper

    def _along_sum(self, k: int, tendon: LinearSum) -> Iterator[Element]:
        M, free_name, name = self.reader.M, self.reader.free_name, self.names[k]
        stiffness, damping, lower, upper = self._spring(k)
        if M.tendon_limited[k]:
            least, greatest = M.tendon_range[k].tolist()
            yield from stops(lambda: free_name(f"{name}_limit"), least, greatest, **tendon.fields)
        if stiffness and lower < upper:
            band: dict[str, Any] = {"lower": lower, "upper": upper, "stiffness": stiffness}
            yield Limit(free_name(f"{name}_spring"), **tendon.fields, **band)
            stiffness = 0.0
        if stiffness or damping:
            given: dict[str, Any] = {"stiffness": stiffness, "rest": lower} if stiffness else {}
            called = f"{name}_spring" if stiffness else f"{name}_damping"
            yield CoordinateSpring(free_name(called), **tendon.fields, damping=damping, **given)
        if M.tendon_frictionloss[k]:
            yield Brake(free_name(f"{name}_friction"), **tendon.fields, capacity=float(M.tendon_frictionloss[k]))

    def _along_path(self, k: int, tendon: Path) -> Iterator[Element]:
        M, free_name, name = self.reader.M, self.reader.free_name, self.names[k]
        stiffness, damping, lower, upper = self._spring(k)
        if M.tendon_limited[k]:
            least, greatest = M.tendon_range[k].tolist()
            yield Rope(free_name(f"{name}_limit"), tendon.frames, length=greatest)
            if least > 0.0:
                self.reader.unused.append(f"lower limit of tendon {name} (a path has no stop at a least length)")
        if stiffness or damping:
            law = None
            if stiffness and lower < upper:
                law = f"{stiffness!r}*(max(length - {upper!r}, 0) - max({lower!r} - length, 0))"
            given: dict[str, Any] = {"stiffness": stiffness, "length": lower} if stiffness and law is None else {}
            yield PathSpring(free_name(f"{name}_spring"), tendon.frames, damping=damping, force=law, **given)
        if M.tendon_frictionloss[k]:
            self.reader.unused.append(f"friction of tendon {name} (a path has no friction along its length)")

    def actuator(self, name: str, k: int, law: Callable[..., str]) -> Element | None:
        """An actuator of a tendon; None if the tendon was not read.

        ``law`` returns its force, by default as a law of ``value``; other arguments are that name, and a factor.
        """
        tendon = self.read.get(k)
        if isinstance(tendon, LinearSum):
            return Actuator(name, **tendon.fields, force=law())
        if isinstance(tendon, Path):  # MuJoCo's force lengthens a tendon, a tension shortens it
            return PathSpring(name, tendon.frames, force=law("length", -1.0))
        return None

    def equality(self, name: str, first: int, second: int, offset: float, slope: float) -> Element | str:
        """Relation L - L0 = offset + slope (L' - L0') of fixed tendons, or of one (``second`` is -1); or why none."""
        M, pair = self.reader.M, [self.read.get(k) for k in (first, second) if k >= 0]
        weights: dict[str, float] = {}
        for tendon, factor in zip(pair, (1.0, -slope), strict=False):
            if not isinstance(tendon, LinearSum):
                return "read of fixed tendons only"
            for coordinate, w in tendon.weights.items():
                weights[coordinate] = weights.get(coordinate, 0.0) + factor * w
        value = (
            float(M.tendon_length0[first]) + offset - (slope * float(M.tendon_length0[second]) if second >= 0 else 0)
        )
        return linear_relation(name, weights, value)


def linear_relation(name: str, weights: dict[str, float], value: float) -> Element | str:
    """The element that keeps a weighted sum of coordinates at a value; or why there is none."""
    kept = {coordinate: w for coordinate, w in weights.items() if w}
    if len(kept) > 1:
        return Coupler(name, tuple(kept), weights=tuple(kept.values()), value=value)
    return next((Driver(name, coordinate, value / w) for coordinate, w in kept.items()), "its coefficients cancel")
