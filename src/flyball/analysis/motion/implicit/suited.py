"""What implicit integrators know, and in which coordinates they are at their best; the rest is refused by name."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from ....errors import ModelError
from ....results.doubts import open_loads
from ...linear.derivatives import refuse_functions
from ...mobility import mobility
from ..start import Start, begin_at
from ..stiff import EXPLICIT
from .layout import layout

RADAU, ALPHA, VARIATIONAL = "radau", "generalised-alpha", "variational"
IMPLICIT = (RADAU, ALPHA, VARIATIONAL)
"""Integrators with loops of their own, by name."""
EVEN = (ALPHA, VARIATIONAL)
"""Those of them whose steps are of one width, which has to be given."""
RHO = 0.8  # spectral radius at infinity of generalised-alpha, where none is given
FEW = 40  # groups of joint coordinates that no equation sees together, up to which these cost less than absolute ones


def explicit(method: str) -> str:
    """The explicit integrator that computes what an implicit one does not know."""
    return EXPLICIT if method in IMPLICIT else method


def refuse_idle(o: Any) -> None:
    """Refuse options that implicit integrators do nothing with.

    Raises
    ------
    ModelError
        Naming the option.
    """
    if o.method in EVEN and o.step is None:
        raise ModelError(f"method={o.method!r} takes steps of fixed width: give one, for instance step='1 ms'")
    alone = o.method != VARIATIONAL  # whether it can keep positions alone
    if o.stabilization not in (("projection", "none") if alone else ("projection",)):
        other = ", or give 'none', and it keeps positions alone (index 3)" if alone else ""
        raise ModelError(
            f"stabilization={o.stabilization!r} does nothing with method={o.method!r}, which keeps positions and "
            f"velocities on the constraints itself; leave it out{other}"
        )
    if o.specialize is True:
        raise ModelError(
            f"specialize=True does nothing with method={o.method!r}, which is computed by the tables; leave it out"
        )


def suited(begun: Start, method: str, wish: str, parameters: Mapping[str, float] | None) -> Start:
    """The start in coordinates that implicit integrators are good at.

    Joint coordinates of long chains have full matrices, and drivers prescribe some; such mechanisms go to absolute
    ones.

    Raises
    ------
    ModelError
        For what implicit integrators do not know.
    """
    s = begun.assembly.compiled.structure
    if method != RADAU:
        _refuse_open_loads(begun, method)
    if method == VARIATIONAL and wish == "joint":
        raise ModelError(f"method={VARIATIONAL!r} takes absolute coordinates, in which masses do not change: leave "
                         f"coordinates out")  # fmt: skip
    if not s.tree or wish == "absolute":
        return begun
    if method == VARIATIONAL:
        why = "masses do not change in these, as the variational method needs it"
    elif s.prescribed:
        if wish == "joint":
            raise ModelError(
                f"method={method!r} does not know coordinates that drivers prescribe ({', '.join(s.prescribed)}), as "
                f"they are in joint coordinates: leave coordinates out"
            )
        why = "drivers' coordinates are rows in an implicit method"
    elif wish == "auto" and (groups := _groups(begun)) > FEW:
        why = f"matrices of {groups} joint coordinates, which follow each other, are full"
    else:
        return begun
    out = begin_at(begun.base, parameters, "absolute", begun.before, switches=True)
    out.since, out.part, out.coordinates = begun.since, begun.part, f"absolute: {why}"
    return out


def unsuited(begun: Start) -> str:
    """Why a motion in those coordinates cannot go on by an implicit method, in words; empty: it can."""
    s = begun.assembly.compiled.structure
    try:
        refuse_functions(s)
        _refuse_open_loads(begun, RADAU)
    except ModelError as error:
        return str(error).removesuffix("; leave method out, or take the redundancy out")
    if begun.assembly.compiled.values.system.scales.semidefinite > 0.0:
        return "a body has no inertia about some axis, which method='radau' does not know"
    if not s.tree:
        return ""
    if s.prescribed:
        return f"drivers prescribe coordinates ({', '.join(s.prescribed)}); method='radau' takes absolute ones"
    return "" if _groups(begun) <= FEW else "its chains are long; method='radau' takes absolute coordinates"


def _refuse_open_loads(begun: Start, method: str) -> None:
    """Friction under reactions that redundancy leaves open takes them from Newton's method, where they are any."""
    s = begun.base.compiled.structure
    found = open_loads(s.loads, mobility(s.model, begun.base).undetermined) if s.loads else []
    if found:
        names = ", ".join(f.title for f, _ in found)
        raise ModelError(
            f"method={method!r} cannot have {names}: it follows reactions that redundant constraints leave open "
            f"(m.mobility() names them); leave method out, or take the redundancy out"
        )


def _groups(begun: Start) -> int:
    """How many evaluations a Jacobian takes in joint coordinates."""
    c = begun.assembly.compiled
    return layout(c.structure, c.system).groups
