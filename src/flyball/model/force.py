"""Base classes of forces: formulas, parameters, laws, frames; one-sided elements and their switches.

A `Switch` is a row with modes: a constraint that is active at times (stops, friction, locks). `Unilateral` elements
have a quantity that is free on one side, and constrained or pushed on the other.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable
from dataclasses import KW_ONLY, dataclass
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from ..constraints.blocks import DISTANCE, Row
from ..constraints.registry import no_inputs
from ..constraints.switches.switch_kind import SwitchKind
from ..errors import ModelError
from .element import Element, Law, Numbers, Point, PointPair, Points, nonnegative, positive
from .geometry import vector
from .joint import WEIGHT_UNITS, WorldFrame, check_weights

if TYPE_CHECKING:
    from .model import Model


@dataclass(frozen=True)
class Force(Element):
    """A force element.

    One family acts between a frame F and a frame M: ``inputs(par, F, M)`` (what its laws may depend on besides time)
    and ``wrench(par, F, M, laws, values)`` with the values of the inputs: force and torque on M at M's origin, world
    axes; the reverse acts on F's body at the same point. The other acts along a measured quantity x: ``effort(par, x,
    rate, laws, load)``, positive towards larger x (`CoordinateForce`). Either may have an ``energy``. Formulas are
    functions of numbers in the subclass's file, in the package with the decorator `compiler.formulas.formula`; ``kind``
    numbers them. A force between frames with states has ``wrench_and_rates(par, F, M, states, data, surfaces)`` in
    place of ``wrench``: force and torque on M, and the rates of its states; par[14] and par[15] are the places of its
    road in ``surfaces`` and of its own numbers in ``data``.
    """

    category: ClassVar[str] = "forces"
    kind: ClassVar[int]
    inputs: ClassVar[Callable]
    wrench: ClassVar[Callable]
    energy: ClassVar[Callable | None] = None
    outputs: ClassVar[dict[str, str]] = {}
    symbol: ClassVar[str] = ""
    single: ClassVar[str] = ""  # "rope" or "friction": impulse time stepping treats it as a single row, not as a force
    reversing: ClassVar[
        dict[str, str]
    ] = {}  # field that names a coordinate -> field that changes sign with its direction
    figures: ClassVar[Callable | None] = None  # values of ``outputs`` of a force between frames
    takes_splines: ClassVar[bool] = False  # whether its wrench has the last argument ``data``; see `curves`
    sampled: ClassVar[bool] = False  # its states have rates, as those of a continuous controller
    fails: ClassVar[str] = "Its numbers are too large"  # when its formulas return no number, and the remedy

    def failure(self, par: Any, F: Any, M: Any, surfaces: Any) -> str:
        """Return why its formulas return no number at these frames, and the remedy."""
        return self.fails

    def ends(self) -> dict[str, str]:
        """Return role of each of its frames -> its body or frame."""
        raise NotImplementedError

    def placed(self, n: SimpleNamespace, planar: bool) -> dict[str, WorldFrame] | None:
        """Return its frames in the world in the reference configuration, if it is given by points; else None."""
        return None

    def parameters(self, n: SimpleNamespace, separation: float) -> tuple[float, ...]:
        """Return up to sixteen parameters of the formulas."""
        return ()

    def wrench_between(self, par: Any, F: Any, M: Any, laws: Any, values: Any, data: Any) -> Any:
        """Return the wrench of a force between frames; ``data`` is given to formulas that take it."""
        return self.wrench(par, F, M, laws, values, *((data,) if self.takes_splines else ()))

    def curves(self, n: SimpleNamespace) -> tuple[list[float], ...]:
        """Return splines that its wrench has as a last argument, ``data``; the first parameter is then their place."""
        return ()

    def laws(self) -> tuple[Law | None, ...]:
        """Return up to three expressions of the formulas."""
        return ()

    def states(self) -> tuple[str, ...]:
        """Return the names of its two states; none if it has none."""
        return ()

    def data(self, n: SimpleNamespace) -> tuple[float, ...]:
        """Return numbers of the formula `wrench_and_rates` besides the parameters."""
        return ()

    def conservative(self) -> bool:
        """Return whether it only exchanges stored energy: no damping, no law."""
        return False

    def needs(self) -> str:
        """Return another element whose numbers its own depend on, as ``n.of``; empty if none."""
        return ""

    def on_points(self) -> bool:
        """Return whether it depends only on the origins of its frames, and makes no torque about them.

        It may then act on point masses; a user-defined formula is checked (`tables.point_formulas`).
        """
        return False


@dataclass(frozen=True)
class TwoPointForce(Force):
    """A force along the line between two points."""

    body_i: str
    body_j: str
    _: KW_ONLY
    at: PointPair | None = None
    inputs: ClassVar[Callable] = staticmethod(no_inputs)

    def ends(self) -> dict[str, str]:
        """F on ``body_i``, M on ``body_j``."""
        return {"F": self.body_i, "M": self.body_j}

    def placed(self, n: SimpleNamespace, planar: bool) -> dict[str, WorldFrame] | None:
        """The two points."""
        if n.at is None:
            return None
        a, b = (vector(p, planar, f"'at' of {self.title}") for p in n.at)
        return {"F": (a, np.eye(3)), "M": (b, np.eye(3))}

    def on_points(self) -> bool:
        """Return True: the force depends on the two points only."""
        return True


@dataclass(frozen=True)
class TwoFrameForce(Force):
    """A force and a torque between two frames that coincide in the reference configuration."""

    body_i: str
    body_j: str
    _: KW_ONLY
    at: Point | None = None
    on_bodies: ClassVar[bool] = False  # whether it may act at the origins of two bodies
    inputs: ClassVar[Callable] = staticmethod(no_inputs)

    def ends(self) -> dict[str, str]:
        """F on ``body_i``, M on ``body_j``."""
        return {"F": self.body_i, "M": self.body_j}

    def placed(self, n: SimpleNamespace, planar: bool) -> dict[str, WorldFrame] | None:
        """Both frames at the point, with the world's axes."""
        if n.at is None:
            return None
        p = vector(n.at, planar, f"'at' of {self.title}")
        return {"F": (p, np.eye(3)), "M": (p, np.eye(3))}


@dataclass(frozen=True)
class BodyForce(Force):
    """An external force or torque on one body."""

    body: str
    inputs: ClassVar[Callable] = staticmethod(no_inputs)

    def ends(self) -> dict[str, str]:
        """M on the body."""
        return {"M": self.body}


@dataclass(frozen=True)
class CoordinateForce(Force):
    """A force along a measured quantity: a joint's coordinate, or a sum of distances."""

    effort: ClassVar[Callable]
    outputs: ClassVar[dict[str, str]] = {
        "value": "",
        "rate": "/s",
        "force": "effort",
    }  # inputs' names, value and rate first
    dimensions: ClassVar[dict[str, tuple[str, str]]] = {  # dimensions of fields for a displacement and for an angle
        "stiffness": ("N/m", "N*m/rad"),
        "damping": ("N*s/m", "N*m*s/rad"),
        "viscous": ("N*s/m", "N*m*s/rad"),
        "rest": ("m", "rad"),
        "force": ("N", "N*m"),
    }
    not_negative: ClassVar[tuple[str, ...]] = ()  # laws that must not be negative
    words: ClassVar[dict[str, str]] = {}  # law -> its name in messages, if that is another
    sign: ClassVar[float] = 1.0  # sign of the output after value and rate, relative to the effort
    odd: ClassVar[tuple[str, ...] | None] = None  # fields that change sign with its direction; None: it has one
    adds_inertia: ClassVar[bool] = False  # whether it adds inertia to the mass matrix along a joint's coordinate

    def ends(self) -> dict[str, str]:
        """No frames of its own."""
        return {}

    def coordinate_text(self) -> str:
        """Return the coordinate along which it acts: ``"A.angle"``."""
        return ""

    def along(self) -> tuple[str, ...]:
        """The coordinates of the sum along which it acts, with weights `switch_weights`; empty if it has a path."""
        return (self.coordinate_text(),) if self.coordinate_text() else ()

    def outward(self, n: SimpleNamespace) -> float:
        """Return 1, or -1 if results reverse its quantity, rate and effort relative to the formulas."""
        return 1.0

    def examine(self, model: Model) -> None:
        """Refuse coordinates along which it cannot act."""

    def reversed_factors(self, signs: tuple[float, ...]) -> dict[str, Any]:
        """Return the factors of its fields that change sign with its direction."""
        if self.odd is None or len(set(signs)) > 1:
            return super().reversed_factors(signs)
        return dict.fromkeys(self.odd, signs[0])

    def added_inertia(self, n: SimpleNamespace) -> Any:
        """Return the inertia that it adds to the mass matrix along its coordinate [kg] or [kg m^2]."""
        return 0.0

    def transmitted(self) -> str:
        """Return the curve of the element that carries its effort, if it belongs to it; empty if it acts itself."""
        return ""

    def measured_with(self) -> str:
        """Return the element that measures its quantity, if it belongs to it; empty if it has terms of its own."""
        return ""

    def path(self) -> tuple[tuple[str, str, Row], ...]:
        """Return the terms (role of F, role of M, formula) of the sum along which it acts, if it has no coordinates."""
        return ()

    def on_points(self) -> bool:
        """Return whether its terms depend on points only."""
        return all(set("FM") <= set(formula.of_kind.points) for _, _, formula in self.path())


class WeightedSumForce:
    """Base class of elements along one coordinate (``coordinate``), or along a sum of several with ``weights``."""

    title: str
    coordinate: str | tuple[str, ...]
    weights: Numbers | None

    kinds: ClassVar[dict[str, tuple[str, ...]]] = {"weights": WEIGHT_UNITS}

    def coordinate_text(self) -> str:
        """Return the coordinate as given; empty for a sum."""
        return self.coordinate if isinstance(self.coordinate, str) else ""

    def along(self) -> tuple[str, ...]:
        """Return the coordinates."""
        return (self.coordinate,) if isinstance(self.coordinate, str) else self.coordinate

    def is_weighted(self) -> bool:
        """Return whether it acts along a weighted sum."""
        return self.weights is not None

    def switch_weights(self, n: SimpleNamespace, label: str) -> tuple[float, ...]:
        """Return the weights as given; none for one coordinate."""
        return n.weights or ()

    def reversed_factors(self, signs: tuple[float, ...]) -> dict[str, Any]:
        """Return the factors of its weights, so that its sum remains the same."""
        return {"weights": signs}

    def check_weights_given(self, n: SimpleNamespace) -> None:
        """Require weights for a sum, and none for one coordinate."""
        if isinstance(self.coordinate, str):
            if n.weights is not None:
                raise ModelError(
                    f"{self.title}: weights are for a sum of coordinates; give a list of coordinates too, or leave "
                    f"weights out"
                )
            return
        if not self.coordinate:
            raise ModelError(f"{self.title}: it names no coordinate; give one, or several with weights")
        if n.weights is None:
            raise ModelError(f"{self.title}: a sum of coordinates needs weights; give weights=, one for each")
        check_weights(self, self.coordinate, n.weights)  # type: ignore[arg-type]


@dataclass(frozen=True)
class PathForce(CoordinateForce):
    """A force along the length of a path: straight from each of two or more points to the next."""

    bodies: tuple[str, ...]
    _: KW_ONLY
    at: Points | None = None

    sign: ClassVar[float] = -1.0
    outputs: ClassVar[dict[str, str]] = {"length": "m", "rate": "m/s", "tension": "N"}
    symbol: ClassVar[str] = "rope"
    fails: ClassVar[str] = "Two neighbouring points of it coincide, where the line between them has no direction"

    def ends(self) -> dict[str, str]:
        """Return one frame for each point."""
        return {f"P{k}": name for k, name in enumerate(self.bodies)}

    def placed(self, n: SimpleNamespace, planar: bool) -> dict[str, WorldFrame] | None:
        """Return the points in the reference configuration."""
        if n.at is None:
            return None
        points = [vector(p, planar, f"'at' of {self.title}") for p in n.at]
        for k, (a, b) in enumerate(itertools.pairwise(points)):
            if not (a.real != b.real).any():
                raise ModelError(
                    f"{self.title}: points {k + 1} and {k + 2} are both at {tuple(a.real.tolist())} m, where the line "
                    f"between them has no direction; move one, or leave it out"
                )
        return {f"P{k}": (p, np.eye(3)) for k, p in enumerate(points)}

    def path(self) -> tuple[tuple[str, str, Row], ...]:
        """Return the terms: the distance from each point to the next."""
        return tuple((f"P{k}", f"P{k + 1}", DISTANCE) for k in range(len(self.bodies) - 1))

    def check(self, n: SimpleNamespace) -> None:
        """Require enough points."""
        if len(self.bodies) < 2:
            raise ModelError(f"{self.title}: a path has two ends at least, got bodies {self.bodies}; name the second")
        if n.at is not None and len(n.at) != len(self.bodies):
            raise ModelError(f"{self.title}: {len(self.bodies)} bodies need as many points in 'at', got {len(n.at)}")


@dataclass(frozen=True)
class JointForce(CoordinateForce):
    """A torque about the axis of a joint that has an angle, positive on ``body_j``."""

    joint: str

    def coordinate_text(self) -> str:
        """The joint's angle."""
        return f"{self.joint}.angle"

    def examine(self, model: Model) -> None:
        """Require the angle of a joint, not of a body."""
        model.joint(self.joint, self, "angle")


@dataclass(frozen=True)
class Switch:
    """A row with a mode along one quantity: a weighted sum of coordinates, or of terms of the element's own.

    Attributes
    ----------
    kind : SwitchKind
        One of `constraints.switches`, or of the element's own.
    label : str
        Label of the switch; empty if the element has only one.
    along : tuple of str
        Coordinates (``"A.angle"``, ``"block.x"``) whose sum is the quantity, with weights if there are several.
    path : tuple of (role, role, Row)
        Or terms between frames of the element's own, such as the parts of a rope.
    measured : tuple of (role, role, Row)
        Terms measured in place of ``path`` while the row is off, if the row itself is not sufficient then.
    other : str
        Label of the element's switch that it depends on: for a slip, the gap.
    slides : bool
        Whether the element is a force along the same quantity that acts while the row is off (friction), or whose
        nonsmooth points are monitored (elastic elements).
    weighted : bool
        Whether a single coordinate has a weight too.
    """

    kind: SwitchKind
    label: str = ""
    along: tuple[str, ...] = ()
    path: tuple[tuple[str, str, Row], ...] = ()
    measured: tuple[tuple[str, str, Row], ...] = ()
    other: str = ""
    slides: bool = False
    weighted: bool = False

    @property
    def summed(self) -> bool:
        """Return whether the quantity is a weighted sum (`Element.switch_weights`), which belongs to the element."""
        return self.weighted or len(self.along) > 1


DIRECTIONS = (1.0, -1.0)


@dataclass(frozen=True)
class Unilateral(CoordinateForce):
    """A stop, a play, a latch: along a coordinate, or along a weighted sum of some.

    A rigid one is a row that is active at times (`switches`), an elastic one a force with a nonsmooth point. For both,
    a result contains ``value`` and ``rate`` of the quantity, the ``force`` along it (positive towards larger values),
    and ``closed``: 1 in contact at its lower side, -1 at its upper, 0 if open.
    """

    category: ClassVar[str] = "limits"
    outputs: ClassVar[dict[str, str]] = {"value": "", "rate": "/s", "force": "effort", "closed": "1"}

    def acts(self) -> bool:
        """Return whether it acts as a force: it does if it is elastic."""
        return getattr(self, "stiffness", None) is not None

    def check_range(self, n: SimpleNamespace, unit: str) -> None:
        """Refuse limits that leave no range; ``unit`` is that of its quantity."""

    def conservative(self) -> bool:
        """Return whether it has no damping, so that it only exchanges stored energy."""
        return getattr(self, "damping", 0.0) == 0.0


@dataclass(frozen=True)
class Latch(Unilateral):
    """An element that allows one direction of motion: of a coordinate, or of the difference of two."""

    coordinate: str

    def along(self) -> tuple[str, ...]:
        """Return the coordinate, and the one it is relative to."""
        other = getattr(self, "relative_to", None)
        return (self.coordinate,) if other is None else (self.coordinate, other)

    def switch_weights(self, n: SimpleNamespace, label: str) -> tuple[float, ...]:
        """Return weights such that the quantity may increase."""
        way = float(n.direction.real)
        return (way, -way)[: len(self.along())]

    def outward(self, n: SimpleNamespace) -> float:
        """Return the sign of the user's coordinate."""
        return float(n.direction.real)

    def examine(self, model: Model) -> None:
        """Require existing coordinates of one kind."""
        for text in self.along():
            model.coordinate(text, self)
        if len(self.along()) == 2:
            check_same_kind(self, model, *self.along())


def check_elastic(e: Element, n: SimpleNamespace, rigid: str = "a rigid one, which does not deform") -> None:
    """Refuse an invalid stiffness, and fields of the other kind of stop."""
    positive(e, n, "stiffness", why=f"Leave it out for {rigid}")
    nonnegative(e, n, "damping")
    if n.stiffness is None and n.damping != 0.0:
        raise ModelError(
            f"{e.title}: damping is {n.damping:g}, and a rigid one has none; give stiffness= too, or neither"
        )
    if n.stiffness is not None and n.restitution is not None:
        raise ModelError(
            f"{e.title}: restitution belongs to a rigid one and stiffness to an elastic one, which bounces off by "
            f"itself; leave one out"
        )


def check_direction(e: Element, value: Any) -> None:
    """Refuse an invalid direction."""
    if value not in DIRECTIONS:
        raise ModelError(f"{e.title}: direction is {value!r}; it must be 1 (the value may grow) or -1 (it may fall)")


def check_same_kind(e: Any, model: Model, first: str, second: str) -> None:
    """Refuse two coordinates of different kinds, or the same coordinate twice."""
    if first == second:
        raise ModelError(f"{e.title}: {first!r} relative to itself never moves; name another, or leave it out")
    units = [model.unit(text, e) for text in (first, second)]
    if units[0] != units[1]:
        raise ModelError(f"{e.title}: {first!r} is in {units[0]} and {second!r} in {units[1]}; name two of one kind")
