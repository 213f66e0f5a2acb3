"""ComputedTorque: feedback linearisation of a robot by its own inverse dynamics."""

from __future__ import annotations

from typing import ClassVar

from ..model.element import element
from .joint_controller import JointController, JointLaws


@element
class ComputedTorque(JointController):
    """Computed torque control: tau = M(q) (rdd + kd (rd - qd) + kp (r - q)) + h(q, qd).

    M and h (Coriolis, centrifugal and gyroscopic efforts less gravity) are those of the controller's model. If it is
    exact and nothing else acts, the errors of the coordinates obey e'' + kd e' + kp e = 0.

    The outputs are efforts along the coordinates, named by the joints: of a controller ``ctc`` the motor of joint ``A``
    has ``torque="ctc.A"``. The errors are ``ctc.A_error``, the commanded accelerations ``ctc.A_acceleration``.

    Parameters
    ----------
    name : str
    coordinates : list of str
        Coordinates of joints, all those of the model: ``["A.angle", "B.displacement"]``.
    reference : list of expressions [rad or m]
        References r, one for each coordinate, or one for all.
    kp, kd : list of expressions [1/s^2, 1/s]
        Gains of errors and of their rates, one for each coordinate, or one for all.
    reference_rate, reference_acceleration : list of expressions, optional
        By default the derivatives of the reference by time, which must then be an expression of ``t`` and parameters.
    base : str, optional
        Body that carries the joints, if it is not ground. The controller's model treats it as fixed in its reference
        orientation, even if it moves: gravity then has another direction in a tilted robot.
    ignored : list of str, optional
        Bodies that the model lacks, with their joints: a load, parts that close loops.
    parameters : dict, optional
        Values of parameters in the model where they differ from the mechanism's, to see the effect of errors:
        ``{"load": 0}``, ``{"load": "0.8*load"}``.
    period, offset : number [s], optional
        It is sampled at offset, offset + period, ...

    Notes
    -----
    The model has bodies, joints and gravity. Springs, dampers, friction and contacts are not part of it. Source: J. Y.
    S. Luh, M. W. Walker, R. P. C. Paul, *Resolved-acceleration control of mechanical manipulators*, 1980; B. Siciliano
    and others, *Robotics*, 2009, section 8.5.2.
    """

    reference_acceleration: JointLaws = ()

    in_files: ClassVar[bool] = True

    @property
    def referred(self) -> tuple[str, ...]:
        """Return the fields with one law for each coordinate, or one for all."""
        return (*super().referred, "reference_acceleration")

    def effort(self, k: int) -> str:
        """Return the inverse dynamics at the commanded accelerations."""
        return f"model_{k}"

    def command(self, k: int) -> str:
        """Return the commanded acceleration."""
        return f"reference_acceleration_{k} + kd_{k}*(reference_rate_{k} - v_{k}) + kp_{k}*(reference_{k} - q_{k})"

    def signals(self) -> dict[str, str]:
        """Return the efforts, the errors, and the commanded accelerations."""
        return super().signals() | {f"{name}_acceleration": self.command(k) for k, name in enumerate(self.output_names)}
