"""Sensors: named outputs, which laws of forces and drivers may use by name."""

from __future__ import annotations

from dataclasses import field
from typing import ClassVar

from .element import Element, element


@element
class Sensor(Element):
    """A measured quantity with a name of its own.

    Positions, angles, lengths and their rates may be named in the laws of forces; positions, angles and lengths in
    those of drivers too. Whatever depends on accelerations (reactions, accelerations themselves) is an output only.
    Sampling never forces the integrator to a step.

    Parameters
    ----------
    name : str
        Its name in results and in laws.
    of : str
        What it measures, a curve of the result: ``"A.angle"``, ``"A.rate"``, ``"tip.y"``, ``"tip.vy"``,
        ``"spring.length"``, ``"A.fx"``, ``"energy.kinetic"``.
    """

    of: str = field(kw_only=False)

    category: ClassVar[str] = "sensors"

    def ends(self) -> dict[str, str]:
        """It has no frame of its own."""
        return {}


@element
class IMU(Element):
    """An inertial measurement unit fixed on a body: what accelerometers and gyroscopes in it would show.

    Its curves are the specific force ``fx``, ``fy``, ``fz`` [m/s^2] (acceleration of its origin less gravity) and the
    angular velocity ``wx``, ``wy``, ``wz`` [rad/s], both along its own axes. In the plane: ``fx``, ``fy``, ``w``.

    Parameters
    ----------
    name : str
    frame : str
        Body or frame that it is fixed to; it has its origin and axes.
    """

    frame: str = field(kw_only=False)

    category: ClassVar[str] = "sensors"

    def ends(self) -> dict[str, str]:
        """At the frame."""
        return {"M": self.frame}
