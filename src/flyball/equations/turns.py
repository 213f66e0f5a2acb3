"""States that count: whole turns of angles, and places of followers on curves."""

from __future__ import annotations

from ..compiler.formulas import formula
from ..constraints.angle import row as angle
from ..math.vec import dot, sub
from .records import load
from .rows import parameters


@formula
def turn(S, W, z, dz):
    """Rates of the states that count turns of angles."""
    for k in range(S.angles.F.shape[0]):
        F = load(W.FK, S.angles.F[k])
        M = load(W.FK, S.angles.M[k])
        n = angle((0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0), F, M, 0.0, S.const)[2]
        dz[S.angles.state[k]] = dot(n, sub(M[2], F[2]))


@formula
def move_on(S, W, z, dz, kind, foot, progress):
    """Rates of the states that say where the terms of a kind are on their curves."""
    for k in range(S.kind_terms[kind], S.kind_terms[kind + 1]):
        F = load(W.FK, S.terms.F[k])
        M = load(W.FK, S.terms.M[k])
        par = parameters(S.term_parameters, k)
        s = foot(par, F, M, z[S.terms.hint[k]], S.const)
        dz[S.terms.hint[k]] = progress(par, F, M, s, S.const)[0]


@formula
def remember_turns(S, W, z):
    """Put the states that count turns where the poses in W say they are."""
    for k in range(S.angles.F.shape[0]):
        F = load(W.FK, S.angles.F[k])
        M = load(W.FK, S.angles.M[k])
        h = S.angles.state[k]
        z[h] = angle((1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0), F, M, z[h], S.const)[0]


@formula
def remember_places(S, W, z, kind, foot):
    """Put the places of a kind's terms where the poses in W say they are."""
    for k in range(S.kind_terms[kind], S.kind_terms[kind + 1]):
        F = load(W.FK, S.terms.F[k])
        M = load(W.FK, S.terms.M[k])
        h = S.terms.hint[k]
        z[h] = foot(parameters(S.term_parameters, k), F, M, z[h], S.const)
