"""The contract that an element must satisfy so that every analysis can use it, checked on an instance.

Besides its formulas (`formula_checks`) an element is tested in a sample mechanism that is simulated briefly, in general
motion with bodies of about 1 kg and 1 m; a convex shape by its support function, its mass properties and its file.
"""

from __future__ import annotations

import dataclasses
import tempfile
import warnings
from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass
from pathlib import Path
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from ..collision.shapes.solid import SUPPORT_SIGNATURES
from ..collision.shapes.solid import SUPPORT_SIGNATURES as SUPPORT
from ..compiler.kernels import CodeTable
from ..constraints.blocks import ConstraintRow
from ..constraints.switches.switch_kind import NO_ROW
from ..errors import FlyballError, ModelError, StartWarning
from ..forces import SIGNATURES
from ..joints import Prismatic, Revolute, Spherical
from ..mechanism import Mechanism, load
from ..model.body import GROUND, Body, Frame
from ..model.element import Unit, Vector, fields_with, resolve
from ..model.force import CoordinateForce, Force
from ..model.geometry import orientation_matrix
from ..model.joint import Joint, WorldFrame
from ..model.names import curve_parts
from ..model.shapes.geometry import polyhedron_integrals
from ..model.shapes.solid import DIRECTIONS, ConvexSolid
from ..tables.structure import structure
from ..tables.values import values
from . import formula_checks
from .formula_checks import ROWS, FormulaState, force_states, random_rotation, row_states

if TYPE_CHECKING:
    from ..results.result import Result


AXIS = np.array([1.0, 2.0, -2.0]) / 3.0
ACROSS = np.array([2.0, 1.0, 2.0]) / 3.0
JOINT_KINDS: dict[str, Any] = {"angle": Revolute, "displacement": Prismatic}
FRAME, CARRIER = "frame", "body of "
GRAVITY = np.array([0.7, -1.5, -9.3])


def sample_mechanism(
    e: Force | Joint,
    parameters: Mapping[str, Any] | None = None,
    Q: np.ndarray | None = None,
    d: np.ndarray | None = None,
) -> Mechanism:
    """Return a mechanism with the element, and the bodies (about 1 kg and 1 m), frames and joints that it names.

    Each body is joined to an arm that is hinged on ground, so that joint coordinates differ from absolute ones.

    Parameters
    ----------
    e : Force or Joint
    parameters : mapping, optional
        Of the mechanism, if the element names some.
    Q, d : ndarray
        Rotation and shift of the whole, element and gravity included.
    """
    Q, d = np.eye(3) if Q is None else Q, np.zeros(3) if d is None else d
    m = Mechanism("sample", gravity=_float_tuple(Q @ GRAVITY), parameters=dict(parameters or {}))
    orientation = _quaternion_of(Q)
    for k, (body, joint, what) in enumerate(_needed_bodies(e)):
        arm, start = f"arm of {body}", np.array([1.5 * k, 0.3 * k, 0.2])
        hinge, ball, centre = (start + np.array(x) for x in ((0.0, 0.4, 0.1), (0.3, 0.1, -0.1), (0.5, -0.2, 0.0)))
        for name, at, spin in ((arm, start, 0.4 * AXIS), (body, centre, np.array([0.6, -1.1, 0.9]))):
            given: dict[str, Any] = {"position": _float_tuple(Q @ at + d), "orientation": orientation}
            if not (what in JOINT_KINDS and name == body):
                given["angular_velocity"] = _float_tuple(Q @ spin)
            m.add(Body(name, mass=1.2, inertia=(0.05, 0.08, 0.11), **given))
        m.add(Revolute(f"hinge of {arm}", GROUND, arm, at=_float_tuple(Q @ hinge + d), axis=_float_tuple(Q @ AXIS)))
        kind = JOINT_KINDS.get(what, Spherical)
        axis = {} if kind is Spherical else {"axis": _float_tuple(Q @ ACROSS)}
        m.add(kind(joint, arm, body, at=_float_tuple(Q @ ball + d), **axis))
        if what == FRAME:
            m.add(Frame(body.removeprefix(CARRIER), body, position=(0.1, 0.05, -0.1), orientation=(0.8, 0.0, 0.6, 0.0)))
    m.add(_turned_element(e, Q, d))
    return m


def _needed_bodies(e: Force | Joint) -> list[tuple[str, str, str]]:
    """Return the required bodies, the joint of each, and what it must have: a coordinate, or a frame on the body."""
    if isinstance(e, Joint) and e.at is None:  # the element names frames
        return [(CARRIER + x, f"joint of {x}", FRAME) for x in e.ends().values() if x != GROUND]
    found: dict[str, tuple[str, str]] = {x: (f"joint of {x}", "") for x in e.ends().values() if x != GROUND}
    for text in e.along() if isinstance(e, CoordinateForce) else ():
        owner, what = curve_parts(text)
        if what in ("angle", "displacement"):
            found[f"body of {owner}"] = owner, what
        else:
            found[owner] = f"joint of {owner}", ""
    return [(body, joint, what) for body, (joint, what) in found.items()]


def _turned_element(e: Any, Q: np.ndarray, d: np.ndarray) -> Force | Joint:
    """Return the element with its points and directions rotated and its points shifted."""
    units, new = fields_with(type(e), Unit), dict[str, Any]()
    points = {name for name, unit in units.items() if unit.dimension == "m" and isinstance(getattr(e, name), tuple)}
    for name in points.union(fields_with(type(e), Vector)):
        value = getattr(e, name)
        if value is not None and (np.eye(3) != Q).any():
            shift = d if name in points else np.zeros(3)
            x = np.array(value, float)
            new[name] = tuple(_float_tuple(Q @ v + shift) for v in x) if x.ndim > 1 else _float_tuple(Q @ x + shift)
    fields = type(e).__dataclass_fields__
    if (np.eye(3) != Q).any() and "orientation" in fields:  # in its reference axes; the world's if not given
        given = e.orientation
        R = np.eye(3) if given is None else orientation_matrix(given, f"orientation of {e.title}")
        new["orientation"] = _quaternion_of(Q @ R)
    return dataclasses.replace(e, **new) if new else e


def _quaternion_of(Q: np.ndarray) -> tuple[float, ...]:
    from scipy.spatial.transform import Rotation

    return _float_tuple(np.roll(Rotation.from_matrix(Q).as_quat(), 1))


def _float_tuple(x: np.ndarray) -> tuple[float, ...]:
    return tuple(float(v) for v in x)


SPAN, OUTPUTS = 0.3, 301  # [s]: part of a period of the sample mechanism
TOLERANCES = {"rtol": 1e-10, "atol": 1e-12}
ENERGY_TOLERANCE = 1e-7  # relative to the energies that change: a thousand times the integration error
WORK_TOLERANCE = 1e-3  # relative to the largest work: power is summed over outputs by the trapezoidal rule
POSITION_TOLERANCE = 1e-7  # [m]: two ways of computing one motion at that tolerance
SHIFT = np.array([5.0, -2.0, 3.0])


def _simulated(s: Subject, **more: object) -> Result:
    return s.mechanism.simulate(SPAN, outputs=OUTPUTS, specialize=False, **TOLERANCES, **more)  # type: ignore[arg-type]


def _positions(r: Result) -> np.ndarray:
    return np.stack([r[b.name].position for b in r.model.bodies])


def _difference(a: np.ndarray, b: np.ndarray) -> str:
    """Return how two motions differ; "" if rounding and tolerance explain it."""
    apart, size = np.abs(a - b).max(), max(1.0, np.abs(a).max())
    return "" if apart <= POSITION_TOLERANCE * size else f"positions of bodies differ by {apart:.3g} m after {SPAN} s"


def file_round_trip(s: Subject) -> str:
    """Saved and loaded again, the element is unchanged."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "saved.toml"
        s.mechanism.save(path)
        again = load(path)
    if again != s.mechanism:
        return f"saved and loaded again it is {again[s.element.name]}, and was {s.element}"
    return ""


def energy_balance(s: Subject) -> str:
    """Energy is balanced, and the work of the element is the sum of its power."""
    r = _simulated(s)
    exchanged = max(np.ptp(r.energy.kinetic), np.ptp(r.energy.potential), 1e-3)
    if not r.energy.drift <= ENERGY_TOLERANCE * exchanged:
        return f"the energy balance is off by {r.energy.drift:.3g} J, while {exchanged:.3g} J are exchanged"
    name = s.element.name
    if name in r.energy.work and isinstance(s.element, Force) and not s.element.conservative():
        power, work, dt = r[name].power, r[name].work, np.diff(r.t)
        moved = np.r_[0.0, np.cumsum((power[1:] + power[:-1]) / 2 * dt)]
        wrong = np.abs(work - moved).max()
        jumps = np.abs(np.diff(power)) * dt  # bounds of the error where the power jumps
        at_events = np.unique(np.searchsorted(r.t, [x.t for x in r.events]).clip(1)) - 1
        if not wrong <= WORK_TOLERANCE * max(1e-9, np.abs(work).max()) + jumps[at_events].sum():
            return f"its work differs from the sum of its power by {wrong:.3g} J of {np.abs(work).max():.3g} J"
    return ""


def coordinate_choices(s: Subject) -> str:
    """Joint coordinates and absolute coordinates give the same motion."""
    return _difference(*(_positions(_simulated(s, coordinates=c)) for c in ("joint", "absolute")))


def generated_code(s: Subject) -> str:
    """Generated code gives the same motion; there is none for constraints that open and close."""
    if isinstance(s.element, Force) and s.element.switches():
        return ""
    other = s.mechanism.simulate(SPAN, outputs=OUTPUTS, specialize=True, **TOLERANCES)  # type: ignore[arg-type]
    return _difference(_positions(_simulated(s)), _positions(other))


def rotated_mechanism(s: Subject) -> str:
    """The whole mechanism rotated and shifted has the same motion, rotated and shifted."""
    if not s.turns:
        return ""
    Q = random_rotation(7)
    r = s.make(Q, SHIFT).simulate(SPAN, outputs=OUTPUTS, specialize=False, **TOLERANCES)  # type: ignore[arg-type]
    wrong = _difference(_positions(_simulated(s)) @ Q.T + SHIFT, _positions(r))
    return (
        wrong and f"the whole mechanism rotated and shifted has another motion: {wrong}. It depends on the world's axes"
    )


def linearization(s: Subject) -> str:
    """The equations of motion at the start can be linearised; with a row that opens and closes only those at rest."""
    if any(x.kind.forces != NO_ROW for x in s.element.switches()):
        return ""
    if np.isfinite(s.mechanism.linearize(frozen=True).eigenvalues).all():
        return ""
    return "linearize(frozen=True) gives eigenvalues that are not finite: the formula has no derivatives"


SUPPORT_TOLERANCE = 1e-11  # relative to the size of the shape
DIRECTION_LENGTHS = (1e-6, 3.0, 1e6)  # number of directions
SURFACE_CORNERS = 96  # corners of a circle on the surface whose inside is integrated
SURFACE_TOLERANCE = 1e-2  # volume, inertia and size: discretisation error of such a surface, with margin


class ShapeSubject(NamedTuple):
    """What is tested: a shape, its fields in SI units, and the parameters of its support function."""

    element: ConvexSolid
    numbers: SimpleNamespace
    par: tuple[float, ...]

    def point(self, d: Any) -> np.ndarray:
        """Return the farthest point along a direction."""
        return np.array(type(self.element).support(self.par, tuple(float(x) for x in d)), float)


def _test_directions() -> np.ndarray:
    given = np.random.default_rng(5).normal(size=(100, 3))
    return np.vstack([DIRECTIONS, given]) / np.linalg.norm(np.vstack([DIRECTIONS, given]), axis=1)[:, None]


def support_finite(s: ShapeSubject) -> str:
    """The support function is finite in every direction."""
    s.element.forms(s.numbers)
    return ""


def support_compiled(s: ShapeSubject) -> str:
    """Compiled code gives what the Python formula gives."""
    size = np.abs(s.point((1.0, 1.0, 1.0))).max()
    for d in _test_directions():
        state = FormulaState(SUPPORT_SIGNATURES[0], type(s.element).support, (s.par, tuple(d.tolist())))
        plain, fast = s.point(d), state.compiled(state.numbers, False)
        if not np.abs(plain - fast).max() <= SUPPORT_TOLERANCE * size:
            return f"support(par, {d}) is {plain} in Python and {fast} compiled"
    return ""


def support_farthest(s: ShapeSubject) -> str:
    """No point of the surface is farther along a direction than the point that the support function gives for it."""
    directions = _test_directions()
    points = np.array([s.point(d) for d in directions])
    size = np.abs(points).max()
    reached = directions @ points.T  # for each direction, the extent of all points along it
    k, other = np.unravel_index(int(np.argmax(reached - np.diag(reached)[:, None])), reached.shape)
    if reached[k, other] - reached[k, k] > SUPPORT_TOLERANCE * size:
        return (
            f"support(par, {directions[k]}) is {points[k]}, at {reached[k, k]:.6g} along that direction; the point "
            f"{points[other]}, which it gives for {directions[other]}, is at {reached[k, other]:.6g}"
        )
    for d, x in zip(directions, points, strict=True):
        for length in DIRECTION_LENGTHS:
            if not np.abs(s.point(length * d) - x).max() <= SUPPORT_TOLERANCE * size:
                return f"support(par, d) is {x} for d = {d} and {s.point(length * d)} for {length:g} d"
    return ""


def shape_mass(s: ShapeSubject) -> str:
    """Volume, centre and inertia, if they are defined, are those of the solid inside the surface."""
    e = s.element
    if type(e).volume is ConvexSolid.volume:
        return ""
    found = polyhedron_integrals(*e.surface(s.numbers, SURFACE_CORNERS))
    gyration = np.real(np.asarray(e.gyration(s.numbers)))
    given = {
        "volume": (np.real(e.volume(s.numbers)), found.volume, found.volume),
        "centre": (np.real(e.centre(s.numbers)), found.centre, found.volume ** (1 / 3)),
        "gyration": (np.diag(gyration) if gyration.ndim == 1 else gyration, found.gyration, np.trace(found.gyration)),
    }
    for name, (value, wanted, size) in given.items():
        if not np.abs(np.asarray(value) - wanted).max() <= SURFACE_TOLERANCE * size:
            return f"{name} is {value}; of the solid inside the surface it is {wanted}"
    return ""


def shape_file(s: ShapeSubject) -> str:
    """Saved and loaded again, the shape is unchanged."""
    m = Mechanism("sample")
    m.add(Body("body", mass=1, inertia=(1, 1, 1), shape=s.element))
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "saved.toml"
        m.save(path)
        again = load(path)
    return "" if again == m else f"saved and loaded again it is {again['body']}, and was {m['body']}"


SHAPE_CHECKS: dict[str, Callable[[ShapeSubject], str]] = {
    "numbers": support_finite,
    "compiled": support_compiled,
    "support": support_farthest,
    "mass": shape_mass,
    "file": shape_file,
}


class ContractError(AssertionError):
    """An element violates the contract: the message names the part of it and the values found."""


@dataclass(frozen=True)
class Subject:
    """What is tested.

    Attributes
    ----------
    element : Force or Joint
    make : function
        Makes the mechanism in which it acts, rotated and shifted (`contract.sample_mechanism`).
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
    states: list[FormulaState]


Checks = dict[str, Callable[[Subject], str]]
_NUMBER_CHECKS: Checks = {
    "numbers": formula_checks.finite,
    "compiled": formula_checks.compiled,
    "complex": formula_checks.complex_numbers,
    "derivatives": formula_checks.derivatives,
    "symbols": formula_checks.symbols,
}
_INVARIANCE_CHECKS: Checks = {
    "points": formula_checks.points,
    "axes": formula_checks.axes,
    "units": formula_checks.units,
    "file": file_round_trip,
    "books": energy_balance,
}
_MOTION_CHECKS: Checks = {
    "layers": coordinate_choices,
    "made": generated_code,
    "turned": rotated_mechanism,
    "linear": linearization,
}
_FORCE_CHECKS: Checks = {
    **_NUMBER_CHECKS,
    "inputs": formula_checks.rates,
    "energy": formula_checks.energy,
    "guard": formula_checks.guards,
    **_INVARIANCE_CHECKS,
    **_MOTION_CHECKS,
}
CHECKS: dict[str, dict[str, Callable[..., str]]] = {
    "forces": _FORCE_CHECKS,
    "limits": _FORCE_CHECKS,
    "joints": {
        **_NUMBER_CHECKS,
        "gradient": formula_checks.gradient,
        "bias": formula_checks.bias,
        **_INVARIANCE_CHECKS,
        **_MOTION_CHECKS,
    },
    "shapes": SHAPE_CHECKS,
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

    Its formulas are evaluated at random states. A force or a joint is simulated briefly in a mechanism.

    Parameters
    ----------
    element : Force, Joint or ConvexSolid
        An instance with ordinary numbers. For a joint the formulas of its `ConstraintRow` are checked.
    mechanism : Mechanism, optional
        A mechanism in which the element can be added, if it needs more than the bodies and joints that it names: for
        instance sensors that its laws depend on. Not given: these bodies, about 1 kg and 1 m, tumbling.
    parameters : mapping, optional
        Parameters that the element names, where no mechanism is given.
    skip : collection of str
        Parts of the contract that do not apply:

        - ``"axes"`` and ``"turned"``: for an element given in the world's axes, such as a wind from the north;
        - ``"units"``: if its formula holds a constant that has a unit, such as the density of air;
        - ``"file"``: if it has Python functions as laws;
        - ``"symbols"`` and ``"made"``: if its formula branches on the motion; symbolic equations do not support it
          then;
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
        If the element is invalid, or a name in ``skip`` is not a part of the contract.
    """
    if not isinstance(element, Force | Joint | ConvexSolid):
        raise ModelError(f"{type(element).__name__} is no force, joint or ConvexSolid; check_element is for these")
    checks = CHECKS[element.category]
    if unknown := set(skip) - set(checks):
        raise ModelError(f"{sorted(unknown)} is no part of the contract; its parts are {', '.join(checks)}")
    asked = [name for name in checks if name not in skip]
    _refuse_incomplete(element)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", StartWarning)  # the joint may change positions and velocities of its bodies
        subject = _subject(element, mechanism, parameters)
        for name in asked:
            if wrong := _failure(checks[name], subject):
                raise ContractError(f"{element.title} fails the check {name!r}: {wrong}")
    return asked


def _failure(check: Callable[[Any], str | None], subject: Any) -> str | None:
    """Return what a check finds wrong, or the error that it meets."""
    try:
        return check(subject)
    except FlyballError as error:
        return f"{type(error).__name__}: {error}"


def _refuse_incomplete(e: Force | Joint | ConvexSolid) -> None:
    """Refuse classes whose formulas are missing or are not static methods."""
    owners: list[tuple[type, Any, Any]] = [(type(r), ROWS, ROWS) for r in _constraint_rows(e)]
    if isinstance(e, ConvexSolid):
        owners = [(type(e), SUPPORT, SUPPORT)]
    if isinstance(e, Force):
        needed = SIGNATURES[2:3] if isinstance(e, CoordinateForce) else SIGNATURES[:2]
        owners = [(type(e), SIGNATURES, needed if e.acts() else ())]
    for cls, signatures, needed in owners:
        for signature in needed:
            if not hasattr(cls, signature.name):
                raise ContractError(f"{cls.__name__} has no formula {signature}; define it as a static method")
        CodeTable(cls, signatures)


def _constraint_rows(e: Any) -> list[ConstraintRow]:
    return [r for r in e.blocks if isinstance(r, ConstraintRow)] if isinstance(e, Joint) else []


def _subject(
    e: Force | Joint | ConvexSolid, given: Mechanism | None, parameters: Mapping[str, Any] | None
) -> Subject | ShapeSubject:
    if isinstance(e, ConvexSolid):
        n = resolve(e, Mechanism("sample", parameters=dict(parameters or {})).environment())
        e.check(n)
        return ShapeSubject(e, n, e.par(n))

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
        states = [s for r in _constraint_rows(e) for s in row_states(r, e.row_parameters(n, r, *ends)[:6])]
        return Subject(e, make, given is None, m, n, 0.0, ends, states)
    separation = float(x.poses.frame_separation(e))
    states = force_states(e, e.parameters(n, separation)) if e.acts() else []
    return Subject(e, make, given is None, m, n, separation, (), states)
