"""The contract that a force element has to keep, checked on an instance."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass
from types import SimpleNamespace
from typing import Any

import numpy as np

from ..compiler.by_address import CodeTable
from ..errors import FlyballError, ModelError
from ..forces import FORMS
from ..mechanism import Mechanism
from ..model.force import CoordinateForce, Force
from ..tables.structure import structure
from ..tables.values import values
from . import formulas, motions
from .sample import sample_mechanism
from .states import State, states


class ContractError(AssertionError):
    """An element does not keep the contract: the message names the part of it, and what was found."""


@dataclass(frozen=True)
class Subject:
    """What is tested.

    Attributes
    ----------
    element : Force
    make : function
        Makes the mechanism in which it acts, turned and shifted (`sample.sample_mechanism`).
    turns : bool
        Whether ``make`` can turn it.
    mechanism : Mechanism
    numbers : SimpleNamespace
        Fields of the element in SI units.
    separation : float
        Distance of its points as drawn [m].
    states : list of State
    """

    element: Force
    make: Callable[..., Mechanism]
    turns: bool
    mechanism: Mechanism
    numbers: SimpleNamespace
    separation: float
    states: list[State]


CHECKS: dict[str, Callable[[Subject], str]] = {
    "numbers": formulas.finite,
    "compiled": formulas.compiled,
    "complex": formulas.complex_numbers,
    "derivatives": formulas.derivatives,
    "symbols": formulas.symbols,
    "inputs": formulas.rates,
    "energy": formulas.energy,
    "axes": formulas.axes,
    "units": formulas.units,
    "file": motions.file,
    "books": motions.books,
    "layers": motions.layers,
    "made": motions.made,
    "turned": motions.turned,
    "linear": motions.linear,
}
"""The parts of the contract, in the order in which they are checked. Each returns what is wrong; "" if nothing is."""


def check_element(
    element: Force,
    *,
    mechanism: Mechanism | None = None,
    parameters: Mapping[str, Any] | None = None,
    skip: Collection[str] = (),
) -> list[str]:
    """Check a force element, of flyball or of a user's own, in every way that analyses use it.

    Its formulas are evaluated at random states, and it acts in a mechanism that moves for a moment.

    Parameters
    ----------
    element : Force
        An instance with ordinary numbers.
    mechanism : Mechanism, optional
        A mechanism in which the element can be added, if it needs more than the bodies and joints that it names: for
        instance sensors that its laws depend on. Not given: these bodies, about 1 kg and 1 m, tumbling.
    parameters : mapping, optional
        Parameters of the mechanism that the element names, where none is given.
    skip : collection of str
        Parts of the contract that do not hold for good reasons:

        - ``"axes"`` and ``"turned"``: for a force given in the world's axes, such as a wind from the north;
        - ``"units"``: if its formula holds a constant that has a unit, such as the density of air;
        - ``"file"``: if it has Python functions as laws;
        - ``"symbols"`` and ``"made"``: if its formula decides by what moves; symbolic equations are not for it then;
        - ``"complex"``, ``"derivatives"`` and ``"linear"``: the same for linearisation, sensitivities and implicit
          methods.

    Returns
    -------
    list of str
        The parts that were checked.

    Raises
    ------
    ContractError
        Naming the part that fails, with the numbers found.
    ModelError
        If the element cannot be described, or a name in ``skip`` is no part of the contract.
    """
    if unknown := set(skip) - set(CHECKS):
        raise ModelError(f"{sorted(unknown)} is no part of the contract; its parts are {', '.join(CHECKS)}")
    cls = type(element)
    if not isinstance(element, Force):
        raise ModelError(f"{cls.__name__} is no force; check_element is for force elements")
    for form in FORMS[2:3] if isinstance(element, CoordinateForce) else FORMS[:2]:
        if not hasattr(cls, form.name):
            raise ContractError(f"{cls.__name__} has no formula {form}; define it as a static method")
    CodeTable(cls, FORMS)  # refuses what is no static method
    subject = _subject(element, mechanism, parameters)
    for name, check in CHECKS.items():
        if name not in skip:
            try:
                wrong = check(subject)
            except FlyballError as error:
                wrong = f"{type(error).__name__}: {error}"
            if wrong:
                raise ContractError(f"{element.title} fails the check {name!r}: {wrong}")
    return [name for name in CHECKS if name not in skip]


def _subject(e: Force, given: Mechanism | None, parameters: Mapping[str, Any] | None) -> Subject:
    def make(Q: np.ndarray | None = None, d: np.ndarray | None = None) -> Mechanism:
        if given is None:
            return sample_mechanism(e, parameters, Q, d)
        m = given.copy()
        m.add(e)
        return m

    m = make()
    x = values(structure(m))
    n = x.numbers[e.name]
    separation = float(x.poses.apart(e))
    return Subject(e, make, given is None, m, n, separation, states(e, e.parameters(n, separation)))
