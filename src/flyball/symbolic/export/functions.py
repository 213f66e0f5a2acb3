"""Functions that can be exported of a mechanism, with arguments, results and their meanings."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from ...errors import ModelError
from ...expression_graph.evaluation import nodes_in_order, substitute
from ...expression_graph.graph import SYMBOL, Node
from ...expression_graph.printers.routines import Argument, Routine
from ...math.vec import add, cross, load3, load9, mm, mv
from ...model.body import Frame
from ...model.messages import listing
from ...results.wording import with_unit
from .solution import Solution, solve_traced

if TYPE_CHECKING:
    from ..equations import Equations


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
    def solution(self) -> Solution:
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
        raise ModelError(f"the output {wide[0]!r} is no single number: take its components, such as {wide[0] + '_x'!r}")
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
