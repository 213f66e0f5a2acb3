"""Andrews' squeezing mechanism for 0.03 s to 1e-5 rad in every angle at the end: flyball and others in one run.

Schiehlen, Multibody Systems Handbook (1990); problem II-13 of the Test Set for IVP Solvers. The end is that of an
80-bit extrapolation of the test set's equations; the test set's own digits differ by 2e-9.
SUNDIALS and SciPy have equations derived by hand (`peer_by_hand.py`), the others the mechanism.
Usage: ``python andrews.py [--target RAD]``.
"""

from __future__ import annotations

from functools import partial
from math import cos, sin
from typing import Any

import timing  # isort: skip  (before numpy: it fixes the thread counts)
import contest
import numpy as np
from contest import Contest, Flyball, Peer
from trees import planar_motion, planar_tree

from mechanisms import GROUND, Planar, example

T_END, TARGET, SAMPLES = 0.03, 1e-5, 500
# beta, theta, gamma, phi, delta, omega, epsilon
START = (
    *(-0.0617138900142764496358948458001, 0.0, 0.455279819163070380255912382449, 0.222668390165885884674473185609),
    *(0.487364979543842550225598953530, -0.222668390165885884674473185609, 1.23054744454982119249735015568),
)
END = (
    *(15.81077119515369977, -15.75637105841183032, 0.04082224011964573388, -0.5347301163420797179),
    *(0.5244099658799540657, 0.534730116342079718, 1.048080741041937871),
)
JOINTS = ("crank", "K1-K2", "B", "K5-K4", "A5", "K7-K6", "A7")  # of flyball's example, for these angles
MASS = (0.04325, 0.00365, 0.02373, 0.00706, 0.07050, 0.00706, 0.05498)
INERTIA = (2.194e-6, 4.410e-7, 5.255e-6, 5.667e-7, 1.169e-5, 5.667e-7, 1.912e-5)
A, B, C = (-0.06934, -0.00227), (-0.03635, 0.03273), (0.014, 0.072)
STIFFNESS, FREE, TORQUE = 4530.0, 0.07785, 0.033
ACCURACY = {"end_error": "end error [rad]"}

# module, setting, first number of steps
PEERS = (
    ("mujoco", "RK4, stiff", 1200),
    ("mujoco", "RK4, softer (4 steps)", 600),
    ("exudyn", "generalised-alpha 0.95", 8000),
    ("exudyn", "generalised-alpha 0.95, full Newton", 8000),
    ("exudyn", "generalised-alpha 0.7", 16000),
    ("exudyn", "trapezoidal, index 2", 4000),
    ("exudyn", "trapezoidal, index 2, full Newton", 4000),
)
BY_HAND = ("IDA", "CVODE, Adams", "DOP853")


def turned(angle: float, x: float, y: float, origin: tuple[float, float] = (0.0, 0.0)) -> tuple[float, float]:
    """A point given along axes that are turned."""
    return origin[0] + x * cos(angle) - y * sin(angle), origin[1] + x * sin(angle) + y * cos(angle)


def squeezer() -> Planar:
    """The seven bodies K1 to K7 in numbers, at rest, with the names of lengths that the literature gives them."""
    beta, theta, gamma, phi, delta, omega, epsilon = START
    angles = (beta, beta + theta, gamma, phi + delta, delta, omega + epsilon, epsilon)
    F = turned(beta, 0.007, 0.0)  # rr
    E = turned(angles[1], -0.028, 0.0, F)  # d
    H = turned(delta, 0.04, 0.0, A)  # zt
    K = turned(epsilon, 0.0, -0.04, A)  # u
    D = turned(gamma, 0.02, -0.018, B)  # sd, sc
    centres = (
        turned(beta, 0.00092, 0.0),  # ra
        turned(angles[1], -0.0115, 0.0, F),  # da
        turned(gamma, 0.01043, -0.01874, B),  # sb, sa
        turned(angles[3], 0.0, 0.01421 - 0.02, H),  # ea - e
        turned(delta, 0.02308, 0.00916, A),  # ta, tb
        turned(angles[5], 0.02 - 0.01421, 0.0, K),  # zf - fa
        turned(epsilon, -0.00449, -0.01228, A),  # ub, ua
    )

    def local(body: int, x: tuple[float, float]) -> tuple[float, float]:
        if body == GROUND:
            return x
        return turned(-angles[body], x[0] - centres[body][0], x[1] - centres[body][1])

    joints = ((GROUND, 0, (0.0, 0.0)), (0, 1, F), (GROUND, 2, B), (1, 2, E), (1, 3, E), (1, 5, E), (3, 4, H),
              (GROUND, 4, A), (5, 6, K), (GROUND, 6, A))  # fmt: skip
    hinges = tuple((i, local(i, x), j, local(j, x)) for i, j, x in joints)
    start = np.column_stack([np.array(centres), angles])
    spring = (GROUND, C, 2, local(2, D), STIFFNESS, FREE)
    return Planar("andrews", np.array(MASS), np.array(INERTIA), start, np.zeros((7, 3)), hinges, 0.0,
                  ((0, TORQUE),), (spring,))  # fmt: skip


def accuracy(end: np.ndarray) -> dict[str, float]:
    """Largest error of the seven angles at the end."""
    return {"end_error": float(np.abs(end - END).max())}


def angles(turned: np.ndarray) -> np.ndarray:
    """The seven angles at the end, from those of the bodies at all times."""
    k1, k2, k3, k4, k5, k6, k7 = np.unwrap(turned, axis=0)[-1]
    return np.array([k1, k2 - k1, k3, k4 - k5, k5, k6 - k7, k7])


def exudyn_end(p: Planar, setting: str, steps: float, samples: int) -> tuple[Any, float]:
    """Angles at the end."""
    from peer_exudyn import solve

    motion, seconds = solve(p, T_END, steps, setting, samples)
    return (None if motion is None else angles(motion[0][:, :, 2])), seconds


def mujoco_end(p: Planar, setting: str, steps: float, samples: int) -> tuple[Any, float]:
    """Angles at the end."""
    from peer_mujoco import solve

    tree = planar_tree(p)
    motion, seconds = solve(tree, T_END, steps, setting, samples)
    return (None if motion is None else angles(planar_motion(p, tree, motion)[0][:, :, 2])), seconds


def end_by_hand(setting: str, rtol: float, samples: int) -> tuple[Any, float]:
    """Angles at the end."""
    from peer_by_hand import solve

    motion, seconds = solve(np.array(START), T_END, rtol, setting, samples)
    return (None if motion is None else motion[-1, :7]), seconds


def main() -> None:
    """Command line."""
    parser = contest.parser(__doc__)
    parser.add_argument("--target", type=float, default=TARGET, help="largest error of an angle [rad] (1e-5)")
    arguments = parser.parse_args()
    one = Contest(f"andrews, {arguments.target:g}", T_END, accuracy, "end_error", arguments.target, SAMPLES)
    model, p = example("andrews.toml"), squeezer()

    def end(run: Any) -> np.ndarray:
        return np.array([run[name].angle[-1] for name in JOINTS])

    ours = [Flyball(model, end, method, arguments.coordinates) for method in ("rk45", "radau")]
    ways = (True, False, "auto")  # auto last: then there is code that was made before
    ours += [Flyball(model, end, "dop853", arguments.coordinates, specialize=way) for way in ways]
    ends = {"mujoco": mujoco_end, "exudyn": exudyn_end}
    peers = [Peer(name, setting, partial(ends[name], p, setting), first) for name, setting, first in PEERS]
    peers += [Peer("by hand", setting, partial(end_by_hand, setting), 1e-7) for setting in BY_HAND]
    rows = contest.run(one, ours, peers)
    print(contest.show(rows, ACCURACY))
    timing.write_json(arguments.json, rows)


if __name__ == "__main__":
    main()
