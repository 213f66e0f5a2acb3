"""Equations written as code: functions of a mechanism in C, Python, CasADi or Numba; what `Mechanism.export` returns.

Accelerations and multipliers are straight-line code: the engine's regularised solve evaluated on expressions.

    [M G^T; G 0] [vdot; -lam] = [f; gamma]

No matrix is inverted: the matrices are factorised sparsely with the engine's regularisation, and the solution is
refined a fixed number of times, since straight-line code cannot test convergence. Multipliers that redundant
constraints leave undetermined are those of the engine. Forces are linear functions of the loads of joints with
friction; the loads follow from a fixed number of Newton steps that start without load.

A new language is a printer in `expression_graph.printers`, an entry of `LANGUAGES` and of `CALLING_CONVENTIONS`, and
its branches here. The docstring of `Mechanism.export`, ``docs/export.md`` and the refusal in
``tests/symbolic/test_export.py`` list the languages by hand; no test finds a language without a sample.
"""

from __future__ import annotations

import keyword
import textwrap
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any

import numpy as np

from ..engine.solve import apply_inverse_mass, factor_schur
from ..errors import ModelError
from ..expression_graph.graph import (
    SYMBOL,
    Node,
    jacobian,
    nodes_in_order,
    object_vector,
    substitute,
    symbols_of,
    zero_objects,
)
from ..expression_graph.printers.c import c_sources
from ..expression_graph.printers.casadi import casadi_functions
from ..expression_graph.printers.numba import numba_module
from ..expression_graph.printers.python import constant_definitions, python_functions, python_module
from ..expression_graph.printers.routines import Argument, Identifiers, Routine, python_functions_of, refuse_too_long
from ..expression_graph.tracing import TracedEquations
from ..math.vec import add, cross, load3, load9, mm, mv
from ..model.body import Frame
from ..model.messages import listing, suggest
from ..model.output_files import make_folder, write_file
from ..model.quantities import component_names, quantities
from ..numerics.sparse_factorisation import LDLPattern, analyse_ldl, ldl_factor, ldl_solve
from ..results.wording import with_unit
from ..tables.table_definitions import FactorVectors, map_arrays
from .fmu import archive as fmu

if TYPE_CHECKING:
    from .equations import Equations


# The first refinement reduces the regularisation error of a well determined solution below rounding.
REFINEMENTS = 2
# A semidefinite mass matrix uses substitute masses, whose effect must be removed, too.
LIGHT_VELOCITIES = 4
# Newton steps for loads; convergence is quadratic from the first step on the solution's side.
NEWTON_STEPS = 7

SinglePass = Callable[[np.ndarray, np.ndarray], tuple[np.ndarray, np.ndarray]]


@dataclass
class SolvedAccelerations:
    """Solution of the equations of motion at a state that fulfils g = 0 and G v = nu."""

    vdot: np.ndarray  # (nv,)
    lam: np.ndarray  # (nr,)
    loads: np.ndarray  # (nl,), of joints with friction


def solve_traced(x: TracedEquations) -> SolvedAccelerations:
    """Solve the traced equations.

    Parameters
    ----------
    x : TracedEquations
        With rows for all prescribed coordinates, as in `symbolic.named_equations`.

    Raises
    ------
    ModelError
        If a force is not a linear function of the load of a joint with friction.
    """
    once = coupled(x) if len(x.system.mass_entries.row) else schur(x)
    if not x.loads:
        return SolvedAccelerations(*_refined(x, once, x.f, x.gamma), zero_objects(0))
    return _loaded(x, once)


def _refined(x: TracedEquations, once: SinglePass, f: np.ndarray, gamma: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Solution refined by its residuals in the unregularised equations."""
    light = x.system.scales.semidefinite > 0.0
    balanced = not len(x.system.mass_entries.row) and not light  # each step fulfils M vdot = f + G^T lam then
    vdot, lam = once(f, gamma)
    for _ in range(LIGHT_VELOCITIES if light else REFINEMENTS if len(lam) else 1):
        left = zero_objects(len(f)) if balanced else f - x.M @ vdot + _forces(x.G, lam)
        dv, dl = once(left, gamma - x.G @ vdot if len(lam) else gamma)
        vdot, lam = vdot + dv, lam + dl
    return vdot, lam


def _forces(G: np.ndarray, lam: np.ndarray) -> np.ndarray:
    return G.T @ lam if len(lam) else zero_objects(G.shape[1])


def schur(x: TracedEquations) -> SinglePass:
    """Solution by S = G M^-1 G^T with the mass matrix M of single bodies: `solve.factor_schur`."""
    S, nr = x.system, len(x.lam)
    rows = np.repeat(np.arange(nr), np.diff(S.row_start[: nr + 1]))
    W = x.work._replace(
        G=zero_objects(len(x.work.G)),
        H=zero_objects(len(x.work.H)),
        rows=map_arrays(lambda _, a: a.copy(), x.work.rows),
    )
    W.G[: len(rows)] = x.G[rows, S.column[: len(rows)]]
    _refuse_long(S.ldl)
    n = len(S.ldl.perm)
    ldl = zero_objects(FactorVectors.layout.width, n).view(FactorVectors)
    W = W._replace(A=zero_objects(len(S.ldl.Ai) + 1), L=zero_objects(len(S.ldl.Li)), ldl=ldl)
    factor_schur(S, W)
    L, D = W.L, W.ldl.inverse_diagonal

    def once(f: np.ndarray, gamma: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        dx = zero_objects(len(f))
        for b in range(len(S.tree.parent)):
            apply_inverse_mass(S, b, f, S.tree.v[b], dx, S.tree.v[b])
        mu = solve_factored(S.ldl, L, D, gamma - x.G @ dx) if nr else gamma
        for e, k in enumerate(rows):
            dx[S.column[e]] = dx[S.column[e]] + W.H[e] * mu[k]
        return dx, mu

    return once


def coupled(x: TracedEquations) -> SinglePass:
    """Solution by [M G^T; G -delta]: `solve.factor_coupled`; symbolic zeros are left out of the pattern."""
    nv, nr = len(x.v), len(x.lam)
    K = np.zeros((nv + nr, nv + nr), object)
    K[:nv, :nv] = x.M
    K[nv:, :nv] = x.G
    for k in range(nr):
        size: Any = 0.0
        for d, least in zip(inertia_velocities(x, k), entry_sizes(x, k), strict=True):
            size = size + (x.G[k, d] * x.G[k, d] + least * least) / x.M[d, d]
        K[nv + k, nv + k] = -x.system.scales.regularization * (1.0 if size == 0.0 else size)
    below = [(i, j) for i in range(nv + nr) for j in possible_entries(K[i, :i])]
    i, j = np.array(below, np.int64).reshape(-1, 2).T
    P, place = analyse_ldl(nv + nr, i, j)
    A = zero_objects(len(P.Ai))
    for at, entry in zip(place, [*K[i, j], *K.diagonal()], strict=True):
        A[at] = entry
    L, D = factor_matrix(P, A)

    def once(f: np.ndarray, gamma: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        both = solve_factored(P, L, D, np.concatenate([f, gamma]))
        return both[:nv], -both[nv:]

    return once


def inertia_velocities(x: TracedEquations, k: int) -> list[int]:
    """Velocities whose inertia scales row k: all that it can act on, except prescribed ones."""
    S = x.system
    if k >= len(S.rows.law):  # row of a driver that prescribes a velocity
        return possible_entries(x.G[k])
    return [int(S.column[e]) for e in inertia_entries(x, k)]


def entry_sizes(x: TracedEquations, k: int) -> np.ndarray:
    """Size of the entry of row k in the column of each of its `inertia_velocities`."""
    S = x.system
    if k >= len(S.rows.law):
        return np.ones(len(possible_entries(x.G[k])))  # the row has the unit of the velocity that it prescribes
    return S.entry_sizes[inertia_entries(x, k)]


def inertia_entries(x: TracedEquations, k: int) -> list[int]:
    """Entries of row k, of those in `Work.G`, except in columns of prescribed velocities."""
    S = x.system
    return [e for e in range(S.row_start[k], S.row_start[k + 1]) if S.pairs.place[e] < len(S.ldl.Ai)]


def possible_entries(row: np.ndarray) -> list[int]:
    """Indices of the entries of a row that are not known to be zero."""
    return [d for d, entry in enumerate(row) if not entry == 0.0]


def factor_matrix(P: LDLPattern, A: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """L and the inverse diagonal, by the engine's factorisation on nodes, which assumes nonzero pivots.

    Raises
    ------
    ModelError
        If it takes too many operations for straight-line code.
    """
    _refuse_long(P)
    n = len(P.perm)
    L, D = zero_objects(len(P.Li)), zero_objects(n)
    ldl_factor(P, A, L, D, zero_objects(n))
    return L, D


def _refuse_long(P: LDLPattern) -> None:
    columns = np.diff(P.Lp)
    refuse_too_long("the solution", int(2 * (columns * (columns + 3)).sum()))


def solve_factored(P: LDLPattern, L: np.ndarray, D: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Solve with the factors."""
    z = zero_objects(len(b))
    z[P.perm] = b
    ldl_solve(P, L, D, z)
    return z[P.perm]


def _loaded(x: TracedEquations, once: SinglePass) -> SolvedAccelerations:
    """Solution where friction depends on the reactions, and these on friction.

    Multipliers are linear functions of the loads, lam = lam0 + K load; each load is a norm of some of them.
    """
    slopes = jacobian(list(x.f), x.loads)
    if set(symbols_of(list(slopes.ravel()))) & set(x.loads):
        raise ModelError("a force is no linear function of the load of a joint with friction: simulate it here")
    f0 = object_vector(substitute(list(x.f), [(s, 0.0) for s in x.loads]))
    vdot, lam = _refined(x, once, f0, x.gamma)
    columns = [_refined(x, once, slopes[:, n], zero_objects(len(lam))) for n in range(len(x.loads))]
    A, K = (np.array([c[k] for c in columns], object).T for k in (0, 1))
    by_lam = jacobian(list(x.returned), x.lam)
    loads = zero_objects(len(x.loads))
    for _ in range(NEWTON_STEPS):
        at = list(zip(x.lam, lam + K @ loads, strict=True))
        back = object_vector(substitute(list(x.returned), at))
        slope = object_vector(substitute(list(by_lam.ravel()), at)).reshape(by_lam.shape) @ K
        loads = loads + eliminate(np.eye(len(loads)) - slope, back - loads)
    return SolvedAccelerations(vdot + A @ loads, lam + K @ loads, loads)


def eliminate(A: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Solve a few equations by Gaussian elimination without pivoting: the diagonal is one minus a slope below one."""
    A, b, n = A.astype(object), b.copy(), len(b)
    for k in range(n):
        for i in range(k + 1, n):
            factor = A[i, k] / A[k, k]
            A[i, k + 1 :] = A[i, k + 1 :] - factor * A[k, k + 1 :]
            b[i] = b[i] - factor * b[k]
    for k in range(n - 1, -1, -1):
        for j in range(k + 1, n):
            b[k] = b[k] - A[k, j] * b[j]
        b[k] = b[k] / A[k, k]
    return b


class Functions:
    """Routines of a mechanism's equations.

    Parameters
    ----------
    equations : Equations
    outputs : sequence of str
        Names of the quantities that the function ``outputs`` returns.
    """

    def __init__(self, equations: Equations, outputs: Sequence[str] = ()) -> None:
        self.equations, self.traced = equations, equations.named_equations.traced
        self.outputs = tuple(outputs)

    def routine(self, name: str) -> Routine:
        """A function by name.

        Raises
        ------
        ModelError
            If there is no such function.
        """
        if name not in FUNCTIONS or (name == "outputs" and not self.outputs):
            raise ModelError(f"there is no function {name!r} to export; {listing(self.names)}")
        results, arguments, meaning, meanings = FUNCTIONS[name](self)
        return Routine(name, self._arguments(arguments.split(), results), results, meaning, meanings)

    @property
    def names(self) -> list[str]:
        """Names of the functions of this mechanism."""
        return [k for k in FUNCTIONS if k != "outputs" or self.outputs]

    @cached_property
    def arguments(self) -> dict[str, Argument]:
        """All possible arguments, in order; those that the mechanism does not have are left out."""
        eq, x = self.equations, self.traced
        named = eq.named
        u = [named[k] for k in eq.inputs]
        p = [named[k] for k in eq.parameters]
        places = [place.symbol for place in eq.named_equations.places]
        found = {
            "t": Argument("t", x.t, "time"),
            "q": Argument("q", x.q, "coordinates"),
            "v": Argument("v", x.v, "velocities"),
            "z": Argument("z", x.states, "states of controllers"),
            "vdot": Argument("vdot", eq.named_equations.vdot, "accelerations"),
            "lam": Argument("lam", x.lam, "multipliers"),
            "loads": Argument("loads", x.loads, "normal forces of joints with friction"),
            "places": Argument("places", places, "places of followers on their curves"),
            "u": Argument("u", u, "inputs", (0.0,) * len(u)),
            "p": Argument("p", p, "parameters", tuple(n.value for n in p)),
        }
        return {k: a for k, a in found.items() if a.single or a.nodes}

    def _arguments(self, usual: Sequence[str], results: dict[str, Any]) -> list[Argument]:
        """The standard arguments of a function, and further ones that it needs for this mechanism."""
        nodes = [x for a in results.values() for x in np.ravel(a)]
        met = {x.index for x in nodes_in_order(nodes) if x.op == SYMBOL}
        return [a for k, a in self.arguments.items() if k in usual or any(x.index in met for x in a.nodes)]

    @cached_property
    def solution(self) -> SolvedAccelerations:
        """Accelerations, multipliers and loads."""
        return solve_traced(self.traced)

    @cached_property
    def solved(self) -> list[tuple[Node, Any]]:
        """Replacements for the symbols of accelerations, multipliers and loads at a state."""
        x, found = self.traced, self.solution
        pairs = ((self.equations.named_equations.vdot, found.vdot), (x.lam, found.lam), (x.loads, found.loads))
        return [(symbol, value) for symbols, values in pairs for symbol, value in zip(symbols, values, strict=True)]

    @property
    def carried(self) -> list[str]:
        """Names of bodies and frames whose poses are exported."""
        model = self.equations.model
        return [e.name for e in (*model.bodies, *model.frames)]

    def records(self) -> list[tuple[Any, ...]]:
        """Position, axes, velocity and angular velocity of every body's reference frame and every named frame."""
        x, found = self.equations.named_equations.values, []
        W = self.traced.work
        for name in self.carried:
            e = self.equations.model[name]
            owner = e.body if isinstance(e, Frame) else name
            b = x.structure.place.get(owner, -1)
            p, R = (np.asarray(a, object) for a in x.poses.named(name))
            if b < 0:
                found.append((p, R, np.zeros(3), np.zeros(3)))
                continue
            body = x.bodies[owner]
            own = np.asarray(body.R, object)
            offset, turn = own.T @ (p - np.asarray(body.c, object)), own.T @ R
            axes, w = load9(W.bodies.rotation, b, 0), load3(W.bodies.angular_velocity, b, 0)
            arm = mv(axes, tuple(offset))
            at, v = add(load3(W.bodies.position, b, 0), arm), add(load3(W.bodies.velocity, b, 0), cross(w, arm))
            found.append((at, np.array(mm(axes, tuple(turn.ravel())), object).reshape(3, 3), v, w))
        return found

    def stacked(self, k: int) -> np.ndarray:
        """Item k of these records, of all bodies and frames."""
        parts = [np.asarray(r[k], object) for r in self.records()]
        made = np.empty((len(parts), *parts[0].shape), object)
        for n, a in enumerate(parts):
            made[n] = a
        return self.equations.named_equations.cleaned(made)


FunctionParts = tuple[dict[str, Any], str, str, dict[str, str]]
FUNCTIONS: dict[str, Callable[[Functions], FunctionParts]] = {}
"""Functions by name: results, standard arguments, meaning of the function and of its results."""


def exported_function(make: Callable[[Functions], FunctionParts]) -> Callable[[Functions], FunctionParts]:
    """Register a function by its name."""
    FUNCTIONS[make.__name__.rstrip("_")] = make
    return make


@exported_function
def kinematics(x: Functions) -> FunctionParts:
    """Poses."""
    told = f"of {', '.join(x.carried)}: origins [m], along the world's axes"
    turned = "their axes, as columns"
    results = {"positions": x.stacked(0), "rotations": x.stacked(1)}
    return results, "t q p", "Poses of bodies' reference frames and of named frames.", {
        "positions": told, "rotations": turned,
    }  # fmt: skip


@exported_function
def velocities(x: Functions) -> FunctionParts:
    """Velocities of the same."""
    results = {"velocities": x.stacked(2), "angular_velocities": x.stacked(3)}
    return results, "t q v p", "Velocities of bodies' reference frames and of named frames.", {
        "velocities": f"of {', '.join(x.carried)}: of origins [m/s], along the world's axes",
        "angular_velocities": "[rad/s], along the world's axes",
    }  # fmt: skip


@exported_function
def T(x: Functions) -> FunctionParts:
    """Rates of coordinates."""
    return {"T": x.traced.T}, "q p", "qdot = T v.", {"T": "rates of the coordinates by the velocities"}


@exported_function
def M(x: Functions) -> FunctionParts:
    """Mass matrix."""
    return {"M": x.traced.M}, "q p", "Mass matrix.", {"M": "symmetric [kg, kg m, kg m^2]"}


@exported_function
def f(x: Functions) -> FunctionParts:
    """Forces."""
    what = "All forces but reactions along the velocities, gyroscopic ones included."
    return {"f": x.traced.f}, "t q v u p", what, {"f": "[N, N m]"}


@exported_function
def g(x: Functions) -> FunctionParts:
    """Constraints."""
    return {"g": x.traced.g}, "t q p", "Constraints, g = 0.", {"g": "[m, rad, 1]; 0 for those of velocities only"}


@exported_function
def nu(x: Functions) -> FunctionParts:
    """Right-hand side of velocities."""
    return {"nu": x.traced.nu}, "t q p", "Velocity constraints: G v = nu.", {}


@exported_function
def G(x: Functions) -> FunctionParts:
    """Jacobian."""
    return {"G": x.traced.G}, "t q p", "Jacobian of the constraints along the velocities.", {}


@exported_function
def gamma(x: Functions) -> FunctionParts:
    """Right-hand side of accelerations."""
    return {"gamma": x.traced.gamma}, "t q v p", "Acceleration constraints: G vdot = gamma.", {}


@exported_function
def residual(x: Functions) -> FunctionParts:
    """Residual."""
    T = x.traced
    missed = T.M @ np.array(x.equations.named_equations.vdot, object) - T.f
    if T.lam:
        missed = missed - T.G.T @ np.array(T.lam, object)
    given = list(zip(T.loads, T.returned, strict=True))
    new = np.empty(len(missed), object)
    new[:] = substitute(list(missed), given)
    what = "M vdot - f - G^T lam: zero along every motion."
    return {"residual": new}, "t q v vdot lam u p", what, {"residual": "[N, N m]"}


@exported_function
def right_hand_side(x: Functions) -> FunctionParts:
    """Rates of the state, and multipliers."""
    T, found = x.traced, x.solution
    qdot = T.T @ np.array(T.v, object)
    results = {"qdot": qdot, "vdot": found.vdot, "lam": found.lam}
    meanings = {
        "qdot": "rates of the coordinates",
        "vdot": "accelerations",
        "lam": "multipliers: reactions are G^T lam",
    }
    places = x.equations.named_equations.places
    if T.states:
        results["zdot"] = T.state_rates
        meanings["zdot"] = "rates of the states of controllers"
    if T.loads:
        results["loads"] = found.loads
        meanings["loads"] = "of joints with friction [N]"
    if places:
        results["placesdot"] = np.array([p.rate for p in places], object)
        meanings["placesdot"] = "rates of the places on curves"
    return results, "t q v u p", "Accelerations and multipliers at a state with g = 0 and G v = nu.", meanings


@exported_function
def energies(x: Functions) -> FunctionParts:
    """Kinetic and potential energy."""
    quantity = x.equations.quantities.quantity
    results = {k: quantity(f"energy.{k}").nodes[()] for k in ("kinetic", "potential")}
    return results, "t q v p", "Kinetic energy, and potential energy of gravity and springs [J].", {}


@exported_function
def outputs(x: Functions) -> FunctionParts:
    """Quantities by name."""
    found = [x.equations[name] for name in x.outputs]
    wide = [name for name, e in zip(x.outputs, found, strict=True) if e.shape]
    if wide:
        owner, _, what = wide[0].rpartition(".")
        parts = component_names(quantities(x.equations.model, owner), what)
        remedy = f": take its components, {', '.join(f'{owner}.{k}' for k in parts)}" if parts else ""
        raise ModelError(f"the output {wide[0]!r} is no single number{remedy}")
    nodes: list[Any] = [e.nodes[()] for e in found]
    met = {n.index for n in nodes_in_order(nodes) if n.op == SYMBOL}
    if any(
        n.index in met for symbols in (x.equations.named_equations.vdot, x.traced.lam, x.traced.loads) for n in symbols
    ):
        nodes = substitute(nodes, x.solved)
    units = ", ".join(with_unit(n, e.unit) for n, e in zip(x.outputs, found, strict=True))
    y = np.empty(len(nodes), object)
    y[:] = nodes
    return {"y": y}, "t q v u p", "Outputs.", {"y": units}


EQUATIONS = "qdot = T v,  M vdot = f + G^T lam,  g = 0,  G v = nu,  G vdot = gamma"

CALLING_CONVENTIONS = {
    "c": "Arguments and results are arrays of double, matrices row by row; results must be allocated by the caller. "
    "The functions have no static data, so threads may share them. Compile with a C99 compiler, link with -lm.",
    "python": "Arguments are numbers and sequences; arrays of states have the states' own axes first, and so have the "
    "results. NumPy is all that is needed.",
    "casadi": "Functions of SX; they take numbers, SX and MX. Matrices are matrices, several of them are stacked. "
    "The other files in this folder contain them.",
    "numba": "Arguments are floats and arrays of floats; one state at a time.",
}
CALLING_CONVENTIONS |= dict.fromkeys(fmu.VERSIONS, CALLING_CONVENTIONS["c"])


def file_header(eq: Equations, language: str, routines: Sequence[Routine]) -> str:
    """Header comment of a file."""
    from .. import __version__

    told = [
        f"Functions of the mechanism {eq.model.name!r}, written by flyball {__version__}.",
        "",
        f"    {EQUATIONS}",
        "",
        *textwrap.wrap(
            "SI units and radians. World axes unless stated otherwise. Velocities v are rates of the coordinates q, "
            "but for bodies that turn freely: unit quaternions e0 to e3 (scalar first) in q, angular velocities w_x, "
            "w_y, w_z along the body's own axes in v. Reactions are G^T lam.",
            105,
        ),
        *textwrap.wrap(CALLING_CONVENTIONS[language], 105),
        "",
        f"Coordinates: {eq.coordinates}.",
    ]
    for name, items in argument_names(eq).items():
        if items:
            told += textwrap.wrap(f"{name} ({len(items)}): {', '.join(items)}", 105, subsequent_indent="    ")
    told += [f"{r.name}: {r.operations} operations" for r in routines]
    return "\n".join(told)


def argument_names(eq: Equations) -> dict[str, tuple[str, ...]]:
    """Names of the entries of each argument."""
    named = {k: getattr(eq, k).rows for k in ("q", "v", "z", "lam")}
    return named | {"u": eq.inputs, "p": tuple(eq.parameters)}


def argument_constants(eq: Equations, start: Mapping[str, np.ndarray]) -> dict[str, Sequence[object]]:
    """Names of the arguments' entries, and their initial values."""
    named = {f"{k}_names": x for k, x in argument_names(eq).items() if x}
    return named | {
        f"{k}_start" if k != "p" else "p_values": x.tolist() for k, x in start.items() if k != "u" and len(x)
    }


LANGUAGES = ("c", "python", "casadi", "numba", "fmu", "fmu2")


@dataclass(frozen=True)
class Code:
    """Functions of a mechanism as code.

    ``code["right_hand_side"]`` is a callable function: a Python function for ``python`` and ``numba``, a
    ``casadi.Function`` for ``casadi``. C must be compiled first.

    Attributes
    ----------
    language : {"c", "python", "casadi", "numba", "fmu", "fmu2"}
    name : str
        Name of the files, and prefix of names in C.
    texts : dict of str to str
        File name -> its text; the functions of CasADi are separate files.
    operations : dict of str to int
        Number of operations of each function; common operations count in each.
    names : dict of str to tuple of str
        Names of the entries of each argument: ``names["q"]``.
    start : dict of str to ndarray
        ``q``, ``v`` and controller states ``z`` as described and assembled, curve parameters ``places``, values of the
        inputs ``u`` and parameters ``p``.
    files : tuple of Path
        Files that were written.
    """

    language: str
    name: str
    texts: dict[str, str] = field(repr=False)
    operations: dict[str, int]
    names: dict[str, tuple[str, ...]] = field(repr=False)
    start: dict[str, np.ndarray] = field(repr=False)
    routines: tuple[Routine, ...] = field(repr=False)
    files: tuple[Path, ...] = ()

    @cached_property
    def functions(self) -> Mapping[str, Any]:
        """The functions by name.

        Raises
        ------
        ModelError
            If they are in C.
        """
        if self.language == "casadi":
            return casadi_functions(self.routines)
        if self.language == "python":
            return python_functions(self.routines)
        if self.language == "numba":
            space: dict[str, Any] = {}
            exec(compile(self.texts[f"{self.name}.py"], f"<{self.name}>", "exec"), space)
            return {r.name: space[r.name] for r in self.routines}
        what = "an FMU" if self.language in fmu.VERSIONS else "C"
        raise ModelError(f"functions in {what} are called when they are compiled: write them to a folder")

    def __getitem__(self, name: str) -> Any:
        """A function by its name."""
        if name not in self.operations:
            raise ModelError(f"there is no function {name!r}{suggest(name, self.operations)} in this code")
        return self.functions[name]

    def written(self, folder: str | Path) -> Code:
        """Write the files to a folder, which is created if missing; returns the code with the file names."""
        folder = make_folder(folder)
        if self.language in fmu.VERSIONS:
            path = folder / f"{self.name}.fmu"
            fmu.pack(self.name, fmu.VERSIONS[self.language], self.texts, path)
            return replace(self, files=(path,))
        for name, text in self.texts.items():
            write_file(folder / name, text)
        written = [folder / name for name in self.texts]
        if self.language == "casadi":
            for name, f in self.functions.items():
                written.append(folder / f"{self.name}_{name}.casadi")
                with TemporaryDirectory() as aside:  # CasADi writes its files itself
                    f.save(str(Path(aside) / name))
                    write_file(written[-1], (Path(aside) / name).read_bytes())
        return replace(self, files=tuple(written))

    def lines(self) -> list[tuple[str, str]]:
        """Labels and texts for people."""
        told = [("language", self.language)]
        told += [(r.name, f"of {', '.join(a.name for a in r.arguments)}: {self.operations[r.name]} operations")
                 for r in self.routines]  # fmt: skip
        return told

    def as_dict(self) -> dict[str, Any]:
        """Plain data: language, operations, names and start."""
        return {
            "language": self.language,
            "name": self.name,
            "operations": self.operations,
            "names": {k: list(x) for k, x in self.names.items()},
            "start": {k: x.tolist() for k, x in self.start.items()},
            "files": [str(f) for f in self.files],
        }


def export_equations(
    eq: Equations,
    folder: str | Path | None = None,
    *,
    language: str = "c",
    functions: Sequence[str] = (),
    outputs: Sequence[str] = (),
    name: str = "",
) -> Code:
    """Equations as code, written to a folder if one is given: see `Mechanism.export`."""
    if language not in LANGUAGES:
        raise ModelError(f"language={language!r}: must be {', '.join(LANGUAGES)}{suggest(str(language), LANGUAGES)}")
    if isinstance(functions, str) or isinstance(outputs, str):
        raise ModelError("functions and outputs are lists of names")
    own = argument_names(eq)
    states = {*own["q"], *own["v"], *own["z"]} if language in fmu.VERSIONS else set()  # which are variables anyway
    made = Functions(eq, [name for name in outputs if name not in states])
    if language in fmu.VERSIONS:
        if functions:
            raise ModelError(f"functions= has no effect with language={language!r}, which decides itself; leave it out")
        functions = [f for f in fmu.FUNCTIONS if f in made.names and (len(made.traced.lam) or f not in fmu.CONSTRAINTS)]
    routines = tuple(made.routine(k) for k in dict.fromkeys(functions or made.names))
    _annotate_functions(eq, routines)
    called = _identifier(name or eq.model.name, language)
    start = _start(eq, made)
    told, top = argument_constants(eq, start), file_header(eq, language, routines)
    if language == "c" or language in fmu.VERSIONS:
        sources = c_sources(routines, called, top, told)
        texts = {f"{called}.c": sources.source, f"{called}.h": sources.header}
        if language in fmu.VERSIONS:
            shown = [(n, "" if n in states else eq[n].unit) for n in outputs]
            texts = fmu.unit_files(fmu.unit_of(called, eq.model.name, language, routines, start, shown, eq), texts)
    elif language == "casadi":
        for r in routines:
            r.check()
        texts = {f"{called}.py": _loader(routines, called, top, told)}
    else:
        texts = {f"{called}.py": (python_module if language == "python" else numba_module)(routines, top, told)}
    names = {a.name: tuple(x.data.name for x in a.nodes) for a in made.arguments.values()}
    code = Code(language, called, texts, {r.name: r.operations for r in routines}, names, start, routines)
    if language == "casadi":
        _ = code.functions  # refuses functions that cannot be written
    return code if folder is None else code.written(folder)


def _start(eq: Equations, made: Functions) -> dict[str, np.ndarray]:
    """Initial values of state, curve parameters, inputs and parameters."""
    wanted = {p.symbol.data.name: p.symbol for p in eq.named_equations.places}
    known = eq.checked(eq.start, wanted)
    values: dict[str, list[float]] = {
        k: [float(known[x.data.name]) for x in made.arguments[k].nodes]
        for k in ("q", "v", "z", "places")
        if k in made.arguments
    }
    given = {k: list(made.arguments[k].values or ()) for k in ("u", "p") if k in made.arguments}
    return {k: np.array(x) for k, x in (values | given).items()}


def _annotate_functions(eq: Equations, routines: Sequence[Routine]) -> None:
    """Record for Python functions which laws they belong to, for messages."""
    laws = {id(c.native.python): c.where for c in eq.named_equations.values.structure.functions}
    for _, f in python_functions_of(routines, Identifiers()).values():
        f.details["of"] = laws.get(id(f.python), "")


def _identifier(name: str, language: str) -> str:
    taken = [*keyword.kwlist, "numpy", "casadi", "numba", "math"] if language != "c" else ["math"]
    return Identifiers(taken)(name.lower())


def _loader(routines: Sequence[Routine], name: str, top: str, constants_text: Mapping[str, Sequence[Any]]) -> str:
    """Text of a module that loads the functions of CasADi."""
    read = "".join(f'{r.name} = ca.Function.load(str(HERE / "{name}_{r.name}.casadi"))\n' for r in routines)
    imports = "from pathlib import Path\n\nimport casadi as ca\n"
    return f'"""{top}\n"""\n\n{imports}{constant_definitions(constants_text)}\nHERE = Path(__file__).parent\n{read}'
