"""Solvers by name. A new one is a file with a kernel, and a line here."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ...compiler.kernels import Kernel
from .admm import admm
from .apgd import apgd
from .barzilai_borwein import barzilai_borwein
from .choose import DOORS, LIMITS, MOST_CONTACTS_UNEVEN, MOST_NODES_UNEVEN, SMALL_ISLANDS, THE_REST, TOLD, Auto, auto
from .gauss_seidel import gauss_seidel
from .islands import room_for_islands
from .jacobi import jacobi
from .lean import lean
from .newton import newton
from .problem import Choices, Problem, Scratch, State
from .rooms import rooms, unfilled

SOLVERS: dict[str, Kernel] = {
    "gauss-seidel": gauss_seidel,
    "newton": newton,
    "jacobi": jacobi,
    "barzilai-borwein": barzilai_borwein,
    "apgd": apgd,
    "apgd-lean": lean,
    "admm": admm,
}
FACTORED = {"newton", "admm"}  # those that want `Factor`: each island by itself, the rest to sweeps where it cannot

# islands up to this size go to Newton, contacts and nodes: with masses that are alike, where 50 sweeps take as long as
# five of its steps, and with uneven ones or joints, where sweeps do not get there
EVEN, UNEVEN = (200, 40), (800, 150)
MANY = 400  # contacts of a crowd
PLACES, NUMBERS = 60, 250  # of `Factor`, for each contact and node of the largest island that is to fit


class Ready(NamedTuple):
    """A solver with its rooms."""

    kernel: Kernel
    F: Auto
    told: np.ndarray  # see `choose`; empty for a solver that does all at once


def names() -> tuple[str, ...]:
    """What solvers may be called."""
    return ("auto", *SOLVERS)


def ready(name: str, P: Problem, X: State, W: Scratch, O: Choices) -> Ready:
    """A solver for problems of these capacities; compiles what it needs.

    Parameters
    ----------
    name : str
        One of `names`.
    P, X, W, O : Problem, State, Scratch, Choices
        As large as they will be.

    Returns
    -------
    Ready
        To be asked for anew when the rooms are enlarged.

    Raises
    ------
    KeyError
        For another name.
    """
    if name != "auto" and name not in FACTORED:
        made = room_for_all(P, False)
        made.doors[THE_REST] = SOLVERS[name].address
        return Ready(auto, made, np.zeros(0, np.int64))
    whole = name != "auto"
    made = room_for_all(P, whole)
    first = SOLVERS["newton" if name == "auto" else name]
    made.doors[SMALL_ISLANDS] = first.address
    if name == "auto" and is_small(len(P.node), len(P.group) - 1, len(P.turn) > 0):
        made.limit[:] = room_for_any(P)  # few bodies: nothing is left for sweeps, which have no door
    else:
        made.doors[THE_REST] = gauss_seidel.address
    return Ready(auto, made, made.told)


def is_small(nodes: int, groups: int, turning: bool) -> bool:
    """Whether Newton's method is all that `auto` needs."""
    return nodes <= EVEN[1] and groups == 0 and not turning


def room_for_any(P: Problem) -> tuple[int, ...]:
    """Limits by which every island is small, of problems of these capacities."""
    nc, nn = len(P.mu), len(P.node)
    return nc, nn, nc, nn, nc


def room_for_all(P: Problem, whole: bool) -> Auto:
    """Rooms of `auto`; ``whole``: for islands of any size."""
    nc, nn, ng, nl = len(P.mu), len(P.node), len(P.group) - 1, len(P.line_at)
    limit = np.zeros(LIMITS, np.int64)
    limit[:] = room_for_any(P) if whole or nn <= EVEN[1] else (*EVEN, *UNEVEN, MANY)
    contacts, nodes = min(nc, int(limit[MOST_CONTACTS_UNEVEN])), min(nn, int(limit[MOST_NODES_UNEVEN]))
    wide = int(P.group[-1]) + 6 * ng
    islands = room_for_islands(nc, nn, ng, nl)
    most = len(islands.island) + 1
    Q = unfilled(nc, nn, ng, nl, 0, len(P.turn) > 0)._replace(
        node=P.node, group=P.group, J=P.J, Y=P.Y, least=np.zeros(len(P.least)),
        **{k: np.zeros(most, np.int64) for k in ("island", "member_p", "line_p")},
    )  # fmt: skip
    size = contacts + nodes + nl + wide
    fill = min(nodes * nodes // 2, 40 * nodes)
    return Auto(
        np.zeros(NUMBERS * size + 72 * fill),
        np.zeros(PLACES * size + 4 * fill + nn + 3 * ng, np.int64),
        Q, rooms(Q)[0], islands, np.zeros(most, np.int64),
        np.zeros(DOORS, np.int64), limit, np.zeros(TOLD, np.int64),
    )  # fmt: skip
