"""GravityCompensatedPD: PD control of joints with the efforts that hold the robot's weight."""

from __future__ import annotations

from typing import ClassVar

from ..model.element import element
from .joint_controller import JointController


@element
class GravityCompensatedPD(JointController):
    """PD control with gravity compensation: tau = kp (r - q) + kd (rd - qd) + g(q).

    g are the efforts that hold the weight of the controller's model at rest. If it is exact and nothing else acts, a
    constant reference is the only equilibrium, and stable for all positive gains.

    The outputs are efforts along the coordinates, named by the joints: of a controller ``pd`` the motor of joint ``A``
    has ``torque="pd.A"``. The errors are ``pd.A_error``.

    Parameters
    ----------
    name : str
    coordinates : list of str
        Coordinates of joints, all those of the model: ``["A.angle", "B.displacement"]``.
    reference : list of expressions [rad or m]
        References r, one for each coordinate, or one for all.
    kp, kd : list of expressions [N m/rad and N m s/rad, or N/m and N s/m]
        Gains of errors and of their rates, one for each coordinate, or one for all.
    reference_rate : list of expressions, optional
        By default the derivative of the reference by time, which must then be an expression of ``t`` and parameters.
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
    Source: M. Takegaki, S. Arimoto, *A new feedback method for dynamic control of manipulators*, 1981; B. Siciliano and
    others, *Robotics*, 2009, section 8.5.1.
    """

    in_files: ClassVar[bool] = True

    def effort(self, k: int) -> str:
        """Return feedback and weight."""
        return f"kp_{k}*(reference_{k} - q_{k}) + kd_{k}*(reference_rate_{k} - v_{k}) + model_{k}"
