"""Gear box with a clutch: gears that are shifted by events, with the clutch open meanwhile."""

from __future__ import annotations

from dataclasses import field
from itertools import pairwise
from types import SimpleNamespace
from typing import TYPE_CHECKING, Annotated, Any, ClassVar

from ..errors import ModelError
from ..model.body import RATE
from ..model.controller import Sensor
from ..model.element import Element, Law, LawOf, Number, Numbers, Unit, element, positive, resolve
from ..model.event import Event, Set
from ..model.force import CoordinateForce
from ..model.table import Table
from .clutch import Brake

if TYPE_CHECKING:
    from ..model.model import Model

START_DELAY = 1e-6  # part of the duration of a shift after which a motion from t = 0 may have its first one


@element
class GearBox(CoordinateForce):
    """A gear box with its clutch, between two coordinates, such as the angles of crankshaft and propeller shaft.

    In gear k the clutch acts along the slip s = angle_i - ratio_k angle_j: closed, it holds the slip rate at zero, so
    that torques and inertias are transmitted by the ratio; slipping, it transmits its capacity against the slip, which
    becomes heat, minus the ``work`` of ``NAME_k``. A shift opens the clutch, changes the gear, and closes the clutch:
    the capacity falls to zero over the time ``opening`` and returns over ``closing``. No velocity jumps. Inertias of
    the box itself belong to either side.

    Automatic shifts follow the speed that the input would have without slip, ratio_k rate_j: to the next higher gear
    above ``up``, to the next lower one below ``down``. Events of the user shift as well: ``Set("NAME_target.value",
    3)`` with ``Set("NAME_shifted.value", "t")``. Gear 0 is neutral.

    Its parts belong to it: a `Brake` along the slip of every gear, ``NAME_1``, ``NAME_2``, ..., the states
    ``NAME_gear``, ``NAME_target`` (the gear that comes) and ``NAME_shifted`` (time at which its shift began), and the
    events ``NAME_up``, ``NAME_down`` and ``NAME_engages``.

    Parameters
    ----------
    name : str
        One word, as the parts are named in expressions.
    coordinate_i, coordinate_j : str
        Input and output: ``"crank.angle"``, ``"shaft.angle"``.
    ratios : list of numbers
        Input speed by output speed of gear 1, 2, ...; a reverse gear has a negative one.
    capacity : law [N m]
        Largest torque of the closed clutch, at the input: an expression of ``t``, sensors, parameters and controllers.
    pedal : law
        Factor of the capacity, from 0, pressed, to 1, for starting: ``"step(speed, 600 rpm, 0, 1000 rpm, 1)"``.
    gear : int
        Gear at the start.
    up, down : number [rad/s]
        Input speeds of shifts; none if not given. With them all ratios are positive and descend, and ``up`` is so much
        greater than ``down`` that a shift is not followed by the reverse one: up / down > ratio_k / ratio_k+1.
    opening, closing : number [s]
        Times in which the clutch opens and closes.

    Notes
    -----
    A gear that is engaged by a synchroniser behind an open clutch accelerates the disc and the shafts of the box only;
    their small inertia counts to the input or output here, and the clutch does the synchronising.
    """

    coordinate_i: str = field(kw_only=False)
    coordinate_j: str = field(kw_only=False)
    ratios: Annotated[Numbers, Unit("1")]
    capacity: Annotated[Law, LawOf("N*m")]
    pedal: Annotated[Law, LawOf("1")] = 1.0
    gear: int = 1
    up: Annotated[Number | None, Unit("rad/s")] = None
    down: Annotated[Number | None, Unit("rad/s")] = None
    opening: Annotated[Number, Unit("s")] = 0.2
    closing: Annotated[Number, Unit("s")] = 0.5

    odd: ClassVar[tuple[str, ...]] = ()
    outputs: ClassVar[dict[str, str]] = {}
    shows_parts: ClassVar[bool] = False

    def check(self, n: SimpleNamespace) -> None:
        """Require ratios, gears and shift speeds that fit."""
        if not all(word.isidentifier() for word in self.name.split(".")):
            raise ModelError(f"{self.title}: its parts occur in expressions; give it a name of one word")
        ratios = [float(x.real) for x in n.ratios]
        if len(ratios) < 2 or not all(ratios):
            raise ModelError(f"{self.title}: ratios is {tuple(ratios)}; give two or more, none of them 0")
        if not 0 <= self.gear <= len(ratios):
            raise ModelError(f"{self.title}: gear is {self.gear}; it must be from 0, neutral, to {len(ratios)}")
        positive(self, n, "opening", "closing", "up", "down")
        if n.up is None and n.down is None:
            return
        steps = [a / b for a, b in pairwise(ratios)]
        if min(ratios) < 0.0 or min(steps) <= 1.0:
            raise ModelError(f"{self.title}: with up or down, ratios are positive and descend; got {tuple(ratios)}")
        if n.up is not None and n.down is not None and not n.up.real > max(steps) * n.down.real:
            raise ModelError(
                f"{self.title}: up is {n.up:g} rad/s and down {n.down:g} rad/s; after a shift up from the ratio "
                f"{max(steps):.4g} times the next one it would shift down again: give up more than {max(steps):.4g} "
                "times down"
            )

    def acts(self) -> bool:
        """Return False: its parts act."""
        return False

    def parts(self, model: Model) -> tuple[Element, ...]:
        """Return the states, the events, and the clutch in every gear."""
        state: Any = Element.of_type("State")  # controllers are not known here
        gear, target, shifted = (f"{self.name}_{x}" for x in ("gear", "target", "shifted"))
        since, opening = f"(t - {shifted})", f"({self.opening})"
        closed = f"1 - step({since}, 0, 0, {opening}, 1) + step({since}, {opening}, 0, {opening} + ({self.closing}), 1)"
        capacity = f"({self.capacity})*({self.pedal})*({closed})"
        return (
            state(gear, rate="0", initial=self.gear),
            state(target, rate="0", initial=self.gear),
            state(shifted, rate="0", initial=f"-(1 - {START_DELAY})*({opening} + ({self.closing}))"),
            *self._schedule(resolve(self, model.environment()).ratios, target, shifted),
            Event(f"{self.name}_engages", f"{since} - {opening}", do=(Set(f"{gear}.value", target),)),
            *(
                Brake(
                    f"{self.name}_{k}",
                    (self.coordinate_i, self.coordinate_j),
                    weights=(1.0, f"-({ratio})"),
                    capacity=f"{capacity}*{engaged(gear, k, len(self.ratios))}",
                )
                for k, ratio in enumerate(self.ratios, 1)
            ),
        )

    def _schedule(self, ratios: tuple[float, ...], target: str, shifted: str) -> tuple[Element, ...]:
        """Return the automatic shifts: a speed is passed, no shift is under way, and there is a next gear."""
        if self.up is None and self.down is None:
            return ()
        count, speed = len(self.ratios), f"{self.name}_speed"
        ratio = Table(
            f"{self.name}_ratio",
            x=tuple(map(float, range(1, count + 1))),
            y=ratios,
            interpolation="linear",
            beyond="hold",
        )
        input_speed = f"{ratio.name}({target})*{speed}"
        over = f"t - {shifted} - ({self.opening}) - ({self.closing})"
        shifts = []
        for name, limit, by in (("up", self.up, 1), ("down", self.down, -1)):
            if limit is None:
                continue
            passed = f"{input_speed} - ({limit})" if by > 0 else f"({limit}) - {input_speed}"
            left = f"{count - 0.5} - {target}" if by > 0 else f"{target} - 1.5"
            do = (Set(f"{target}.value", f"{target} + {by}"), Set(f"{shifted}.value", "t"))
            shifts.append(Event(f"{self.name}_{name}", f"min({passed}, {over}, {left})", do=do))
        return (Sensor(speed, f"{self.coordinate_j}{RATE}"), ratio, *shifts)


def engaged(gear: str, k: int, count: int) -> str:
    """Return an expression that is 1 where the whole number ``gear`` is k, 0 where it is another one from 0 to count.

    It is Lagrange's polynomial, which has no corners that a motion would have to watch.
    """
    factors = [f"({gear} - {j})/{k - j}" for j in range(count + 1) if j != k]
    return f"({'*'.join(factors)})"
