"""SpeedDriver: throttle and brake that hold the speed of a vehicle."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Annotated, Any, ClassVar

from ..model.controller import Controller, ControlState
from ..model.element import Law, Number, Unit, element, positive


@element
class SpeedDriver(Controller):
    """A driver who follows a speed: PI control of ``throttle`` and ``brake``, each from 0 to 1.

    With the error e = setpoint - measured and the integral I, the demand u = kp e + I opens the throttle if it is
    positive and presses the brake if it is negative; pedal positions end at 1. The integral follows I' = ki e +
    (u_lim - u) ki / kp, where u_lim is u limited to -1 to 1, so that it does not wind up at full throttle.

    Laws name the outputs ``NAME.throttle`` and ``NAME.brake``, and ``NAME.error``, ``NAME.demand``.

    Parameters
    ----------
    name : str
    setpoint : expression [m/s]
        Speed to be followed: an expression of ``t``, parameters and sensors.
    measured : expression [m/s]
        Speed of the vehicle: ``"frame.vx"``.
    kp : number [s/m]
        Demand by error.
    ki : number [1/m]
        Rate of the integral by error; kp / ki is the integral time.
    initial : number
        Initial value of the integral: the throttle of a steady start.
    period, offset : number [s], optional
        It is sampled at offset, offset + period, ...

    Notes
    -----
    Anti-windup by back-calculation: K. J. Astrom and T. Hagglund, *Advanced PID Control*, ISA 2006, section 3.5. A
    vehicle of mass m whose driving force is F u, without resistance, has the characteristic equation m s^2 + F kp s + F
    ki = 0.
    """

    setpoint: Law
    measured: Law
    kp: Annotated[Number, Unit("s/m")]
    ki: Annotated[Number, Unit("1/m")]
    initial: Annotated[Number, Unit("1")] = 0.0

    compared: ClassVar[tuple[str, ...]] = ("setpoint", "measured")

    @property
    def output_names(self) -> tuple[str, ...]:
        """Return the names of the pedals."""
        return ("throttle", "brake")

    def check(self, n: SimpleNamespace) -> None:
        """Refuse gains that are not positive."""
        super().check(n)
        positive(self, n, "kp", "ki")

    def given(self) -> dict[str, Any]:
        """Return inputs and gains."""
        own = {k: getattr(self, k) for k in ("setpoint", "measured", "kp", "ki", "period")}
        return {k: v for k, v in own.items() if v is not None}

    def signals(self) -> dict[str, str]:
        """Return the pedals, the demand and the error."""
        return {
            "throttle": "max(min(demand, 1), 0)",
            "brake": "max(min(-demand, 1), 0)",
            "demand": "kp*error + integral",
            "error": "setpoint - measured",
            "setpoint": "setpoint",
            "measured": "measured",
        }

    def states(self, n: SimpleNamespace) -> tuple[ControlState, ...]:
        """Return the integral."""
        time = "max(period, kp/ki)" if self.sampled else "(kp/ki)"
        rate = f"ki*error + (throttle - brake - demand)/{time}"
        return (ControlState("integral", f"integral + period*({rate})" if self.sampled else rate, n.initial),)
