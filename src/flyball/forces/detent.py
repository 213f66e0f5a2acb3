"""Detent: notches that hold a coordinate until the force exceeds a limit."""

from __future__ import annotations

from dataclasses import field
from types import SimpleNamespace
from typing import Annotated, ClassVar

import numpy as np

from ..compiler.formulas import formula
from ..errors import ModelError
from ..math.scalar import cos, sin
from ..model.element import Number, Unit, element, nonnegative, positive
from ..model.force import CoordinateForce

KIND = 9


@formula
def effort(par, x, rate, laws, load):
    """Return the effort along x: -T sin(2 pi (x - x_0) / p) - c rate."""
    return -par[0] * sin(par[1] * (x - par[2])) - par[3] * rate


@formula
def energy(par, x):
    """Potential energy T p / (2 pi) (1 - cos(2 pi (x - x_0) / p)) [J]."""
    return par[0] / par[1] * (1.0 - cos(par[1] * (x - par[2])))


@element
class Detent(CoordinateForce):
    """Notches at a pitch: a click wheel, a stepping motor at rest, a ball that a spring presses into a row of dimples.

    The law is a sine: -holding sin(2 pi (x - notch) / pitch) - damping rate. The coordinate rests in any notch, with
    the stiffness 2 pi holding / pitch there; a force greater than ``holding`` moves it out. The restoring force is
    largest a quarter of a pitch from a notch; half way between two notches is an unstable equilibrium. The energy
    barrier between notches is holding pitch / pi. For friction add a `JointFriction`.

    Parameters
    ----------
    name : str
    coordinate : str
        ``"joint.coordinate"``, or a world coordinate of a body's or frame's origin.
    pitch : number [rad] or [m]
        Distance between notches.
    holding : number [N] or [N m]
        Greatest force or torque that it can resist; or give ``barrier``.
    barrier : number [J]
        Energy needed to move from one notch to the next.
    notch : number [rad] or [m]
        Value of the coordinate in one of the notches.
    damping : number [N s/m] or [N m s/rad]
        Viscous damping, at every position.
    """

    coordinate: str = field(kw_only=False)
    pitch: Annotated[Number, Unit(None)]
    holding: Annotated[Number | None, Unit(None)] = None
    barrier: Annotated[Number | None, Unit("J")] = None
    notch: Annotated[Number, Unit(None)] = 0.0
    damping: Annotated[Number, Unit(None)] = 0.0

    kind: ClassVar[int] = KIND
    odd: ClassVar[tuple[str, ...]] = ("notch",)
    effort: ClassVar = staticmethod(effort)
    energy: ClassVar = staticmethod(energy)
    dimensions: ClassVar = CoordinateForce.dimensions | {
        "pitch": ("m", "rad"),
        "notch": ("m", "rad"),
        "holding": ("N", "N*m"),
    }
    outputs: ClassVar[dict[str, str]] = {"value": "", "rate": "/s", "force": "effort"}

    def coordinate_text(self) -> str:
        """Return the coordinate as given."""
        return self.coordinate

    def check(self, n: SimpleNamespace) -> None:
        """Require a pitch, and either holding or barrier."""
        positive(self, n, "pitch", "holding", "barrier")
        nonnegative(self, n, "damping")
        if (n.holding is None) == (n.barrier is None):
            raise ModelError(f"{self.title}: give holding= or barrier=, one of them")

    def parameters(self, n: SimpleNamespace, separation: float) -> tuple[float, ...]:
        """Return the parameters of the formulas."""
        holding = n.holding if n.barrier is None else np.pi * n.barrier / n.pitch
        return (holding, 2.0 * np.pi / n.pitch, n.notch, n.damping)

    def conservative(self) -> bool:
        """Return whether it has no damping, so that it only exchanges stored energy."""
        return self.damping == 0.0
