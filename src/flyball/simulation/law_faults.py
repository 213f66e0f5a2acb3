"""Faults of laws: table arguments out of range, undefined values, motions that grow without bound."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from typing import Any

import numpy as np

from ..assembly.assembled_state import Assembly
from ..assembly.compiled_mechanism import CompiledMechanism
from ..engine.entry_point import MOTION, evaluate_state
from ..engine.kinematics import load_record
from ..engine.loads import force_row
from ..engine.rows import count_measured
from ..errors import ModelError
from ..laws.bytecode import evaluate as evaluate_law
from ..laws.python_functions import TableFault, clear_faults
from ..model.contact_point import Touch
from ..model.element import Element
from ..model.element_laws import force_and_driver_laws
from ..model.expression_parser import DEFINED, DEFINITIONS, SyntaxNode, called_table, is_closed, tree_text
from ..model.expressions import Expression
from ..model.force import CoordinateForce, Force
from ..model.messages import abbreviated, shortened_list
from ..model.table import Table
from ..numerics.integrators import time_loop as ex
from ..numerics.integrators.butcher_tableaux import TABLEAUX, Tableau, tableau
from ..tables.law_inputs import element_laws
from ..tables.table_definitions import assign

LAW_SAMPLES = 257  # times at which the arguments of tables are checked


def refuse_out_of_table(a: Assembly, until: float) -> None:
    """Refuse a motion from an assembled start to ``until`` [s] during which the argument of a table leaves its range.

    Arguments that depend on time alone are checked over the whole time, the others at the start.

    Raises
    ------
    ModelError
        Naming the element, the table, the time and the value.
    """
    c = a.compiled
    model = c.structure.model
    tables = model.law_tables()
    if all(x.beyond != "refuse" for x in tables.values()):
        return
    env = model.environment(c.parameters)
    for title, law in force_and_driver_laws(model):
        if law.tables and (found := _first_out_of_table(law, env, tables, a.t, until)):
            t, table, x = found
            span = f"the motion is to go from {a.t:.6g} s to {until:.6g} s"
            raise ModelError(f"{title}: at t = {t:.6g} s {table.out_of_range_message(x)}. Here {span}")
    if missed := out_of_table_at_start(a):
        raise ModelError(f"{model.name!r}: {missed.message}")


def out_of_table_at_start(a: Assembly) -> TableFault | None:
    """Return the fault of a law whose table argument is out of range at an assembled start; None if there is none."""
    c = a.compiled
    clear_faults(c.work.stack)
    c.at(a.t, a.q, a.v, MOTION)
    return c.structure.missed(c.work.stack)


def _first_out_of_table(
    law: Expression, env: Mapping[str, Any], tables: Mapping[str, Table], start: float, end: float
) -> tuple[float, Table, float] | None:
    """Return the first time at which the argument of a table is out of range, the table, and the argument; or None."""
    times = np.linspace(start, end, LAW_SAMPLES)
    found = []
    for table, x, live in _table_arguments(law.tree, law, {**env, "t": times}, tables, np.full(LAW_SAMPLES, True)):
        missing = np.flatnonzero(live & _out_of_range(table, x))
        if len(missing):
            found.append((float(times[missing[0]]), table, float(x[missing[0]])))
    if not found:
        return None
    late = min(found, key=lambda f: f[0])
    early = late[0] - (end - start) / (LAW_SAMPLES - 1)
    if early < start:
        return late
    for _ in range(60):  # bisection towards the time at which it leaves the table
        middle = 0.5 * (early + late[0])
        at = [
            (middle, table, float(x[0]))
            for table, x, live in _table_arguments(
                law.tree, law, {**env, "t": np.array([middle])}, tables, np.full(1, True)
            )
            if (live & _out_of_range(table, x))[0]
        ]
        early, late = (early, at[0]) if at else (middle, late)
    return late


def _out_of_range(table: Table, x: np.ndarray) -> np.ndarray:
    first, last = table.ends()
    return (x < first) | (x > last)


def _table_arguments(
    node: SyntaxNode, law: Expression, env: Mapping[str, Any], tables: Mapping[str, Table], live: np.ndarray
) -> Iterator[tuple[Table, np.ndarray, np.ndarray]]:
    """Yield the tables that a law calls, their arguments where these depend on time alone, and when the law uses
    them.
    """

    def value(part: SyntaxNode) -> Any:
        names = {n.value for n in part.walk() if n.kind == "name"}
        known = names <= env.keys() and is_closed(part)
        return Expression(law.text, part).evaluate(env, tables) if known else None

    if node.kind == "where":
        condition = value(node.args[0])
        yield from _table_arguments(node.args[0], law, env, tables, live)
        if condition is not None:
            condition = np.broadcast_to(condition, live.shape)
            yield from _table_arguments(node.args[1], law, env, tables, live & condition)
            yield from _table_arguments(node.args[2], law, env, tables, live & ~condition)
        return
    if node.kind == "table" and (x := value(node.args[0])) is not None:
        yield tables[called_table(node)[0]], np.broadcast_to(np.real(x), live.shape), live
    for arg in node.args:
        yield from _table_arguments(arg, law, env, tables, live)


LONGEST_TEXT = 100  # longest part of a law in a message, in characters


def law_inputs(c: CompiledMechanism, k: int) -> tuple[float, float]:
    """Return the inputs of the laws of force k besides time, at the kinematics in the workspace."""
    S, W, e = c.values.system, c.work, c.structure.forces[k]
    F, M = S.forces.F[k], S.forces.M[k]
    if isinstance(e, CoordinateForce):
        return float(W.sensed.value[F]), float(W.sensed.rate[F])
    x, y = e.inputs(force_row(S.force_parameters, k), load_record(W.frames, F), load_record(W.frames, M))
    return float(x), float(y)


def undefined_law_part(c: CompiledMechanism, element: Element, t: float, given: tuple[float, ...] = ()) -> str:
    """Return the part of an element's law that has no finite value at the last sensor values; empty if there is none.

    Parameters
    ----------
    c : CompiledMechanism
        Its workspace holds the measured values and the states of controllers.
    element : Element
        A force, a driver or a controller.
    t : float
        Time [s].
    given : tuple of float
        Values of the inputs of a force's laws.
    """
    s = c.structure
    values = {name: float(c.work.sensed.value[at]) for name, at in s.slots.items()}
    values |= dict(zip(s.model.parameters, c.values.system.const.tolist(), strict=False)) | {"t": t}
    tables = s.model.law_tables()
    for owner, law, inputs in element_laws(s.model):
        if owner.name == element.name:
            known = values | dict(zip(inputs, given, strict=False))
            if text := undefined_part(law, known, tables):
                return text
    return ""


def undefined_part(law: Expression, values: Mapping[str, Any], tables: Mapping[str, Table]) -> str:
    """Return the part of a law that has no finite value though its arguments have, with these; empty if there is
    none.
    """
    if law.function is not None or not law.names <= values.keys():
        return ""

    def value(node: SyntaxNode) -> Any:
        try:
            with np.errstate(all="ignore"):
                return Expression(law.text, node).evaluate(values, tables)
        except (ModelError, ArithmeticError):
            return np.nan

    node, values = law.tree, dict(values)
    if np.isfinite(value(node)):
        return ""
    while True:
        if node.kind == DEFINITIONS:
            values[DEFINED] = found = list[Any]()
            for definition in node.args:
                found.append(value(definition))
                if not np.isfinite(found[-1]):
                    node = definition
                    break
        read = node.args if node.kind != "where" else (node.args[0], node.args[1 if value(node.args[0]) else 2])
        part = next((arg for arg in read if not np.isfinite(value(arg))), None)
        if part is None:
            break
        node = part
    arguments = {tree_text(x): value(x) for x in node.args if x.kind != "number"}
    for name in sorted({x.value for arg in node.args for x in arg.walk() if x.kind == "name"}):
        arguments.setdefault(name, values[name])
    shown = ", ".join(f"{abbreviated(name, LONGEST_TEXT)} = {x:.6g}" for name, x in arguments.items())
    at = f" for {shown}" if shown else ""
    return f"{abbreviated(tree_text(node), LONGEST_TEXT)} is {value(node):g}{at}"


UNBOUNDED_GROWTH = 1e30  # growth, relative to the initial value or a unit, beyond which a motion is unbounded
LARGE_GROWTH = 1e3  # the same, from which on a fixed step may be unstable
ESCAPING = 1e-4  # relative change of a state within a narrowest step from which on it escapes in finite time
NARROW_STEP = 1e-13  # width of a narrowest step, relative to the largest time
MOST_EIGENVALUES = 400  # largest number of state variables whose eigenvalues are computed
DIFFERENCE_STEP = 1e-7  # relative step of the finite differences
LARGEST_STRETCH, STRETCH_POINTS = (
    15.0,
    3000,
)  # largest h |lambda| that is examined, and the number of points
GROWTH_TOLERANCE = 1e-3  # relative growth per step of a mode that still counts as stable
UNSTABLE_SHARE = 0.1  # ratio of real part to modulus above which an eigenvalue is unstable by itself

ComponentNames = Callable[[Assembly, int], str]


def step_too_long(a: Assembly, clock: ex.StepState, method: str) -> str:
    """Return the message that a fixed step is too long, with a stable one; empty if that is not the cause."""
    step = float(clock.real.step)
    if not step > 0.0 or method not in TABLEAUX:
        return ""
    grown = np.r_[_growth(a, clock, clock.y.current), _growth(a, clock, clock.y.proposed)]
    if not len(grown) or not grown.max() > LARGE_GROWTH:
        return ""
    longest, rate = longest_stable(a, tableau(method), clock.y.unit)
    if not step > longest:
        return ""
    return (
        f"a step of {step:g} s is too long for {method}: the fastest rate at its start is {rate:.3g} 1/s, for which "
        f"this method is stable with steps up to {longest:.2g} s. Give such a step, leave step out to have it chosen, "
        "or take method='radau'"
    )


def unbounded_motion(a: Assembly, clock: ex.StepState, named: ComponentNames) -> str:
    """Return a message on a state variable that has grown beyond all bounds; empty if there is none."""
    y, grown = clock.y.current, _growth(a, clock, clock.y.current)
    if not len(grown) or not grown.max() > UNBOUNDED_GROWTH:
        return ""
    i = int(np.argmax(grown))
    return (
        f"the motion grows without bound: by t = {clock.real.t:.6g} s "
        f"{_component_in_words(a, i, float(y[i]), named)}. Possible causes: a gain, damping or stiffness of the wrong "
        "sign, an unstable controller"
    )


def finite_time_escape(a: Assembly, clock: ex.StepState, named: ComponentNames) -> str:
    """Return a message on a quantity that diverges within a finite time; empty if there is none.

    It may be the law of a force or the state of a controller. Where there are no constraint rows, so that nothing can
    lock, it may also be a coordinate or a velocity.
    """
    s, t = a.compiled.structure, float(clock.real.t)
    if not clock.real.h < NARROW_STEP * max(abs(t), clock.real.largest):
        return ""
    if text := _unbounded_law(a, clock):
        return text
    y, rate, n = clock.y.current, clock.K[0], _state_length(a)
    first = s.nq + s.nv if s.rows else 0
    with np.errstate(all="ignore"):
        part = np.nan_to_num(np.abs(rate[first:n]) * clock.real.h / np.abs(y[first:n]))
    if not len(part) or not part.max() > ESCAPING:
        return ""
    i = first + int(np.argmax(part))
    return (
        f"at t = {t:.6g} s {_component_in_words(a, i, float(y[i]), named)} and changes by {rate[i]:.3g} in a "
        "second, faster and "
        f"faster: it has no value from there on. {_likely_cause(a, i)}"
    )


def _unbounded_law(a: Assembly, clock: ex.StepState) -> str:
    """Return a message on a force whose law has grown and changes by more than `ESCAPING` of itself within a narrow
    step.
    """
    c, t, h, y = a.compiled, float(clock.real.t), float(clock.real.h), clock.y.current
    if not np.isfinite(y).all():
        return ""
    s, S, begun, now = c.structure, c.values.system, c.again(), c.again()
    for other, at, state in ((begun, a.t, a.y), (now, t, y)):
        assign(other.work.modes, c.work.modes)
        other.z = state[s.nq + s.nv :].copy()
        other.at(at, state[: s.nq].copy(), state[s.nq : s.nq + s.nv].copy(), MOTION)
    W, stack, n = now.work, np.zeros_like(c.work.stack), count_measured(S)
    later = W.sensed.copy()
    later.value[:n] += h * W.sensed.rate[:n]
    for k, e in enumerate(s.forces):
        if isinstance(e, Touch):
            continue
        x, rate = law_inputs(now, k)
        for law in filter(lambda at: at >= 0, S.forces.laws[k].tolist()):
            before, here, then = (
                abs(evaluate_law(S.code, S.const, law, stack, *of))
                for of in (
                    ((a.t, *law_inputs(begun, k)), begun.work.sensed),
                    ((t, x, rate), W.sensed),
                    ((t, x + h * rate, rate), later),
                )
            )
            if here > LARGE_GROWTH * before and abs(then - here) > ESCAPING * here:
                given = ", ".join(f"{name} = {z:.3g}" for name, z in zip(e.outputs, (x, rate), strict=False))
                given = f" for {given}" if given else ""
                return (
                    f"at t = {t:.6g} s the law of {e.title} gives {here:.3g}{given} and grows without bound: the "
                    "motion has no continuation. If parts that attract each other as 1/r**2 meet, bound the law, "
                    "1/(r**2 + a**2), or keep the parts apart by a stop (Limit, Touch)"
                )
    return ""


def _likely_cause(a: Assembly, i: int) -> str:
    """Return a hint at the likely cause of the divergence of component i."""
    s = a.compiled.structure
    if i >= s.nq + s.nv:
        x = s.controls[i - s.nq - s.nv]
        return f"Look at the law of its rate, {abbreviated(tree_text(x.law.tree))}"
    pushing = dict.fromkeys(e.title for e, _, _ in element_laws(s.model) if isinstance(e, Force))
    known = f"Look at the laws of {shortened_list(pushing)}, or for" if pushing else "Look for"
    return f"{known} a force that grows without bound where the motion ended, as 1/r**2 does towards r = 0"


def longest_stable(a: Assembly, R: Tableau, unit: np.ndarray) -> tuple[float, float]:
    """Return the longest stable step [s] of a method at the start of a motion, and the rate [1/s] that limits it.

    ``unit``: of each component of the state.

    Modes that grow by themselves are left out. Returns infinity and 0 if nothing limits the step, or there are too many
    state variables. The stability function of the method (Hairer and Wanner 1996, section IV.2) is evaluated at the
    eigenvalues of the Jacobian of (q, v, x)', where x are states of controllers; modes are held fixed.
    """
    n = _state_length(a)
    J = _difference_jacobian(a, unit[:n]) if 0 < n <= MOST_EIGENVALUES else np.zeros((1, 1))
    if not np.isfinite(J).all():
        return np.inf, 0.0
    modes = np.linalg.eigvals(J)
    size = np.abs(modes)
    modes = modes[(size > DIFFERENCE_STEP * size.max(initial=0.0)) & (modes.real <= UNSTABLE_SHARE * size)]
    z = np.linspace(0.0, LARGEST_STRETCH, STRETCH_POINTS)
    powers = _stability_polynomial(R)
    longest, rate = np.inf, 0.0
    for w in modes:
        grows = np.abs(np.polynomial.polynomial.polyval(z * w / abs(w), powers)) > 1.0 + GROWTH_TOLERANCE
        edge = float(z[np.argmax(grows)]) if grows.any() else LARGEST_STRETCH
        if edge / abs(w) < longest:
            longest, rate = edge / abs(w), float(abs(w))
    return longest, rate


def _stability_polynomial(R: Tableau) -> np.ndarray:
    """Return the coefficients of the stability function: 1 + z b.(1 + z A 1 + z^2 A^2 1 + ...)."""
    s = int(R.order_i[1])
    A, b, x, out = R.A[:s, :s], R.A[s, :s], np.ones(s), [1.0]
    for _ in range(s):
        out.append(float(b @ x))
        x = A @ x
    return np.array(out)


def _difference_jacobian(a: Assembly, unit: np.ndarray) -> np.ndarray:
    """Return the derivatives of the first rates by the state, by finite differences; the run's workspace is unchanged.

    ``unit``: of each of these components of the state.
    """
    c, y, n = a.compiled, a.y, len(unit)
    other = c.again()
    assign(other.work.modes, c.work.modes)
    assign(other.work.options, c.work.options)
    other.work.sensed.value = c.work.sensed.value

    def rates(x: np.ndarray) -> np.ndarray:
        status, dy = evaluate_state(other.values.system, other.work, a.t, x, MOTION)
        return dy[:n].copy() if status == 0 else np.full(n, np.nan)

    here, out = rates(y.copy()), np.zeros((n, n))
    for k in range(n):
        x = y.copy()
        x[k] += DIFFERENCE_STEP * max(abs(x[k]), unit[k])
        out[:, k] = (rates(x) - here) / (x[k] - y[k])
    return out


def _growth(a: Assembly, clock: ex.StepState, y: np.ndarray) -> np.ndarray:
    """Return a state relative to its initial values, or to its units; 0 for what is not finite."""
    n = _state_length(a)
    return np.nan_to_num(np.abs(y[:n]), nan=0.0) / np.maximum(np.abs(a.y[:n]), clock.y.unit[:n])


def _state_length(a: Assembly) -> int:
    """Return the number of coordinates, velocities and states of continuous controllers."""
    s = a.compiled.structure
    return s.nq + s.nv + len(s.controls) - len(s.sampled)


def _component_in_words(a: Assembly, i: int, value: float, named: ComponentNames) -> str:
    """Describe a component of the state and its value."""
    s = a.compiled.structure
    if i >= s.nq + s.nv:
        return f"{named(a, i)} is {value:.3g}"
    return f"{'a coordinate' if i < s.nq else 'a velocity'} of {named(a, i)} is {value:.3g}"
