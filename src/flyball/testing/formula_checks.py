"""Checks of an element's formulas: with every kind of number, their derivatives, and their invariances.

Formulas are evaluated at random states of frames in arbitrary motion, as functions of one array of numbers.
"""

from __future__ import annotations

import ctypes
import itertools
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any

import numpy as np

from ..compiler.kernels import CodeTable, FormulaCode, Signature, short_reason
from ..constraints.blocks import ConstraintRow
from ..constraints.registry import SIGNATURES as ROWS
from ..constraints.switches.switch_kind import HELD, OFF, STEADY
from ..constraints.switches.switch_kind import SIGNATURES as GUARDS
from ..errors import ModelError
from ..expression_graph.graph import Graph, Symbol, UndeterminedDecision, evaluate
from ..forces import SIGNATURES
from ..model.element import LawOf, Unit, fields_with
from ..model.force import CoordinateForce, Force
from ..model.joint import Joint
from ..model.names import curve_parts
from ..model.units import powers_in_si
from ..tables.point_formulas import REMEDIES, force_wrench, law_values, orientation_need, row_wrench

if TYPE_CHECKING:
    from .contract import Subject


Frame = dict[str, np.ndarray]
"""Position ``p``, rotation ``R``, angular velocity ``w``, velocity ``v``, and their rates ``alpha`` and ``a``."""


def random_motion(seed: int) -> list[Frame]:
    """Two frames with random poses, velocities and accelerations."""
    from scipy.spatial.transform import Rotation

    rng = np.random.default_rng(seed)
    keys = ("p", "w", "v", "alpha", "a")
    return [{"R": Rotation.random(random_state=rng).as_matrix()} | {k: rng.normal(size=3) for k in keys} for _ in "FM"]


def random_rotation(seed: int) -> np.ndarray:
    """A random rotation matrix."""
    return random_motion(seed)[0]["R"]


def frame_record(m: Frame, dtype: Any = float) -> tuple[tuple[Any, ...], ...]:
    """Return the kinematic record of a frame."""
    return tuple(tuple(np.asarray(m[k], dtype).ravel().tolist()) for k in ("p", "R", "w", "v", "alpha", "a"))


def moved_frame(m: Frame, t: float) -> Frame:
    """The frame after a time t of its motion, exact to second order."""
    from scipy.spatial.transform import Rotation

    turn = m["w"] * t + 0.5 * m["alpha"] * t * t
    return m | {
        "p": m["p"] + m["v"] * t + 0.5 * m["a"] * t * t,
        "R": Rotation.from_rotvec(turn).as_matrix() @ m["R"],
        "w": m["w"] + m["alpha"] * t,
        "v": m["v"] + m["a"] * t,
    }


def complex_step_frame(m: Frame, e: float) -> Frame:
    """The frame after an imaginary time i e of its motion: imaginary parts over e are rates."""
    w = m["w"]
    turn = np.array([[0, -w[2], w[1]], [w[2], 0, -w[0]], [-w[1], w[0], 0]])
    return m | {
        "p": m["p"] + 1j * e * m["v"],
        "R": (np.eye(3) + 1j * e * turn) @ m["R"],
        "w": w + 1j * e * m["alpha"],
        "v": m["v"] + 1j * e * m["a"],
    }


def turned_frame(m: Frame, Q: np.ndarray, d: np.ndarray) -> Frame:
    """The frame and its motion in a world that was turned by Q, then shifted by d."""
    return {"p": Q @ m["p"] + d, "R": Q @ m["R"]} | {k: Q @ m[k] for k in ("w", "v", "alpha", "a")}


def wrench_power(wrench: Any, F: Frame, M: Frame) -> Any:
    """Return the power of a force and a torque on M, and of the reverse on F's body at the same point."""
    f, t = (np.array(x) for x in wrench)
    d = M["p"] - F["p"]
    return f @ (M["v"] - F["v"] - np.cross(F["w"], d)) + t @ (M["w"] - F["w"])


SEEDS = range(4)
INPUTS, WRENCH, EFFORT, _ = SIGNATURES
(ROW,) = ROWS


@dataclass(frozen=True)
class FormulaState:
    """A formula and its arguments, nested tuples of numbers.

    Attributes
    ----------
    signature : Signature
    function : function
    arguments : tuple
    frames : tuple of Frame, optional
        The frames F and M that the arguments were made from.
    row : ConstraintRow, optional
        The row that the formula is of.
    """

    signature: Signature
    function: Any
    arguments: tuple[Any, ...]
    frames: tuple[Frame, Frame] | None = None
    row: ConstraintRow | None = None

    def at(self, x: Sequence[Any]) -> np.ndarray:
        """Return all numbers of the result, for other numbers in the arguments."""
        return np.array(list(flat_numbers(self.function(*nest_numbers(self.signature.lengths, iter(x))))))

    @property
    def numbers(self) -> np.ndarray:
        """Return all numbers in the arguments."""
        return np.array(list(flat_numbers(self.arguments)), float)

    def compiled(self, x: np.ndarray, first_order: bool) -> np.ndarray:
        """Return the same as `at`, computed by the machine code that kernels call."""
        code = FormulaCode(self.function, first_order, self.signature)
        dtype = complex if first_order else float
        given, out = (
            np.ascontiguousarray(x, dtype),
            np.zeros(len(list(flat_numbers(nested_zeros(self.signature.result)))), dtype),
        )
        try:
            address = code.address
        except (ImportError, MemoryError):
            raise
        except Exception as error:  # Numba raises many kinds of exceptions
            raise ModelError(f"{self.signature} cannot be compiled: {short_reason(error)}") from error
        ctypes.CFUNCTYPE(None, ctypes.c_void_p, ctypes.c_void_p)(address)(given.ctypes.data, out.ctypes.data)
        return out


def flat_numbers(x: Any) -> Iterator[Any]:
    """Return the numbers in nested tuples as a flat sequence."""
    if isinstance(x, tuple):
        for part in x:
            yield from flat_numbers(part)
    else:
        yield x


def nest_numbers(lengths: Any, numbers: Iterator[Any]) -> Any:
    """Nested tuples of numbers, with lengths as in a `Signature`."""
    if isinstance(lengths, tuple):
        return tuple(nest_numbers(n, numbers) for n in lengths)
    return tuple(next(numbers) for _ in range(lengths)) if lengths else next(numbers)


def nested_zeros(lengths: Any) -> Any:
    """Nested tuples of zeros."""
    return nest_numbers(lengths, iter(lambda: 0.0, None))


def force_states(e: Force, par: Sequence[float]) -> list[FormulaState]:
    """States of the formulas of a force with these parameters."""
    par = (*par, *(0.0,) * (16 - len(par)))
    laws = law_values(e)
    out = []
    for seed in SEEDS:
        if isinstance(e, CoordinateForce):
            x, rate, load = np.random.default_rng(seed).normal(size=3).tolist()
            given = (abs(laws[0]), 0.0, float(np.sign(rate)))
            out.append(FormulaState(EFFORT, type(e).effort, (par, x, rate, given, abs(load))))
            continue
        F, M = random_motion(seed)
        f, m = frame_record(F), frame_record(M)
        out.append(FormulaState(INPUTS, type(e).inputs, (par, f, m), (F, M)))
        values = tuple(float(x) for x in e.inputs(par, f, m))
        out.append(FormulaState(WRENCH, type(e).wrench, (par, f, m, laws, values), (F, M)))
    return out


def row_states(row: ConstraintRow, par: Sequence[float]) -> list[FormulaState]:
    """States of the formula of a constraint row with these parameters."""
    pairs = [random_motion(seed) for seed in SEEDS]
    return [
        FormulaState(ROW, type(row).row, (tuple(par), frame_record(F), frame_record(M)), (F, M), row) for F, M in pairs
    ]


ROUNDING = 1e-11  # relative to the largest result: the same operations, with at most other functions of the C library
STEP = 1e-30  # imaginary step: its square is negligible beside 1
STEPS = (1e-3, 1e-4, 1e-5, 1e-6)  # steps of differences; one of them must suffice
SLOPE = 1e-6  # relative error of differences of fourth order with the best step
WORLD = 1e-9  # relative: error left by a shift of SHIFT, which costs three digits
SHIFT = np.array([1e3, -2e2, 5e2])
SCALES = {"meter": 3.0, "kilogram": 0.7, "second": 1.7}
"""Other units of length, mass and time, in those of the SI."""


def _differ(a: Any, b: Any, tolerance: float, size: float = 0.0) -> bool:
    """Return whether numbers differ by more than a part of the largest; nan equals nan."""
    a, b = np.asarray(a), np.asarray(b)
    if a.shape != b.shape or (np.isnan(a) != np.isnan(b)).any():
        return True
    known = ~np.isnan(a)
    largest = max(size, np.abs(a[known]).max(initial=0.0), np.abs(b[known]).max(initial=0.0))
    return bool((np.abs(a - b)[known] > tolerance * largest).any())


def _array_text(x: Any) -> str:
    return np.array2string(np.asarray(x), precision=6)


def finite(s: Subject) -> str:
    """The formulas give the right count of finite numbers at ordinary states."""
    for state in s.states:
        try:
            found = state.function(*state.arguments)
        except Exception as error:  # a user's formula may raise anything
            return f"{state.signature} raises {type(error).__name__}: {error}"
        lengths = _lengths(found)
        if lengths != state.signature.result:
            return f"{state.signature} returns {found!r}; it must return {state.signature.returns}"
        if not np.isfinite(list(flat_numbers(found))).all():
            return f"{state.signature} returns {found!r} at an ordinary state"
    return ""


def _lengths(x: Any) -> Any:
    if not isinstance(x, tuple):
        return 0
    inner = [_lengths(part) for part in x]
    return tuple(inner) if any(n != 0 for n in inner) else len(inner)


def compiled(s: Subject) -> str:
    """Compiled code gives what the Python formula gives."""
    for state in s.states:
        x = state.numbers
        plain, fast = state.at(x.tolist()), state.compiled(x, False)
        if _differ(plain, fast, ROUNDING):
            return f"{state.signature} is {_array_text(plain)} in Python and {_array_text(fast)} compiled"
    return ""


def guards(s: Subject) -> str:
    """Compiled guards of a user-defined kind of switch give what Python gives, nan included, in every mode."""
    for kind in {type(x.kind) for x in s.element.switches() if hasattr(x.kind, "guard")}:
        (signature,) = CodeTable(kind, GUARDS).signatures
        for mode, seed in itertools.product((OFF, HELD, STEADY), SEEDS):
            numbers = np.random.default_rng(seed).normal(size=sum(signature.lengths) + signature.lengths.count(0))
            given = nest_numbers(signature.lengths, iter([mode, float(np.sign(numbers[1])), *numbers[2:].tolist()]))
            state = FormulaState(signature, kind.guard, given)
            plain, fast = state.at(state.numbers.tolist()), state.compiled(state.numbers, False)
            if _differ(plain, fast, ROUNDING):
                return (
                    f"{signature} of {kind.__name__} is {_array_text(plain)} in Python and {_array_text(fast)} compiled"
                )
    return ""


def complex_numbers(s: Subject) -> str:
    """Complex numbers give the same results, in Python and compiled; the imaginary parts of both agree."""
    for state in s.states:
        x = state.numbers
        for way in (np.zeros(len(x)), _random_direction(x)):
            given = x + 1j * STEP * way
            real, plain, fast = state.at(x.tolist()), state.at(given.tolist()), state.compiled(given, True)
            for found, how in ((plain, "in Python"), (fast, "compiled")):
                if _differ(real, np.real(found), ROUNDING):
                    return (
                        f"{state.signature} is {_array_text(real)} on floats and {_array_text(found)} on complex "
                        f"numbers {how}"
                    )
            if _differ(np.imag(plain) / STEP, np.imag(fast) / STEP, ROUNDING, np.abs(real).max()):
                return f"{state.signature}: derivatives by complex numbers differ between Python and compiled code"
    return ""


def _random_direction(x: np.ndarray) -> np.ndarray:
    """Return a direction that changes all arguments by a part of their size; zeros stay zero."""
    return np.random.default_rng(1).normal(size=len(x)) * np.abs(x)


def derivatives(s: Subject) -> str:
    """A complex step gives the same derivatives as finite differences."""
    for state in s.states:
        x = state.numbers
        for seed in range(3):
            way = np.random.default_rng(seed).normal(size=len(x)) * np.abs(x)
            exact = np.imag(state.at((x + 1j * STEP * way).tolist())) / STEP
            near = [_difference(state, x, h * way) / h for h in STEPS]
            size = np.abs(state.at(x.tolist())).max()
            if all(_differ(exact, d, SLOPE, size) for d in near):
                return (
                    f"the derivatives of {state.signature} by a complex step are {_array_text(exact)}, and "
                    f"{_array_text(near[1])} by differences; abs(), max(), math.sqrt() and the like lose "
                    f"imaginary parts: "
                    f"use functions of flyball.math.scalar"
                )
    return ""


def _difference(state: FormulaState, x: np.ndarray, h: np.ndarray) -> np.ndarray:
    f = {k: state.at((x + k * h).tolist()) for k in (-2, -1, 1, 2)}
    return (8.0 * (f[1] - f[-1]) - (f[2] - f[-2])) / 12.0


def symbols(s: Subject) -> str:
    """The formulas run on symbols, and the expressions have the values that floats give."""
    for state in s.states:
        graph, x = Graph(), state.numbers
        given: list[Any] = []
        for k, value in enumerate(x.tolist()):
            symbol = Symbol(f"x{k}", "parameter" if k < state.signature.lengths[0] else "coordinate")
            given.append(graph.symbol(symbol, value if k < state.signature.lengths[0] else None) if value else 0.0)
        try:
            found = state.at(given)
        except UndeterminedDecision as error:
            return f"{state.signature} cannot be written in symbols: {error}"
        got = np.array(evaluate(list(found), {f"x{k}": value for k, value in enumerate(x.tolist())}), float)
        if _differ(state.at(x.tolist()), got, ROUNDING):
            return (
                f"{state.signature} is {_array_text(state.at(x.tolist()))} on floats and {_array_text(got)} in symbols"
            )
    return ""


def rates(s: Subject) -> str:
    """The second input is the rate of the first."""
    for state in s.states:
        if state.signature == INPUTS and state.frames is not None:
            F, M = (frame_record(complex_step_frame(x, STEP), complex) for x in state.frames)
            rate = np.imag(state.function(state.arguments[0], F, M)[0]) / STEP
            found = state.function(*state.arguments)[1]
            if _differ(rate, found, ROUNDING, 1e-3):
                return f"{state.signature}: the second input is {found:.6g}; the rate of the first is {rate:.6g}"
    return ""


def energy(s: Subject) -> str:
    """The power of a conservative element is minus the rate of its energy."""
    e: Any = s.element
    if not e.conservative():
        return ""
    cls: Any = type(e)
    for state in s.states:
        if isinstance(e, CoordinateForce):
            par, x, rate, laws, load = state.arguments
            lost = -np.imag(cls.energy(par, complex(x, STEP))) / STEP if cls.energy is not None else 0.0
            found = cls.effort(par, x, rate, laws, load)
            if _differ(lost, found, ROUNDING, abs(found)):
                return f"it is conservative; effort is {found:.6g}, minus the slope of its energy is {lost:.6g}"
        elif state.signature == WRENCH and state.frames is not None:
            F, M = state.frames
            lost = 0.0
            if cls.energy is not None:
                f, m = (frame_record(complex_step_frame(x, STEP), complex) for x in (F, M))
                lost = -np.imag(cls.energy(state.arguments[0], f, m)) / STEP
            given = wrench_power(state.function(*state.arguments), F, M)
            size = np.abs(np.array(list(flat_numbers(state.function(*state.arguments))))).max()
            if _differ(lost, given, 10.0 * ROUNDING, size):
                return f"it is conservative; its power is {given:.6g} W, and it loses {lost:.6g} W of its energy"
    return ""


def gradient(s: Subject) -> str:
    """The rate of a row's value is the power of its force and torques with the velocities of the frames."""
    for state in s.states:
        if state.frames is None or state.row is None or not state.row.holonomic:
            continue
        F, M = (frame_record(complex_step_frame(x, STEP), complex) for x in state.frames)
        rate = np.imag(state.function(state.arguments[0], F, M)[0]) / STEP
        found = _rate(state.function(*state.arguments), *state.arguments[1:])
        if _differ(rate, found, 10.0 * ROUNDING, _size(state)):
            return (
                f"{state.signature}: the value changes at a rate of {rate:.6g}; force . (v_M - v_F) + torque_M . w_M + "
                f"torque_F . w_F is {found:.6g}. The reverse of the force acts on F's body at F's origin"
            )
    return ""


def bias(s: Subject) -> str:
    """The bias of a row is the rate of its velocity, with the accelerations of the frames."""
    for state in s.states:
        if state.frames is None or state.row is None:
            continue
        F, M = (frame_record(complex_step_frame(x, STEP), complex) for x in state.frames)
        wanted = np.imag(_rate(state.function(state.arguments[0], F, M), F, M)) / STEP
        found = state.function(*state.arguments)[4]
        if _differ(wanted, found, 10.0 * ROUNDING, _size(state)):
            return (
                f"{state.signature}: the bias is {found:.6g}; the rate of force . (v_M - v_F) + torque_M . w_M + "
                f"torque_F . w_F, with the accelerations of F and M, is {wanted:.6g}"
            )
    return ""


def _rate(row: Any, F: Any, M: Any) -> Any:
    """Return the power of a row's force and torques with the velocities of its frames."""
    _, force, torque_M, torque_F, _ = (np.array(x) for x in row)
    return force @ (np.array(M[3]) - F[3]) + torque_M @ np.array(M[2]) + torque_F @ np.array(F[2])


def _size(state: FormulaState) -> float:
    """The largest number in the result of a state."""
    return float(np.abs(state.at(state.numbers.tolist())).max())


def points(s: Subject) -> str:
    """What may act on a point mass exerts no torque there, and does not depend on the orientation of its frame."""
    for state in s.states:
        if state.row is not None:
            roles, formula = state.row.points, row_wrench(state.row, state.arguments[0])
        elif state.signature == WRENCH and isinstance(s.element, Force) and s.element.on_points():
            roles, formula = "FM", force_wrench(s.element, state.arguments[0], state.arguments[3])
        else:
            continue
        for role in (x for x in roles if x in s.element.ends()):
            if why := orientation_need(formula, state.arguments[1], state.arguments[2], role):
                return f"{state.signature} {why}, which may be on a point mass: {REMEDIES[state.row is not None]}"
    return ""


def axes(s: Subject) -> str:
    """Frames rotated and shifted in the world: measured values stay, the wrench rotates with them."""
    Q = random_rotation(3)
    for state in s.states:
        if state.frames is None:
            continue
        F, M = (frame_record(turned_frame(x, Q, SHIFT)) for x in state.frames)
        here = state.function(*state.arguments)
        there = state.function(state.arguments[0], F, M, *state.arguments[3:])
        wanted = tuple(tuple(Q @ np.array(x)) if isinstance(x, tuple) else x for x in here)
        if _differ(list(flat_numbers(wanted)), list(flat_numbers(there)), WORLD, 1e-3):
            return (
                f"{state.signature} depends on the axes or the origin of the world: frames turned and shifted together "
                f"give {_array_text(list(flat_numbers(there)))}, and must give "
                f"{_array_text(list(flat_numbers(wanted)))}. For an element that "
                f"is given in the world's axes skip the checks 'axes' and 'turned'"
            )
    return ""


def units(s: Subject) -> str:
    """In other units of length, mass and time the result is the same: the formula contains no constant with a unit."""
    if (new := _rescaled(s)) is None:
        return ""
    for state, given, wanted in (
        _rescaled_rows(s, new) if isinstance(s.element, Joint) else _rescaled_force(s, s.element, new)
    ):
        found = np.array(list(flat_numbers(state.function(*given))))
        if _differ(wanted, found, WORLD):
            return (
                f"{state.signature} in other units of length, mass and time is {_array_text(found)}, and must be "
                f"{_array_text(wanted)}: a constant in it has a unit, or a field has another unit than "
                f"its formula needs"
            )
    return ""


def _rescaled(s: Subject) -> SimpleNamespace | None:
    """Return the element's numbers in other units; None if a unit is unknown."""
    e = s.element
    along = _is_angular(e) if isinstance(e, CoordinateForce) else 0
    new = SimpleNamespace(**vars(s.numbers))
    for name, unit in fields_with(type(e), Unit).items():
        value, dimension = getattr(new, name), unit.dimension
        if dimension is None and isinstance(e, CoordinateForce):
            dimension = e.dimensions.get(name, (None, None))[along]
        if value is not None:
            if dimension is None:
                return None
            setattr(new, name, _scaled(value, _unit_factor(dimension)))
    return new


Rescaled = Iterator[tuple[FormulaState, tuple[Any, ...], np.ndarray]]
"""States, their arguments in other units, and the results expected in these."""


def _rescaled_rows(s: Subject, new: SimpleNamespace) -> Rescaled:
    """Rescale the rows of a joint."""
    e: Any = s.element
    m = _unit_factor("m")
    ends = [(p * m, R) for p, R in s.ends]
    for state in s.states:
        row: Any = state.row
        par = e.row_parameters(new, row, *ends)[:6]
        F, M = (_rescaled_frame(f) for f in state.arguments[1:])
        value, rate = _unit_factor(row.measure), _unit_factor("1/s")
        units = np.repeat([value, value / m, value, value, value * rate * rate], [1, 3, 3, 3, 1])
        yield state, (par, F, M), np.array(list(flat_numbers(state.function(*state.arguments)))) * units


def _rescaled_force(s: Subject, e: Any, new: SimpleNamespace) -> Rescaled:
    """Rescale a force."""
    along = _is_angular(e) if isinstance(e, CoordinateForce) else 0
    laws = [of.dimension for of in fields_with(type(e), LawOf).values()]
    length, force = (1.0 if along else _unit_factor("m")), (_unit_factor("N*m") if along else _unit_factor("N"))
    effort = force if not laws or laws[0] is None else _unit_factor(laws[0])
    par = (*e.parameters(new, s.separation * _unit_factor("m")), *(0.0,) * 16)[:16]
    for state in s.states:
        function, arguments = state.function, state.arguments
        if state.frames is None:
            _, x, rate, values, load = arguments
            slower = length * _unit_factor("1/s")
            given = par, x * length, rate * slower, (values[0] * effort, *values[1:]), load * _unit_factor("N")
            wanted = np.array([function(*arguments) * force])
        else:
            F, M = (_rescaled_frame(f) for f in arguments[1:3])
            if state.signature == INPUTS:
                continue
            given = par, F, M, tuple(x * effort for x in arguments[3]), e.inputs(par, F, M)
            wanted = np.array(list(flat_numbers(function(*arguments)))) * np.repeat(
                [_unit_factor("N"), _unit_factor("N*m")], 3
            )
        yield state, given, wanted


def _is_angular(e: CoordinateForce) -> int:
    """Return 1 for an angle, 0 for a length."""
    return int(any(curve_parts(text)[1].startswith("angle") for text in e.along()))


def _unit_factor(unit: str) -> float:
    """Return the factor from the given unit to the same unit made of `SCALES`."""
    out = 1.0
    for base, exponent in powers_in_si(unit).items() if unit not in ("", "1") else ():
        out *= SCALES.get(base, 1.0) ** -exponent
    return out


def _scaled(value: Any, factor: float) -> Any:
    return tuple(_scaled(x, factor) for x in value) if isinstance(value, tuple | list) else value * factor


def _rescaled_frame(x: Sequence[Any]) -> Any:
    m, s = _unit_factor("m"), _unit_factor("1/s")
    scales = (m, 1.0, s, m * s, s * s, m * s * s)
    return nest_numbers((3, 9, 3, 3, 3, 3), _scaled_parts(x, scales))


def _scaled_parts(parts: Sequence[Any], scales: Sequence[float]) -> Iterator[float]:
    for part, scale in zip(parts, scales, strict=True):
        yield from (x * scale for x in part)
