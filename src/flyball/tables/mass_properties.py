"""Mass properties in the body table: masses, inertias, their inverses, and substitutes where one is zero.

Where a principal inertia or a mass is zero, a small substitute makes the inverse exist; the solve removes it again.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from ..math.scalar import maximum, real_parts
from ..math.vec import cross
from ..model.body import GROUND
from .reference_configuration import Refresh
from .structure_definition import Structure
from .table_definitions import POINT, Bodies, zero_table

NEGLIGIBLE = 1e-9  # principal inertias below this fraction of the body's size count as zero
SUBSTITUTE = 1e-6  # substitute for a zero value while factoring, relative to the body's size


def typical_mass(masses: list[Any]) -> Any:
    """Typical mass: the mean of those that are not zero; 1 kg where all are zero."""
    heavy = [m for m in masses if m.real > 0.0]
    return sum(heavy) / len(heavy) if heavy else 1.0


def inverse_inertia(J: np.ndarray, size: Any, planar: bool) -> tuple[np.ndarray, np.ndarray]:
    """Inverse of an inertia, and the substitute that was added to it before.

    Parameters
    ----------
    J : (3, 3)
        Inertia about the centre of mass; complex if it carries a complex step.
    size : number
        Inertia that the body would have if it were compact; complex too.
    planar : bool
        Whether only the inertia about z counts.

    Returns
    -------
    inverse : (3, 3)
        Inverse of ``J`` plus the excess; in the plane of the zz entry only.
    excess : (3, 3)
        Raises zero principal inertias to ``SUBSTITUTE`` times the size; zero if there are none.
    """
    w, V = (np.diag(real_parts(J)), np.eye(3)) if planar else np.linalg.eigh(real_parts(J))
    used = np.array([not planar, not planar, True])
    weak = used & (w < NEGLIGIBLE * size.real)
    more = np.where(weak, SUBSTITUTE * size.real - w, 0.0)
    inverse = (V * np.where(used, 1.0 / np.where(used, w + more, 1.0), 0.0)) @ V.T
    excess = (V * more) @ V.T
    if J.dtype == object:
        return _inverse_by_cofactors(J + excess, used), excess
    if not (np.iscomplexobj(J) or isinstance(size, complex)):
        return inverse, excess
    d_excess = _rate_of_excess(J, size, w, V, weak) if weak.any() else np.zeros((3, 3))
    return inverse - 1j * inverse @ (J.imag + d_excess) @ inverse, excess + 1j * d_excess


def _inverse_by_cofactors(J: np.ndarray, used: np.ndarray) -> np.ndarray:
    """Inverse by cofactors, for number types that LAPACK does not support; in the plane of the zz entry only."""
    if not used[0]:
        out = np.zeros((3, 3), object)
        out[2, 2] = 1.0 / J[2, 2]
        return out
    rows = [np.array(cross(J[:, (k + 1) % 3], J[:, (k + 2) % 3])) for k in range(3)]
    return np.array(rows) / (J[:, 0] @ rows[0])


def _rate_of_excess(J: np.ndarray, size: Any, w: np.ndarray, V: np.ndarray, weak: np.ndarray) -> np.ndarray:
    """Imaginary part of size SUBSTITUTE P - P J P, P the projector onto the directions without inertia.

    P rotates with these directions: dP = sum of (v_i v_j^T + v_j v_i^T) (v_i . dJ v_j) / (w_i - w_j) over v_i in the
    range of P and v_j not in it (Kato, *Perturbation Theory for Linear Operators*, 1966, chapter II).
    """
    dJ, P = J.imag, V[:, weak] @ V[:, weak].T
    between = weak[:, None] & ~weak
    gap = w[:, None] - w  # zero in the plane, where x and y count as without inertia; no entry couples to them there
    C = np.where(between, V.T @ dJ @ V / np.where(gap == 0.0, 1.0, gap), 0.0)
    dP = V @ (C + C.T) @ V.T
    across = dP @ J.real @ P
    return SUBSTITUTE * (size.imag * P + size.real * dP) - P @ dJ @ P - across - across.T


def mass_table(s: Structure, bodies: Mapping, places: np.ndarray, length: Any, refresh: Refresh) -> Bodies:
    """Fill in masses and inertias in the body table; ``places``: of all frames, from their bodies' mass centres.

    Where a principal inertia or a mass is zero, a substitute is added that the solve removes again.
    """
    joint = s.tables["tree"].joint
    table = refresh.table("bodies", zero_table(Bodies, len(joint), places.dtype), places.dtype)
    moved = {f.body for f in s.frames if refresh.asks(f.element)}
    rescaled = refresh.base is None or refresh.base.system.scales.length != length
    usual = typical_mass([d.mass for name, d in bodies.items() if name != GROUND])
    reach = _largest_offsets(s, places)
    for name, b in s.place.items():
        if b < 0:
            continue
        d = bodies[name]
        heavy = d.mass.real > 0.0
        if heavy and not (rescaled or b in moved or refresh.asks(s.model[name])):
            continue
        bulk, more_mass = (d.mass, 0.0) if heavy else (usual, SUBSTITUTE * usual)
        table.mass[b], table.excess_mass[b] = d.mass, more_mass
        table.inverse_mass[b], table.inverse_reference_mass[b] = 1.0 / (d.mass + more_mass), 1.0 / bulk
        if joint[b] == POINT:
            table.inverse_reference_inertia[b] = table.inverse_reference_mass[b]
            table.inverse_inertia[b, 8], table.excess_inertia[b, 8] = table.inverse_mass[b], more_mass
            table.body_rotation[b] = d.R.ravel()
        else:
            _write_inertia(table, b, d.inertia, (bulk * reach[b] ** 2, bulk * length**2), s.model.planar)
    return table


def _write_inertia(table: Bodies, b: int, J: np.ndarray, sizes: tuple[Any, Any], planar: bool) -> None:
    """Write the inertia of a body, its inverse, and its substitute to its row of the table.

    ``sizes``: inertia if all that its frames reach were filled; and the fallback if it has no size of its own.
    """
    compact, bulky = sizes
    own = J[2, 2]
    size = maximum(own if planar else (J[0, 0] + J[1, 1] + own) / 2, compact)
    size = size if size.real > 0.0 else bulky
    table.inverse_reference_inertia[b] = 1.0 / size
    if planar and own.real >= NEGLIGIBLE * size.real:
        table.inertia[b, 8], table.inverse_inertia[b, 8], table.excess_inertia[b, 8] = own, 1.0 / own, 0.0
        return
    inverse, more = inverse_inertia(np.diag([0.0, 0.0, own]) if planar else J, size, planar)
    table.inertia[b] = 0.0 if planar else J.ravel()
    table.inertia[b, 8] = own
    table.inverse_inertia[b], table.excess_inertia[b] = inverse.ravel(), more.ravel()


def _largest_offsets(s: Structure, flat: np.ndarray) -> np.ndarray:
    """Largest absolute component, for every body, of the vectors from its centre of mass to its frames."""
    out, body = np.zeros(len(s.tables["tree"].parent), flat.dtype), s.tables["frame_body"]
    best = np.argmax(np.abs(real_parts(flat)), axis=1)
    largest = flat[np.arange(len(flat)), best]
    largest = np.where(real_parts(largest) < 0.0, -largest, largest)
    order = np.argsort(real_parts(largest), kind="stable")
    order = order[body[order] >= 0]
    out[body[order]] = largest[order]  # the last assignment, the largest value, remains
    return out
