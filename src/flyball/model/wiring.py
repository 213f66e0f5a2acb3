"""Signals of controllers as expressions of what is measured, of time, parameters and the controllers' states.

Where a law names a controller, the formula of its output stands in its place: so every reader of laws knows it, corners
of limits included. A state is a name such as ``pid.integral``, which laws read as they read a sensor.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Collection
from typing import TYPE_CHECKING, Any, NamedTuple

from ..errors import ExpressionError, ModelError
from .controller import Controller, refuse_equal
from .element import LawOf, resolve
from .expressions import Expression
from .function import called
from .grammar import Node
from .rings import solved
from .words import suggest

if TYPE_CHECKING:
    from .model import Model

MOST = 20_000
"""Operations of one law, controllers' formulas in their places: longer ones are refused."""
GIVEN = LawOf(None, curves=True)
"""What laws that controllers are given may use."""


class Wired(NamedTuple):
    """One state of a controller, wired; of a sampled one also a signal, which is held."""

    controller: Controller
    state: str
    law: Expression  # its rate, or its value from the next sample on
    signal: bool = False

    @property
    def name(self) -> str:
        """As laws read it: "pid.integral"."""
        return f"{self.controller.name}.{self.state}"


def controllers(model: Model) -> dict[str, Controller]:
    """Controllers by name, those that are just being added too."""
    return {c.name: c for c in (*model.controllers, *vars(model).get("_adding", ()))}


def names(model: Model) -> Collection[str]:
    """All names of signals and states that laws may use."""
    return _wiring(model).names if controllers(model) else ()


def inlined(model: Model, law: Expression, of: LawOf) -> Expression:
    """The law with formulas of controllers' signals in the places of their names; of a function its arguments are."""
    known = set(names(model))
    if not law.names & known:
        return law
    if law.function is None:
        return dataclasses.replace(law, tree=_wiring(model).placed(law.tree))
    tree = called(law.tree, model.names_in_laws(of), law.text, law.where)
    return dataclasses.replace(law, tree=_wiring(model).placed(tree), function=None)


def signal(model: Model, e: Controller, name: str) -> Expression:
    """A signal of a controller, or a state, as a law."""
    return Expression(f"{e.name}.{name}", _wiring(model).signal(e, name), None, f"{name} of {e.title}")


def given(model: Model, e: Controller, name: str) -> Expression:
    """What a controller is given, as a law."""
    return Expression(name, _wiring(model).template(e, name), None, f"{e.called(name)} of {e.title}")


def wired(model: Model) -> list[Wired]:
    """All states of all controllers: those with a rate; then of sampled ones signals, in the order in which they are
    known, and states.

    Raises
    ------
    ModelError
        If signals of sampled controllers depend on each other in a ring.
    """
    return model.kept.get("wired", None, 1, lambda: _wired(model)) if model.frozen else _wired(model)


def _wired(model: Model) -> list[Wired]:
    wiring = _wiring(model)
    every = controllers(model).values()

    def made(e: Controller, name: str, text: str, signal: bool = False) -> Wired:
        return Wired(e, name, Expression(text, wiring.template(e, text), None, f"{name} of {e.title}"), signal)

    rates = [made(e, x.name, x.law) for e in every if not e.sampled for x in wiring.states[e.name]]
    held = [made(e, name, text, True) for e in every if e.holds for name, text in e.signals().items()]
    later = [made(e, x.name, x.law) for e in every if e.sampled for x in wiring.states[e.name]]
    return [*rates, *_in_order(held), *later]


def _in_order(held: list[Wired]) -> list[Wired]:
    """Signals that are held, each after those that it is said by at the same instant."""
    waiting, out = {x.name: x for x in held}, list[Wired]()
    while waiting:
        ready = [x for x in waiting.values() if not x.law.names & waiting.keys()]
        if not ready:
            raise ModelError(_ringed(waiting))
        out += ready
        waiting = {k: x for k, x in waiting.items() if x not in ready}
    return out


def _ringed(waiting: dict[str, Wired]) -> str:
    """What to say of signals that need each other at one instant."""
    way = [next(iter(waiting))]
    while (name := next(iter(sorted(waiting[way[-1]].law.names & waiting.keys())))) not in way:
        way.append(name)
    ring = " -> ".join([*way[way.index(name) :], name])
    e = waiting[name].controller
    return (
        f"{e.title}: at an instant at which it is sampled its {waiting[name].state} depends on itself: {ring}. Have "
        f"one of them go through a state, or sample them one after the other (offset=...)"
    )


def check(model: Model, e: Controller) -> None:
    """Refuse a controller whose laws name what is not there, or depend on themselves."""
    own = wiring_of(model, e)
    refuse_equal(e, own)
    for name, law in e.given().items():
        if law is not None:
            model.law(law, GIVEN, f"{e.called(name)} of {e.title}")
    wiring = _wiring(model)
    for name in e.signals():
        wiring.signal(e, name)
    for x in wiring.states[e.name]:
        wiring.template(e, x.law)
    wired(model)


def wiring_of(model: Model, e: Controller) -> list[str]:
    """Names of a controller's signals and states."""
    return [*e.signals(), *(x.name for x in _wiring(model).states[e.name])]


def _wiring(model: Model) -> _Wiring:
    return model.kept.get("wiring", None, 1, lambda: _Wiring(model)) if model.frozen else _Wiring(model)


class _Wiring:
    """The controllers of one model, as their formulas are put in place."""

    def __init__(self, model: Model) -> None:
        self.model, self.all = model, controllers(model)
        self.known: dict[tuple[str, str], Node] = {}
        self.way: list[str] = []
        self.rings: dict[str, str] = {}
        self.states = {name: e.states(resolve(e, model.environment())) for name, e in self.all.items()}
        self.own = {name: (*e.signals(), *(x.name for x in self.states[name])) for name, e in self.all.items()}
        self.names = {f"{name}.{k}" for name, own in self.own.items() for k in own}
        self.names |= {name for name, e in self.all.items() if e.bare}

    def signal(self, e: Controller, name: str) -> Node:
        """A signal as an expression; solved for where it depends on itself, or refused."""
        key = e.name, name
        if key in self.known:
            return self.known[key]
        if e.holds or name not in e.signals():
            return Node("name", (), f"{e.name}.{name}")
        told = f"{e.name}.{name}"
        if told in self.way:
            self.rings.setdefault(told, " -> ".join([*self.way[self.way.index(told) :], told]))
            return Node("name", (), told)
        self.way.append(told)
        tree = self.template(e, e.signals()[name])
        self.way.pop()
        if told in self.rings:
            tree = solved(tree, told, e.title, self.rings[told])
        if all(n.kind != "name" or n.value not in self.way for n in tree.walk()):  # of a ring it is known with the rest
            self.known[key] = tree
        return tree

    def template(self, e: Controller, text: str) -> Node:
        """A formula of a controller's own, of its signals, its states, and what it is given."""
        tree = Expression.parse(text).tree
        given, own = e.given(), self.own[e.name]

        def found(node: Node) -> Node | None:
            name = node.value
            if name in given:
                return self.law(given[name], f"{e.called(name)} of {e.title}")
            return self.signal(e, name) if name in own else None

        return self.limited(_at(_replaced(tree, found), 0), e.title)

    def law(self, value: Any, where: str) -> Node:
        """A law of the user's that a controller is given."""
        law = self.model.law(value, GIVEN, where, whole=False)
        if law.function is None:
            return self.placed(law.tree)
        return self.placed(called(law.tree, self.model.names_in_laws(GIVEN), law.text, where))

    def placed(self, tree: Node) -> Node:
        """A law's tree with signals in place."""

        def found(node: Node) -> Node | None:
            owner, dot, what = node.value.partition(".")
            e = self.all.get(owner)
            if e is None:
                return None
            name = what if dot else e.bare
            return self.signal(e, name) if name in self.own[owner] else None

        return self.limited(_replaced(tree, found), "a law")

    def limited(self, tree: Node, whose: str) -> Node:
        """The tree; refused if it is too long."""
        if sum(1 for _ in tree.walk()) > MOST:
            raise ModelError(
                f"{whose} is a formula of more than {MOST} operations, controllers that follow one another at the same "
                f"instant being put in; have some of them go through a state, or sample them (period=...)"
            )
        return tree


def _replaced(tree: Node, found: Any) -> Node:
    """The tree with what ``found`` gives for names, at their places in the text."""
    if tree.kind == "name":
        new = found(tree)
        return tree if new is None else _at(new, tree.start)
    if not tree.args:
        return tree
    return dataclasses.replace(tree, args=tuple(_replaced(a, found) for a in tree.args))


def _at(tree: Node, start: int) -> Node:
    """The tree as if it stood at a place of no width."""
    return dataclasses.replace(tree, start=start, stop=start, args=tuple(_at(a, start) for a in tree.args))


def refuse_in_driver(model: Model, law: Expression, where: str) -> None:
    """Refuse controllers in the law of a driver, which needs derivatives that a controller's signals have not."""
    for name in sorted(law.names):
        owner = name.partition(".")[0]
        if owner in controllers(model):
            raise ModelError(
                f"{where}: {name!r} is of {controllers(model)[owner].title}; a driver prescribes a motion and needs "
                f"two derivatives of its law by time. Use an Actuator or a Motor, whose force the controller says"
            )


def refuse_unknown(model: Model, law: Expression) -> None:
    """Refuse signals that a controller has not."""
    all_, known = controllers(model), set(names(model))
    for name in sorted(law.names - known):
        if name.partition(".")[0] in all_:
            raise ExpressionError(f"'{law}': {_unknown(model, name)}")


def _unknown(model: Model, name: str) -> str:
    """What to say of a name whose owner is a controller."""
    owner, _, what = name.partition(".")
    e = controllers(model)[owner]
    own = wiring_of(model, e)
    if not what:
        return f"{e.title} has several outputs; name one: {', '.join(f'{owner}.{k}' for k in own)}"
    return f"{e.title} has no signal {what!r}{suggest(what, own)}; it has {', '.join(own)}"
