"""Calls of the elements' formulas by kind: rows, forces, counted turns and places on curves.

The lists of kinds are generated from the registries, so no kind is named here. An unknown kind gives nan, which a run
reports; the formula of another element is never used instead. The formulas of user classes are not part of these lists:
they are called by address (`compiler/kernels.py`).
"""

from __future__ import annotations

from math import nan

from ..compiler.formulas import dispatch_by_kind, formula, formula_at, generated_formula, has_formula
from ..constraints.angle import row as angle
from ..constraints.registry import BY_ADDRESS, KINDS, RARE
from ..forces import BRANCHES, EFFORTS, INPUTS, SIGNATURES, WITH_STATES, WRENCHES
from ..math.vec import dot, sub
from ..tables.table_definitions import TERM_KINDS
from . import rows
from .kinematics import load_record
from .rows import row_parameters


@formula
def turn_rates(S, W, z, dz):
    """Rates of the states that count turns of angles."""
    for k in range(S.angles.F.shape[0]):
        F = load_record(W.frames, S.angles.F[k])
        M = load_record(W.frames, S.angles.M[k])
        n = angle((0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0), F, M, 0.0, S.const)[2]
        dz[S.angles.state[k]] = dot(n, sub(M[2], F[2]))


@formula
def curve_place_rates(S, W, z, dz, kind, foot, progress):
    """Rates of the states that hold the places of a kind's terms on their curves."""
    for k in range(S.kind_terms[kind], S.kind_terms[kind + 1]):
        F = load_record(W.frames, S.terms.F[k])
        M = load_record(W.frames, S.terms.M[k])
        par = row_parameters(S.term_parameters, k)
        s = foot(par, F, M, z[S.terms.hint[k]], S.const)
        dz[S.terms.hint[k]] = progress(par, F, M, s, S.const)[0]


@formula
def remember_turns(S, W, z):
    """Set the states that count turns to the values given by the poses in W."""
    for k in range(S.angles.F.shape[0]):
        F = load_record(W.frames, S.angles.F[k])
        M = load_record(W.frames, S.angles.M[k])
        h = S.angles.state[k]
        z[h] = angle((1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0), F, M, z[h], S.const)[0]


@formula
def remember_places(S, W, z, kind, foot):
    """Set the states that hold the places of a kind's terms on their curves to those given by the poses in W."""
    for k in range(S.kind_terms[kind], S.kind_terms[kind + 1]):
        F = load_record(W.frames, S.terms.F[k])
        M = load_record(W.frames, S.terms.M[k])
        h = S.terms.hint[k]
        z[h] = foot(row_parameters(S.term_parameters, k), F, M, z[h], S.const)


NAN = "nan + 0.0 * par[0]"
NONE = f"({NAN}, {NAN}, {NAN})"
FREQUENT_KINDS = KINDS[:RARE]

_rare = dispatch_by_kind(
    __name__,
    "_rare",
    "par, F, M, hint, data",
    {k.number: k.row for k in KINDS[RARE:]},
    f"{NAN}, {NONE}, {NONE}, {NONE}, {NAN}",
)


@formula
def rare(kind, par, F, M, hint, data):
    """Formula of a kind of row without a loop of its own; for a user-defined row by the address of its code table."""
    if kind <= BY_ADDRESS:
        return _rare(kind, par, F, M, hint, data)
    x = nan + 0.0 * par[0]
    none = (x, x, x)
    value, force, torque_M, torque_F, bias = formula_at(kind, 0, (par[:6], F, M), (x, none, none, none, x))
    return value - par[6], force, torque_M, torque_F, bias


INPUT, WRENCH, EFFORT, BRANCH = range(len(SIGNATURES))

inputs = dispatch_by_kind(__name__, "inputs", SIGNATURES[INPUT].arguments, INPUTS, f"({NAN}, {NAN})", INPUT)
"""Inputs of the laws of a force between frames."""

wrench = dispatch_by_kind(
    __name__, "wrench", SIGNATURES[WRENCH].arguments, WRENCHES, f"({NONE}, {NONE})", WRENCH, "data"
)
"""Wrench of a force between frames on M; ``data`` has the splines of those that are given by curves."""

wrench_and_rates = dispatch_by_kind(
    __name__,
    "wrench_and_rates",
    "par, F, M, states, data, surfaces",
    WITH_STATES,
    f"({NONE}, {NONE}, ({NAN}, {NAN}))",
)
"""Wrench of a force with two states on M, and the rates of these."""

branch = dispatch_by_kind(
    __name__, "branch", SIGNATURES[BRANCH].arguments, BRANCHES, f"({NAN}, {NAN}, {NAN}, {NAN}, {NAN})", BRANCH
)
"""Branch of a force between frames, for kinds whose formula is discontinuous; see `forces.BRANCHES`."""

breaks = generated_formula(
    __name__,
    "breaks",
    "kind",
    [*(f"if kind == {k}:\n        return True" for k in sorted(BRANCHES)), f"return has_formula(kind, {BRANCH})"],
    {"has_formula": has_formula},
)
"""Whether the formula of a kind of force is discontinuous somewhere."""

effort = dispatch_by_kind(__name__, "effort", SIGNATURES[EFFORT].arguments, EFFORTS, NAN, EFFORT)
"""Force along a measured quantity."""


@formula
def force_kind(S, k):
    """Number of the kind of force k, or the address of its class's code table, for the formulas above."""
    return S.force_code[k] if S.force_code[k] != 0 else S.forces.kind[k]


_LOOPS = {name: getattr(rows, name) for name in ("begin", "end", "begin_biases", "end_biases")}
_ROWS = {"rare": rare} | {f"row_{k.number}": k.row for k in FREQUENT_KINDS}

row_values = generated_formula(
    __name__,
    "row_values",
    "S, W, t, z",
    [
        "begin(S, W)",
        *(f"each_value(S, W, z, {k.number}, row_{k.number})" for k in FREQUENT_KINDS),
        f"rare_values(S, W, z, {RARE}, {TERM_KINDS}, rare)",
        "end(S, W, t)",
    ],
    _LOOPS | _ROWS | {"each_value": rows.each_value, "rare_values": rows.rare_values},
)
"""Values, Jacobian and rates of all constraint rows, from the poses; ``z`` holds the turns of angles."""

row_biases = generated_formula(
    __name__,
    "row_biases",
    "S, W, t, v, z",
    [
        "begin_biases(S, W, v)",
        *(f"each_bias(S, W, z, {k.number}, row_{k.number})" for k in FREQUENT_KINDS),
        f"rare_biases(S, W, z, {RARE}, {TERM_KINDS}, rare)",
        "end_biases(S, W, t)",
    ],
    _LOOPS | _ROWS | {"each_bias": rows.each_bias, "rare_biases": rows.rare_biases},
)
"""Gamma of all constraint rows and rates of measured quantities, from poses and velocities."""

whole_rows = generated_formula(
    __name__,
    "whole_rows",
    "S, W, t, v, z, whole",
    [
        "begin_rows(S, W)",
        *(f"each_row(S, W, z, whole, {k.number}, row_{k.number})" for k in FREQUENT_KINDS),
        f"rare_rows(S, W, z, {RARE}, {TERM_KINDS}, rare)",
        "end_rows(S, W, t, v)",
    ],
    _ROWS | {name: getattr(rows, name) for name in ("begin_rows", "each_row", "rare_rows", "end_rows")},
)
"""Both in one pass, from poses and motions; biases of measured quantities only if ``whole``."""

_PLACES = [k for k in KINDS if k.place]
_FEET = {f"foot_{k.number}": k.foot for k in _PLACES}

progress = generated_formula(
    __name__,
    "progress",
    "S, W, z, dz",
    ["turn(S, W, z, dz)"]
    + [f"move_on(S, W, z, dz, {k.number}, foot_{k.number}, progress_{k.number})" for k in _PLACES],
    _FEET | {f"progress_{k.number}": k.progress for k in _PLACES} | {"turn": turn_rates, "move_on": curve_place_rates},
)
"""Rates of the states that count turns of angles and places on curves."""

remember = generated_formula(
    __name__,
    "remember",
    "S, W, z",
    ["remember_turns(S, W, z)", *(f"remember_places(S, W, z, {k.number}, foot_{k.number})" for k in _PLACES)],
    _FEET | {"remember_turns": remember_turns, "remember_places": remember_places},
)
"""Set the states that count turns and places to the values given by the poses in W: no drift over long motions."""
