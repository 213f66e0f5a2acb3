"""Friction in a joint, driven by what the joint actually carries."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import field
from types import SimpleNamespace
from typing import TYPE_CHECKING, Annotated, ClassVar

from ..compiler.jit import formula
from ..constraints.modes import FRICTION
from ..errors import ModelError
from ..math.scalar import absolute, choose, exp, sqrt, tanh
from ..math.vec import col, dot, scale, sub
from ..model.element import Length, Number, Unit, element, nonnegative, positive
from ..model.force import CoordinateForce
from ..model.joint import Joint
from ..model.switch import Switch

if TYPE_CHECKING:
    from ..model.model import Model

KIND = 6
SLIDING = 1.5  # ways of sliding are -1, 0 and 1; `constraints.modes.STATIC` is more, and asks for what holds at rest
FALLS, CREEPS = 10, 11  # parameters that are 1 where there is a Stribeck speed, a stick speed; else 0
STICKING = 3.0  # times the stick speed: slower than this counts as sticking (the law is then within 0.5 % of full)
FALL = 0.01  # m/s: Stribeck speed of the regularised law


@formula
def load(par, axes, force, torque):
    """What presses the surfaces together [N], from the joint's reaction on body j; the axis is that frame's z."""
    a = col(axes[1], 2)
    thrust = dot(a, force)
    twist = dot(a, torque)
    radial = sub(force, scale(thrust, a))
    bending = sub(torque, scale(twist, a))
    pressed = sqrt(dot(radial, radial)) + par[7] * absolute(thrust)
    return pressed + par[8] * sqrt(dot(bending, bending)) + par[9] * absolute(twist)


@formula
def coefficient(par, v, way):
    """Stribeck's law mu_k + (mu_s - mu_k) exp(-(v / v_s)^2); without v_s it is mu_k; at rest, if asked for, mu_s."""
    s = v / par[3]
    fall = choose(way - SLIDING, 1.0, choose(par[FALLS], exp(-s * s), 0.0))
    return par[2] + (par[1] - par[2]) * fall


@formula
def effort(par, x, rate, laws, load):
    """Along the coordinate: -r mu(v) (N + preload) d - c rate, with the sliding speed v = r rate.

    The direction d is that of its switch; with a stick speed v_0 it is tanh(v / v_0).
    """
    v = par[0] * rate
    way = choose(laws[2] - SLIDING, 1.0, choose(par[CREEPS], tanh(v / par[4]), laws[2]))
    return -par[0] * coefficient(par, v, laws[2]) * (load + par[6]) * way - par[5] * rate


@element
class JointFriction(CoordinateForce):
    """Coulomb friction in a joint, proportional to the load that the joint carries: it sticks, or slips.

    The load is N = |radial force| + thrust_factor |thrust| + |bending moment| / bending_length + |twist| /
    twist_length, from the joint's actual reaction at every instant. What sticks is held by a constraint and does not
    move at all, until that carries more than static (N + preload); then it slips, against kinetic (N + preload).

    With a ``stick_speed`` the law is regularised instead: friction is tanh(v / stick_speed) of the full one, and what
    would stick creeps at ``stick_speed`` times artanh(part of the full friction that holds it);
    ``result.health.creep`` says how far it crept. (Armstrong-Helouvry, Dupont and Canudas de Wit, *A survey of models
    for the control of machines with friction*, 1994.)

    Parameters
    ----------
    name : str
    joint : str
        Joint with a coordinate ``angle`` or ``displacement``.
    coordinate : str
        Which one, if it has both; not given: ``angle`` if there is a radius, else ``displacement``.
    static, kinetic : number
        Coefficients of friction at rest and in motion; the kinetic one equals the static one if not given.
    radius : number [m]
        Radius of the bearing, where the friction acts; needed for an angle.
    stribeck_speed : number [m/s]
        Sliding speed over which the coefficient falls from static to kinetic. Not given: it falls as soon as the
        surfaces slide; of the regularised law, 0.01 m/s.
    stick_speed : number [m/s]
        Not given: friction sticks. Given: the regularised law, in which slower sliding than this counts as rest;
        smaller is nearer to sticking, and stiffer.
    viscous : number [N s/m] or [N m s/rad]
        Viscous friction along the coordinate.
    preload : number [N]
        Load that is there besides the reaction (seals, clamping).
    thrust_factor : number
        Weight of the force along the axis, for collars.
    bending_length, twist_length : number [m]
        Lengths over which bending moment and twist are carried as pairs of forces; moments count nothing if not given.
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
    effort: ClassVar = staticmethod(effort)
    load: ClassVar = staticmethod(load)
    single: ClassVar[str] = "friction"
    outputs: ClassVar[dict[str, str]] = {"value": "", "rate": "/s", "friction": "effort"}

    def coordinate_text(self) -> str:
        """The joint's coordinate."""
        return f"{self.joint}.{self._coordinate()}"

    def _coordinate(self) -> str:
        return ("displacement" if self.radius is None else "angle") if self.coordinate is None else self.coordinate

    def switches(self) -> tuple[Switch, ...]:
        """It sticks, or slides; the regularised law knows no difference."""
        return () if self.stick_speed is not None else (Switch(FRICTION, along=self.along(), slides=True),)

    def examine(self, model: Model) -> None:
        """It needs a joint that carries something, and the radius of a bearing that turns."""
        found = model.find(self.joint)
        if isinstance(found, Joint) and self.radius is None and self.coordinate is None:
            has = found.measured(model.planar)
            if "angle" in has and "displacement" not in has:
                raise ModelError(
                    f"{self.title}: friction about the angle of {found.title} needs the radius of the bearing; give "
                    f"radius="
                )
        model.joint(self.joint, self, self.coordinate_text().partition(".")[2])

    def check(self, n: SimpleNamespace) -> None:
        """Coefficients and lengths make sense."""
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

    def counted(self, components: Iterable[str]) -> tuple[str, ...]:
        """Those of a reaction's components (``"force x"``, ``"torque y"``, ...) that the load counts."""
        moments = self.bending_length is not None or self.twist_length is not None
        return tuple(k for k in components if moments or k.startswith("force"))

    @staticmethod
    def sticking(par: tuple[float, ...]) -> tuple[float, float]:
        """Arm of the surfaces about the coordinate, and the sliding speed [m/s] below which they should stick."""
        return par[0], STICKING * par[4]

    def parameters(self, n: SimpleNamespace, separation: float) -> tuple[float, ...]:
        """Numbers that the formulas see."""
        turning = self._coordinate().startswith("angle")
        kinetic = n.static if n.kinetic is None else n.kinetic
        arm = n.radius if turning else 1.0
        fall = FALL if n.stribeck_speed is None and n.stick_speed is not None else n.stribeck_speed
        bending, twist = (0.0 if x is None else 1.0 / x for x in (n.bending_length, n.twist_length))
        fall, falls, stick, creeps = (y for x in (fall, n.stick_speed) for y in ((1.0, 0.0) if x is None else (x, 1.0)))
        laws = n.viscous, n.preload, n.thrust_factor, bending, twist
        return (arm, n.static, kinetic, fall, stick, *laws, falls, creeps)
