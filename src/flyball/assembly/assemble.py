"""`assemble`: positions and velocities that satisfy every constraint, or an explanation of the contradiction.

Positions are found by damped Gauss-Newton with steps of least weighted size: first with residuals that are true angles
(they converge from far away, and never to an antiparallel joint), then with the constraint rows. Velocities are as
described where the constraints allow it; velocities not described are free.

Explanation of contradictory velocities: drivers and initial rates prescribe motion, joints only restrain it. Where
constraints are dependent and their right-hand sides are inconsistent, either several prescribe the same freedom, or
there is no freedom, or the free motion does not move the prescribed coordinate (in any position, or in this one).
"""

from __future__ import annotations

from collections.abc import Mapping

from ..model.model import Model
from .assembled_state import Assembly, consistent_state


def assemble(model: Model, *, t: float = 0.0, parameters: Mapping[str, float] | None = None) -> Assembly:
    """Find positions and velocities that fulfil all constraints at time t, near those described.

    Parameters
    ----------
    model : Model
    t : float [s]
    parameters : mapping, optional
        Values of parameters in SI units, in place of the model's.

    Returns
    -------
    Assembly
        ``departures`` lists the deviations from the description.

    Raises
    ------
    AssemblyError
        If no closed position, or no consistent velocity, is found; the message names the joints that disagree, by how
        much, and why.
    """
    from ..mobility.mobility import explain_contradiction  # mobility imports assembly

    return consistent_state(model, t=t, parameters=parameters, explain=explain_contradiction)
