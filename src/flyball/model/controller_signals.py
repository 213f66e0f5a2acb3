"""Signals of controllers as expressions of measured quantities, time, parameters and the controllers' states.

If a law names a controller, the formula of its output is substituted, so that all analyses of laws, such as the search
for nonsmooth points, include the controller. A state is a name such as ``pid.integral``, which laws read like a sensor.
Algebraic loops of signals are solved if each signal is linear in the others.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Collection
from dataclasses import replace
from typing import TYPE_CHECKING, Any, NamedTuple

from ..errors import ExpressionError, ModelError
from .controller import Controller, refuse_equal
from .element import LawOf, resolve
from .expression_parser import SyntaxNode, call_node
from .expressions import Expression
from .messages import suggest
from .names import curve_parts

if TYPE_CHECKING:
    from .model import Model


ZERO, ONE = (SyntaxNode("number", (), x) for x in (0.0, 1.0))
SINGULAR_GAIN = 1e-9  # distance of a loop's gain from 1 below which the loop does not determine its signal


def solve_loop(tree: SyntaxNode, name: str, whose: str, ring: str) -> SyntaxNode:
    """Solve the formula of a signal that contains the signal itself: y = a y + b gives b / (1 - a).

    Parameters
    ----------
    tree : Node
    name : str
        Name of the signal.
    whose, ring : str
        The controller and the signals of the loop, for messages.

    Raises
    ------
    ModelError
        If the formula is not linear in the signal, or every value or none satisfies it.
    """
    parts = _linear(tree, name)
    if parts is None:
        raise ModelError(
            f"{whose}: its {curve_parts(name)[1]} depends on itself at the same instant, and not linearly (limits, "
            f"products, functions): {ring}. Have one of them go through a state, as a Lag or an Integrator has, or "
            f"sample one of the controllers (period=...)"
        )
    a, b = parts
    if a.kind == "number" and abs(a.value - 1.0) <= SINGULAR_GAIN:
        raise ModelError(
            f"{whose}: its {curve_parts(name)[1]} depends on itself at the same instant with the gain 1, so it is "
            f"not determined: {ring}. Add a state to this loop, with a Lag or an Integrator"
        )
    return _over(b, _plus(ONE, _minus(a)))


def _folded(tree: SyntaxNode) -> SyntaxNode:
    """Fold sums, products and ratios of numbers in the tree."""
    if not tree.args:
        return tree
    args = tuple(_folded(x) for x in tree.args)
    if tree.kind == "neg":
        return _minus(args[0])
    by = {"+": _plus, "-": lambda x, y: _plus(x, _minus(y)), "*": _times, "/": _over}.get(tree.kind)
    plain = by is not None and all(x.kind == "number" for x in args)
    return by(*args) if plain and by is not None else replace(tree, args=args)


def _linear(tree: SyntaxNode, name: str) -> tuple[SyntaxNode, SyntaxNode] | None:
    """Return a and b of a y + b, both without the name y; None if the tree does not have this form."""
    if all(n.kind != "name" or n.value != name for n in tree.walk()):
        return ZERO, _folded(tree)
    if tree.kind == "name":
        return ONE, ZERO
    found = [_linear(x, name) for x in tree.args]
    if any(x is None for x in found):
        return None
    parts = [x for x in found if x is not None]
    if tree.kind == "neg":
        return _minus(parts[0][0]), _minus(parts[0][1])
    if tree.kind in ("+", "-"):
        first, last = parts
        if tree.kind == "-":
            last = _minus(last[0]), _minus(last[1])
        return _plus(first[0], last[0]), _plus(first[1], last[1])
    if tree.kind == "*":
        for (a, b), (none, by) in (parts, parts[::-1]):
            if none == ZERO:
                return _times(a, by), _times(b, by)
    if tree.kind == "/" and parts[1][0] == ZERO:
        return _over(parts[0][0], parts[1][1]), _over(parts[0][1], parts[1][1])
    if tree.kind == "where" and parts[0][0] == ZERO:
        (_, when), (a, b), (c, d) = parts
        return SyntaxNode("where", (when, a, c)), SyntaxNode("where", (when, b, d))
    return None


def _minus(x: SyntaxNode) -> SyntaxNode:
    return SyntaxNode("number", (), -x.value) if x.kind == "number" else SyntaxNode("neg", (x,))


def _plus(x: SyntaxNode, y: SyntaxNode) -> SyntaxNode:
    if x.kind == y.kind == "number":
        return SyntaxNode("number", (), x.value + y.value)
    return y if x == ZERO else x if y == ZERO else SyntaxNode("+", (x, y))


def _times(x: SyntaxNode, y: SyntaxNode) -> SyntaxNode:
    if x.kind == y.kind == "number":
        return SyntaxNode("number", (), x.value * y.value)
    return ZERO if ZERO in (x, y) else y if x == ONE else x if y == ONE else SyntaxNode("*", (x, y))


def _over(x: SyntaxNode, y: SyntaxNode) -> SyntaxNode:
    if x.kind == y.kind == "number" and y.value != 0.0:
        return SyntaxNode("number", (), x.value / y.value)
    return ZERO if x == ZERO else x if y == ONE else SyntaxNode("/", (x, y))


MAX_OPERATIONS = 20_000
"""Largest number of operations of a law after substitution of controllers' formulas."""
CONTROLLER_INPUT = LawOf(None, curves=True)
"""Names that laws of controllers' inputs may use."""


class ConnectedState(NamedTuple):
    """One state of a controller with its law in terms of measured quantities; for a sampled one also a held signal.

    The states of forces are among them: their rates are given by the forces' formulas, in place of laws.
    """

    controller: Any  # or a force
    state: str
    law: Expression  # its rate, or its value from the next sample on
    signal: bool = False

    @property
    def name(self) -> str:
        """Name in laws: "pid.integral"."""
        return f"{self.controller.name}.{self.state}"


def controllers_by_name(model: Model) -> dict[str, Controller]:
    """Return the controllers by name, including those that are being added."""
    return {c.name: c for c in (*model.controllers, *vars(model).get("_adding", ()))}


def signal_names(model: Model) -> Collection[str]:
    """Return all names of signals and states that laws may use."""
    return _signal_graph(model).names if controllers_by_name(model) else ()


def substitute_signals(model: Model, law: Expression, of: LawOf) -> Expression:
    """Replace controllers' signals in the law by their formulas; for a function in its arguments."""
    known = set(signal_names(model))
    if not law.names & known:
        return law
    if law.function is None:
        return dataclasses.replace(law, tree=_signal_graph(model).placed(law.tree))
    tree = call_node(law.tree, model.names_in_laws(of), law.text, law.where)
    return dataclasses.replace(law, tree=_signal_graph(model).placed(tree), function=None)


def signal_law(model: Model, e: Controller, name: str) -> Expression:
    """Return a signal or state of a controller as a law."""
    graph, key = _signal_graph(model), (e.name, name)
    if key not in graph.laws:
        graph.laws[key] = Expression(f"{e.name}.{name}", graph.signal(e, name), None, f"{name} of {e.title}")
    return graph.laws[key]


def input_law(model: Model, e: Controller, name: str) -> Expression:
    """Return an input of a controller as a law."""
    return Expression(name, _signal_graph(model).template(e, name), None, f"{e.called(name)} of {e.title}")


def controller_states(model: Model) -> list[ConnectedState]:
    """Return all states of all controllers, in order of evaluation.

    First those with a rate; then, of sampled controllers, held signals in the order of their dependence, and states.

    Raises
    ------
    ModelError
        If signals of sampled controllers depend on each other in a loop.
    """
    return (
        model.cache.get("wired", None, 1, lambda: _controller_states(model))
        if model.frozen
        else _controller_states(model)
    )


def _controller_states(model: Model) -> list[ConnectedState]:
    wiring = _signal_graph(model)
    every = controllers_by_name(model).values()

    def connected_state(e: Controller, name: str, text: str, signal: bool = False) -> ConnectedState:
        return ConnectedState(e, name, Expression(text, wiring.template(e, text), None, f"{name} of {e.title}"), signal)

    rates = [connected_state(e, x.name, x.law) for e in every if not e.sampled for x in wiring.states[e.name]]
    held = [connected_state(e, name, text, True) for e in every if e.holds for name, text in e.signals().items()]
    rates += [ConnectedState(f, name, Expression.constant(0.0)) for f in model.forces for name in f.states()]
    later = [connected_state(e, x.name, x.law) for e in every if e.sampled for x in wiring.states[e.name]]
    return [*rates, *_in_order(held), *later]


def _in_order(held: list[ConnectedState]) -> list[ConnectedState]:
    """Return held signals, each after those on which it depends at the same instant."""
    waiting, out = {x.name: x for x in held}, list[ConnectedState]()
    while waiting:
        ready = [x for x in waiting.values() if not x.law.names & waiting.keys()]
        if not ready:
            raise ModelError(_loop_message(waiting))
        out += ready
        waiting = {k: x for k, x in waiting.items() if x not in ready}
    return out


def _loop_message(waiting: dict[str, ConnectedState]) -> str:
    """Return the message on signals that depend on each other at one instant."""
    way = [next(iter(waiting))]
    while (name := next(iter(sorted(waiting[way[-1]].law.names & waiting.keys())))) not in way:
        way.append(name)
    ring = " -> ".join([*way[way.index(name) :], name])
    e = waiting[name].controller
    return (
        f"{e.title}: at an instant at which it is sampled its {waiting[name].state} depends on itself: {ring}. Have "
        f"one of them go through a state, or sample them one after the other (offset=...)"
    )


def check_controller(model: Model, e: Controller) -> None:
    """Refuse a controller whose laws use unknown names or depend on themselves."""
    e.examine(model)
    own = controller_names(model, e)
    refuse_equal(e, own)
    for name, law in e.given().items():
        if law is not None:
            model.law(law, CONTROLLER_INPUT, f"{e.called(name)} of {e.title}")
    wiring = _signal_graph(model)
    for name in e.signals():
        wiring.signal(e, name)
    for x in wiring.states[e.name]:
        wiring.template(e, x.law)
    controller_states(model)


def controller_names(model: Model, e: Controller) -> list[str]:
    """Return the names of a controller's signals and states."""
    return [*e.signals(), *(x.name for x in _signal_graph(model).states[e.name])]


def _signal_graph(model: Model) -> _SignalGraph:
    return model.cache.get("wiring", None, 1, lambda: _SignalGraph(model)) if model.frozen else _SignalGraph(model)


class _SignalGraph:
    """The controllers of one model, while their formulas are substituted."""

    def __init__(self, model: Model) -> None:
        self.model, self.all = model, controllers_by_name(model)
        self.known: dict[tuple[str, str], SyntaxNode] = {}
        self.laws: dict[tuple[str, str], Expression] = {}
        self.way: list[str] = []
        self.rings: dict[str, str] = {}
        self.states = {name: e.states(resolve(e, model.environment())) for name, e in self.all.items()}
        self.own = {name: (*e.signals(), *(x.name for x in self.states[name])) for name, e in self.all.items()}
        self.names = {f"{name}.{k}" for name, own in self.own.items() for k in own}
        self.names |= {name for name, e in self.all.items() if e.bare}

    def signal(self, e: Controller, name: str) -> SyntaxNode:
        """Return a signal as an expression, solved for if it depends on itself, or refuse it."""
        key = e.name, name
        if key in self.known:
            return self.known[key]
        if e.holds or name not in e.signals():
            return SyntaxNode("name", (), f"{e.name}.{name}")
        told = f"{e.name}.{name}"
        if told in self.way:
            self.rings.setdefault(told, " -> ".join([*self.way[self.way.index(told) :], told]))
            return SyntaxNode("name", (), told)
        self.way.append(told)
        tree = self.template(e, e.signals()[name])
        self.way.pop()
        if told in self.rings:
            tree = solve_loop(tree, told, e.title, self.rings[told])
        if all(n.kind != "name" or n.value not in self.way for n in tree.walk()):  # in a loop: known with the others
            self.known[key] = tree
        return tree

    def template(self, e: Controller, text: str) -> SyntaxNode:
        """Return a controller's own formula of its signals, states and inputs."""
        tree = Expression.parse(text).tree
        given, own = e.given(), self.own[e.name]

        def found(node: SyntaxNode) -> SyntaxNode | None:
            name = node.value
            if name in given:
                return self.law(given[name], f"{e.called(name)} of {e.title}")
            if name in own:
                return self.signal(e, name)
            return e.derived(name, self)

        return self.limited(_at(_replaced(tree, found), 0), e.title)

    def law(self, value: Any, where: str) -> SyntaxNode:
        """Return a user's law for a controller's input."""
        law = self.model.law(value, CONTROLLER_INPUT, where, whole=False)
        if law.function is None:
            return self.placed(law.tree)
        return self.placed(call_node(law.tree, self.model.names_in_laws(CONTROLLER_INPUT), law.text, where))

    def placed(self, tree: SyntaxNode) -> SyntaxNode:
        """Return a law's tree with signals substituted."""

        def found(node: SyntaxNode) -> SyntaxNode | None:
            owner, what = curve_parts(node.value, self.all)
            e = self.all.get(owner)
            if e is None:
                return None
            name = what or e.bare
            return self.signal(e, name) if name in self.own[owner] else None

        return self.limited(_replaced(tree, found), "a law")

    def limited(self, tree: SyntaxNode, whose: str) -> SyntaxNode:
        """Return the tree; refuse it if it is too long."""
        if sum(1 for _ in tree.walk()) > MAX_OPERATIONS:
            raise ModelError(
                f"{whose} is a formula of more than {MAX_OPERATIONS} operations, controllers that follow "
                f"one another at the same "
                f"instant being put in; have some of them go through a state, or sample them (period=...)"
            )
        return tree


def _replaced(tree: SyntaxNode, found: Any) -> SyntaxNode:
    """Return the tree with names replaced by ``found``, at their positions in the text."""
    if tree.kind == "name":
        new = found(tree)
        return tree if new is None else _at(new, tree.start)
    return tree.with_args(tuple(_replaced(a, found) for a in tree.args))


def _at(tree: SyntaxNode, start: int) -> SyntaxNode:
    """Return the tree as if it were at a position of zero width."""
    if tree.start == tree.stop == start:  # parsed text has a width, so all of this tree is at the position already
        return tree
    return SyntaxNode(tree.kind, tuple(_at(a, start) for a in tree.args), tree.value, start, start)


def refuse_in_driver(model: Model, law: Expression, where: str) -> None:
    """Refuse controllers in the law of a driver, which needs derivatives that controllers' signals do not have."""
    for name in sorted(law.names):
        owner = curve_parts(name, controllers_by_name(model))[0]
        if owner in controllers_by_name(model):
            raise ModelError(
                f"{where}: {name!r} is of {controllers_by_name(model)[owner].title}; a driver prescribes a motion and "
                "needs two derivatives of its law by time. Use an Actuator or a Motor, whose force the controller "
                "sets"
            )


def refuse_unknown(model: Model, law: Expression) -> None:
    """Refuse unknown signals of a controller."""
    all_, known = controllers_by_name(model), set(signal_names(model))
    for name in sorted(law.names - known):
        if curve_parts(name, all_)[0] in all_:
            raise ExpressionError(f"'{law}': {_unknown(model, name)}")


def _unknown(model: Model, name: str) -> str:
    """Return the message on an unknown name whose owner is a controller."""
    owner, what = curve_parts(name, controllers_by_name(model))
    e = controllers_by_name(model)[owner]
    own = controller_names(model, e)
    if not what:
        return f"{e.title} has several outputs; name one: {', '.join(f'{owner}.{k}' for k in own)}"
    return f"{e.title} has no signal {what!r}{suggest(what, own)}; it has {', '.join(own)}"
