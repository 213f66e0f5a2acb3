"""Closed contacts at a position: gap, normal, local shape of the surfaces, and the forces that carry the load."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from ..assembly.assembled_state import Assembly
from ..collision import shape_kinds
from ..collision.contact_finder import ContactFinder
from ..collision.tables import (
    Geometry,
)
from ..derivatives.equation_derivatives import EquationDerivatives, MechanismState, force_magnitudes
from ..errors import ModelError
from ..math.vec import axes_across
from ..model.body import GROUND
from ..model.model import Model
from ..numerics.complementarity.douglas_rachford import ConeProduct, ForceBalance, balance_forces
from ..results.contacts import OPEN, SLIP, STICK, ContactBodies, Contacts
from ..simulation.impulse_stepping.setup import Movers, movers_of_assembly, smallest_radius
from ..tables import table_definitions as su
from ..tables.contact_tables import ContactTables, contact_tables
from ..tables.reference_configuration import BodyState
from .stability import RestState

CLOSED_GAP = 1e-6  # largest gap of a closed contact, relative to the smallest shape


@dataclass(frozen=True)
class StaticContact:
    """A closed contact.

    Attributes
    ----------
    name : str
        ``"block-floor"``, with a number where there are several.
    shapes : tuple of int
    bodies : tuple of str
        Bodies on both sides; ``"ground"`` for fixed shapes.
    parts : tuple of str
        The same, with the names of ground parts instead of ``"ground"``.
    point, normal : ndarray (3,)
        In world axes; the normal points from the first body to the second.
    gap : float [m]
    friction : float
        Coefficient of static friction.
    """

    name: str
    shapes: tuple[int, int]
    bodies: tuple[str, str]
    parts: tuple[str, str]
    point: np.ndarray
    normal: np.ndarray
    gap: float
    friction: float

    @property
    def frame(self) -> np.ndarray:
        """Rows: the normal and two tangents; in a planar model the first tangent lies in the plane."""
        n = self.normal
        t = np.array([n[1], -n[0], 0.0]) if n[2] == 0.0 else np.array(axes_across(tuple(n))[0])
        return np.array([n, t, np.cross(n, t)])


@dataclass(frozen=True)
class ContactState:
    """A position with its closed contacts.

    Attributes
    ----------
    at : Assembly
        In absolute coordinates.
    scene : ContactTables
    bodies : dict
        Name -> position of its mass centre, and its axes.
    contacts : tuple of StaticContact
    """

    at: Assembly
    scene: ContactTables
    bodies: dict[str, BodyState]
    contacts: tuple[StaticContact, ...]


def find_closed_contacts(model: Model, at: Assembly) -> ContactState:
    """Find the closed contacts at a position.

    Parameters
    ----------
    model : Model
        The model with its contacts.
    at : Assembly
        An assembly of this model.

    Raises
    ------
    ModelError
        If statics does not support a surface: belts, grains, rolling friction.
    """
    scene = contact_tables(model, at.compiled.values.given, [b.name for b in model.bodies])
    refuse_unknown_surfaces(scene)
    bodies = at.compiled.moving(at.t, at.q, 0.0 * at.v)
    size = smallest_radius(scene, at.compiled.values)
    finder = ContactFinder(scene.geometry, margin=CLOSED_GAP * size)
    C = finder.find(movers_of_assembly(scene, Assembly(at.compiled, at.t, at.q, 0.0 * at.v)), rebuild=True)
    rows = [k for k in range(int(C.count.found)) if C.x.gap[k] <= CLOSED_GAP * size]
    pairs = [(scene.name(int(C.at.shape_1[k])), scene.name(int(C.at.shape_2[k]))) for k in rows]
    out = []
    for n, k in enumerate(rows):
        i, j = int(C.at.shape_1[k]), int(C.at.shape_2[k])
        name = "-".join(pairs[n]) + (f"-{pairs[:n].count(pairs[n]) + 1}" if pairs.count(pairs[n]) > 1 else "")
        a, b = (_carrier_name(scene, s) for s in (i, j))
        mu = float(scene.surfaces.pair[scene.geometry.shape.material[i], scene.geometry.shape.material[j], 0])
        out.append(
            StaticContact(name, (i, j), (a, b), pairs[n], C.x.point[k].copy(), C.x.normal[k].copy(),
                   float(C.x.gap[k]), mu)
        )  # fmt: skip
    return ContactState(at, scene, bodies, tuple(out))


def _carrier_name(scene: ContactTables, shape: int) -> str:
    mover = int(scene.geometry.shape.mover[shape])
    return GROUND if mover < 0 else scene.carriers.name(mover)


def refuse_unknown_surfaces(scene: ContactTables) -> None:
    """Refuse surfaces that statics does not support."""
    pair = scene.surfaces.pair
    pair = pair[~np.isnan(pair[..., su.STATIC])]
    what = (
        ("a surface that moves (surface_velocity): bodies on it are not at rest", bool(scene.surfaces.belt.any())),
        ("rolling or spinning friction", bool((pair[..., [su.ROLLING, su.SPINNING]] > 0.0).any())),
        ("friction with a grain", bool((pair[..., su.ACROSS] != 1.0).any())),
    )
    for text, there in what:
        if there:
            raise ModelError(f"statics does not support {text}; simulate does")


def contact_rows(place: ContactState) -> np.ndarray:
    """Velocities of the second side relative to the first along the frames of all contacts, (3 n, nv)."""
    s = place.at.compiled.structure
    tree = s.tables["tree"]
    out = np.zeros((3 * len(place.contacts), s.nv))
    for k, c in enumerate(place.contacts):
        for name, sign in zip(c.bodies, (-1.0, 1.0), strict=True):
            if name == GROUND or s.place[name] < 0:
                continue
            b = s.place[name]
            v0, nv = tree.v[b], tree.nv[b]
            x = place.bodies[name]
            for r, d in enumerate(c.frame):
                turn = np.cross(c.point - x.p, d)
                full = np.r_[d[:2], turn[2]] if s.model.planar else np.r_[d, x.R.T @ turn]
                out[3 * k + r, v0 : v0 + nv] += sign * full[:nv]
    return out


FLAT, EDGE, CORNER, BALL, DISK, ODD = "flat", "edge", "corner", "ball", "disk", "odd"
FORM_WORDS = {
    FLAT: "a flat face", EDGE: "an edge", CORNER: "a corner", BALL: "a sphere", DISK: "a circular rim",
    ODD: "a surface of unknown curvature",
}  # fmt: skip
SHARP = (FLAT, EDGE, CORNER)
SHAPE_TOLERANCE = 1e-6  # deviation of a unit vector, or relative to a shape, that counts as zero


@dataclass(frozen=True)
class SurfaceForm:
    """Local shape of one side of a contact.

    Attributes
    ----------
    form : str
        ``"flat"``; ``"edge"`` or ``"corner"``, which touch at a fixed material point; ``"ball"`` about a centre;
        ``"disk"``, the sharp rim about an axle or one end of a cylinder; ``"odd"`` where its curvature is not known.
    centre : ndarray (3,)
        Centre of a ball or disk, in world axes.
    axle : ndarray (3,)
        Axis of a disk.
    radius : float [m]
    """

    form: str
    centre: np.ndarray
    axle: np.ndarray
    radius: float = 0.0


def surface_form(G: Geometry, M: Movers, shape: int, point: np.ndarray, normal: np.ndarray) -> SurfaceForm:
    """Local form of a shape at a point of its surface.

    Parameters
    ----------
    G, M : Geometry, Movers
    shape : int
    point, normal : ndarray (3,)
        In world axes; the normal points out of the shape.
    """
    p, R = _shape_pose(G, M, shape)
    x, n = R.T @ (point - p), R.T @ normal
    kind, par = int(G.shape.kind[shape]), G.dimensions.par[shape]
    form, centre, radius = _local_form(G, shape, kind, par, x, n)
    return SurfaceForm(form, p + R @ centre, R[:, 2], radius)


def _shape_pose(G: Geometry, M: Movers, shape: int) -> tuple[np.ndarray, np.ndarray]:
    """Origin and axes of a shape in the world."""
    p, R = G.dimensions.place[shape], G.dimensions.axes[shape].reshape(3, 3)
    mover = int(G.shape.mover[shape])
    if mover < 0:
        return p, R
    q, T = M.pose[mover, :3], M.pose[mover, 3:].reshape(3, 3)
    return q + T @ p, T @ R


def _local_form(
    G: Geometry, shape: int, kind: int, par: np.ndarray, x: np.ndarray, n: np.ndarray
) -> tuple[str, np.ndarray, float]:
    """Form, centre and radius, in the shape's axes."""
    o = np.zeros(3)
    up = np.array([0.0, 0.0, 1.0])
    if kind == shape_kinds.SPHERE:
        return BALL, o, float(par[0])
    if kind == shape_kinds.PLANE:
        return FLAT, o, 0.0
    if kind == shape_kinds.BOX:
        return (FLAT, EDGE, CORNER)[min(2, int((np.abs(n) > SHAPE_TOLERANCE).sum()) - 1)], o, 0.0
    if kind == shape_kinds.CAPSULE:
        z = float(x[2] - par[0] * n[2])  # position on the core
        if abs(abs(z) - par[1]) <= SHAPE_TOLERANCE * (par[0] + par[1]):
            return BALL, np.sign(z) * par[1] * up, float(par[0])
        return ODD, o, 0.0
    if kind == shape_kinds.CYLINDER:
        return (FLAT, o, 0.0) if abs(n[2]) >= 1.0 - SHAPE_TOLERANCE else (DISK, float(x[2]) * up, float(par[0]))
    if kind == shape_kinds.CONE:
        return _cone_form(par, x, n)
    if kind == shape_kinds.HEMISPHERE:
        if n[2] > SHAPE_TOLERANCE:
            return BALL, o, float(par[0])
        return (FLAT, o, 0.0) if n[2] <= -1.0 + SHAPE_TOLERANCE else (DISK, o, float(par[0]))
    if kind in (shape_kinds.HULL, shape_kinds.POLYGON):
        return _hull_form(G, shape, kind, float(par[0]), x, n)
    return ODD, o, 0.0


def _cone_form(par: np.ndarray, x: np.ndarray, n: np.ndarray) -> tuple[str, np.ndarray, float]:
    o = np.zeros(3)
    if n[2] <= -1.0 + SHAPE_TOLERANCE:
        return FLAT, o, 0.0
    if abs(x[2] - par[1]) <= SHAPE_TOLERANCE * par[1]:
        return CORNER, o, 0.0
    slope = par[1] * n[2] - par[0] * np.hypot(n[0], n[1])  # 0 if the normal is that of the lateral surface
    if abs(x[2]) <= SHAPE_TOLERANCE * par[1] and slope < -SHAPE_TOLERANCE * par[1]:
        return DISK, o, float(par[0])
    return ODD, o, 0.0


def _hull_form(
    G: Geometry, shape: int, kind: int, radius: float, x: np.ndarray, n: np.ndarray
) -> tuple[str, np.ndarray, float]:
    """Form of a hull or polygon, by the number of corners that are farthest along the normal."""
    first, count = int(G.shape.first[shape]), int(G.shape.count[shape])
    corner = G.vertex[first : first + count]
    reach = corner @ n
    far = corner[reach >= reach.max() - SHAPE_TOLERANCE * np.ptp(corner, axis=0).max()]
    if np.linalg.matrix_rank(far - far[0], tol=SHAPE_TOLERANCE * np.ptp(corner, axis=0).max()) >= (
        1 if kind == shape_kinds.POLYGON else 2
    ):
        return FLAT, np.zeros(3), 0.0
    if len(far) > 1:
        return (EDGE if radius == 0.0 else ODD), np.zeros(3), 0.0
    return (CORNER, far[0], 0.0) if radius == 0.0 else (BALL, far[0], radius)


FRICTION_LIMIT = 1e-6  # friction within this relative distance of its limit counts as at its limit
PARTING_LIMIT = 1e-6  # a normal force below this part of the largest counts as zero


@dataclass(frozen=True)
class SupportForces:
    """Reactions and contact forces that carry a mechanism at rest.

    Attributes
    ----------
    lam : ndarray
        Multipliers of the joints' rows.
    force : ndarray (n, 3) [N]
        Contact forces on the second body, in the contact frames.
    unbalanced : float
        Largest residual force or torque, relative to the largest applied one.
    unique : bool
        Whether these are the only forces that balance the load.
    """

    lam: np.ndarray
    force: np.ndarray
    unbalanced: float
    unique: bool


def support_forces(
    place: ContactState, x: RestState, signs: Mapping[str, float], bears: Mapping[str, float] | None = None
) -> SupportForces:
    """Find reactions and admissible contact forces that balance the applied forces.

    Parameters
    ----------
    place : ContactState
    x : RestState
        State at rest at this position, of the model with active stops as constraints.
    signs : mapping
        Name of a stop -> +1 if its effort may only be positive, -1 if only negative, 0 for both.
    bears : mapping, optional
        Name of a sticking element -> its friction capacity [N] or [N m].
    """
    c = x.c
    r = EquationDerivatives(MechanismState.resting(c, x.t, x.q)).block("r")
    n = len(place.contacts)
    J = (contact_rows(place) * c.sizes).T / c.values.length
    G = (x.G.toarray()).T
    stop = np.zeros(G.shape[1])
    for name, sign in signs.items():
        stop[c.structure.slices[name]] = sign
    most = np.full(G.shape[1], np.inf)
    for name, bound in (bears or {}).items():
        most[c.structure.slices[name]] = bound / x.row_scale[c.structure.slices[name]]
    free, signed, sticks = (np.flatnonzero(k) for k in ((stop == 0.0) & (most == np.inf), stop, most < np.inf))
    order = np.r_[free, signed]
    used = J.reshape(len(r), n, 3).copy()
    mu = np.array([k.friction for k in place.contacts])
    used[:, mu == 0.0, 1:] = 0.0
    if c.structure.model.planar:
        used[:, :, 2] = 0.0
    b = c.sizes * r
    columns = np.hstack([G[:, order], used.reshape(len(r), -1), G[:, sticks]])
    found = balance_forces(columns, b, ConeProduct(len(free), stop[signed], mu, most[sticks]))
    lam, last = np.zeros(G.shape[1]), len(found.x) - len(sticks)
    lam[order], lam[sticks] = found.x[: len(order)], found.x[last:]
    force = found.x[len(order) : last].reshape(n, 3) / c.values.length
    return SupportForces(x.row_scale * lam, force, _unbalanced_part(x, r, found), _is_unique(used, G, found))


def _unbalanced_part(x: RestState, r: np.ndarray, found: ForceBalance) -> float:
    """Residual relative to the largest applied force."""
    acts = np.abs(x.scale * force_magnitudes(EquationDerivatives(MechanismState.resting(x.c, x.t, x.q)))).max(
        initial=0.0
    )
    most = max(acts, float(np.abs(x.scale * r).max(initial=0.0)))
    return float(np.abs(found.left).max(initial=0.0)) / most if most > 0.0 else 0.0


def _is_unique(used: np.ndarray, G: np.ndarray, found: ForceBalance) -> bool:
    """Whether the columns of the active forces are independent."""
    A = np.hstack([G, used.reshape(len(G), -1)])
    A = A[:, np.abs(A).max(axis=0, initial=0.0) > 0.0]
    return bool(np.linalg.matrix_rank(A, tol=1e-10 * max(np.abs(A).max(initial=0.0), 1e-300)) == A.shape[1])


def contact_table(place: ContactState, force: np.ndarray) -> Contacts:
    """The contacts of a position as a table with one time."""
    scene, n = place.scene, len(place.contacts)
    names = [*scene.carriers.names, "ground"]
    number = {name: k for k, name in enumerate(names)}
    normal = force[:, 0]
    most = normal.max(initial=0.0)
    tangential = np.hypot(force[:, 1], force[:, 2])
    mu = np.array([c.friction for c in place.contacts])
    state = np.where(tangential >= (1.0 - FRICTION_LIMIT) * mu * normal, SLIP, STICK)
    state = np.where(normal <= PARTING_LIMIT * most, OPEN, state)
    frames = np.array([c.frame for c in place.contacts]).reshape(n, 3, 3)
    return Contacts(
        t=np.array([place.at.t]),
        sides=ContactBodies(names, [-1] * len(names)),
        begin=np.array([0, n]),
        pair=np.array([[number[a] for a in c.bodies] for c in place.contacts], np.int64).reshape(n, 2),
        point=np.array([c.point for c in place.contacts]).reshape(n, 3),
        normal=np.array([c.normal for c in place.contacts]).reshape(n, 3),
        gap=np.array([c.gap for c in place.contacts]),
        force=np.einsum("ki,kij->kj", force, frames),
        state=state.astype(np.int64),
        friction=mu,
        planar=place.at.compiled.structure.model.planar,
    )
