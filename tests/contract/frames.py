"""Frames in arbitrary motion, and what a row of constraint says about them."""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation

import flyball as fb
from flyball.constraints import (
    alignment,
    angle,
    coincident,
    curve,
    displacement,
    distance,
    flat_face,
    inclination,
    knife_edge,
    perpendicular,
    relative_spin,
    rolling,
    rotation_component,
    skew_lines,
    space_curve,
    tangent,
)
from flyball.constraints.registry import KINDS
from flyball.joints.flat_faced_cam import support_function
from flyball.joints.point_on_curve import space_curve_splines
from flyball.model.element import resolve
from flyball.testing.formula_checks import frame_record, random_motion, turned_frame

OVAL = [(2.0 * np.cos(u), 1.2 * np.sin(u)) for u in np.linspace(0.0, 2.0 * np.pi, 40, endpoint=False)]
PROFILE = fb.Cam("c", "a", "b", points=OVAL, axis=(0, 0, 1))
SPLINES = PROFILE.curves(resolve(PROFILE, {}))
KNOT = [
    (2.0 * np.cos(u), 1.2 * np.sin(u), 0.5 * np.sin(2 * u)) for u in np.linspace(0.0, 2.0 * np.pi, 40, endpoint=False)
]
WIRE = space_curve_splines(tuple(KNOT), True)[1]
EXTENT = support_function(tuple(OVAL))
RADII = [0.7, -0.4]
DATA = np.concatenate([*SPLINES, *WIRE, EXTENT, RADII])
WIRE_AT = sum(map(len, SPLINES))
EXTENT_AT = float(WIRE_AT + sum(map(len, WIRE)))
RADII_AT = EXTENT_AT + len(EXTENT)

ASSEMBLY = (alignment.KIND_AXIS, alignment.KIND_FULL)  # stand-ins while a joint is far from closed: no motion
AXES = (0.36, 0.48, 0.8, 0.6, 0.0, -0.8, 0.3, 1.0)  # two unit axes; a constant; the coefficient, which no row reads
PARAMETERS = {
    coincident.KIND: {"": AXES},
    displacement.KIND: {"": AXES},
    perpendicular.KIND: {"": AXES},
    distance.KIND: {"": AXES},
    angle.KIND: {"": (0.0, *AXES[1:]), "unwrapped": (1.0, *AXES[1:])},
    skew_lines.KIND: {"": (*AXES[:3], 0.7, -0.4, 1.3, 0.3, 1.0)},
    curve.KIND: {
        "outside": (0.0, 0.0, len(SPLINES[0]), 1.0, 0.0, 0.0, 0.3, 1.0),
        "inside": (0.0, 0.0, len(SPLINES[0]), -1.0, 0.0, 0.0, 0.1, 1.0),
    },
    space_curve.KIND: {
        name: (which, WIRE_AT, WIRE_AT + len(WIRE[0]), 0.0, 0.0, 0.0, 2.8 * (which == 0.0), 1.0)
        for name, which in (("position", 0.0), ("first across", 1.0), ("second across", 2.0))
    },
    flat_face.KIND: {"": (0.0, EXTENT_AT, 0.0, 0.0, 0.0, 0.0, 0.3, 1.0)},
    rolling.KIND: {
        "height of a disk": (0.0, 0.0, 1.0, 0.5, 0.0, 1.0, 0.3, 1.0),
        "height of a wheel": (0.0, 0.0, 1.0, 0.5, 0.2, 1.0, 0.3, 1.0),
        "height of a ball": (0.0, 0.0, 1.0, 0.0, 0.2, 1.0, 0.3, 1.0),
        "slip of a disk": (0.8, -0.6, 0.0, 0.5, 0.0, 0.0, 0.0, 1.0),
        "slip of a wheel": (0.8, -0.6, 0.0, 0.5, 0.2, 0.0, 0.0, 1.0),
        "slip of a ball": (0.8, -0.6, 0.0, 0.0, 0.2, 0.0, 0.0, 1.0),
    },
    knife_edge.KIND: {"": AXES},
    relative_spin.KIND: {"": AXES},
    inclination.KIND_ANGLE: {"angle": AXES},
    inclination.KIND_PITCH: {"pitch": AXES},
    rotation_component.KIND: {"": AXES},
    tangent.KIND: {
        "open": (0.0, RADII_AT, 0.0, 0.0, 0.0, 0.0, 0.3, 1.0),
        "crossed": (0.0, RADII_AT + 1, 0.0, 0.0, 0.0, 0.0, 0.3, 1.0),
    },
}
CASES = [(kind, name) for kind, sets in PARAMETERS.items() for name in sets]
WORLD = (coincident.KIND, skew_lines.KIND)  # they speak of an axis of the world, not of their frames


def label(case) -> str:
    """Name of a case in pytest's output."""
    kind, name = case
    return f"{KINDS[kind].row.__module__.rsplit('.', 1)[1]} {name}".strip()


def has_value(case) -> bool:
    """Whether the row restrains positions."""
    kind, _ = case
    par = PARAMETERS[kind][case[1]]
    return kind not in (knife_edge.KIND, relative_spin.KIND) and not (kind == rolling.KIND and par[5] == 0.0)


def frames(case, seed: int) -> tuple[dict, dict, float]:
    """F, M and what the row leans on: a whole turn too far for an angle, a place near the nearest one for a curve."""
    F, M = random_motion(seed)
    hint = 14.0 * np.pi
    if case[0] == curve.KIND:
        r, u = (1.6 if case[1] == "outside" else 0.8), 0.7 + 2.0 * seed
        M["p"] = F["p"] + F["R"] @ (r * 2.0 * np.cos(u), r * 1.2 * np.sin(u), 0.4)
        s = np.linspace(0.0, SPLINES[0][1 + int(SPLINES[0][1])], 400)
        x, _, _, y, _, _ = curve.point(PARAMETERS[curve.KIND][case[1]], s, DATA)
        p = F["R"].T @ (M["p"] - F["p"])
        hint = s[np.argmin((x - p[0]) ** 2 + (y - p[1]) ** 2)]
    if case[0] == space_curve.KIND:  # on the curve: the rows are exact to second order there only
        par = PARAMETERS[space_curve.KIND][case[1]]
        hint = 2.0 + seed
        M["p"] = F["p"] + F["R"] @ space_curve.vector(par, 0, hint, DATA)[0]
    return F, M, hint


def evaluated(case, F: dict, M: dict, hint: float, dtype=float) -> tuple:
    """The row's value, wrench and bias."""
    kind, name = case
    return KINDS[kind].row(PARAMETERS[kind][name], frame_record(F, dtype), frame_record(M, dtype), hint, DATA)


def rate(out: tuple, F: dict, M: dict, w: str = "w", v: str = "v") -> float:
    """G v of a row's record; with other keys, G times something else."""
    _, f, tM, tF, _ = (np.array(x) for x in out)
    return f @ (M[v] - F[v]) + tM @ M[w] + tF @ F[w]


def elsewhere(case, F: dict, M: dict) -> tuple[dict, dict, tuple]:
    """Both frames after the world has been turned and put 10 km away; the row's parameters there."""
    Q, d = Rotation.random(random_state=3).as_matrix(), np.array([1e4, -2e3, 5e2])
    new = [turned_frame(m, Q, d) for m in (F, M)]
    par = PARAMETERS[case[0]][case[1]]
    if case[0] in WORLD:
        par = (*(Q @ par[:3]).tolist(), *par[3:])
    return *new, par, Q
