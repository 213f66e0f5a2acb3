"""What surfaces are to each other, in arrays: carried beside the geometry, for whoever turns contacts into impulses."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

# columns of Surfaces.pair
MU, STATIC, ACROSS, STATIC_ACROSS, RESTITUTION, ROLLING, SPINNING, GRAIN = range(8)
# Surfaces.pair[..., GRAIN]: whose grain friction is counted from
NO_GRAIN, GRAIN_1, GRAIN_2 = range(3)
# columns of Surfaces.own
MOVES, ALONG = 0, 3


class Surfaces(NamedTuple):
    """Numbers of every pair of surfaces; which surface a shape has is its MATERIAL in the geometry.

    Friction with a grain: ``MU`` and ``STATIC`` along it, the others across it; without one all are alike. Where the
    grain stands square on the surface, those across hold all around.
    """

    pair: np.ndarray  # (surfaces, surfaces, 8): friction of sliding, of rest, the same across the grain; restitution;
    # rolling and spinning friction [m]; whose grain counts, that of shape 1 or of shape 2
    own: np.ndarray  # (ns, 6): velocity of the shape's surface relative to its mover [m/s], its grain (a unit vector,
    # or 0); in the mover's axes
