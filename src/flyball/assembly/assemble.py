"""`assemble`: positions and velocities that fulfil every constraint, or an explanation of the contradiction.

Positions by damped Gauss-Newton with steps of least weighted size, first on residuals that are true angles (they
lead from far away, and never to an antiparallel joint), then on the constraint rows. Velocities as described
where the constraints allow it; what is not described is free.

Why constraints contradict one another: drivers and initial rates prescribe, joints only hold. Where the
constraints depend on one another and their right-hand sides do not, several prescribe the same freedom, or
nothing is free, or the free motion does not move the prescribed coordinate: nowhere, or not in this position.
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
        ``departures`` says what of the description it does not have.

    Raises
    ------
    AssemblyError
        If no closed position, or no consistent velocity, is found; the message names the joints that disagree, by how
        much, and why.
    """
    from ..mobility.contradictions import explain_contradiction  # mobility stands on assembly

    return consistent_state(model, t=t, parameters=parameters, explain=explain_contradiction)
