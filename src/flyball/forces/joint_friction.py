"""Friction in a joint, proportional to the joint's actual load."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import field, replace
from types import SimpleNamespace
from typing import TYPE_CHECKING, Annotated, ClassVar

from ..compiler.formulas import formula
from ..constraints import displacement
from ..constraints.switches.friction import FRICTION
from ..errors import ModelError, warn_user
from ..math.scalar import absolute, choose, exp, sqrt, tanh
from ..math.vec import add, col, cross, dot, norm, scale, sub
from ..model.element import Length, Number, Unit, element, nonnegative, positive
from ..model.force import CoordinateForce, Switch
from ..model.joint import Joint
from ..model.names import curve_parts

if TYPE_CHECKING:
    from ..model.model import Model

KIND = 6
TURN = 6.283185307179586  # rad
SLIDING = 1.5  # sliding directions are -1, 0 and 1; `switch_kind.STATIC` is larger, and selects the static friction
FALLS, CREEPS = 10, 11  # parameters that are 1 if a Stribeck speed, a stick speed is given; else 0
STICKING = 3.0  # times the stick speed: slower sliding counts as sticking (the law is then within 0.5 % of full)
FALL = 0.01  # m/s: Stribeck speed of the regularised law
THREAD = "thread"
"""Coordinate of friction on a `Screw`: the angle, with the path along the helix as the sliding distance."""


@formula
def load(par, axes, force, torque):
    """Return the normal load of the surfaces [N] from the joint's reaction on body j; the axis a is that frame's z.

    A guide of two points at +-L/2 along the axis carries the radial force R and the moment M by the normal forces
    R/2 + M x a / L and R/2 - M x a / L, whose magnitudes add up. Without a length L it is |R|.
    """
    a = col(axes[1], 2)
    thrust = dot(a, force)
    radial = sub(force, scale(thrust, a))
    couple = scale(par[8], cross(torque, a))
    pressed = 0.5 * (norm(add(radial, couple)) + norm(sub(radial, couple)))
    return pressed + par[7] * absolute(thrust) + par[9] * absolute(dot(a, torque))


@formula
def coefficient(par, v, way):
    """Stribeck's law mu_k + (mu_s - mu_k) exp(-(v / v_s)^2); mu_k without v_s; mu_s if static friction is requested."""
    s = v / par[3]
    fall = choose(way - SLIDING, 1.0, choose(par[FALLS], exp(-s * s), 0.0))
    return par[2] + (par[1] - par[2]) * fall


@formula
def effort(par, x, rate, laws, load):
    """Along the coordinate: -r mu(v) (N + preload) d - c rate, with the sliding speed v = r rate.

    The direction d is the sliding direction of its switch; with a stick speed v_0 it is tanh(v / v_0).
    """
    v = par[0] * rate
    way = choose(laws[2] - SLIDING, 1.0, choose(par[CREEPS], tanh(v / par[4]), laws[2]))
    return -par[0] * coefficient(par, v, laws[2]) * (load + par[6]) * way - par[5] * rate


def _slide_on_plane(joint: Joint, *coordinates: str) -> bool:
    """Return whether coordinates are displacements along two axes of a joint that prevents that along the third."""
    slides = [joint.coordinates[name].row for name in coordinates]
    axes = {row.axes for row in slides if row.kind == displacement.KIND}
    held = {row.axes for row in joint.blocks if row.kind == displacement.KIND}
    return len(axes) == 2 and axes | held == set("xyz")


@element
class JointFriction(CoordinateForce):
    """Coulomb friction in a joint, proportional to the joint's load, with sticking and sliding.

    The load N is computed from the joint's actual reaction at every instant: the radial force R, thrust_factor |thrust|
    and, where lengths are given, moments. Over ``bending_length`` L a bending moment M is carried as in a guide of two
    points, one L/2 before and one L/2 behind the joint's point: these press with |R/2 + M x a / L| and |R/2 - M x a /
    L| (a: the axis), so that a force F at the distance e from the axis presses with 2 F e / L. A sticking joint is
    locked by a constraint and does not move at all, until the constraint force exceeds static (N + preload); then it
    slips against kinetic (N + preload).

    On a `Screw` the surface is the thread: friction acts along the helix of the given mean ``radius`` r, and the thrust
    F presses with F / cos(lead angle), where tan(lead angle) = lead / (2 pi r). So the torque that lifts F is F r
    tan(lead angle + arctan(mu)). Results contain it as a torque about the angle. A collar is another surface: model it
    as a joint of its own. For a trapezoidal thread thrust_factor is 1 / cos(flank angle).

    A surface has one friction force, opposite to its total slip. If a joint's coordinates are slips of one surface
    (`Cylindrical`, `Planar`, `PointInPlane`), friction along a second one is refused. Friction along one coordinate
    only depends on the slip along it: this is correct if there is no slip along the others, and
    ``result.health.warnings`` reports such slip (a fast spinning shaft would creep axially under any thrust, but sticks
    in this model).

    With a ``stick_speed`` the law is regularised instead: friction is tanh(v / stick_speed) times the full value, and a
    joint that should stick creeps at ``stick_speed`` times artanh(required / full friction); ``result.health.creep``
    gives the creep distance. (Armstrong-Helouvry, Dupont and Canudas de Wit, *A survey of models for the control of
    machines with friction*, 1994.)

    Parameters
    ----------
    name : str
    joint : str
        Joint with a coordinate ``angle`` or ``displacement``.
    coordinate : str
        Which one, if it has both. If not given: ``angle`` if there is a radius, else ``displacement``; of a `Screw`,
        ``thread``.
    static, kinetic : number
        Coefficients of friction at rest and in motion; the kinetic one equals the static one if not given.
    radius : number [m]
        Radius of the bearing, or mean radius of the thread, at which the friction acts; required for an angle.
    stribeck_speed : number [m/s]
        Sliding speed over which the coefficient falls from static to kinetic. Not given: it falls as soon as the
        surfaces slide; of the regularised law, 0.01 m/s.
    stick_speed : number [m/s]
        If not given, friction sticks. If given, the law is regularised, and slower sliding counts as rest; smaller
        values are closer to sticking, but stiffer.
    viscous : number [N s/m] or [N m s/rad]
        Viscous friction along the coordinate.
    preload : number [N]
        Load in addition to the reaction (seals, clamping).
    thrust_factor : number
        Weight of the force along the axis, for collars.
    bending_length : number [m]
        Distance of the two points of a guide that carry a bending moment; without it the moment is ignored.
    twist_length : number [m]
        Distance at which two opposite forces carry the moment about the axis, 2 |twist| / twist_length in all; without
        it that moment is ignored.
    """

    joint: str = field(kw_only=False)
    coordinate: str | None = None
    static: Annotated[Number, Unit("1")]
    kinetic: Annotated[Number | None, Unit("1")] = None
    radius: Length | None = None
    stribeck_speed: Annotated[Number | None, Unit("m/s")] = None
    stick_speed: Annotated[Number | None, Unit("m/s")] = None
    viscous: Annotated[Number, Unit(None)] = 0.0
    preload: Annotated[Number, Unit("N")] = 0.0
    thrust_factor: Annotated[Number, Unit("1")] = 1.0
    bending_length: Length | None = None
    twist_length: Length | None = None

    kind: ClassVar[int] = KIND
    odd: ClassVar[tuple[str, ...]] = ()
    effort: ClassVar = staticmethod(effort)
    load: ClassVar = staticmethod(load)
    single: ClassVar[str] = "friction"
    outputs: ClassVar[dict[str, str]] = {"value": "", "rate": "/s", "friction": "effort"}

    def bound(self, model: Model) -> JointFriction:
        """Return it as friction of the thread if it is on a `Screw`, whichever of the two coordinates is named."""
        joint = model.find(self.joint)
        if getattr(joint, "thread", False) and self.coordinate in (None, "angle", "displacement"):
            return replace(self, coordinate=THREAD)
        return self

    def coordinate_text(self) -> str:
        """Return the joint's coordinate; empty for a thread, which slides along two."""
        return "" if self.coordinate == THREAD else f"{self.joint}.{self._coordinate()}"

    def along(self) -> tuple[str, ...]:
        """Return the coordinates: for a thread both, weighted."""
        if self.coordinate == THREAD:
            return f"{self.joint}.angle", f"{self.joint}.displacement"
        return super().along()

    def needs(self) -> str:
        """Return the joint whose numbers it needs: friction of a thread depends on the lead."""
        return self.joint if self.coordinate == THREAD else ""

    def switch_weights(self, n: SimpleNamespace, label: str) -> tuple[float, ...]:
        """Return the weights of a thread's coordinates: cos^2 and sin cos / r of the lead angle.

        The sum is the angle, since displacement = r tan angle; a force along it acts along the helix.
        """
        if self.coordinate != THREAD:
            return super().switch_weights(n, label)
        pitch = n.of.lead / TURN
        square = n.radius * n.radius + pitch * pitch
        return n.radius * n.radius / square, pitch / square

    def _coordinate(self) -> str:
        return ("displacement" if self.radius is None else "angle") if self.coordinate is None else self.coordinate

    def switches(self) -> tuple[Switch, ...]:
        """Return one friction switch; none for the regularised law."""
        return () if self.stick_speed is not None else (Switch(FRICTION, along=self.along(), slides=True),)

    def examine(self, model: Model) -> None:
        """Require a joint with a load, a radius for an angle, and no second friction on the same surface."""
        found = model.find(self.joint)
        if isinstance(found, Joint) and self.radius is None:
            has = found.measured(model.planar)
            if self.coordinate == THREAD or (self.coordinate is None and "angle" in has and "displacement" not in has):
                what, radius = ("the thread", "mean radius of the thread") if self.coordinate == THREAD else (
                    "the angle", "radius of the bearing"
                )  # fmt: skip
                raise ModelError(
                    f"{self.title}: friction about {what} of {found.title} needs the {radius}; give radius="
                )
        if self.coordinate == THREAD:
            self._examine_thread(model)
            return
        what = curve_parts(self.coordinate_text())[1]
        joint = model.joint(self.joint, self, what)
        if joint.coordinates[what].singular:
            raise ModelError(
                f"{self.title}: friction is opposite to a slip, and the rate of {self.coordinate_text()!r} is none: "
                f"all rotations of {joint.title} slip on one surface. Use a Bushing with torsional_damping="
            )
        for other in self._other_directions(model):
            if joint.one_surface:
                raise ModelError(self._rectangle(other, joint))
            if _slide_on_plane(joint, self._coordinate(), other._coordinate()):
                warn_user(
                    f"{self.title} and {other.title} act along two directions in one plane of {joint.title}, each as "
                    f"if it were alone: together they give up to 1.4 mu N. If this is one surface, declare "
                    f"one_surface: ClassVar[bool] = True in {type(joint).__name__}, and use one friction",
                    UserWarning,
                )

    def _examine_thread(self, model: Model) -> None:
        """Require a screw, and a load that counts the thread's normal force."""
        joint = model.joint(self.joint, self, "angle")
        if not getattr(joint, "thread", False):
            raise ModelError(f"{self.title}: {joint.title} has no thread; coordinate='thread' is for a Screw")
        if self.twist_length is not None:
            raise ModelError(
                f"{self.title}: twist_length has no effect on {joint.title}: the moment about its axis and the thrust "
                f"are the normal force of the thread, which counts already; leave it out"
            )

    def _other_directions(self, model: Model) -> list[JointFriction]:
        """Return the frictions along other coordinates of the same joint."""
        same = [f for f in model.forces if isinstance(f, JointFriction) and f.joint == self.joint]
        return [f for f in same if f.name != self.name and f._coordinate() != self._coordinate()]

    def _rectangle(self, other: JointFriction, joint: Joint) -> str:
        """Return why friction along two coordinates of one surface is refused: its limit would be no circle."""
        return (
            f"{self.title}: {other.title} already acts on the surface of {joint.title}, along "
            f"{other.coordinate_text()!r}. One surface has one friction force, mu N against its total slip "
            "velocity; two would together give up to 1.4 mu N. Leave one out, give the bodies shapes and a "
            "Contact(friction=...) in place of the joint, or put a body between them with a joint for each "
            "motion, if these are two surfaces"
        )

    def check(self, n: SimpleNamespace) -> None:
        """Require valid coefficients and lengths."""
        nonnegative(self, n, "static", "kinetic", "viscous", "preload", "thrust_factor")
        positive(self, n, "radius", "stribeck_speed", "bending_length", "twist_length")
        positive(self, n, "stick_speed", why="Leave it out, and it sticks")
        if n.kinetic is not None and n.kinetic.real > n.static.real:
            raise ModelError(
                f"{self.title}: kinetic friction {n.kinetic:g} is greater than static friction {n.static:g}; it must "
                f"not be. Are they swapped?"
            )
        if self._coordinate().startswith("angle") and n.radius is None:
            raise ModelError(f"{self.title}: friction about an angle needs the radius of the bearing; give radius=")

    def loading_components(self, components: Iterable[str]) -> tuple[str, ...]:
        """Return the reaction components (``"force x"``, ``"torque y"``, ...) that the load depends on."""
        moments = self.bending_length is not None or self.twist_length is not None
        return tuple(k for k in components if moments or k.startswith("force"))

    @staticmethod
    def sticking(par: tuple[float, ...]) -> tuple[float, float]:
        """Return the lever arm about the coordinate, and the sliding speed [m/s] below which surfaces should stick."""
        return par[0], STICKING * par[4]

    def parameters(self, n: SimpleNamespace, separation: float) -> tuple[float, ...]:
        """Return the parameters of the formulas."""
        kinetic = n.static if n.kinetic is None else n.kinetic
        arm, thrust = (n.radius if self._coordinate().startswith("angle") else 1.0), n.thrust_factor
        if self.coordinate == THREAD:
            pitch = n.of.lead / TURN
            arm = sqrt(n.radius * n.radius + pitch * pitch)
            thrust = thrust * arm / n.radius
        fall = FALL if n.stribeck_speed is None and n.stick_speed is not None else n.stribeck_speed
        bending, twist = (0.0 if x is None else 2.0 / x for x in (n.bending_length, n.twist_length))
        fall, falls, stick, creeps = (y for x in (fall, n.stick_speed) for y in ((1.0, 0.0) if x is None else (x, 1.0)))
        laws = n.viscous, n.preload, thrust, bending, twist
        return (arm, n.static, kinetic, fall, stick, *laws, falls, creeps)
