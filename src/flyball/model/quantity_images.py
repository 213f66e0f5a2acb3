"""The quantities of a part that was moved, turned or reflected, in terms of those of the original part.

A coordinate of the image is that of the original, or its negative, plus a constant; if it is neither, it has no image.
The
formulas of coordinates themselves are evaluated to find out.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from .geometry import rotation_about
from .joint import FLOATING, Coordinate, Joint, Primitive, WorldFrame
from .placement import AXES, Placement, Written, scaled, total
from .quantities import Quantity

PLANAR_TURNING = ("omega", "alpha", "angular_velocity", "angular_acceleration")
PLANAR_TURNING = ("omega", "alpha", "angular_velocity", "angular_acceleration")
FLOATING_IN_PLANE = (Primitive("P", "x"), Primitive("P", "y"), Primitive("R", "z"))
ROUNDING = 1e-9  # differences of values [m] or [rad] below which they count as equal


class Image(NamedTuple):
    """A quantity of the image: its name, and its value as ``sign`` times that of the original plus ``shift``."""

    name: str
    sign: float = 1.0
    shift: Written = 0.0

    @property
    def same(self) -> bool:
        """Return whether the values are equal."""
        return self.sign == 1.0 and self.shift == 0.0

    def original(self) -> str:
        """Return the value of the original as a formula of the image's name."""
        if self.same:
            return self.name
        if self.shift == 0.0:
            return f"(-{self.name})"
        return f"({total(scaled(self.sign, self.name), scaled(-self.sign, self.shift))})"

    def of_value(self, value: Written) -> Written:
        """Return the image's value for one of the original."""
        return total(scaled(self.sign, value), self.shift)


def _value(c: Coordinate, M: WorldFrame) -> float:
    """Return the value of a coordinate, up to a constant and whole turns, for a pose of M in F."""
    frames = {"F": (np.zeros(3), np.eye(3)), "M": M}
    ends = []
    for (p, R), turn in zip((frames[k] for k in c.frames), (c.turn_F, c.turn_M), strict=True):
        R = R @ np.array(turn) if turn else R
        ends.append((tuple(p.tolist()), tuple(R.ravel().tolist()), *((0.0, 0.0, 0.0),) * 4))
    return c.sign * float(c.row.of_kind.row((*c.row.par[:6], 0.0, 1.0), *ends, 0.0, ())[0])


def _poses(chain: Sequence[Primitive], rest: np.ndarray) -> list[WorldFrame]:
    """Return some poses of M in F that the free motions of a chain reach."""
    out = []
    for amounts in ((0.0, 0.0, 0.0), (0.2, -0.1, 0.3), (-0.1, 0.3, -0.2), (0.3, 0.2, 0.1)):
        p, R = np.zeros(3), np.eye(3)
        for k, step in enumerate(chain):
            axis = AXES.index(step.axis)
            if step.kind == "P":
                p = p + amounts[k % 3] * R[:, axis]
            elif step.kind == "R":
                R = R @ rotation_about(axis, amounts[k % 3])
            else:
                R = R @ rotation_about(0, amounts[0]) @ rotation_about(1, amounts[1]) @ rotation_about(2, amounts[2])
        out.append((p, R @ rest))
    return out


def coordinate_image(
    coordinates: Mapping[str, Coordinate],
    what: str,
    image: Callable[[WorldFrame], WorldFrame],
    chain: Sequence[Primitive],
    rest: np.ndarray,
) -> Image | None:
    """Return the image of a coordinate, one of the same part; None if there is none.

    Parameters
    ----------
    coordinates : mapping
        All coordinates of the part.
    what : str
        Name of the coordinate.
    image : function
        The pose of M in F of the image for one of the original.
    chain : sequence of Primitive
        The free motions of M in F.
    rest : (3, 3)
        Axes of M in F in the reference configuration.
    """
    poses = _poses(chain, rest)
    old = np.array([_value(coordinates[what], M) for M in poses])
    alike = [
        k for k, c in coordinates.items() if c.unit == coordinates[what].unit and k != what and not c.row.of_kind.place
    ]
    for name, sign in itertools.product([what, *alike], (1.0, -1.0)):
        shift = np.array([_value(coordinates[name], image(M)) for M in poses]) - sign * old
        if coordinates[what].unit == "rad":
            shift = np.arctan2(np.sin(shift), np.cos(shift))
        if np.abs(shift - shift[0]).max() < ROUNDING:
            return Image(name, sign, 0.0 if abs(shift[0]) < ROUNDING else float(shift[0]))
    return None


def component_image(names: Mapping[int, str], component: int, matrix: np.ndarray) -> Image | None:
    """Return the image of a component of a vector; None if several components of the image make it up."""
    row = next((k for k in names if abs(abs(matrix[k, component]) - 1.0) < ROUNDING), None)
    return None if row is None else Image(names[row], float(np.sign(matrix[row, component])))


def located_image(what: str, table: Mapping[str, Quantity], part: Any, place: Placement, planar: bool) -> Image | None:
    """Return the image of a quantity of a body or frame, whose components are along the world's axes."""
    own = part.measured(planar)
    base = what.removesuffix("_rate")
    if what in own or base in own:
        chain = FLOATING_IN_PLANE if planar else FLOATING
        found = coordinate_image(
            own, base, lambda M: (place.polar @ M[0], place.polar @ M[1] @ place.reflection), chain, np.eye(3)
        )
        if found is None or base != what:
            return found and Image(f"{found.name}_rate", found.sign)
        return found._replace(shift=place.translation[AXES.index(found.name)]) if found.name in AXES else found
    component = table[what].component
    if component is None:  # in the plane
        return Image(what, place.sign) if what in PLANAR_TURNING else None
    of = table[what].of
    names = {q.component: k for k, q in table.items() if q.of == of and q.component is not None}
    return component_image(names, component, place.axial if of.startswith("angular") else place.polar)


def joint_image(
    what: str, e: Joint, frames: tuple[np.ndarray, np.ndarray], planar: bool, rest: np.ndarray
) -> Image | None:
    """Return the image of a coordinate of a joint, its rate or its acceleration.

    Parameters
    ----------
    what : str
    e : Joint
    frames : two (3, 3)
        For F and M, the components along the image's frame of a vector whose image has them along the original's.
    planar : bool
    rest : (3, 3)
        Axes of M in F in the reference configuration.
    """
    own = e.measured(planar)
    base = what.removesuffix("_rate").removesuffix("_acceleration")
    suffix = what[len(base) :]
    if base in ("rate", "acceleration") and len(own) == 1:
        base, suffix = next(iter(own)), f"_{base}"
    if base not in own:
        return None
    if own[base].row.of_kind.place:  # the arc length along a curve, of which the image has the same
        return Image(what)
    f, m = frames
    found = coordinate_image(own, base, lambda M: (f @ M[0], f @ M[1] @ m.T), e.primitives(planar), rest)
    return found and found._replace(name=what if found.name == base else f"{found.name}{suffix}", shift=0.0)
