"""Ropes over pulleys: straight parts along common tangents, and arcs around the pulleys; and their friction.

As drawn, over time, and as expressions of the coordinates of their parts, which the friction of a rope needs.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from itertools import pairwise
from types import SimpleNamespace
from typing import Any, ClassVar, NamedTuple

import numpy as np

from ..constraints.tangent import tangent
from ..errors import ModelError
from ..math.vec import matrix_product
from ..model.controller import Controller, ControlState
from ..model.element import Law, element
from ..model.expression_parser import DEFINED, DEFINITIONS, SyntaxNode
from ..model.geometry import triad, vector

TURN = 2.0 * math.pi
LIFTED = 1e-9  # [rad] below zero: a wrap that rounding makes negative is zero, not a full turn
ARC = math.radians(10.0)  # largest angle between neighbouring points of an arc in pictures
COPLANAR = 1e-9  # relative to the distance of two points: how far they may be from one plane


class DrawnRope(NamedTuple):
    """A rope as drawn.

    Attributes
    ----------
    lengths, directions : tuple of numbers [m], [rad]
        Of its straight parts, from each point to the next.
    places : tuple of numbers [rad]
        Directions as a `RopeSpan` measures them: backwards where only the second end has a radius.
    wraps : tuple of numbers [rad]
        Around each point.
    """

    lengths: tuple[Any, ...]
    directions: tuple[Any, ...]
    places: tuple[Any, ...]
    wraps: tuple[Any, ...]

    def arcs(self, radii: tuple[Any, ...]) -> Any:
        """Return the length on all pulleys [m]."""
        return sum(sign(r) * r * phi for r, phi in zip(radii, self.wraps, strict=True))


def sign(radius: Any) -> float:
    """Return 1 if a rope runs counterclockwise, else -1."""
    return 1.0 if radius.real > 0.0 else -1.0


def is_backward(a: Any, b: Any) -> bool:
    """Return whether a `RopeSpan` is from the second of two ends with these radii to the first, which is a point."""
    return is_point(a) and not is_point(b)


def is_point(radius: Any) -> bool:
    """Return whether an end is a point: its radius is the number 0."""
    return not isinstance(radius, str) and radius == 0.0


def pulley_axes(e: Any, axis: Any, planar: bool) -> np.ndarray:
    """Return axes (columns) of which z is the axis of the pulleys of a rope."""
    if planar:
        if axis is not None:
            raise ModelError(f"{e.title}: in a planar mechanism the axis of its pulleys is the normal; leave axis out")
        return np.eye(3)
    if axis is None:
        raise ModelError(f"{e.title}: give the axis of its pulleys in world coordinates, for instance axis=(0, 0, 1)")
    return triad(vector(axis, False, f"axis of {e.title}", direction=True))


def drawn_rope(e: Any, n: SimpleNamespace) -> DrawnRope:
    """Return the lengths, directions and wraps of a rope over pulleys as drawn.

    Parameters
    ----------
    e : Element
        The rope, for messages.
    n : SimpleNamespace
        Its numbers: ``at`` [m], ``radii`` [m], ``turns``, ``axis``.

    Raises
    ------
    ModelError
        If two pulleys are so close that no line touches both, or are not in one plane.
    """
    planar = len(n.at[0]) == 2
    R = pulley_axes(e, n.axis, planar)
    p = [matrix_product(R.T, vector(x, planar, f"'at' of {e.title}")) for x in n.at]
    found = []
    for k, (here, there) in enumerate(pairwise(p)):
        b, d = n.radii[k + 1] - n.radii[k], there - here
        size = math.sqrt(float((d.real**2).sum()))
        if abs(d[2].real) > COPLANAR * size and (n.radii[k] or n.radii[k + 1]):
            raise ModelError(
                f"{e.title}: points {k + 1} and {k + 2} are {abs(d[2].real):.6g} m apart along the axis of its "
                "pulleys; all pulleys and the points next to them are in one plane. Move one, or divide the rope"
            )
        if not size > abs(b.real):
            raise ModelError(
                f"{e.title}: points {k + 1} and {k + 2} are {size:.6g} m apart, and with the radii {n.radii[k].real:g} "
                f"and {n.radii[k + 1].real:g} m no line touches both from the given sides; move one, or change a sign"
            )
        length, theta = tangent(tuple(d), b)
        found.append((length, theta, tangent(tuple(-d), b)[1] if is_backward(*n.radii[k : k + 2]) else theta))
    wraps = [TURN * n.turns[0]]
    for (_, before, _), (_, after, _), r, turns in zip(found, found[1:], n.radii[1:], n.turns[1:], strict=False):
        turned = (after - before) * sign(r)
        whole = math.floor((turned.real + LIFTED) / TURN)
        wraps.append((turned + TURN * (turns - whole)) if r else 0.0 * turned)
    lengths, directions, places = zip(*found, strict=True)
    return DrawnRope(lengths, directions, places, (*wraps, TURN * n.turns[-1]))


class RopeCourse(NamedTuple):
    """Where a rope over pulleys runs, over time; world axes, arrays (n, 3).

    Attributes
    ----------
    centres, axes : list of arrays [m], [1]
        Of its points.
    radii : tuple of numbers [m]
    pulls : list of arrays [1]
        Of each straight part: the unit vector along it, from each point to the next.
    normals : list of arrays [1]
        Of each straight part: the direction to its left in the plane of the pulleys.
    """

    centres: list[np.ndarray]
    axes: list[np.ndarray]
    radii: tuple[float, ...]
    pulls: list[np.ndarray]
    normals: list[np.ndarray]

    def ends(self, k: int) -> tuple[np.ndarray, np.ndarray]:
        """Return both ends of straight part k (from 0) [m]."""
        a, b = (self.centres[i] - self.radii[i] * self.normals[k] for i in (k, k + 1))
        return a, b

    def line(self, wraps: list[np.ndarray]) -> list[np.ndarray]:
        """Return points of the rope with its arcs, for pictures; ``wraps`` are angles around each point [rad]."""
        out = []
        for i in range(len(self.centres)):
            if self.radii[i] == 0.0:
                out.append(self.centres[i])
            else:
                out += self._arc(i, wraps[i])
        return out

    def _arc(self, i: int, wrap: np.ndarray) -> list[np.ndarray]:
        """Return points of the arc around pulley i; of several turns the last incomplete one and a full one."""
        whole = np.floor(wrap / TURN)
        shown = np.maximum(np.where(whole > 0.0, TURN, 0.0) + wrap - whole * TURN, 0.0) * sign(self.radii[i])
        first = i == 0  # the arc then ends where the rope leaves; else it begins where the rope arrives
        arm = -self.radii[i] * self.normals[0 if first else i - 1]
        side = np.cross(self.axes[i], arm)
        count = 2 + math.ceil(float(np.abs(shown).max()) / ARC)
        parts = [(x - 1.0 if first else x) * shown[:, None] for x in np.linspace(0.0, 1.0, count)]
        return [self.centres[i] + np.cos(phi) * arm + np.sin(phi) * side for phi in parts]


def rope_course(centres: list[np.ndarray], axes: list[np.ndarray], radii: tuple[float, ...]) -> RopeCourse:
    """Return the course of a rope over pulleys with these centres [m] and axes over time."""
    pulls, normals = [], []
    for k, (a, b) in enumerate(pairwise(radii)):
        z, d, more = axes[k + 1 if is_backward(a, b) else k], centres[k + 1] - centres[k], b - a
        up = (z * d).sum(axis=1, keepdims=True)
        flat = d - up * z
        rho = (flat * flat).sum(axis=1, keepdims=True)
        left, run = np.cross(z, flat), np.sqrt(rho - more * more)
        length = np.sqrt((d * d).sum(axis=1, keepdims=True) - more * more)
        pulls.append(flat * (1.0 / length - more * more / (rho * run)) - left * (more / rho) + up * z / length)
        normals.append((left * run + flat * more) / rho)
    return RopeCourse(centres, axes, radii, pulls, normals)


def tangent_texts(x: str, y: str, z: str, radii: tuple[Any, Any]) -> tuple[str, str]:
    """Return length [m] and direction [rad] of a straight part as expressions; see `constraints.tangent`.

    The second centre is at (x, y, z) in the axes of the first, z along the pulleys' axis.
    """
    b, flat = f"(({radii[1]}) - ({radii[0]}))", f"(({x})**2 + ({y})**2)"
    return f"sqrt({flat} + ({z})**2 - {b}**2)", f"(atan2({y}, {x}) - asin({b}/sqrt({flat})))"


class RopeTexts:
    """A rope over pulleys as expressions: of its parts' coordinates, and of the numbers it is drawn by.

    Parameters
    ----------
    e : Element
        The rope.
    n : SimpleNamespace
        Its numbers, of which full turns and axes are taken.
    """

    def __init__(self, e: Any, n: SimpleNamespace) -> None:
        self.e, self.radii, self.drawn = e, e.radii, drawn_rope(e, n)
        self.numbers, self.signs = n.radii, [sign(r) for r in n.radii]
        R = pulley_axes(e, n.axis, len(n.at[0]) == 2)
        self.centres = [
            [" + ".join(f"{float(R[i, k])!r}*({x})" for i, x in enumerate(p) if R[i, k] != 0.0) for k in range(3)]
            for p in e.at
        ]

    def part(self, k: int, backward: bool = False) -> tuple[str, str]:
        """Return length and direction of straight part k (from 0) as drawn; ``backward``: from its second end."""
        ends, radii = self.centres[k : k + 2], self.radii[k : k + 2]
        if backward:
            ends, radii = ends[::-1], (f"-({radii[1]})", f"-({radii[0]})")
        x, y, z = (f"({b or 0}) - ({a or 0})" for a, b in zip(*ends, strict=True))
        return tangent_texts(x, y, z, radii)

    def value(self, k: int) -> str:
        """Return the coordinate ``length`` of straight part k as drawn."""
        a, b = self.radii[k : k + 2]
        length, direction = self.part(k, is_backward(a, b))
        return length if is_point(a) and is_point(b) else f"({length} - (({b}) - ({a}))*{direction})"

    def length(self) -> str:
        """Return the length as drawn, with all arcs."""
        arcs = [f"({self.signs[0]}*({self.radii[0]})*{self.drawn.wraps[0]!r})"]
        for i in range(1, len(self.radii) - 1):
            off = f"({self.signs[i]}*({self.part(i)[1]} - {self.part(i - 1)[1]}) - {self.drawn.wraps[i]!r})"
            turned = f"({self.drawn.wraps[i]!r} + atan2(sin({off}), cos({off})))"  # up to full turns
            arcs += [] if is_point(self.radii[i]) else [f"({self.signs[i]}*({self.radii[i]})*{turned})"]
        arcs.append(f"({self.signs[-1]}*({self.radii[-1]})*{self.drawn.wraps[-1]!r})")
        return " + ".join([*(self.part(k)[0] for k in range(len(self.radii) - 1)), *arcs])

    def wrap(self, i: int, moves: tuple[bool, bool]) -> str:
        """Return the angle around pulley i in motion, up to full turns; ``moves``: whether the parts at it do."""
        r = self.radii[i - 1 : i + 2]
        x, y, angle = (f"{self.e.name}_{i}.{what}" for what in ("x", "y", "angle"))
        if not moves[0]:
            before = self.part(i - 1)[1]
        elif is_backward(*r[:2]):
            before = f"({tangent_texts(x, y, '0', (f'-({r[1]})', 0.0))[1]} + pi)"
        else:
            before = f"({tangent_texts(x, y, '0', r[:2])[1]} - {angle})"
        x, y = (f"{self.e.name}_{i + 1}.{what}" for what in ("x", "y"))
        after = tangent_texts(x, y, "0", r[1:])[1] if moves[1] else self.part(i)[1]
        return f"{self.signs[i]}*({after} - {before})"

    def share(self, i: int) -> float:
        """Return the part of the whole length that is before pulley i, with half of its arc."""
        arcs = [s * r * phi for s, r, phi in zip(self.signs, self.numbers, self.drawn.wraps, strict=True)]
        before = sum(self.drawn.lengths[:i]) + sum(arcs[:i]) + 0.5 * arcs[i]
        return float((before / (sum(self.drawn.lengths) + sum(arcs))).real)


SOLVED = "solved_"
"""Beginning of names for the formulas of `SLIP`."""


def _slip_formulas() -> Iterator[tuple[str, str]]:
    """Yield names and formulas, each of names given to the controller and of formulas before it."""
    yield "off", "turned - middle"
    yield "around", "middle + atan2(sin(off), cos(off))"
    yield "ratio", "exp(friction*max(0, around))"
    for k, s in ((1, "-"), (2, "+")):
        yield f"longer_{k}", f"stretch_{k} {s} slip"
        yield f"stuck_{k}", f"where(longer_{k} > 0, stiffness_{k}*longer_{k} + damping_{k}*rate_{k}, 0)"
        yield f"soft_{k}", f"where(longer_{k} > 0, damping_{k}, 0)"
    for k, other in ((1, 2), (2, 1)):
        excess = f"(stuck_{k} - ratio*stuck_{other})/(damping_{k} + ratio*soft_{other})"
        yield f"slips_{k}", f"max(0, min({excess}, stuck_{k}/damping_{k}))"
    yield "speed", "slips_1 - slips_2"
    yield "pull_1", "max(0, stuck_1 - soft_1*speed)"
    yield "pull_2", "max(0, stuck_2 + soft_2*speed)"
    yield "loss", "(pull_1 - pull_2)*speed"


SLIP = tuple(_slip_formulas())
"""Slip, tensions and loss by the tensions of a rope that sticks, without a search for the corners of these laws."""


@element
class RopeSlip(Controller):
    """Slip of an elastic rope around a pulley: by Euler and Eytelwein one tension is at most exp(mu wrap) the other.

    Each side is a spring and a damper in parallel: its tension is k e + c edot while its stretch e and this are
    positive. As the rope slips by s towards side 1, e_1 = stretch_1 - s and e_2 = stretch_2 + s; the rate of s is zero
    within the cone, and else the one that puts the tensions on it,

        T_1 - c_1 s' = exp(mu wrap) (T_2 + c_2 s'),

    or, where that would leave no tension, the one that makes T_1 zero. So for side 2.

    Notes
    -----
    Signals: ``tension_1``, ``tension_2`` [N], ``wrap`` [rad], and the ``rate`` of the slip [m/s], relative to the
    surface of the pulley. States: the ``slip`` [m], and the ``heat`` [J] of friction since the start.
    """

    friction: Law
    turned: Law
    middle: Law
    stretch_1: Law
    stretch_2: Law
    rate_1: Law
    rate_2: Law
    stiffness_1: Law
    stiffness_2: Law
    damping_1: Law
    damping_2: Law

    in_files: ClassVar[bool] = False

    @property
    def output_names(self) -> tuple[str, ...]:
        """Return both tensions."""
        return ("tension_1", "tension_2")

    def given(self) -> dict[str, Any]:
        """Return its laws."""
        sides = (f"{name}_{k}" for name in ("stretch", "rate", "stiffness", "damping") for k in (1, 2))
        return {k: getattr(self, k) for k in ("friction", "turned", "middle", *sides)}

    def derived(self, name: str, wiring: Any) -> SyntaxNode | None:
        """Return a formula of `SLIP` after those that it uses, each of which is computed once."""
        if not name.startswith(SOLVED):
            return None
        trees: list[SyntaxNode] = []
        known: dict[str, SyntaxNode] = {}
        for key, text in SLIP:
            trees.append(_placed(wiring.template(self, text), known))
            known[key] = SyntaxNode(DEFINED, (), len(known))
            if key == name.removeprefix(SOLVED):
                break
        return SyntaxNode(DEFINITIONS, (*trees, SyntaxNode(DEFINED, (), len(known) - 1)))

    def signals(self) -> dict[str, str]:
        """Return tensions, wrap and rate of slip."""
        solved = {"tension_1": "pull_1", "tension_2": "pull_2", "wrap": "around", "rate": "speed"}
        return {k: f"{SOLVED}{name}" for k, name in solved.items()}

    def signal_units(self) -> dict[str, str]:
        """Return the units."""
        return {"tension_1": "N", "tension_2": "N", "wrap": "rad", "rate": "m/s", "slip": "m", "heat": "J"}

    def states(self, n: SimpleNamespace) -> tuple[ControlState, ...]:
        """Return slip and heat."""
        return (ControlState("slip", "rate"), ControlState("heat", f"{SOLVED}loss"))


def _placed(tree: SyntaxNode, known: Mapping[str, SyntaxNode]) -> SyntaxNode:
    """Return a tree with uses of definitions in place of their names."""
    if tree.kind == "name":
        return known.get(tree.value, tree)
    return tree.with_args(tuple(_placed(x, known) for x in tree.args))
