"""Rope: a line over two or more points that can pull but not push, elastic or inextensible."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from itertools import pairwise
from types import SimpleNamespace
from typing import TYPE_CHECKING, Annotated, Any, ClassVar

from ..compiler.formulas import formula
from ..constraints.switches.elastic_stop import ELASTIC
from ..constraints.switches.stop import STOP
from ..constraints.switches.switch_kind import FROZEN
from ..errors import ModelError
from ..math.scalar import choose, maximum
from ..model.body import Body, Driver
from ..model.contact import check_restitution
from ..model.element import (
    Damping,
    Direction,
    Element,
    Law,
    LawOf,
    Length,
    Numbers,
    Points,
    Ratio,
    Stiffness,
    Unit,
    element,
    nonnegative,
    resolve,
)
from ..model.force import PathForce, Switch, check_elastic
from ..model.joint import WorldFrame
from .bushing import PerAxis
from .limit import Limit, stop_switch_numbers
from .motor import LITTLE, Actuator
from .rope_geometry import RopeSlip, RopeTexts, drawn_rope, is_backward, is_point, pulley_axes

if TYPE_CHECKING:
    from ..constraints.blocks import Row
    from ..model.model import Model

KIND = 2


@formula
def effort(par, x, rate, laws, load):
    """Return the effort along the rope's length x: -max(0, k (x - x_0) + c rate) if longer than x_0, else zero.

    While its state is fixed as taut or slack (`switch_kind.FROZEN`), the formula is continued smoothly beyond the
    corner.
    """
    o = 0.0 * x
    stretch = x - par[2]
    pull = par[0] * stretch + par[1] * rate
    side = laws[2] - FROZEN
    return -choose(side + 1.5, choose(-side, pull, o), choose(stretch, maximum(pull, o), o))


@formula
def energy(par, x):
    """Potential energy k max(0, x - x_0)^2 / 2 [J]."""
    stretch = maximum(x - par[2], 0.0 * x)
    return 0.5 * par[0] * stretch * stretch


_WORDS = {"closing": ("taut", "goes taut"), "opening": ("slack", "goes slack"), "states": ("taut", "slack")}
RIGID_ROPE, ELASTIC_ROPE = replace(STOP, **_WORDS), replace(ELASTIC, **_WORDS)  # type: ignore[arg-type]


@element
class LengthLimit(Limit):
    """The largest length of a path and of the rope on a drum, with the words of a rope."""

    in_files: ClassVar[bool] = False

    @property
    def title(self) -> str:  # type: ignore[override]
        """Return kind and name of the rope, for messages."""
        return f"Rope {self.name.removesuffix('_limit')!r}"

    def switches(self) -> tuple[Switch, ...]:
        """Return one switch along the sum."""
        (stop,) = super().switches()
        return (replace(stop, kind=ELASTIC_ROPE if self.acts() else RIGID_ROPE),)


@element
class PulleyLimit(LengthLimit):
    """The largest length of a rope over pulleys: the sum of its straight parts and of the arcs."""

    at: Points = ()
    radii: Annotated[Numbers, Unit("m")] = ()
    turns: Annotated[Numbers, Unit("1")] = ()
    axis: Direction | None = None
    fixed: tuple[int, ...] = ()  # straight parts of constant length, which the sum does not contain

    in_files: ClassVar[bool] = False

    def derive(self, n: SimpleNamespace, env: Any) -> None:
        """Add the length as drawn, and its excess over the sum of the coordinates."""
        x = drawn_rope(self, n)
        n.drawn = sum(x.lengths) + x.arcs(n.radii)
        parts = zip(x.lengths, x.places, pairwise(n.radii), strict=True)
        n.excess = n.drawn - sum(
            length - (b - a) * place for k, (length, place, (a, b)) in enumerate(parts) if k not in self.fixed
        )
        if n.upper is None:
            n.upper = n.drawn

    def check(self, n: SimpleNamespace) -> None:
        """Require what a rope requires, which was checked with it."""

    def total(self, n: SimpleNamespace) -> Any:
        """Return the value of the sum at which the length is zero."""
        return -n.excess

    def first_weight(self, n: SimpleNamespace) -> float:
        """Return 1: weights are relative to the first."""
        return 1.0


@element
class Rope(PathForce):
    """A rope over points of bodies and around pulleys: the tension is the same everywhere, except for friction.

    With a stiffness it is elastic: the tension is k (l - length) + c ldot while the rope is longer than its free length
    and this is positive; otherwise it is slack. Without a stiffness it is inextensible: when it becomes taut at the
    speed v it rebounds at ``restitution`` times v. Intermediate points are frictionless eyes or small pulleys; a body
    may occur more than once.

    A winch winds it up: with ``drum`` and ``radius`` its free length is ``length`` less radius times the drum's angle,
    and the tension turns the drum. With ``feed`` it is ``length`` plus that law.

    With ``radii`` its points are the centres of pulleys, drums and fixed cylinders; it touches them along tangents. The
    arcs are part of its length. It slides around a pulley without friction: the torque on the pulley's body is zero. An
    end with a radius is fixed to its body, a drum: the rope is wound on it as the body turns, over any number of turns,
    and the torque is tension times radius. A pulley that turns with the rope and has inertia is the end of two ropes.

    With ``friction`` an elastic rope slips around one pulley, drum or fixed cylinder where the ratio of the tensions on
    both sides reaches exp(friction * wrap), with the wrap of the instant, and sticks to its surface below (Euler 1762,
    Eytelwein 1808). Both sides stretch, each with the stiffness of its part of the length as drawn. If the body of the
    pulley turns, the rope turns it by the difference of the tensions times the radius.

    A rope with winch, feed or radii consists of elements of its own, which decide what an analysis makes of it:
    coordinates ``NAME_1``, ``NAME_2``, ... of its straight parts (`LinearActuator`, next to a pulley `RopeSpan`), a
    `Limit` ``NAME_limit`` of their sum with the rope on the drum, and for ``feed`` a slide ``NAME_feed`` on ground with
    a body ``NAME_end`` of 1e-6 kg and its `Driver` ``NAME_drive``. With friction the `Limit` is replaced by the slip
    ``NAME_slip`` with its two states, and an `Actuator` for each side, ``NAME_pull_1`` and ``NAME_pull_2``.

    Parameters
    ----------
    name : str
    bodies : list of str
        Bodies or frames with the points, in order, two or more; ``"ground"`` is the world.
    at : list of points [m]
        The points, in world coordinates of the drawn configuration. Not given: the origins of the frames.
    stiffness : number [N/m]
        Of the whole rope: E A / length. If not given, the rope is inextensible.
    damping : number [N s/m]
        Of an elastic rope.
    length : number [m]
        Free length; that in the reference configuration if not given. With ``drum`` or ``feed`` at an angle and a law
        of zero; required with points that are frames.
    drum : str
        Angle of the winch, ``"J.angle"``. The end of the path on the drum is a point of the body that carries the drum.
    radius : number [m]
        Of the drum: positive if a growing angle winds the rope up.
    feed : law [m]
        Rope paid out, an expression of ``t``, tables, parameters and sensors of positions.
    restitution : number [1]
        Of an inextensible rope, from 0 (it stays taut; the default) to 1.
    radii : list of numbers [m]
        One for each point, in place of ``drum`` and ``radius``: 0 for a point, positive where the rope runs
        counterclockwise around the centre, negative where it runs clockwise. Requires ``at``.
    turns : list of numbers [1]
        One for each point, 0 if not given: whole turns around a pulley besides the arc between the drawn tangents; at a
        drum all the rope wound on it as drawn, in turns.
    axis : direction
        In space: axis of all pulleys, about which the rope runs, in world coordinates of the drawn configuration. The
        pulleys, and the points next to them, are in a plane across it as drawn.
    friction : number [1], or list of numbers
        With ``radii``: coefficient of friction around the pulley between the ends, or a list with one number for each
        point, of which one is not zero. Requires stiffness and damping.

    Notes
    -----
    A result contains the ``length`` of the path, its ``rate``, the ``tension``, and ``taut``: 1 if taut, 0 if slack;
    ``load_1``, ``load_2``, ...: the magnitude of the force on each point, such as the bearing of a pulley; with
    ``radii`` also ``wrap_1``, ``wrap_2``, ...: the angle around each centre [rad]. The ``length`` of such a rope
    includes its arcs and the rope on its drums, less the rope paid out by ``feed``. With ``friction`` also
    ``tension_1``, ``tension_2``, ... of each straight part, ``tension`` being the largest; and ``rate``, ``slip`` [m]
    and ``heat`` [J] of ``NAME_slip``: the slip relative to the surface of the pulley, positive towards the first end,
    and the work lost in friction since the start.

    A wrap below zero means that the rope has left the pulley, which is not modelled: the motion goes on as if the
    pulley could pull, and ``health.warnings`` names rope, pulley and time. In space
    a straight part may leave the plane of its pulley, as a load swings; a pulley swivels with its body only.
    """

    stiffness: Stiffness | None = None
    damping: Damping = 0.0
    length: Length | None = None
    restitution: Ratio | None = None
    drum: str | None = None
    radius: Length | None = None
    feed: Law | None = None
    radii: Annotated[Numbers | None, Unit("m")] = None
    turns: Annotated[Numbers | None, Unit("1")] = None
    axis: Direction | None = None
    friction: Annotated[PerAxis | None, Unit("1")] = None

    kind: ClassVar[int] = KIND
    effort: ClassVar = staticmethod(effort)
    energy: ClassVar = staticmethod(energy)
    outputs: ClassVar[dict[str, str]] = {"length": "m", "rate": "m/s", "tension": "N", "taut": "1"}
    single: ClassVar[str] = "rope"
    shows_parts: ClassVar[bool] = False
    reversing: ClassVar[dict[str, str]] = {"drum": "radius"}
    axial: ClassVar[bool] = True
    handed: ClassVar[tuple[str, ...]] = ("radii",)

    def derive(self, n: SimpleNamespace, env: Any) -> None:
        """Complete the turns."""
        if self.radii is not None and self.turns is None:
            n.turns = (0.0,) * len(self.radii)

    def check(self, n: SimpleNamespace) -> None:
        """Require enough points, and valid constants."""
        super().check(n)
        check_restitution(self, n)
        check_elastic(self, n, "a rope that does not stretch")
        nonnegative(self, n, "length")
        if (self.drum is None) != (n.radius is None) or n.radius == 0.0:
            raise ModelError(f"{self.title}: a drum has an angle and a radius; give drum='J.angle' and radius=, not 0")
        if self.radii is not None:
            self._check_pulleys(n)
        elif self.turns is not None or self.axis is not None:
            raise ModelError(f"{self.title}: turns and axis are those of pulleys; give their radii=, or leave both out")
        elif self.friction is not None:
            raise ModelError(f"{self.title}: friction acts around pulleys and cylinders; give their radii=")
        elif self._winds() and n.length is None and n.at is None:
            raise ModelError(f"{self.title}: its points are frames; give its free length too: length=")

    def _check_pulleys(self, n: SimpleNamespace) -> None:
        """Require centres, a radius and turns for each, and a common tangent of all neighbours."""
        count = len(self.bodies)
        if self.drum is not None:
            raise ModelError(
                f"{self.title}: radii and drum are both given; a drum is an end with a radius, on its body"
            )
        if n.at is None:
            raise ModelError(f"{self.title}: give the centres of its pulleys: at=")
        if len(n.radii) != count or len(n.turns) != count:
            raise ModelError(
                f"{self.title}: {count} bodies need as many radii and turns (0 for a point), got {len(n.radii)} and "
                f"{len(n.turns)}"
            )
        for k, (r, given, turns) in enumerate(zip(n.radii, self.radii or (), n.turns, strict=True)):
            inner = 0 < k < count - 1
            if r == 0.0 and not is_point(given):
                raise ModelError(f"{self.title}: radius {k + 1}, {given!r}, is 0; write the number 0 for a point")
            if turns < 0.0 or (inner and turns != int(turns)) or (turns and is_point(given)):
                raise ModelError(
                    f"{self.title}: turns {k + 1} is {turns:g}; it is 0 at a point, a whole number at a pulley, "
                    "and not negative"
                )
        drawn_rope(self, n)
        if self.friction is not None:
            self._check_friction(n)

    def _check_friction(self, n: SimpleNamespace) -> None:
        """Require one pulley with friction, and an elastic rope with damping."""
        count = len(self.bodies)
        each = n.friction if isinstance(n.friction, tuple) else (n.friction,) * count
        if len(each) != count:
            raise ModelError(
                f"{self.title}: friction has {len(each)} numbers; give one, or one for each of {count} points"
            )
        if any(mu.real < 0.0 for mu in each):
            raise ModelError(f"{self.title}: friction is {self.friction}; it must not be negative")
        for k, (mu, r) in enumerate(zip(each, n.radii, strict=True)):
            if isinstance(n.friction, tuple) and mu and (not r or k in (0, count - 1)):
                raise ModelError(f"{self.title}: friction {k + 1} is {mu:g}; there is none at a point or at an end")
        at = self.slips_at()
        if len(at) != 1:
            where = f"at points {', '.join(str(k + 1) for k in at)}" if at else "at no pulley between its ends"
            raise ModelError(
                f"{self.title}: there is friction {where}; it is possible at one. Give a list with zeros, "
                "friction=(0, 0.3, 0, 0), or divide the rope at a small body between two pulleys"
            )
        if n.stiffness is None or not n.damping.real > 0.0:
            raise ModelError(
                f"{self.title}: friction around pulleys needs a rope that stretches, and damping, which gives the rate "
                "of its slip; give stiffness= and damping=. Of inextensible ropes it is not available"
            )
        if self.feed is not None:
            raise ModelError(
                f"{self.title}: feed and friction are both given; wind the rope on a drum, an end with a radius"
            )
        if not all(word.isidentifier() for word in self.name.split(".")):
            raise ModelError(f"{self.title}: its parts occur in expressions; give it a name of one word")

    def slips_at(self) -> tuple[int, ...]:
        """Return the points (from 0) of pulleys that it slips around with friction."""
        if self.friction is None or self.radii is None:
            return ()
        each = self.friction if isinstance(self.friction, tuple) else (self.friction,) * len(self.bodies)
        inner = range(1, len(self.bodies) - 1)
        return tuple(k for k in inner if not is_point(self.radii[k]) and not is_point(each[k]))

    def placed(self, n: SimpleNamespace, planar: bool) -> dict[str, WorldFrame] | None:
        """Return the points in the reference configuration, of pulleys with z along the axis."""
        points = super().placed(n, planar)
        if points is None or self.radii is None:
            return points
        return {role: (p, pulley_axes(self, n.axis, planar)) for role, (p, _) in points.items()}

    def path(self) -> tuple[tuple[str, str, Row], ...]:
        """Return the terms: the distance from each point to the next; none if it is measured by its parts."""
        return super().path() if self.radii is None else ()

    def measured_with(self) -> str:
        """Return the limit that measures its length, if it has pulleys."""
        if self.friction is not None:
            return f"{self.name}_slip"
        return "" if self.radii is None else f"{self.name}_limit"

    def examine(self, model: Model) -> None:
        """Require an angle of the drum, and a law that its driver accepts."""
        if self.drum is not None and model.unit(self.drum, self) != "rad":
            raise ModelError(f"{self.title}: drum is {self.drum!r}, which is no angle; name that of a joint: 'J.angle'")
        model.law(self.feed, LawOf("m"), f"feed of {self.title}", driver=True)

    def _winds(self) -> bool:
        return self.drum is not None or self.feed is not None or self.radii is not None

    def parts(self, model: Model) -> tuple[Element, ...]:
        """Return the straight parts, their limit, and the slide that pays out."""
        if not self._winds():
            return ()
        spans = self._spans(model)
        out: list[Element] = []
        coordinates: Any = []
        weights: Any = []
        for k, ends, at, moves in spans:
            if moves:
                part, turning = self._part(k, ends, at)
                out.append(part)
                coordinates.append(f"{part.name}.length")
                weights.append(1.0)
                if turning is not None:
                    coordinates.append(f"{part.name}.angle")
                    weights.append(turning)
        if self.feed is not None:
            out += self._slide(self.feed, model.planar)
            coordinates, weights = [*coordinates, f"{self.name}_feed.displacement"], [*weights, -1.0]
        if self.drum is not None:
            coordinates, weights = [*coordinates, self.drum], [*weights, self.radius]
        own: Any = {"stiffness": self.stiffness, "damping": self.damping, "restitution": self.restitution}
        own |= {"weights": weights}
        limit = f"{self.name}_limit"
        if self.friction is not None:
            return (*out, *self._slipping(model, [moves for *_, moves in spans]))
        if self.radii is not None:
            own |= {"at": self.at, "radii": self.radii, "turns": self.turns or (0.0,) * len(self.radii)}
            own |= {"axis": self.axis, "fixed": tuple(k - 1 for k, _, _, moves in spans if not moves)}
            return (*out, PulleyLimit(limit, coordinates, upper=self.length, **own))
        if self.length is None:
            length: Any = _distance_text(at for _, _, at, moves in spans if moves)
        elif fixed := _distance_text(at for _, _, at, moves in spans if not moves):
            length = f"({self.length}) - ({fixed})"
        else:
            length = self.length
        return (*out, LengthLimit(limit, coordinates, upper=length, **own))

    def _slipping(self, model: Model, moves: list[bool]) -> tuple[Element, ...]:
        """Return the slip around the pulley with friction, and the forces of both sides."""
        (i,) = self.slips_at()
        texts = RopeTexts(self, resolve(self, model.environment()))
        share, longer = texts.share(i), "0" if self.length is None else f"({texts.length()} - ({self.length}))"
        friction = self.friction[i] if isinstance(self.friction, tuple) else self.friction
        slip, own, pulls = f"{self.name}_slip", dict[str, Any](), list[Element]()
        for side, part, ks in ((1, share, range(i)), (2, 1.0 - share, range(i, len(moves)))):
            sums = [("", " + ".join(texts.value(k) for k in ks if moves[k]) or "0"), ("_rate", "0")]
            at = [x for k in ks if moves[k] for x in self._coordinates_of(k + 1)]
            for ending, drawn in sums:
                own[f"{'rate' if ending else 'stretch'}_{side}"] = " + ".join(
                    [*(f"({weight})*{name}{ending}" for name, weight in at), f"(-({drawn}))"]
                )
            own[f"stretch_{side}"] += f" + {part!r}*{longer}"
            for name in ("stiffness", "damping"):
                own[f"{name}_{side}"] = f"({getattr(self, name)})/{part!r}"
            if at:
                names, weights = zip(*at, strict=True)
                pull = f"-{slip}.tension_{side}"
                pulls.append(Actuator(f"{self.name}_pull_{side}", names, weights=weights, force=pull))
        own |= {"turned": texts.wrap(i, (moves[i - 1], moves[i])), "middle": float(texts.drawn.wraps[i].real)}
        return (RopeSlip(slip, friction=friction or 0.0, **own), *pulls)

    def _coordinates_of(self, k: int) -> list[tuple[str, Any]]:
        """Return the coordinates of straight part k (from 1), with their weights in the length."""
        a, b = self.radii[k - 1 : k + 1] if self.radii is not None else (0.0, 0.0)
        turns = [] if is_point(b) or is_backward(a, b) else [(f"{self.name}_{k}.angle", b)]
        return [(f"{self.name}_{k}.length", 1.0), *turns]

    def _part(self, k: int, ends: tuple[str, str], at: Any) -> tuple[Element, Any]:
        """Return straight part k (from 1), and the weight of its angle if that counts in the length."""
        line: Any = Element.of_type("LinearActuator")  # joints are not known here
        a, b = (0.0, 0.0) if self.radii is None else self.radii[k - 1 : k + 1]
        name = f"{self.name}_{k}"
        if is_point(a) and is_point(b):
            return line(name, *ends, at=at), None
        span: Any = Element.of_type("RopeSpan")
        if is_backward(a, b):
            return span(name, *ends[::-1], at=at[::-1], radii=(_negative(b), 0.0), axis=self.axis), None
        return span(name, *ends, at=at, radii=(a, b), axis=self.axis), None if is_point(b) else b

    def _spans(self, model: Model) -> list[tuple[int, tuple[str, str], Any, bool]]:
        """Return (number, bodies, points, whether its length changes) of each straight part."""
        points = [None] * len(self.bodies) if self.at is None else list(self.at)
        out = []
        for k, (ends, at) in enumerate(zip(pairwise(self.bodies), pairwise(points), strict=True), 1):
            moves = model.carrier(ends[0], self) != model.carrier(ends[1], self)
            if not moves and at[0] is None:
                raise ModelError(f"{self.title}: {ends[0]!r} and {ends[1]!r} are on one body; give points: at=")
            out.append((k, ends, None if at[0] is None else at, moves))
        return out

    def _slide(self, feed_law: Law, planar: bool) -> tuple[Element, ...]:
        """Return a body on a slide that follows the law of feed; its mass, place and axis have no effect."""
        end, feed = f"{self.name}_end", f"{self.name}_feed"
        slide: Any = Element.of_type("Prismatic")
        n = 2 if planar else 3
        return (
            Body(end, mass=LITTLE, inertia=LITTLE if planar else (LITTLE,) * 3, position=(0.0,) * n),
            slide(feed, "ground", end, at=(0.0,) * n, axis=(1.0, *(0.0,) * (n - 1))),
            Driver(f"{self.name}_drive", f"{feed}.displacement", feed_law),
        )

    def transmitted(self) -> str:
        """Return the curve of the limit that carries its tension; empty if it acts itself, or by several tensions."""
        return f"{self.name}_limit.force" if self._winds() and self.friction is None else ""

    def parameters(self, n: SimpleNamespace, separation: float) -> tuple[float, ...]:
        """Return the parameters of the formulas."""
        return (n.stiffness, n.damping, self._free(n, separation))

    @staticmethod
    def _free(n: SimpleNamespace, separation: float) -> float:
        return separation if n.length is None else n.length

    def acts(self) -> bool:
        """Return whether it acts as a force: it does if it is elastic; with a winch its parts act."""
        return self.stiffness is not None and not self._winds()

    def switches(self) -> tuple[Switch, ...]:
        """Return one switch along its length."""
        if self._winds():
            return ()
        return (Switch(ELASTIC_ROPE if self.acts() else RIGID_ROPE, path=self.path(), slides=self.acts()),)

    def switched(self, n: SimpleNamespace, label: str, separation: float) -> tuple[float, ...]:
        """Return the bounds: its length is the upper one."""
        return stop_switch_numbers(n, None, self._free(n, separation))

    def conservative(self) -> bool:
        """Return whether it has no damping, so that it only exchanges stored energy."""
        return self.damping == 0.0


def _distance_text(spans: Iterable[Any]) -> str:
    """Return an expression of the sum of the distances of pairs of points."""
    squares = (" + ".join(f"(({y}) - ({x}))**2" for x, y in zip(a, b, strict=True)) for a, b in spans)
    return " + ".join(f"sqrt({x})" for x in squares)


def _negative(x: float | str) -> float | str:
    """Return the negative of a number or of an expression."""
    return f"-({x})" if isinstance(x, str) else -x
