"""What steps by impulses compile, known before they are taken."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..compiler.beside import Wanted
from ..contact import finder
from ..contact.surfaces import Surfaces
from ..contact.tables import Geometry
from ..equations.engine import engine
from ..numerics.cone import registry
from ..numerics.cone.rooms import rooms, unfilled
from .joined import no_mechanism
from .joints import joined, joined_kernel
from .march import march_kernel
from .solvers import Solvers
from .tables import Free, Pace, Tracks


class Needed(NamedTuple):
    """What compiles; and what else stands behind a door: the engine, which the start compiles, or what is not there."""

    behind: list[Wanted]
    wanted: list[Wanted]


def needed(geometry: Geometry, solver: str, small: bool, mechanism: bool) -> Needed:
    """What a motion needs.

    Parameters
    ----------
    geometry : Geometry
    solver : str
        Of the cone problems.
    small : bool
        Whether the problem is; see `registry.is_small`.
    mechanism : bool
        Whether joints, forces or drivers hold bodies.
    """
    search = finder.needed(geometry)
    G, M, C, _, B = search[-1][1]
    solvers = registry.needed(solver, small)
    P, F = unfilled(1, 1), solvers[-1][1][4]
    X, W, O, _ = rooms(P)
    A = no_mechanism()
    none, long = np.zeros((0, 0)), np.zeros(0, np.int64)
    tail = Free(none, none, none, none, none), Surfaces(np.zeros((0, 0, 0)), none, none), Pace(np.zeros(0), long, long)
    args = G, A, M, C, C, C, B, P, P, P, X, X, X, X, W, O, Solvers(F, F, F), *tail, Tracks(none), Tracks(none)
    behind: list[Wanted] = [(joined, (A, M, C, P, X)), (joined_kernel, (0, A, M, C, P, X, 0))]
    rest: list[Wanted] = [*search, *solvers, (march_kernel, args)]
    if not mechanism:
        return Needed(behind[:1], rest)
    return Needed([(engine, (A.S, A.W, A.R, A.clock, A.sheet))], [*behind, *rest])
