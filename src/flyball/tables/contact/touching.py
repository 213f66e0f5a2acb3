"""A model and its numbers -> shapes, surfaces and carriers in arrays."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ...compiler.by_address import CodeTable, addresses, code_table
from ...contact import kinds
from ...contact import tables as ct
from ...contact.narrow.shapes.solid import SIGNATURES
from ...contact.surfaces import Surfaces
from ...errors import ModelError
from ...model.body import GROUND, Body
from ...model.bulk import Bodies
from ...model.element import resolve
from ...model.ground import Ground, frame_of
from ...model.model import Model
from ...model.shapes.form import Form
from ...model.shapes.solid import ConvexSolid, Solid
from ...model.touching import Owner
from ..numbers import Numbers
from .carriers import Carriers, carriers
from .groups import Groups, groups
from .pairs import Surface, own_of, pairs
from .penalty import check_curvature
from .solids import finished, outlined


@dataclass(frozen=True)
class Touching:
    """All that contact needs to know of a model.

    Attributes
    ----------
    geometry : contact.tables.Geometry
    surfaces : contact.surfaces.Surfaces
    carriers : Carriers
        The movers of the geometry.
    parts : tuple of str
        Names of what the shapes are of.
    part : (ns,)
        Of each shape, its place in ``parts``.
    code : list of CodeTable or None
        Of each shape of a user's own, its support function: their addresses stand in the geometry.
    """

    geometry: ct.Geometry
    surfaces: Surfaces
    carriers: Carriers
    parts: tuple[str, ...]
    part: np.ndarray
    code: list[CodeTable | None]

    def name(self, shape: int) -> str:
        """What carries a shape, for messages: ``"floor"``, ``"crank"``, ``"balls[17]"``."""
        mover = int(self.geometry.shape_i[shape, ct.MOVER])
        return self.parts[self.part[shape]] if mover < 0 else self.carriers.name(mover)


def touching(model: Model, given: Numbers, names: Sequence[str]) -> Touching:
    """Tables of a model's contact.

    Parameters
    ----------
    model : Model
    given : Numbers
        Numbers of its elements.
    names : sequence of str
        Bodies and many bodies that move, in the order that their movers are to have. Shapes of others, and of ground,
        are left out or stand still.

    Raises
    ------
    ModelError
        If a shape has no form that contact knows, what touches has no mass, or nothing says the friction of a pair.
    """
    at = carriers(model, given, names)
    owners: list[Owner] = [*model.ground, *(e for name in names if isinstance(e := model.find(name), (Body, Bodies)))]
    owners = [e for e in owners if any(s.touches for s in e.shapes())]
    _refuse_massless(owners, at)
    g = groups(model, owners)
    rows = _Rows(model, given, at, g)
    for k, e in enumerate(owners):
        rows.add(k, e)
    own = _joined(rows.own, (0, 2, 3))
    surfaces = Surfaces(pairs(model, given, g, rows.surfaces), own[:, 0].copy(), own[:, 1].copy())
    apart = np.array(sorted(sorted((at.slices[a].start, at.slices[b].start)) for a, b in g.apart), np.int64).reshape(
        -1, 2
    )
    geometry = ct.Geometry(
        _joined(rows.ints, (0, 9), np.int64),
        _joined(rows.reals, (0, 24)),
        _joined(rows.vertex, (0, 3)),
        _joined(rows.face, (0,), np.int64),
        apart,
        addresses(rows.code),
    )
    check_curvature(geometry, surfaces.pair, [m or "" for _, m in rows.surfaces], model.planar)
    part = _joined(rows.part, (0,), np.int64)
    return Touching(geometry, surfaces, at, tuple(e.name for e in owners), part, rows.code)


def _refuse_massless(owners: list[Owner], at: Carriers) -> None:
    """Refuse what impulses would give any velocity."""
    for e in owners:
        if not isinstance(e, Ground) and not at.mass[at.slices[e.name].start] > 0.0:
            raise ModelError(
                f"{e.title}: it touches and has no mass; give it one, or contact=False to its shapes and put such that "
                f"touch on the bodies that it joins"
            )


def _joined(parts: list[np.ndarray], empty: tuple[int, ...], dtype: type = float) -> np.ndarray:
    return np.ascontiguousarray(np.concatenate([np.zeros(empty, dtype), *parts]), dtype)


class _Rows:
    """Rows of the shape tables, grown owner by owner."""

    def __init__(self, model: Model, given: Numbers, at: Carriers, g: Groups) -> None:
        self.model, self.given, self.at, self.groups = model, given, at, g
        self.surfaces: dict[Surface, set[str]] = {}  # what carries each; of ground there is one
        self.ints: list[np.ndarray] = []
        self.reals: list[np.ndarray] = []
        self.own: list[np.ndarray] = []
        self.part: list[np.ndarray] = []
        self.vertex: list[np.ndarray] = []
        self.face: list[np.ndarray] = []
        self.code: list[CodeTable | None] = []
        self._corners = self._places = 0

    def add(self, k: int, e: Owner) -> None:
        """The shapes of one owner; of many bodies, those of the first, of the second, and so on."""
        where, movers, sizes, com = self._frame(e)
        forms = [(s, f) for s in e.shapes() if s.touches for f in self._forms(e, s)]
        count, n = len(movers), len(forms)
        ints, reals = np.zeros((count, n, 9), np.int64), np.zeros((count, n, 24))
        mine = np.zeros((n, 2, 3))
        for j, (s, form) in enumerate(forms):
            f = form if where is None else form.carried(*where)
            reals[:, j] = _reals(f, com, sizes, self._places)
            ints[:, j] = self._ints(e, s, f, sizes)
            mine[j] = self._own(e, s, where)
        ints[:, :, ct.MOVER] = movers[:, None]
        self.ints.append(ints.reshape(-1, 9))
        self.reals.append(reals.reshape(-1, 24))
        self.own.append(np.broadcast_to(mine, (count, n, 2, 3)).reshape(-1, 2, 3))
        self.part.append(np.full(count * n, k))
        self.code += [None if f.owner is None else code_table(f.owner, SIGNATURES) for _, f in forms] * count

    def _frame(self, e: Owner) -> tuple:
        """Frame in the world of what stands still, movers, sizes, centre of mass."""
        if isinstance(e, Ground):
            return frame_of(e, self.given.of[e.name]), np.array([-1]), np.ones(1), np.zeros(3)
        at = self.at.slices[e.name]
        sizes = e.sizes() if isinstance(e, Bodies) else np.ones(1)
        return None, np.arange(at.start, at.stop), sizes, self.at.com[e.name]

    def _forms(self, e: Owner, s: Solid) -> list[Form]:
        """The parts of a shape, in the body's reference frame."""
        n = resolve(s, self.given.env)
        try:
            if isinstance(s, ConvexSolid):
                code_table(type(s), SIGNATURES, SIGNATURES)
            if self.model.planar:
                return [g for f in s.outlines(n) for g in outlined(f)]
            p, R = s.pose(n)
            return [g.carried(p, R) for f in s.forms(n) for g in finished(f)]
        except ModelError as error:
            raise type(error)(f"{e.title}: {error}") from None

    def _ints(self, e: Owner, s: Solid, f: Form, sizes: np.ndarray) -> np.ndarray:
        """Kind, places of corners and faces, groups and surface; corners of other sizes are corners of their own."""
        group, material = self.groups.of[e.name], s.material or e.material
        row = np.zeros((len(sizes), 9), np.int64)
        row[:, ct.KIND] = getattr(kinds, f.kind)
        row[:, ct.COUNT] = len(f.vertex) if f.corners is None else f.corners
        row[:, ct.FACE_COUNT] = f.sides
        row[:, ct.FIRST], row[:, ct.FACE_FIRST] = self._corners, self._places
        if len(f.vertex):
            other = (sizes != sizes[0]).any()
            row[:, ct.FIRST] += len(f.vertex) * np.arange(len(sizes)) if other else 0
            self.vertex.append(f.grown(sizes if other else sizes[:1])[1])
            self.face.append(np.asarray(f.face, np.int64))
            self._corners += len(self.vertex[-1])
            self._places += len(f.face)
        row[:, ct.MEMBER], row[:, ct.MASK] = 1 << group, self.groups.meets(group)
        surface = group, material
        on = self.surfaces.setdefault(surface, set())
        on |= {GROUND} if isinstance(e, Ground) else {e.name, f"{e.name}[1]"} if len(sizes) > 1 else {e.name}
        row[:, ct.MATERIAL] = list(self.surfaces).index(surface)
        return row

    def _own(self, e: Owner, s: Solid, where: tuple | None) -> np.ndarray:
        name = s.material or e.material
        out = own_of(self.model.find(name) if name else None, self.given.of)  # type: ignore[arg-type]
        return out if where is None else out @ where[1].T


def _reals(f: Form, com: np.ndarray, sizes: np.ndarray, places: int) -> np.ndarray:
    """Origin from the mover's, axes, parameters, radius around it; the edges of a hull are counted from all faces."""
    row = np.zeros((len(sizes), 24))
    row[:, ct.PLACE : ct.PLACE + 3] = sizes[:, None] * (np.real(f.place) - com)
    row[:, ct.AXES : ct.AXES + 9] = np.real(f.axes).ravel()
    row[:, ct.PAR : ct.PAR + len(f.par)] = replace(f, vertex=np.zeros((0, 3))).grown(sizes)[0]
    if f.kind == "HULL" and f.par[1] >= 0:
        row[:, ct.PAR + 1] += places
    row[:, ct.RADIUS] = sizes * np.real(f.reach)
    return row
