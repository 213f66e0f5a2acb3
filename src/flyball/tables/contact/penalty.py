"""Numbers of normal forces of contacts that give way."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from ...contact import kinds
from ...contact import surfaces as su
from ...contact import tables as ct
from ...errors import ModelError
from ...model.penalty import EXPONENT, HARD, LINEAR

FLAT = (kinds.PLANE, kinds.BOX, kinds.HULL, kinds.FIELD)


def give_way(row: np.ndarray, who: tuple, told: Sequence[Any], sides: Sequence[Any]) -> None:
    """The law of one pair: what a contact says that names bodies, else a pair of materials, else the contact for all.

    Where it says no stiffness: 4/3 E*, 1/E* = (1 - nu_1^2) / E_1 + (1 - nu_2^2) / E_2 (Johnson 1985, equation 4.24).

    Raises
    ------
    ModelError
        If neither says how stiff it is.
    """
    n = next((x for x in told if x.law is not None), None)
    if n is None or n.law == HARD:
        return
    row[su.RESTITUTION] = 0.0
    row[su.EXPONENT] = 1.0 if n.law == LINEAR else EXPONENT if n.exponent is None else np.real(n.exponent)
    row[su.DISSIPATION], row[su.DAMPING] = (0.0 if x is None else np.real(x) for x in (n.dissipation, n.damping))
    if n.stiffness is not None:
        row[su.STIFFNESS] = np.real(n.stiffness)
        return
    known = [x for x in sides if x.youngs_modulus is not None]
    if len(known) < 2 or row[su.EXPONENT] != EXPONENT:
        exponent = row[su.EXPONENT]
        why = (
            f"Hertz' law has the exponent 1.5, not {exponent:g}"
            if exponent != EXPONENT
            else "that follows only from youngs_modulus and poissons_ratio of both materials"
        )
        raise ModelError(
            f"{who[0].title}: law={n.law!r} says no stiffness of {who[3]}, and {why}; give stiffness=... "
            f"[N/m^{exponent:g}]"
        )
    give = sum((1.0 - np.real(x.poissons_ratio) ** 2) / np.real(x.youngs_modulus) for x in known)
    row[su.MODULUS] = 4.0 / 3.0 / give


def check_curvature(G: ct.Geometry, pair: np.ndarray, materials: Sequence[str], planar: bool) -> None:
    """Refuse stiffness by elastic constants between shapes whose curvatures say none.

    Raises
    ------
    ModelError
        If two of the shapes that it holds for are not a sphere and a sphere or something flat.
    """
    of = [set(G.shape_i[G.shape_i[:, ct.MATERIAL] == k, ct.KIND].tolist()) for k in range(len(pair))]
    balls = {kinds.SPHERE}
    for a, b in np.argwhere(pair[:, :, su.MODULUS] > 0.0):
        if planar or balls not in (of[a], of[b]) or not of[a] | of[b] <= {*balls, *FLAT}:
            raise ModelError(
                f"contact of {materials[a]!r} and {materials[b]!r}: its stiffness follows from youngs_modulus only "
                f"for spheres on spheres or on flat shapes, in space; say stiffness=... for others"
            )
