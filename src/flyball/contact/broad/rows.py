"""Rows of the table of contacts, written as far as there is room."""

from __future__ import annotations

from ...compiler.formulas import formula
from ..tables import APART, BEFORE, FEATURE, GAP, NORMAL, POINT, SHAPE_1, SHAPE_2


@formula
def write(C, n, point, normal, gap, apart):
    """Row n of the contacts, if there is one."""
    if n < C.x.shape[0]:
        C.x[n, POINT], C.x[n, POINT + 1], C.x[n, POINT + 2] = point
        C.x[n, NORMAL], C.x[n, NORMAL + 1], C.x[n, NORMAL + 2] = normal
        C.x[n, GAP] = gap
        C.x[n, APART], C.x[n, APART + 1], C.x[n, APART + 2] = apart


@formula
def sign(C, n, i, j, feature, first):
    """Say between which shapes contact n is, and which it was before."""
    if n < C.at.shape[0]:
        C.at[n, SHAPE_1], C.at[n, SHAPE_2], C.at[n, FEATURE], C.at[n, BEFORE] = i, j, feature, first
