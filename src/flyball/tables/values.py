"""Values of a mechanism in floats: the tables of `System`, and the reference state.

This runs again for every change of a parameter; nothing is compiled and no description is validated here. Parameters
may be complex. All tables are then complex: for a small imaginary part of one parameter, their imaginary parts are that
part times the exact derivatives (complex step). Decisions use real parts.

Typical length and characteristic rate of the mechanism, the scales of lengths and rates, are computed here too. They do
not depend on the duration of a simulation.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from types import SimpleNamespace
from typing import Any

import numpy as np

from ..compiler.kernels import table_addresses
from ..errors import ModelError
from ..math.scalar import real_parts, sqrt
from ..math.vec import inner_product
from ..model.body import GROUND
from ..model.expressions import Expression, number
from ..model.force import Force
from ..model.joint import Coupling, Joint
from ..model.model import Model
from ..model.snapshot import ResultCache, exact_key
from . import constraint_rows
from .element_numbers import ElementNumbers, element_numbers, number_type
from .forest import check_centred
from .mass_properties import mass_table
from .point_formulas import check_point_formulas
from .reference_configuration import BodyState, Poses, Refresh, free_velocities, positions, tree_frames
from .structure_definition import Structure, TermSpec, velocity_names
from .table_definitions import FLAT, Frames, Scales, SwitchNumbers, System, zero_table


def characteristic_rate(given: ElementNumbers, model: Model, gravity: np.ndarray, length: Any) -> Any:
    """Characteristic rate [1/s]: half swings of a pendulum of the typical length, sqrt(g / length) / pi.

    Without gravity: the fastest body or coordinate at the start, speed per length or angular speed; 0 if all are at
    rest.
    """
    if (g := _norm(gravity)).real > 0.0:
        return np.sqrt(g / length) / np.pi
    moving = [d for name, d in given.bodies.items() if name != GROUND]
    speeds = [x for d in moving for x in (_norm(d.v) / length, _norm(d.w))]
    for e in model.initial:
        if (rate := getattr(given.of.get(e.name), "rate", None)) is not None:
            unit = model.unit(e.name, e)
            size = _norm(np.array([number(rate, given.env, f"{unit}/s", f"rate of {e.title}"), 0.0, 0.0]))
            speeds.append(size / length if unit == "m" else size)
    return max(speeds, key=lambda x: x.real, default=0.0)


def _norm(x: np.ndarray) -> Any:
    """Length of a vector (3,); 0 for a zero vector, where the square root has no derivative."""
    return np.sqrt(inner_product(x, x)) if real_parts(x).any() else 0.0


NO_LENGTH = 1e-13  # relative to the coordinates: a distance that is only rounding
FACTOR_COLUMN = 7  # of `System.term_parameters`
MAX_VALUES = 4  # sets of values of one structure that are cached
REGULARISATION = 1e-9
STEP = 1e-100  # complex step


@dataclass
class Values:
    """A compiled mechanism: the System, the reference state, and the numbers of every element."""

    structure: Structure
    system: System
    q: np.ndarray
    v: np.ndarray
    given: ElementNumbers
    length: float  # a typical length of the mechanism [m]
    poses: Poses  # frames in the reference configuration
    cache: ResultCache = field(
        default_factory=ResultCache, init=False
    )  # initial states of motions; a changed copy has its own
    alike: Values | None = field(default=None, init=False, repr=False)  # see `unforced`

    @property
    def numbers(self) -> Mapping[str, SimpleNamespace]:
        """Element -> its fields in SI units."""
        return self.given.of

    @property
    def bodies(self) -> Mapping[str, SimpleNamespace]:
        """Body -> p, R, com: reference frame in the reference configuration, centre of mass in it; c: its position."""
        return self.given.bodies

    @property
    def env(self) -> Mapping[str, Any]:
        """Values of the parameters."""
        return self.given.env

    @property
    def unforced(self) -> Values:
        """Values that differ from these in numbers of forces and controllers only; these themselves if there are none.

        Results that depend on bodies, joints and the reference state only are computed once for both.
        """
        return self if self.alike is None else self.alike

    @property
    def parameter_values(self) -> dict[str, float]:
        """Values of the parameters used."""
        names = list(self.structure.model.parameters)
        return dict(zip(names, self.system.const[: len(names)].real.tolist(), strict=True))

    def __getstate__(self) -> dict[str, Any]:
        return vars(self) | {"alike": None}

    def __setstate__(self, state: dict[str, Any]) -> None:
        """Restore in another process, where code has other addresses."""
        vars(self).update(state)
        self.system = self.system._replace(
            force_code=table_addresses(self.structure.force_code),
            term_code=table_addresses(self.structure.term_code),
            guard_code=table_addresses(self.structure.guard_code),
        )


def values(
    s: Structure, parameters: Mapping[str, complex] | None = None, holds: Mapping[str, complex] | None = None
) -> Values:
    """Numbers of a mechanism, computed once for each set of values; cached, not to be changed.

    Parameters
    ----------
    s : Structure
    parameters : mapping, optional
        Values in SI units in place of the model's own. If one is complex, all tables and the state are.
    holds : mapping, optional
        Values of the coordinates that are held (see ``structure``).
    """
    return values_of(s, element_numbers(s.model, parameters), holds)


def values_of(s: Structure, n: ElementNumbers, holds: Mapping[str, complex] | None = None) -> Values:
    """Numbers of a mechanism from the numbers of its elements."""
    if n.dtype is not float or (holds and number_type(holds.values()) is not float):
        return _fill(s, n, holds or {})
    return s.cache.get("values", (n.key, exact_key(holds or {})), MAX_VALUES, lambda: _fill(s, n, holds or {}))


def _fill(s: Structure, given: ElementNumbers, holds: Mapping[str, Any]) -> Values:
    """Compute all tables; where some exist already, only the rows that differ."""
    if holds:
        return _fill_all(s, given, holds, Refresh())
    first = s.cache.known("filled first")
    new = Refresh.since(first, given, s.model)
    x = _fill_forces(s, given, new) if new.forces_only and given.dtype is float else None
    x = x or _fill_all(s, given, holds, new)
    if first is None and given.dtype is float:
        s.cache.get("filled first", None, 1, lambda: x)
    return x


def _fill_forces(s: Structure, given: ElementNumbers, refresh: Refresh) -> Values | None:
    """Values where only forces and controllers have other numbers; None if these move bodies or frames."""
    base, pose = refresh.base, Poses(s, given)
    assert base is not None
    S, dtype = base.system, base.system.const.dtype
    frames = _frames(s, pose, refresh.table("frames", S.frames, dtype), refresh)
    const, curve_at = _constants(s, given.of, given.env, dtype)
    terms = _term_parameters(s, pose, {}, curve_at, refresh.table("term_parameters", S.term_parameters, dtype), refresh)
    gravity = np.array(s.model.gravity_vector(given.env), dtype)
    rotors = _rotor_inertia(s, given.of, dtype)
    same = (
        *zip(frames, S.frames, strict=True), (terms, S.term_parameters), (gravity, S.gravity),
        (rotors, S.rotor_inertia),
    )  # fmt: skip
    if any(a.tobytes() != b.tobytes() for a, b in same):
        return None
    forces = refresh.table("force_parameters", S.force_parameters, dtype)
    forces = _force_parameters(s, pose, curve_at, forces, refresh)
    of_switches = refresh.table("switch_numbers", S.switch_numbers, dtype)
    constraint_rows.fill_switch_numbers(s, given.of, of_switches, refresh.asks, pose.frame_separation)
    S = S._replace(force_parameters=forces, const=const, switch_numbers=of_switches)
    x = Values(s, S, base.q, base.v, given, base.length, pose)
    x.alike = base
    return x


def _fill_all(s: Structure, given: ElementNumbers, holds: Mapping[str, Any], refresh: Refresh) -> Values:
    model, env, numbers, bodies = s.model, given.env, given.of, given.bodies
    dtype = number_type([*given.env.values(), *holds.values()]) if holds else given.dtype
    pose = Poses(s, given)
    frames = _frames(s, pose, refresh.table("frames", zero_table(Frames, len(s.frames), dtype), dtype), refresh)
    length = _length(s, frames.position, bodies)
    _check_points(s, frames.position, length, refresh)
    table = mass_table(s, bodies, frames.position, length, refresh)
    tree_frames(s, pose, numbers, table, refresh)
    const, curve_at = _constants(s, numbers, env, dtype)
    terms = refresh.table("term_parameters", np.zeros((len(s.terms), 8), dtype), dtype)
    terms = _term_parameters(s, pose, holds, curve_at, terms, refresh)
    forces = refresh.table("force_parameters", np.zeros((len(s.forces), 16), dtype), dtype)
    forces = _force_parameters(s, pose, curve_at, forces, refresh)
    if refresh.base is None and s.points and s.code_tables and dtype is float:
        check_point_formulas(s, pose, forces, terms, float(length))
    of_switches = refresh.table("switch_numbers", zero_table(SwitchNumbers, len(s.switches), dtype), dtype)
    constraint_rows.fill_switch_numbers(s, numbers, of_switches, refresh.asks, pose.frame_separation)
    semidefinite = float((table.excess_inertia != 0.0).any() or (table.excess_mass != 0.0).any())
    gravity = model.gravity_vector(env)
    pace = characteristic_rate(given, model, gravity, length)
    scales = np.array([REGULARISATION, semidefinite, length, pace], dtype).view(Scales)
    system = System(  # type: ignore[misc]
        **s.tables,
        bodies=table, frames=frames, term_parameters=terms, force_parameters=forces, switch_numbers=of_switches,
        force_code=table_addresses(s.force_code), term_code=table_addresses(s.term_code),
        guard_code=table_addresses(s.guard_code), const=const, surfaces=s.surfaces,
        gravity=np.array([*gravity], dtype),
        scales=scales, units=np.array(_units(s, length), dtype),
        velocity_units=_velocity_units(s, length, dtype),
        rotor_inertia=_rotor_inertia(s, numbers, dtype),
        row_levers=length / _row_units(s, terms, length, pose),
        entry_sizes=_entry_sizes(s, terms, _body_length(s, frames.position, length), pose),
        ldl=s.ldl, flat=np.zeros(FLAT, np.int64),
    )  # fmt: skip
    x = Values(
        s, system, refresh.state("q", s.nq, dtype), refresh.state("v", s.nv, dtype), given, float(length.real), pose
    )
    drawn = {b.name: BodyState(d.c, d.R, d.v, d.w, d.angle) for b, d in ((b, bodies[b.name]) for b in model.bodies)}
    x.q[:], x.v[:] = positions(x, drawn, refresh=refresh), free_velocities(x, drawn, refresh=refresh)
    return x


def _frames(s: Structure, pose: Poses, table: Frames, refresh: Refresh) -> Frames:
    for k in refresh.rows(s, "frames"):
        row = pose.row(s.frames[k])
        table.position[k], table.rotation[k] = row[:3], row[3:]
    return table


def _check_points(s: Structure, places: np.ndarray, length: Any, refresh: Refresh) -> None:
    """Refuse ends that miss the centre of a point mass with these numbers."""
    single = {s.place[name]: name for name in s.points}
    for f, way in zip(s.frames, places, strict=True) if single else ():
        if f.body in single and refresh.asks(f.element):
            check_centred(s.model, single[f.body], f.element, way, length)


def _length(s: Structure, places: np.ndarray, bodies: Mapping[str, SimpleNamespace]) -> Any:
    """Typical length: the largest distance from a centre of mass to a frame, or from one body to the mean of all.

    Where that is zero: the extent of bodies and points on the ground about their mean, or the largest radius of
    gyration; else 1 m.
    """
    moving = [b for k, b in bodies.items() if k != GROUND]
    if not moving:
        return 1.0
    centres, on_body = np.array([b.c for b in moving]), s.tables["frame_body"] >= 0
    if (length := _extent(places[on_body], places[~on_body], centres)).real > 0.0:
        return length
    spin = [np.trace(b.inertia) / b.mass for b in moving if b.mass.real > 0.0]
    length = np.sqrt(max(spin, key=lambda x: x.real, default=0.0))
    return length if length.real > 0.0 else 1.0


def _extent(on_bodies: np.ndarray, on_ground: np.ndarray, centres: np.ndarray) -> Any:
    """Typical length from places alone, (..., k, 3) each; 0 where they coincide."""
    places = np.concatenate([on_ground, centres], axis=-2)
    nothing = NO_LENGTH * np.abs(real_parts(places)).max(axis=(-2, -1), initial=0.0)[..., None]
    first = _longest_vector(np.concatenate([on_bodies, centres - centres.mean(axis=-2, keepdims=True)], axis=-2))
    if (real_parts(first) > nothing).all():
        return first[..., 0][()]
    other = _longest_vector(places - places.mean(axis=-2, keepdims=True))
    other = np.where(real_parts(other) > nothing, other, 0.0)
    return np.where(real_parts(first) > nothing, first, other)[..., 0][()]


def _units(s: Structure, length: Any) -> list[Any]:
    """Unit of every measured quantity: the mechanism's length, or a radian."""
    metric = {t.row - len(s.rows) for t in s.terms if t.measured and t.formula.measure == "m"}
    return [length if m in metric else 1.0 for m in range(len(s.measured))]


def _velocity_units(s: Structure, length: Any, dtype: Any) -> np.ndarray:
    """Unit of each coordinate whose rate is a velocity: the length or a radian."""
    return np.array([length if n.unit == "m" else 1.0 for n in velocity_names(s)], dtype)


def _rotor_inertia(s: Structure, numbers: Mapping[str, SimpleNamespace], dtype: Any) -> np.ndarray:
    """Inertia that rotors add to the mass matrix along each velocity, (nv,)."""
    out = np.zeros(s.nv, dtype)
    for rotor, d in s.rotors:
        out[d] += rotor.added_inertia(numbers[rotor.name])
    return out


def _row_units(s: Structure, terms: np.ndarray, length: Any, pose: Poses) -> np.ndarray:
    """Unit of every row: the largest of its terms', the length or a radian by its factor; the length if all are 0."""
    out = [0.0] * len(s.rows)
    for t, factor in zip(s.terms, terms[:, FACTOR_COLUMN], strict=True):
        if not t.measured:
            unit = (-factor if factor.real < 0.0 else factor) * (length if t.formula.measure == "m" else 1.0)
            out[t.row] = max(out[t.row], unit, key=lambda x: x.real)
    for k, row in enumerate(s.rows):
        if isinstance(row.element, Coupling) and (law := row.element.equation(s.model)) is not None:
            out[k] = _equation_unit(s, law, length, pose)
    return np.array([unit if unit != 0.0 else length for unit in out], terms.dtype)


def _equation_unit(s: Structure, law: Expression, length: Any, pose: Poses) -> float:
    """Largest change of an equation's value where one coordinate changes by the length or a radian; 0 if none does.

    It is linearised in the reference configuration; where all derivatives are 0 there, half a unit beside it.
    """
    env: dict[str, Any] = {name: x.real for name, x in pose.env.items()}
    tables = s.model.law_tables()
    units: dict[str, float] = {}
    for t in s.terms:
        name = f"{t.owner.name}.{t.what}" if t.measured and t.owner is not None else ""
        if name in law.names:
            units[name] = float(length.real) if t.formula.measure == "m" else 1.0
            env[name] = float((t.sign * pose.term_value(t) + _offset(t, pose.numbers)).real)
    found = 0.0
    for beside in (0.0, 0.5):
        near = env | {name: env[name] + beside * unit for name, unit in units.items()}
        for name, unit in units.items():
            with np.errstate(all="ignore"):
                step = law.evaluate(near | {"t": 0.0, name: near[name] + 1j * STEP * unit}, tables)
            slope = abs(np.imag(step)) / STEP
            found = max(found, float(slope)) if np.isfinite(slope) else found
        if found > 0.0:
            break
    return found


def _body_length(s: Structure, places: np.ndarray, otherwise: Any) -> Any:
    """Largest distance from a centre of mass to a frame on its body; ``otherwise`` if all are centres."""
    on_bodies = places[s.tables["frame_body"] >= 0]
    longest = _longest_vector(on_bodies)[0] if len(on_bodies) else 0.0
    return longest if longest.real > 0.0 else otherwise


def _entry_sizes(s: Structure, terms: np.ndarray, length: Any, pose: Poses) -> np.ndarray:
    """Unit of the row by the unit of the velocity, for every entry of G; 0 for those of measured quantities."""
    units = _row_units(s, terms, length, pose)
    count = np.diff(s.tables["row_start"])[: len(units)]
    out = np.zeros(len(s.tables["column"]), terms.dtype)
    of_rows = s.tables["column"][: count.sum()]
    out[: len(of_rows)] = np.repeat(units, count) / _velocity_units(s, length, terms.dtype)[of_rows]
    return out


def _longest_vector(vectors: np.ndarray) -> np.ndarray:
    """Length (..., 1) of the longest of some vectors (..., k, 3)."""
    at = np.argmax((real_parts(vectors) ** 2).sum(axis=-1), axis=-1)
    longest = np.take_along_axis(vectors, at[..., None, None], axis=-2)[..., 0, :]
    return sqrt((longest**2).sum(axis=-1, keepdims=True))


def _constants(s: Structure, numbers: Mapping, env: Mapping[str, Any], dtype: Any) -> tuple[np.ndarray, dict[str, int]]:
    """Parameters, literals and tables of the laws; splines of joints, data of forces, and where those of each begin."""
    const: list[Any] = list(s.const or [0.0])
    const[: len(s.model.parameters)] = [env[k] for k in s.model.parameters]
    curve_at = {}
    elements: tuple[Joint | Force, ...] = (*s.model.joints, *s.forces)
    for e in elements:
        if curves := e.curves(numbers[e.name]):
            curve_at[e.name] = len(const)
            for data in curves:
                const += data
    for force in s.forces:
        if own := force.data(numbers[force.name]):
            curve_at[force.name] = len(const)
            const += own
    return np.array(const, dtype), curve_at


def _term_parameters(
    s: Structure,
    pose: Poses,
    holds: Mapping[str, Any],
    curve_at: Mapping[str, int],
    x: np.ndarray,
    refresh: Refresh,
) -> np.ndarray:
    """Parameters of the terms: axes from the declaration, constants from the numbers."""
    numbers = pose.numbers
    factors = {c.name: np.array(c.factors(numbers[c.name], s.model, pose.axis)) for c in s.model.couplings}
    factors = {name: f / f[0] for name, f in factors.items() if len(f)}
    for k in refresh.rows(s, "terms"):
        t = s.terms[k]
        x[k] = t.formula.par
        x[k, 7] = t.sign * t.formula.par[7]
        e = t.element
        n = numbers[e.name]
        if t.formula.of_kind.splines and t.owner is not None:
            x[k, 1:3] = curve_at[t.owner.name], curve_at[t.owner.name] + len(t.owner.curves(numbers[t.owner.name])[0])
        if t.hint >= 0 and t.formula.of_kind.turns:
            x[k, 0] = 1.0
        if isinstance(e, Joint) and t.owner is None:
            x[k, :7] = e.row_parameters(n, t.formula, *pose.ends(e))
            if t.formula.of_kind.splines:
                at = curve_at[e.name]
                x[k, 1:3] = at, at + len(e.curves(n)[0])
        elif isinstance(e, Joint):
            x[k, 7] *= e.weight(n, t.what, *pose.ends(e))
        elif isinstance(e, Coupling) and not t.measured:
            x[k, 7] *= factors[e.name][t.index]
            x[k, 6] = _coupling_constant(e, n, t, pose)
        elif t.owner is not None:
            if t.switch is not None and (weights := e.switch_weights(n, t.switch)):
                x[k, 7] *= weights[t.index]
            held = t.sign * (holds.get(e.name, 0.0) - _offset(t, numbers))
            weighted = hasattr(e, "total") and not isinstance(e, Coupling)
            x[k, 6] = _coupling_constant(e, n, t, pose) if weighted else held
    return x


def _offset(t: TermSpec, numbers: Mapping) -> float:
    """Offset of a term's coordinate in the reference configuration."""
    return t.owner.offset(numbers[t.owner.name], t.what) if isinstance(t.owner, Joint) else 0.0


def _coupling_constant(e: Any, n: SimpleNamespace, t: TermSpec, pose: Poses) -> float:
    """Reference value of a coupled coordinate: its value in the reference configuration, unless the sum is given."""
    total = e.total(n)
    if total is None:
        return pose.term_value(t)
    share = total / e.first_weight(n) if t.index == 0 else 0.0
    return t.sign * (share - _offset(t, pose.numbers))


SURFACE_COLUMN, DATA_COLUMN = 14, 15  # of `System.force_parameters`: places of a force's road, and of its own numbers


def _force_parameters(
    s: Structure, pose: Poses, data_at: Mapping[str, int], x: np.ndarray, refresh: Refresh
) -> np.ndarray:
    for k in refresh.rows(s, "forces"):
        e = s.forces[k]
        par = e.parameters(pose.numbers[e.name], pose.frame_separation(e))
        if len(par) > x.shape[1]:
            raise ModelError(f"{e.title}: parameters() gives {len(par)} numbers; a force has up to {x.shape[1]}")
        x[k], x[k, : len(par)] = 0.0, par
        if e.states():
            x[k, SURFACE_COLUMN], x[k, DATA_COLUMN] = s.surface_at.get(e.ends()["F"], -1), data_at[e.name]
        elif e.name in data_at:
            x[k, 0] = data_at[e.name]
    return x
