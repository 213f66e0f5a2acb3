"""PID: proportional, integral, derivative; with limits, anti-windup and a filtered derivative."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Annotated, Any, ClassVar, Literal

from ..errors import ModelError
from ..model.controller import Controller, ControlState
from ..model.element import Law, Number, Unit, element, positive
from ..model.units import same_kind

BACK, CLAMPING = "back-calculation", "clamping"


@element
class PID(Controller):
    """A PID controller: u = kp (b r - y) + I + D, I' = ki (r - y), D = kd s / (1 + filter s) (c r - y).

    r is the set point, y the measured value, e = r - y. The output is u within its limits. Gains are expressions, so
    that they may depend on time or measured values (scheduled gains).

    Parameters
    ----------
    name : str
    setpoint, measured : expression
        Expressions of ``t``, parameters, sensors, curves such as ``A.angle``, and controllers.
    kp, ki, kd : expression
        Gains: of the error, of its integral over time, of its derivative.
    filter : number [s]
        Time constant of the derivative's filter; required if ``kd`` is given.
    lower, upper : expression, optional
        Limits of the output. A motion stops with an error if the lower limit exceeds the upper one.
    anti_windup : {"back-calculation", "clamping", "none"}
        Treatment of the integral while the output is at a limit: back-calculation, I' = ki e + (u_limited - u) /
        tracking; clamping: it stays constant while the error would drive it further beyond the limit; none: it
        continues.
    tracking : number [s], optional
        Time constant of the back-calculation; if not given sqrt(kd/ki), without a derivative kp/ki.
    setpoint_weight, derivative_weight : number
        b and c: weights of the set point in the proportional part and in the derivative.
    bias : expression
        Added to the output before limits, for instance to compensate gravity.
    initial : number
        Initial value of the integral part I.
    initial_measured : number
        Measured value before the start, for the derivative: a different value at the start acts as a jump.
    period, offset : number [s], optional
        It is sampled at offset, offset + period, ...: I by Euler's rule, D by backward differences.

    Notes
    -----
    Sources: K. J. Astrom and T. Hagglund, *Advanced PID Control*, ISA 2006: set-point weighting (section 3.4), filtered
    derivative (3.3), back-calculation and tracking time (3.5: between Td and Ti, sqrt(Ti Td) proposed), conditional
    integration, "clamping" (3.5).
    """

    setpoint: Law
    measured: Law
    kp: Law = 0.0
    ki: Law = 0.0
    kd: Law = 0.0
    filter: Annotated[Number | None, Unit("s")] = None
    lower: Law | None = None
    upper: Law | None = None
    anti_windup: Literal["back-calculation", "clamping", "none"] | None = None
    tracking: Annotated[Number | None, Unit("s")] = None
    setpoint_weight: Annotated[Number, Unit("1")] = 1.0
    derivative_weight: Annotated[Number, Unit("1")] = 0.0
    bias: Law = 0.0
    initial: Annotated[Number, Unit(None)] = 0.0
    initial_measured: Annotated[Number, Unit(None)] = 0.0

    compared: ClassVar[tuple[str, ...]] = ("setpoint", "measured")

    @property
    def windup(self) -> str:
        """Return the anti-windup method; by default back-calculation if there are limits and an integral."""
        return self.anti_windup or (BACK if self._limited and self.ki != 0.0 else "none")

    @property
    def _limited(self) -> bool:
        return self.lower is not None or self.upper is not None

    def check(self, n: SimpleNamespace) -> None:
        """Refuse fields without effect, and missing fields."""
        super().check(n)
        if self.kp == 0.0 and self.ki == 0.0 and self.kd == 0.0:
            raise ModelError(f"{self.title}: it has no gains; give at least one of kp, ki, kd")
        if self.kd != 0.0 and self.filter is None:
            raise ModelError(
                f"{self.title}: a derivative needs a filter; give filter=..., a tenth of kd/kp for instance: the "
                "derivative of a signal that jumps is infinite"
            )
        positive(self, n, "filter", "tracking")
        for name, needs, there in (
            ("filter", "kd", self.kd != 0.0),
            ("derivative_weight", "kd", self.kd != 0.0 or n.derivative_weight == 0.0),
            ("setpoint_weight", "kp", self.kp != 0.0 or n.setpoint_weight == 1.0),
            ("anti_windup", "limits and ki", self._limited and self.ki != 0.0),
            ("tracking", f"anti_windup={BACK!r}", self.windup == BACK),
            ("initial", "ki", self.ki != 0.0 or n.initial == 0.0),
            ("initial_measured", "kd", self.kd != 0.0 or n.initial_measured == 0.0),
        ):
            if getattr(self, name) is not None and not there:
                raise ModelError(f"{self.title}: {name} does nothing without {needs}; leave it out")
        if self.windup == BACK and self.tracking is None and self.kp == 0.0 and self.kd == 0.0:
            raise ModelError(
                f"{self.title}: without kp and kd the rate of the back-calculation is not determined; give tracking"
            )
        if isinstance(self.lower, str) and isinstance(self.upper, str):
            same_kind(self.lower, self.upper, f"{self.title}: lower")
        if isinstance(self.lower, float) and isinstance(self.upper, float) and not self.lower < self.upper:
            raise ModelError(f"{self.title}: lower is {self.lower:g}, upper {self.upper:g}; lower must be less")

    def ordered(self) -> tuple[str, str] | None:
        """Return limits that are expressions and may cross."""
        plain = isinstance(self.lower, float) and isinstance(self.upper, float)
        return None if plain or self.lower is None or self.upper is None else ("lower", "upper")

    def unlimited(self) -> PID:
        """Return the controller without limits, which needs no anti-windup."""
        if not self._limited:
            return self
        return replace(self, lower=None, upper=None, anti_windup=None, tracking=None)

    def smoother(self, state: str) -> str:
        """Return the replacement for clamping, which makes the rate of the integral jump."""
        if state != "integral" or self.windup != CLAMPING:
            return ""
        return (
            f"anti_windup={CLAMPING!r} stops and restarts the integral abruptly: give anti_windup={BACK!r}, which "
            "changes it smoothly, or 'none'"
        )

    def given(self) -> dict[str, Any]:
        """Return inputs, gains and limits."""
        numbers = ("kp", "ki", "kd", "filter", "lower", "upper", "tracking", "bias", "period")
        own = {k: getattr(self, k) for k in ("setpoint", "measured", *numbers)}
        return {k: v for k, v in own.items() if v is not None} | {
            "weight_p": self.setpoint_weight,
            "weight_d": self.derivative_weight,
        }

    def called(self, given: str) -> str:
        """Return the field name of a weight."""
        return {"weight_p": "setpoint_weight", "weight_d": "derivative_weight"}.get(given, given)

    def signals(self) -> dict[str, str]:
        """Return the limited output, the unlimited output, the error and the parts."""
        parts = {}
        if self.kp != 0.0:
            parts["proportional"] = "kp*error" if self.setpoint_weight == 1.0 else "kp*(weight_p*setpoint - measured)"
        if self.kd != 0.0:
            parts["derivative"] = "kd/filter*(damped - slow)"
            if self.sampled:
                parts["derivative"] = "filter/(filter + period)*before + kd/(filter + period)*(damped - last)"
        total = " + ".join([*parts, *(["integral"] if self.ki != 0.0 else []), *(["bias"] if self.bias != 0.0 else [])])
        out = "unlimited" if self.lower is None else "max(unlimited, lower)"
        out = out if self.upper is None else f"min({out}, upper)"
        if self.ordered():  # nan where the limits cross
            out = f"where(lower > upper, (upper - lower)**0.5, {out})"
        inner = {"damped": "-measured" if self.derivative_weight == 0.0 else "weight_d*setpoint - measured"}
        return {
            "output": out,
            "setpoint": "setpoint",
            "measured": "measured",
            "error": "setpoint - measured",
            "unlimited": total,
            **parts,
            **(inner if self.kd != 0.0 else {}),
        }

    def states(self, n: SimpleNamespace) -> tuple[ControlState, ...]:
        """Return the integral part, and the state of the derivative filter."""
        out = []
        if self.ki != 0.0:
            rate = self._rate_of_integral()
            out.append(ControlState("integral", f"integral + period*({rate})" if self.sampled else rate, n.initial))
        before = f"-({n.initial_measured})" if isinstance(n.initial_measured, str) else -n.initial_measured
        if self.kd != 0.0 and self.sampled:
            out += [ControlState("before", "derivative"), ControlState("last", "damped", before)]
        elif self.kd != 0.0:
            out.append(ControlState("slow", "(damped - slow)/filter", before))
        return tuple(out)

    def _rate_of_integral(self) -> str:
        """Return the integrand."""
        if self.windup == BACK:
            usual = "sqrt(kd/ki)" if self.kd != 0.0 else "kp/ki"
            time = usual if self.tracking is None else "tracking"
            # a sampled controller takes back at most the whole excess at one instant
            back = f"max(period, {time})" if self.sampled else time
            return f"ki*error + (output - unlimited)/({back})"
        if self.windup == CLAMPING:
            beyond = []
            beyond += ["unlimited > upper and ki*error > 0"] if self.upper is not None else []
            beyond += ["unlimited < lower and ki*error < 0"] if self.lower is not None else []
            condition = " or ".join(f"({x})" for x in beyond)
            return f"where({condition}, 0, ki*error)"
        return "ki*error"
