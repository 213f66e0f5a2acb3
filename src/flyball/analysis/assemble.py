"""Assembly: from rough guesses to positions and velocities that fulfil every constraint.

Positions by damped Gauss-Newton with steps of least weighted size, first on residuals that are true angles (they lead
from far away, and never to an antiparallel joint), then on the rows of the motion. Velocities as described where the
constraints allow it; what is not described is free. What fulfils the constraints already is left alone.
"""

from __future__ import annotations

from collections.abc import Mapping

from ..model.model import Model
from .assembly.start import Assembly, assembled


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
    from .freedom.contradiction import story  # mobility stands on assembly

    return assembled(model, t=t, parameters=parameters, why=story)
