"""The vector form of every kind of constraint row, as textbooks write it: data, which tests hold against the rows.

Texts are expressions of p_F, p_M (origins), x_F, y_F, z_F, x_M, y_M, z_M (axes), v_F, v_M, w_F, w_M (velocities), all
world components, of n and m (the row's own directions, fixed where `Vector` says) and c (its constant). ``@`` is the
scalar product, ``cross`` the vector product.
"""

from __future__ import annotations

from typing import NamedTuple

from ..constraints import along, blade, coincident, distance, perpendicular, skew, spin


class Vector(NamedTuple):
    """A row as a vector equation.

    Attributes
    ----------
    text : str
        Its left side, which is zero.
    hahn : str
        The same in Hahn's order of indices; r_P0 is the way from O to P along the axes of 0, A_0P turns from P to 0.
    block : str
        Hahn's building block that it belongs to.
    of_velocity : bool
        Whether it restrains velocities only.
    """

    text: str
    hahn: str
    block: str = ""
    of_velocity: bool = False


VECTORS = {
    coincident.KIND: Vector("n @ (p_M - p_F) - c", "n^T (r^R_{MO} - r^R_{FO}) = 0", "BB1"),
    along.KIND: Vector("n_F @ (p_M - p_F) - c", "(A^{RF} n^F)^T (r^R_{MO} - r^R_{FO}) = c", "BB3"),
    perpendicular.KIND: Vector("m_M @ n_F - c", "(A^{RM} m^M)^T A^{RF} n^F = 0", "BB2, BB4"),
    distance.KIND: Vector("sqrt((p_M - p_F) @ (p_M - p_F)) - c", "|r^R_{MO} - r^R_{FO}| = c", "BB5"),
    skew.KIND: Vector(
        "n @ (p_M - p_F - s_1*z_F - s_2*z_M - k*cross(z_F, z_M))",
        "n^T (r^R_{MO} - r^R_{FO} - s_1 f - s_2 m - k f x m) = 0",
    ),
    blade.KIND: Vector(
        "n_M @ (v_M - v_F - cross(w_F, p_M - p_F))", "(A^{RM} n^M)^T (v_M - v_F - w_F x (r_M - r_F)) = 0", "", True
    ),
    spin.KIND: Vector("n_M @ (w_M - w_F)", "(A^{RM} n^M)^T (w_M - w_F) = 0", "", True),
}
"""Kind of row -> its vector form; angles, curves and wheels, which are not here, have none that is short."""
