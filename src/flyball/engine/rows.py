"""Constraint rows and measured quantities: values, Jacobian entries, velocity and acceleration terms.

    g = sum c_k value_k - f(t),  G v = nu = f',  G vdot = gamma = f'' - sum c_k bias_k

or, for a law f of the rate, G v = nu = f, G vdot = gamma = f' - sum c_k bias_k.

A row is a sum of unit wrenches on frames less a law of time; G[row, d] is the power of the row's wrench along twist
column d, whatever the coordinates. A measured quantity is the same without a law: value, gradient, rate, bias. Where a
driver's law reads sensors s, g = sum c_k value_k - f(t, s), and the sensors' gradients times df/ds are subtracted from
the row.

Also here: the characteristic rates that measured rates are compared with, and the states of controllers, which laws
read like measured quantities. Their rates are z' = f(t, z, measured), where all signals of controllers are substituted
in the laws. Measured quantities are known once rows are, so these rates need no accelerations.
"""

from __future__ import annotations

from ..compiler.formulas import formula
from ..constraints.registry import BY_ADDRESS
from ..constraints.switches.switch_kind import OFF, STEADY
from ..laws.bytecode import evaluate, evaluate_jet
from ..math.scalar import atan2, cos, magnitude, sin
from ..math.vec import add, cross, load3, neg, scale, store3, sub
from ..tables.table_definitions import OF_RATE
from .kinematics import load_record, project_wrench

COEFFICIENT = 7
ALONG_MOTION, BY_TIME = -1, -2  # derivatives of evaluate_jet, if not with respect to a sensor


@formula
def row_parameters(T, k):
    """The eight parameters of row k of an element table."""
    return (T[k, 0], T[k, 1], T[k, 2], T[k, 3], T[k, 4], T[k, 5], T[k, 6], T[k, 7])


@formula
def count_measured(S):
    """Number of measured quantities."""
    return S.row_start.shape[0] - 1 - S.rows.law.shape[0]


@formula
def term_wrench(S, W, k):
    """Wrench (force, torque) of the multiplier of term k's row on its second body, about M's origin."""
    c = W.rows.multiplier[S.terms.row[k]] * S.term_parameters[k, COEFFICIENT]
    return scale(c, load3(W.term_wrenches.force, k, 0)), scale(c, load3(W.term_wrenches.torque, k, 0))


@formula
def wrench_on_second(S, W, what):
    """Wrench on the second body of the term's joint, about its point there; see `term_from_side_M` for ``what``."""
    nt = S.terms.row.shape[0]
    k = what if what < nt else what - nt
    force, torque = term_wrench(S, W, k)
    if what >= nt:  # seen from the other body, at the other frame: both reversed, about that frame's origin
        arm = sub(load3(W.frames.position, S.terms.M[k], 0), load3(W.frames.position, S.terms.F[k], 0))
        return neg(force), neg(add(torque, cross(arm, force)))
    return force, torque


@formula
def begin(S, W):
    """Set every row and measured quantity to zero."""
    for k in range(W.rows.value.shape[0]):
        W.rows.value[k] = 0.0
    for m in range(count_measured(S)):
        W.sensed.value[m] = 0.0
    for e in range(W.G.shape[0]):
        W.G[e] = 0.0


@formula
def hint_of(S, z, k, o):
    """State that term k uses to find whole turns, or its place on a curve; zero if it needs none."""
    h = S.terms.hint[k]
    return z[h] if h >= 0 else o


@formula
def add_value(S, W, k, g, force, torque_M, torque_F, from_F, from_M):
    """Add term k, with frames F and M at the given points, to its row or measured quantity."""
    c = S.term_parameters[k, COEFFICIENT]
    r = S.terms.row[k]
    nr = S.rows.law.shape[0]
    if r < nr:
        W.rows.value[r] += c * g
    else:
        W.sensed.value[r - nr] += c * g
    if W.term_wrenches.shape[0] > 0:
        store3(W.term_wrenches.force, k, 0, force)
        store3(W.term_wrenches.torque, k, 0, torque_M)
    for s in range(S.terms.segment[k], S.terms.segment_end[k]):
        if S.segments.side[s] > 0:
            project_wrench(S, W, S.segments.body[s], W.G, S.segments.entry[s], c, force, torque_M, from_M)
        else:
            project_wrench(S, W, S.segments.body[s], W.G, S.segments.entry[s], c, neg(force), torque_F, from_F)


@formula
def add_bias(S, W, k, bias):
    """Subtract term k's acceleration bias from its row's gamma, or add it to its measured quantity."""
    r = S.terms.row[k]
    nr = S.rows.law.shape[0]
    if r < nr:
        W.rows.gamma[r] -= S.term_parameters[k, COEFFICIENT] * bias
    else:
        W.sensed.bias[r - nr] += S.term_parameters[k, COEFFICIENT] * bias


@formula
def each_value(S, W, z, kind, row):
    """Add every term of one kind to its row: value and Jacobian entries, from the poses."""
    for k in range(S.kind_terms[kind], S.kind_terms[kind + 1]):
        F = load_record(W.frames, S.terms.F[k])
        M = load_record(W.frames, S.terms.M[k])
        hint = hint_of(S, z, k, 0.0 * S.term_parameters[k, 0])
        g, force, torque_M, torque_F, _ = row(row_parameters(S.term_parameters, k), F, M, hint, S.const)
        add_value(S, W, k, g, force, torque_M, torque_F, F[0], M[0])


@formula
def each_bias(S, W, z, kind, row):
    """Subtract the acceleration bias of every term of one kind from its row's gamma; add it for measured quantities."""
    for k in range(S.kind_terms[kind], S.kind_terms[kind + 1]):
        F = load_record(W.frames, S.terms.F[k])
        M = load_record(W.frames, S.terms.M[k])
        hint = hint_of(S, z, k, 0.0 * S.term_parameters[k, 0])
        _, _, _, _, bias = row(row_parameters(S.term_parameters, k), F, M, hint, S.const)
        add_bias(S, W, k, bias)


@formula
def each_row(S, W, z, whole, kind, row):
    """``each_value`` and ``each_bias`` in one; biases of measured quantities only if ``whole``."""
    for k in range(S.kind_terms[kind], S.kind_terms[kind + 1]):
        F = load_record(W.frames, S.terms.F[k])
        M = load_record(W.frames, S.terms.M[k])
        hint = hint_of(S, z, k, 0.0 * S.term_parameters[k, 0])
        g, force, torque_M, torque_F, bias = row(row_parameters(S.term_parameters, k), F, M, hint, S.const)
        add_value(S, W, k, g, force, torque_M, torque_F, F[0], M[0])
        if whole or S.terms.row[k] < S.rows.law.shape[0]:
            add_bias(S, W, k, bias)


@formula
def row_kind(S, k, kind):
    """The number of term k's kind, or the address of its code table."""
    return S.term_code[k] if kind == BY_ADDRESS else kind


@formula
def rare_values(S, W, z, first, last, row):
    """``each_value`` for kinds that share one loop, ``row(kind, par, F, M, hint, data)``, which compiles faster.

    The kind of a user-defined row is the address of its code table.
    """
    for kind in range(first, last):
        for k in range(S.kind_terms[kind], S.kind_terms[kind + 1]):
            F = load_record(W.frames, S.terms.F[k])
            M = load_record(W.frames, S.terms.M[k])
            hint = hint_of(S, z, k, 0.0 * S.term_parameters[k, 0])
            g, force, torque_M, torque_F, _ = row(
                row_kind(S, k, kind), row_parameters(S.term_parameters, k), F, M, hint, S.const
            )
            add_value(S, W, k, g, force, torque_M, torque_F, F[0], M[0])


@formula
def rare_biases(S, W, z, first, last, row):
    """``each_bias`` for kinds that share one loop."""
    for kind in range(first, last):
        for k in range(S.kind_terms[kind], S.kind_terms[kind + 1]):
            F = load_record(W.frames, S.terms.F[k])
            M = load_record(W.frames, S.terms.M[k])
            hint = hint_of(S, z, k, 0.0 * S.term_parameters[k, 0])
            _, _, _, _, bias = row(row_kind(S, k, kind), row_parameters(S.term_parameters, k), F, M, hint, S.const)
            add_bias(S, W, k, bias)


@formula
def rare_rows(S, W, z, first, last, row):
    """``each_row`` for kinds that share one loop, biases always."""
    for kind in range(first, last):
        for k in range(S.kind_terms[kind], S.kind_terms[kind + 1]):
            F = load_record(W.frames, S.terms.F[k])
            M = load_record(W.frames, S.terms.M[k])
            hint = hint_of(S, z, k, 0.0 * S.term_parameters[k, 0])
            g, force, torque_M, torque_F, bias = row(
                row_kind(S, k, kind), row_parameters(S.term_parameters, k), F, M, hint, S.const
            )
            add_value(S, W, k, g, force, torque_M, torque_F, F[0], M[0])
            add_bias(S, W, k, bias)


@formula
def begin_rows(S, W):
    """Set rows and measured quantities, with their biases, to zero."""
    begin(S, W)
    for k in range(S.rows.law.shape[0]):
        W.rows.gamma[k] = 0.0
    for m in range(count_measured(S)):
        W.sensed.bias[m] = 0.0


@formula
def end_rows(S, W, t, v):
    """Complete the rows: laws of time, rates of the measured quantities, and gamma of the laws."""
    end(S, W, t)
    update_measured_rates(S, W, v)
    for k in range(S.rows.law.shape[0]):
        W.rows.gamma[k] += W.rows.nu_dot[k]
    end_biases(S, W, t)


@formula
def end(S, W, t):
    """Subtract the laws of time from the rows; angles that follow a law are compared modulo a whole turn."""
    for k in range(S.rows.law.shape[0]):
        law = S.rows.law[k]
        if law >= 0:
            f, f1, f2 = evaluate_jet(S.code, S.const, law, W.stack, t, W.sensed, BY_TIME)
            g = W.rows.value[k] - f
            W.rows.value[k] = atan2(sin(g), cos(g)) if S.rows.wrapped[k] == 1 else g
            W.rows.nu[k] = f1
            W.rows.nu_dot[k] = f2
            if S.rows.wrapped[k] == OF_RATE:
                W.rows.value[k] = 0.0
                W.rows.nu[k] = f
                W.rows.nu_dot[k] = f1
        else:
            W.rows.nu[k] = 0.0
            W.rows.nu_dot[k] = 0.0
    apply_switch_modes(S, W)
    for x in range(S.sensor_drivers.row.shape[0]):
        law = S.rows.law[S.sensor_drivers.row[x]]
        _, slope, _ = evaluate_jet(S.code, S.const, law, W.stack, t, W.sensed, S.sensor_drivers.slot[x])
        for i in range(S.sensor_drivers.entries[x]):
            W.G[S.sensor_drivers.to[x] + i] -= slope * W.G[S.sensor_drivers.start[x] + i]


@formula
def direction_column(S, W, s):
    """Column of W.sensed with the direction of switch s: of sliding, of pushing, the side of a nonsmooth point."""
    return W.sensed.shape[1] - S.switches.row.shape[0] + s


@formula
def apply_switch_modes(S, W):
    """Apply the modes of switches to their rows.

    Rows that are off are cleared; the values of held rows are measured from their hold, angles that follow a law modulo
    a whole turn.
    """
    for s in range(S.switches.row.shape[0]):
        k = S.switches.row[s]
        if k < 0:
            continue
        if W.modes.mode[s].real == OFF:
            for e in range(S.row_start[k], S.row_start[k + 1]):
                W.G[e] = 0.0
            W.rows.value[k] = 0.0
            W.rows.nu[k] = 0.0
            W.rows.nu_dot[k] = 0.0
        elif W.modes.mode[s].real == STEADY:
            W.rows.value[k] = 0.0
        else:
            g = W.rows.value[k] - W.modes.hold[s]
            W.rows.value[k] = atan2(sin(g), cos(g)) if S.rows.wrapped[k] == 1 else g


@formula
def clear_inactive_biases(S, W):
    """Clear the right-hand side of rows that are off."""
    for s in range(S.switches.row.shape[0]):
        k = S.switches.row[s]
        if k >= 0 and W.modes.mode[s].real == OFF:
            W.rows.gamma[k] = 0.0


@formula
def size_inactive_rows(S, W):
    """Give rows that are off a nonzero size, as their entries are zero."""
    for s in range(S.switches.row.shape[0]):
        k = S.switches.row[s]
        if k >= 0 and W.modes.mode[s].real == OFF:
            W.rows.diagonal[k] = W.rows.diagonal[k] + 1.0


@formula
def begin_biases(S, W, v):
    """Start of the biases: rates of the measured quantities; gamma of the laws as far as they depend on time."""
    update_measured_rates(S, W, v)
    for m in range(count_measured(S)):
        W.sensed.bias[m] = 0.0
    for k in range(S.rows.law.shape[0]):
        W.rows.gamma[k] = W.rows.nu_dot[k]


@formula
def update_measured_rates(S, W, v):
    """Rates of the measured quantities."""
    nr = S.rows.law.shape[0]
    nm = count_measured(S)
    for m in range(nm):
        s = 0.0 * W.sensed.value[m]
        for e in range(S.row_start[nr + m], S.row_start[nr + m + 1]):
            s += W.G[e] * v[S.column[e]]
        W.sensed.rate[m] = s
        W.sensed.value[nm + m] = s


@formula
def end_biases(S, W, t):
    """End of the biases: gamma of laws that read sensors uses f'' along the motion in place of the time derivative."""
    for k in range(S.rows.law.shape[0]):
        if S.rows.wrapped[k] == OF_RATE:
            _, f1, _ = evaluate_jet(S.code, S.const, S.rows.law[k], W.stack, t, W.sensed, ALONG_MOTION)
            W.rows.gamma[k] += f1 - W.rows.nu_dot[k]
    last = -1
    for x in range(S.sensor_drivers.row.shape[0]):
        k = S.sensor_drivers.row[x]
        if k != last:
            _, _, f2 = evaluate_jet(S.code, S.const, S.rows.law[k], W.stack, t, W.sensed, ALONG_MOTION)
            W.rows.gamma[k] += f2 - W.rows.nu_dot[k]
        last = k
    clear_inactive_biases(S, W)


@formula
def row_times(S, W, k, x):
    """G[k] . x."""
    s = 0.0 * W.rows.value[k]
    for e in range(S.row_start[k], S.row_start[k + 1]):
        s += W.G[e] * x[S.column[e]]
    return s


@formula
def characteristic_speed(S, W):
    """Characteristic speed of the mechanism: its length times its characteristic rate [m/s]."""
    return S.scales.length * W.options.rate


@formula
def characteristic_rate(S, W, m):
    """Characteristic rate of quantity m, whose unit may be a radian."""
    return S.units[m] * W.options.rate


@formula
def largest_measured_rate(S, W):
    """Largest measured rate, relative to the unit of its quantity."""
    fastest = 0.0
    for m in range(count_measured(S)):
        fastest = max(fastest, magnitude(W.sensed.rate[m]) / S.units[m])
    return fastest


@formula
def controller_column(S, W, c):
    """Column of W.sensed that holds state c of a controller."""
    return W.sensed.shape[1] - S.switches.row.shape[0] - S.control_laws.shape[0] + c


@formula
def update_controllers(S, W, t, z, dz):
    """Write the states z where laws read them; their rates go to ``dz`` and to where laws' derivatives read them."""
    for c in range(S.control_laws.shape[0]):
        W.sensed.value[controller_column(S, W, c)] = z[c]
    for c in range(S.control_laws.shape[0]):
        law = S.control_laws[c]
        o = 0.0 * t
        rate = evaluate(S.code, S.const, law, W.stack, (t, o, o), W.sensed) if law >= 0 else o
        W.sensed.rate[controller_column(S, W, c)] = rate
        dz[c] = rate
