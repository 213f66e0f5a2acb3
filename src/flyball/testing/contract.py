"""The contract that an element has to keep so that every analysis can use it, checked on an instance."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass
from types import SimpleNamespace
from typing import Any

import numpy as np

from ..compiler.by_address import CodeTable
from ..constraints.blocks import ConstraintRow
from ..contact.narrow.shapes.solid import SIGNATURES as SUPPORT
from ..errors import FlyballError, ModelError, StartWarning
from ..forces import SIGNATURES
from ..mechanism import Mechanism
from ..model.element import resolve
from ..model.force import CoordinateForce, Force
from ..model.joint import Joint, WorldFrame
from ..model.shapes.solid import ConvexSolid
from ..tables.structure import structure
from ..tables.values import values
from . import formulas, motions, shapes
from .sample import sample_mechanism
from .states import ROWS, State, force_states, row_states


class ContractError(AssertionError):
    """An element does not keep the contract: the message names the part of it, and what was found."""


@dataclass(frozen=True)
class Subject:
    """What is tested.

    Attributes
    ----------
    element : Force or Joint
    make : function
        Makes the mechanism in which it acts, rotated and shifted (`sample.sample_mechanism`).
    turns : bool
        Whether ``make`` can rotate it.
    mechanism : Mechanism
    numbers : SimpleNamespace
        Fields of the element in SI units.
    separation : float
        Distance of the two points of a force as drawn [m].
    ends : tuple of frames
        The frames F and M of a joint as drawn.
    states : list of State
        States at which its formulas are evaluated.
    """

    element: Force | Joint
    make: Callable[..., Mechanism]
    turns: bool
    mechanism: Mechanism
    numbers: SimpleNamespace
    separation: float
    ends: tuple[WorldFrame, ...]
    states: list[State]


Checks = dict[str, Callable[[Subject], str]]
_NUMBERS: Checks = {
    "numbers": formulas.finite,
    "compiled": formulas.compiled,
    "complex": formulas.complex_numbers,
    "derivatives": formulas.derivatives,
    "symbols": formulas.symbols,
}
_INVARIANCE: Checks = {"axes": formulas.axes, "units": formulas.units, "file": motions.file, "books": motions.books}
_MOTIONS: Checks = {
    "layers": motions.layers,
    "made": motions.made,
    "turned": motions.turned,
    "linear": motions.linear,
}
CHECKS: dict[str, dict[str, Callable[..., str]]] = {
    "forces": {**_NUMBERS, "inputs": formulas.rates, "energy": formulas.energy, **_INVARIANCE, **_MOTIONS},
    "joints": {**_NUMBERS, "gradient": formulas.gradient, "bias": formulas.bias, **_INVARIANCE, **_MOTIONS},
    "shapes": shapes.CHECKS,
}
"""The parts of the contract for each category of elements, in the order in which they are checked.

Each returns what is wrong; "" if nothing is."""


def check_element(
    element: Force | Joint | ConvexSolid,
    *,
    mechanism: Mechanism | None = None,
    parameters: Mapping[str, Any] | None = None,
    skip: Collection[str] = (),
) -> list[str]:
    """Check a force or a joint, of flyball or of a user's own, or a convex shape, in every way that analyses use it.

    Its formulas are evaluated at random states. A force or a joint acts in a mechanism that is simulated for a moment.

    Parameters
    ----------
    element : Force, Joint or ConvexSolid
        An instance with ordinary numbers. Of a joint the formulas of its `ConstraintRow` are checked.
    mechanism : Mechanism, optional
        A mechanism in which the element can be added, if it needs more than the bodies and joints that it names: for
        instance sensors that its laws depend on. Not given: these bodies, about 1 kg and 1 m, tumbling.
    parameters : mapping, optional
        Parameters that the element names, where no mechanism is given.
    skip : collection of str
        Parts of the contract that do not hold for good reasons:

        - ``"axes"`` and ``"turned"``: for an element given in the world's axes, such as a wind from the north;
        - ``"units"``: if its formula holds a constant that has a unit, such as the density of air;
        - ``"file"``: if it has Python functions as laws;
        - ``"symbols"`` and ``"made"``: if its formula branches on what moves; symbolic equations are not for it then;
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
    if not isinstance(element, Force | Joint | ConvexSolid):
        raise ModelError(f"{type(element).__name__} is no force, joint or ConvexSolid; check_element is for these")
    checks = CHECKS[element.category]
    if unknown := set(skip) - set(checks):
        raise ModelError(f"{sorted(unknown)} is no part of the contract; its parts are {', '.join(checks)}")
    _refuse_incomplete(element)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", StartWarning)  # a joint may change where its bodies are, and how they move
        subject = _subject(element, mechanism, parameters)
        for name, check in checks.items():
            if name not in skip:
                try:
                    wrong = check(subject)
                except FlyballError as error:
                    wrong = f"{type(error).__name__}: {error}"
                if wrong:
                    raise ContractError(f"{element.title} fails the check {name!r}: {wrong}")
    return [name for name in checks if name not in skip]


def _refuse_incomplete(e: Force | Joint | ConvexSolid) -> None:
    """Refuse classes whose formulas are missing or are no static methods."""
    owners: list[tuple[type, Any, Any]] = [(type(r), ROWS, ROWS) for r in _own_rows(e)]
    if isinstance(e, ConvexSolid):
        owners = [(type(e), SUPPORT, SUPPORT)]
    if isinstance(e, Force):
        needed = SIGNATURES[2:3] if isinstance(e, CoordinateForce) else SIGNATURES[:2]
        owners = [(type(e), SIGNATURES, needed)]
    for cls, signatures, needed in owners:
        for signature in needed:
            if not hasattr(cls, signature.name):
                raise ContractError(f"{cls.__name__} has no formula {signature}; define it as a static method")
        CodeTable(cls, signatures)


def _own_rows(e: Any) -> list[ConstraintRow]:
    return [r for r in e.blocks if isinstance(r, ConstraintRow)] if isinstance(e, Joint) else []


def _subject(
    e: Force | Joint | ConvexSolid, given: Mechanism | None, parameters: Mapping[str, Any] | None
) -> Subject | shapes.Shape:
    if isinstance(e, ConvexSolid):
        n = resolve(e, Mechanism("sample", parameters=dict(parameters or {})).environment())
        e.check(n)
        return shapes.Shape(e, n, e.par(n))

    def make(Q: np.ndarray | None = None, d: np.ndarray | None = None) -> Mechanism:
        if given is None:
            return sample_mechanism(e, parameters, Q, d)
        m = given.copy()
        m.add(e)
        return m

    m = make()
    x = values(structure(m))
    n = x.numbers[e.name]
    if isinstance(e, Joint):
        ends = x.poses.ends(e)
        states = [s for r in _own_rows(e) for s in row_states(r, e.row_parameters(n, r, *ends)[:6])]
        return Subject(e, make, given is None, m, n, 0.0, ends, states)
    separation = float(x.poses.apart(e))
    return Subject(e, make, given is None, m, n, separation, (), force_states(e, e.parameters(n, separation)))
