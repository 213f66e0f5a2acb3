"""Rubber: a spring whose stiffness and damping depend on frequency and amplitude."""

from __future__ import annotations

from dataclasses import field
from types import SimpleNamespace
from typing import TYPE_CHECKING, Annotated, Any, ClassVar

from ..errors import ModelError
from ..model.body import RATE
from ..model.controller import Sensor
from ..model.element import Element, Number, Numbers, Unit, element, nonnegative
from ..model.event import Event, Set
from ..model.force import CoordinateForce
from .coordinate_spring import CoordinateSpring, refuse_without_stiffness

if TYPE_CHECKING:
    from ..model.model import Model


STILL = 1e-9  # friction travels per second, and part of the largest friction, below which nothing moves


@element
class Rubber(CoordinateForce):
    """A rubber spring along a coordinate: elastic, viscous and friction forces added up.

    The elastic force is -k (x - rest). The viscous one is that of a generalised Maxwell model, a spring and a damper in
    series for each relaxation time T_i: F_i' = -k_i x' - F_i / T_i. At the frequency w they add k_i (w T_i)^2 / (1 + (w
    T_i)^2) to the stiffness. The friction force follows Berg's law: with F_s and x_s the force and place where the
    motion last turned, the largest friction F_m and the travel x_2 that reaches half of it, a growing x gives

        F = F_s + (F_m - F_s) (x - x_s) / (x_2 (1 - F_s / F_m) + x - x_s)

    and a falling one its image. So small amplitudes find a stiffer spring, by F_m / x_2 at most, and the loss per
    cycle hardly depends on the frequency (M. Berg, *A non-linear rubber spring model for rail vehicle dynamics
    analysis*, Vehicle System Dynamics 30, 1998).

    Its parts belong to it: the `CoordinateSpring` ``NAME_spring``, which carries the force, the states
    ``NAME_viscous_1``, ..., ``NAME_friction`` [N] or [N m], and with friction the `Event`s ``NAME_turns_up`` and
    ``NAME_turns_down`` at every turning point. A motion begins relaxed and without friction.

    Parameters
    ----------
    name : str
        One word, as the parts are named in expressions.
    coordinate : str
        ``"joint.coordinate"``, such as ``"mount.displacement"``, or the ``length`` of a `LinearActuator`.
    stiffness : number [N/m] or [N m/rad]
        Static stiffness k.
    rest : number [m] or [rad]
        Value of the coordinate without elastic force.
    viscous_stiffness : list of numbers [N/m] or [N m/rad]
        k_i, one for each relaxation time.
    relaxation_times : list of numbers [s]
        T_i, greater than zero.
    friction : number [N] or [N m]
        Largest friction force F_m.
    friction_travel : number [m] or [rad]
        Travel x_2 from rest that reaches half of it.

    Notes
    -----
    A result contains ``value``, ``rate`` and ``force``.
    """

    coordinate: str = field(kw_only=False)
    stiffness: Annotated[Number, Unit(None)]
    rest: Annotated[Number, Unit(None)] = 0.0
    viscous_stiffness: Annotated[Numbers, Unit(None)] = ()
    relaxation_times: Annotated[Numbers, Unit("s")] = ()
    friction: Annotated[Number, Unit(None)] = 0.0
    friction_travel: Annotated[Number | None, Unit(None)] = None

    outputs: ClassVar[dict[str, str]] = {"value": "", "rate": "/s", "force": "effort"}
    dimensions: ClassVar = CoordinateForce.dimensions | {
        "viscous_stiffness": ("N/m", "N*m/rad"),
        "friction": ("N", "N*m"),
        "friction_travel": ("m", "rad"),
    }
    odd: ClassVar[tuple[str, ...]] = ("rest",)
    shows_parts: ClassVar[bool] = False

    def coordinate_text(self) -> str:
        """Return the coordinate."""
        return self.coordinate

    def check(self, n: SimpleNamespace) -> None:
        """Require one stiffness for each relaxation time, a travel for friction, and signs."""
        if not all(word.isidentifier() for word in self.name.split(".")):
            raise ModelError(f"{self.title}: its parts occur in expressions; give it a name of one word")
        nonnegative(self, n, "stiffness", "friction")
        refuse_without_stiffness(self, "rest", 0.0)
        if len(n.viscous_stiffness) != len(n.relaxation_times):
            raise ModelError(
                f"{self.title}: {len(n.viscous_stiffness)} viscous_stiffness and {len(n.relaxation_times)} "
                "relaxation_times are given; each Maxwell element has one of either"
            )
        if not all(x > 0.0 for x in (*n.relaxation_times, *n.viscous_stiffness)):
            raise ModelError(f"{self.title}: viscous_stiffness and relaxation_times must be greater than zero")
        if (self.friction_travel is None) != (n.friction == 0.0):
            raise ModelError(f"{self.title}: friction and friction_travel belong together; give both, or neither")
        if n.friction_travel is not None and not n.friction_travel > 0.0:
            raise ModelError(f"{self.title}: friction_travel is {n.friction_travel:g}; it must be greater than zero")

    def acts(self) -> bool:
        """Return False: its parts act."""
        return False

    def transmitted(self) -> str:
        """Return the curve of the part that carries its force."""
        return f"{self.name}_spring.force"

    def parts(self, model: Model) -> tuple[Element, ...]:
        """Return its states, the event of its turning points, and the spring that carries the force."""
        state: Any = Element.of_type("State")  # controllers are not known here
        speed = f"{self.name}_speed"
        out: list[Element] = [Sensor(speed, f"{self.coordinate}{RATE}")]
        forces = []
        for i, (k, time) in enumerate(zip(self.viscous_stiffness, self.relaxation_times, strict=True), 1):
            forces.append(f"{self.name}_viscous_{i}")
            out.append(state(forces[-1], rate=f"-({k})*{speed} - {forces[-1]}/({time})"))
        if self.friction_travel is not None:
            forces.append(f"{self.name}_friction")
            out += self._friction(state, speed, forces[-1])
        law = " + ".join(forces) or None
        own: Any = {"stiffness": self.stiffness, "rest": self.rest} if self.stiffness != 0.0 else {}
        return (*out, CoordinateSpring(f"{self.name}_spring", self.coordinate, force=law, **own))

    def _friction(self, state: Any, speed: str, force: str) -> tuple[Element, ...]:
        """Return the states of friction, and the events of its turning points.

        Berg's law as a differential equation: dF/dx = -(F_m / x_2) ((F_m + s F) / (F_m + s F_s))^2 with the force F on
        the coordinate and s the direction, which is 0 until friction has first moved. The direction and F_s change
        where the speed exceeds `STILL`, so that what has come to rest but for rounding turns no more.
        """
        most, turned, way = f"({self.friction})", f"{self.name}_turned", f"{self.name}_direction"
        slope, slow = f"{most}/({self.friction_travel})", f"{STILL}*({self.friction_travel})"
        up, down = (f"(({most} {s} {force})/({most} {s} {turned}))**2" for s in "+-")
        rate = f"-{slope}*{speed}*where({way} > 0.5, {up}, where({way} < -0.5, {down}, 1))"
        first = f"abs({force}) - {STILL}*{most}"  # positive once it has moved
        turns = [
            Event(
                f"{self.name}_turns_{name}",
                f"min({s}{speed} - {slow}, where(abs({way}) < 0.5, {first}, -({s}{way})))",
                do=(Set(f"{turned}.value", force), Set(f"{way}.value", f"{s}1")),
            )
            for name, s in (("up", "+"), ("down", "-"))
        ]
        return (state(turned, rate="0"), state(way, rate="0"), state(force, rate=rate), *turns)
