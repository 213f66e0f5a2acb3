"""The 24 sequences of Euler angles by name, and where each is singular."""

from __future__ import annotations

from itertools import product
from typing import NamedTuple

import numpy as np

from ..errors import ModelError

INTRINSIC = tuple("".join(s) for s in product("XYZ", repeat=3) if s[0] != s[1] != s[2])
EXTRINSIC = tuple(s.lower() for s in INTRINSIC)


class Sequence(NamedTuple):
    """A sequence of turns, put in the order of the intrinsic one that gives the same rotation."""

    name: str
    axes: tuple[int, int, int]
    extrinsic: bool  # the angles come in the reverse order of the axes

    @property
    def proper(self) -> bool:
        """Whether the first and the last axis are the same (ZXZ), not three different ones (XYZ)."""
        return self.axes[0] == self.axes[2]

    @property
    def parity(self) -> int:
        """1 if the first two axes and the remaining one are right-handed in this order, else -1."""
        return 1 if (self.axes[1] - self.axes[0]) % 3 == 1 else -1

    def ordered(self, angles: np.ndarray) -> np.ndarray:
        """Angles (or anything along the last axis) from the user's order to that of the axes, or back."""
        return angles[..., ::-1] if self.extrinsic else angles


def _read(name: str) -> Sequence:
    i, j, k = ("XYZ".index(c) for c in name.upper())
    return Sequence(name, (i, j, k) if name.isupper() else (k, j, i), name.islower())


_ALL = {name: _read(name) for name in INTRINSIC + EXTRINSIC}


def find(name: str) -> Sequence:
    """Read the name of a sequence.

    Raises
    ------
    ModelError
        If there is no such sequence.
    """
    if isinstance(name, str) and name in _ALL:
        return _ALL[name]
    rule = "three letters, neighbours different"
    if isinstance(name, str) and name.upper() in INTRINSIC:
        rule = "either all upper case or all lower case"
    raise ModelError(
        f"there is no sequence of Euler angles {name!r}: it takes {rule}; upper case for turns about the moving axes "
        f"({', '.join(INTRINSIC)}), lower case for turns about the fixed ones"
    )


def singular_angles(sequence: str = "XYZ") -> tuple[float, float]:
    """Middle angles [rad] at which a sequence is singular: 0 and pi if its outer axes are the same, else -+ pi/2.

    There the first and the last turn happen about one line. Only their sum or difference is determined by the
    orientation, and no finite rates of the angles give an angular velocity along the line across all three axes.

    Raises
    ------
    ModelError
        If there is no such sequence.
    """
    return (0.0, np.pi) if find(sequence).proper else (-np.pi / 2, np.pi / 2)
