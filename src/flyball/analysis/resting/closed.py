"""What touches at a position: contacts that are closed, with their friction, and the rows of their velocities."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...contact import surfaces as su
from ...contact.finder import Finder
from ...contact.tables import FOUND, GAP, MATERIAL, MOVER, NORMAL, POINT, SHAPE_1, SHAPE_2
from ...errors import ModelError
from ...math.vec import axes_across
from ...model.body import GROUND
from ...model.model import Model
from ...tables.contact import Touching, touching
from ...tables.coordinates import BodyState
from ..assembly.start import Assembly
from ..motion.impulse.scene import placed, smallest

CLOSED = 1e-6  # gap that is none, in parts of the smallest shape


@dataclass(frozen=True)
class Closed:
    """A closed contact.

    Attributes
    ----------
    name : str
        ``"block-floor"``, with a number where there are several.
    shapes : tuple of int
    bodies : tuple of str
        On either side; ``"ground"`` for what stands still.
    parts : tuple of str
        The same by the names of parts of ground.
    point, normal : ndarray (3,)
        In the world; the normal leads from the first to the second.
    gap : float [m]
    friction : float
        The coefficient of sticking.
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
        """Rows: the normal and two tangents; in the plane the first of these lies in it."""
        n = self.normal
        t = np.array([n[1], -n[0], 0.0]) if n[2] == 0.0 else np.array(axes_across(tuple(n))[0])
        return np.array([n, t, np.cross(n, t)])


@dataclass(frozen=True)
class Place:
    """A position, and what touches there.

    Attributes
    ----------
    at : Assembly
        In absolute coordinates.
    scene : Touching
    bodies : dict
        Name -> where its mass centre is, and its axes.
    contacts : tuple of Closed
    """

    at: Assembly
    scene: Touching
    bodies: dict[str, BodyState]
    contacts: tuple[Closed, ...]


def closed(model: Model, at: Assembly) -> Place:
    """What touches at a position.

    Parameters
    ----------
    model : Model
        With its contacts.
    at : Assembly
        Of this model.

    Raises
    ------
    ModelError
        If surfaces are such that statics does not know: belts, grains, friction against rolling.
    """
    scene = touching(model, at.compiled.values.given, [b.name for b in model.bodies])
    refuse_surfaces(scene)
    bodies = at.compiled.moving(at.t, at.q, 0.0 * at.v)
    size = smallest(scene, at.compiled.values)
    finder = Finder(scene.geometry, margin=CLOSED * size)
    C = finder.find(placed(scene, Assembly(at.compiled, at.t, at.q, 0.0 * at.v)), afresh=True)
    rows = [k for k in range(int(C.count[FOUND])) if C.x[k, GAP] <= CLOSED * size]
    pairs = [(scene.name(int(C.at[k, SHAPE_1])), scene.name(int(C.at[k, SHAPE_2]))) for k in rows]
    out = []
    for n, k in enumerate(rows):
        i, j = (int(s) for s in C.at[k, [SHAPE_1, SHAPE_2]])
        name = "-".join(pairs[n]) + (f"-{pairs[:n].count(pairs[n]) + 1}" if pairs.count(pairs[n]) > 1 else "")
        a, b = (_carrier(scene, s) for s in (i, j))
        mu = float(scene.surfaces.pair[scene.geometry.shape_i[i, MATERIAL], scene.geometry.shape_i[j, MATERIAL], 0])
        x = C.x[k]
        out.append(
            Closed(name, (i, j), (a, b), pairs[n], x[POINT : POINT + 3].copy(), x[NORMAL : NORMAL + 3].copy(),
                   float(x[GAP]), mu)
        )  # fmt: skip
    return Place(at, scene, bodies, tuple(out))


def _carrier(scene: Touching, shape: int) -> str:
    mover = int(scene.geometry.shape_i[shape, MOVER])
    return GROUND if mover < 0 else scene.carriers.name(mover)


def refuse_surfaces(scene: Touching) -> None:
    """Refuse what statics does not know."""
    pair = scene.surfaces.pair
    pair = pair[~np.isnan(pair[..., su.STATIC])]
    what = (
        ("a surface that moves (surface_velocity): what it drags along does not rest", bool(scene.surfaces.belt.any())),
        ("rolling or spinning friction", bool((pair[..., [su.ROLLING, su.SPINNING]] > 0.0).any())),
        ("friction with a grain", bool((pair[..., su.ACROSS] != 1.0).any())),
    )
    for text, there in what:
        if there:
            raise ModelError(f"statics does not know {text}; simulate does")


def rows(place: Place) -> np.ndarray:
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
