"""A hexapod with 40 postures: forward kinematics of a Stewart-Gough platform by all ways of assembling it.

Six legs of given lengths between a base and a platform leave no freedom, but many postures. Of a general geometry there
are at most 40; P. Dietmaier (*The Stewart-Gough platform of general geometry can have 40 real postures*, Advances in
Robot Kinematics, 1998) found one for which all 40 are real. `p.inverse_kinematics` without a pose finds configurations
in which the loops close. `mechanism` hangs in one of them, on five legs and a spring in place of the first.

Run it with ``python examples/hexapod_postures.py out``: it lists the postures, the lengths that the legs have in the
first (inverse kinematics), and writes a page with the animation into the folder.
"""

import sys
from pathlib import Path

import numpy as np

import flyball as fb

# hinges of the six legs on the base, and on the platform in its own axes; lengths of the legs
BASE = np.array([
    (0.0, 0.0, 0.0), (1.107915, 0.0, 0.0), (0.549094, 0.756063, 0.0),
    (0.735077, -0.223935, 0.525991), (0.514188, -0.526063, -0.368418), (0.590473, 0.094733, -0.205018),
])  # fmt: skip
PLATFORM = np.array([
    (0.0, 0.0, 0.0), (0.542805, 0.0, 0.0), (0.956919, -0.528915, 0.0),
    (0.665885, -0.353482, 1.402538), (0.478359, 1.158742, 0.107672), (-0.137087, -0.235121, 0.353913),
])  # fmt: skip
LENGTHS = (1.0, 0.645275, 1.086284, 1.503439, 1.281933, 0.771071)
# a posture of the list in the demo "stewgou40" of PHCpack (J. Verschelde): origin, x axis and y axis of the platform
ORIGIN = np.array([0.863325713770891, 0.00564402867997359, -0.504615553547690])
X_AXIS = np.array([0.191288333012351, 0.943756501770663, 0.269689523376340])
Y_AXIS = np.array([-0.727039337601767, -0.0483533608080227, 0.684891052707037])


def platform(position: np.ndarray, quaternion: np.ndarray) -> fb.Body:
    """The platform: thin rods from its first hinge to the others."""
    rods = tuple(fb.Rod(start=(0, 0, 0), end=tuple(x), radius=0.012, looks=True) for x in PLATFORM[1:].tolist())
    pose = {"position": tuple(position.tolist()), "orientation": tuple(quaternion.tolist())}
    return fb.Body("platform", mass=1, inertia=(0.2, 0.2, 0.2), shape=rods, color="#e5862b", **pose)


def hexapod(position: np.ndarray, quaternion: np.ndarray) -> fb.Mechanism:
    """The platform on massless legs of constant length, drawn in some pose."""
    m = fb.Mechanism("hexapod", parameters={f"L{k + 1}": x for k, x in enumerate(LENGTHS)})
    m.add(platform(position, quaternion))
    for k in range(6):
        m.add(fb.Frame(f"base_{k + 1}", "ground", position=tuple(BASE[k].tolist())))
        m.add(fb.Frame(f"hinge_{k + 1}", "platform", position=tuple(PLATFORM[k].tolist())))
        m.add(fb.Distance(f"leg_{k + 1}", f"base_{k + 1}", f"hinge_{k + 1}", length=f"L{k + 1}"))
    return m


def postures(starts: int = 3000) -> np.ndarray:
    """Position (3) and quaternion (4) of the platform in every posture, (n, 7)."""
    drawn = hexapod(np.array([0.1, 0.2, 0.9]), np.array([1.0, 0.0, 0.0, 0.0]))  # beside all of them
    p = drawn.prepare(coordinates="absolute")
    return p.inverse_kinematics("platform", starts=starts).q


def lengths(posture: np.ndarray) -> np.ndarray:
    """Lengths of the legs in a posture: inverse kinematics, in closed form."""
    R = fb.rotations.matrix(posture[3:])
    return np.linalg.norm(posture[:3] + PLATFORM @ R.T - BASE, axis=1)


def mechanism() -> fb.Mechanism:
    """The platform in a posture under its weight, with a spring and a damper in place of the first leg."""
    m = hexapod(ORIGIN, fb.rotations.quaternion(np.column_stack([X_AXIS, Y_AXIS, np.cross(X_AXIS, Y_AXIS)])))
    m = m.changed({"leg_1": None})
    m.gravity = (0, 0, -9.81)
    m.add(fb.SpringDamper("spring", "base_1", "hinge_1", length="L1", stiffness=200, damping=3))
    return m


if __name__ == "__main__":
    folder = Path(sys.argv[1] if len(sys.argv) > 1 else "out")
    folder.mkdir(parents=True, exist_ok=True)
    found = postures()
    print(f"{len(found)} postures")
    for posture in found:
        print(" ".join(f"{x:9.6f}" for x in posture))
    print("lengths:", lengths(found[0]).round(6))
    mechanism().simulate(4, outputs=201).to_html(folder / "hexapod_postures.html")
