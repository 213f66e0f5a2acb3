"""Robots from URDF: recursive dynamics beside Pinocchio, agreement at random states and time at many.

Usage: ``python benchmarks/pinocchio_batches.py FILE.urdf [...] [--floating FILE.urdf [...]] [--states N]``. Files come,
for instance, with the package example-robot-data. Agreement is relative to the largest entry, over 100 states; times
are microseconds of CPU for each state of 10,000 in one thread, Pinocchio called once for each from Python. Joints that
follow others (mimic) are free in both.
"""

from __future__ import annotations

import argparse
import time
import warnings
from collections.abc import Callable
from typing import Any

import numpy as np
import pinocchio as pin

import flyball as fb

Array = np.ndarray
STATES = 100
METHODS = ("rnea", "aba", "rnea_derivatives", "aba_derivatives")


class Pair:
    """One robot in both programs, and the map between their velocities: theirs = T(q) ours."""

    def __init__(self, path: str, floating: bool) -> None:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", fb.ModelWarning)
            m = fb.load(path, floating=floating)
        m = m.changed({c.name: None for c in m.couplings}) if m.couplings else m
        self.p, self.special = (m.prepare(coordinates="joint", specialize=x) for x in (False, True))
        root = (pin.JointModelFreeFlyer(),) if floating else ()
        self.model = pin.buildModelFromUrdf(path, *root)
        self.model.gravity.linear = np.array(m.gravity, float)
        self.data = self.model.createData()
        self.first = 6 if floating else 0  # of the joints' velocities
        self.convention = self.p.convention("pinocchio", joints=list(self.model.names)[2 if floating else 1 :])

    def state(self, rng: np.random.Generator) -> tuple[Array, ...]:
        """Random q, v, a of ours."""
        n = len(self.p.v)
        shift = np.zeros(n)
        shift[: self.first] = rng.normal(size=self.first)
        q = self.p.step(self.p.q, shift)
        q[len(q) - n + self.first :] = rng.uniform(-1.0, 1.0, n - self.first)
        return q, *rng.normal(size=(2, n))

    def theirs(self, q: Array, v: Array, a: Array) -> tuple[Array, Array, Array, Array]:
        """Their q, v, a, and T."""
        Q, V, A = self.convention.from_flyball(q, v, a)
        return Q, V, A, self.convention.velocity_matrix(q)


def agreement(x: Pair, states: int) -> dict[str, float]:
    """Largest differences, relative to the largest entry."""
    rng, worst = np.random.default_rng(0), dict[str, float]()

    def compare(name: str, mine: Array, theirs: Array) -> None:
        worst[name] = max(worst.get(name, 0.0), float(abs(mine - theirs).max() / abs(theirs).max()))

    for _ in range(states):
        q, v, a = x.state(rng)
        Q, V, A, T = x.theirs(q, v, a)
        tau = pin.rnea(x.model, x.data, Q, V, A)
        M = np.triu(pin.crba(x.model, x.data, Q))
        M = M + np.triu(M, 1).T
        for p in (x.p, x.special):
            compare("rnea", p.rnea(q, v, a), T.T @ tau)
            compare("crba", p.crba(q), T.T @ M @ T)
            compare("aba", p.aba(q, v, T.T @ tau), a)
            if not x.first:  # the base's velocities differ, and so do derivatives along them
                pin.computeRNEADerivatives(x.model, x.data, Q, V, A)
                for name, mine, theirs in zip(("dtau/dq", "dtau/dv"), p.rnea_derivatives(q, v, a),
                                              (x.data.dtau_dq, x.data.dtau_dv), strict=False):  # fmt: skip
                    compare(name, T @ mine @ T.T, theirs)
                pin.computeABADerivatives(x.model, x.data, Q, V, tau)
                for name, mine, theirs in zip(("da/dq", "da/dv"), p.aba_derivatives(q, v, T.T @ tau),
                                              (x.data.ddq_dq, x.data.ddq_dv), strict=False):  # fmt: skip
                    compare(name, T @ mine @ T.T, theirs)
        pin.framesForwardKinematics(x.model, x.data, Q)
        pin.computeJointJacobians(x.model, x.data, Q)
        name = next(f.name for f in reversed(x.model.frames) if f.name in x.p.model)
        frame = x.model.getFrameId(name)
        compare("position", x.p.pose(name, q)[0], x.data.oMf[frame].translation)
        theirs = pin.getFrameJacobian(x.model, x.data, frame, pin.LOCAL_WORLD_ALIGNED)
        compare("Jacobian", x.p.frame_jacobian(name, q), theirs @ T)
    return worst


def microseconds(call: Callable[[], Any], states: int) -> float:
    """CPU time of a call for each state; the least of three."""
    times = []
    for _ in range(3):
        begin = time.process_time()
        call()
        times.append(time.process_time() - begin)
    return min(times) / states * 1e6


def times(x: Pair, states: int) -> None:
    """Print times and ratios."""
    rng = np.random.default_rng(1)
    q, v, a = (np.array(y) for y in zip(*(x.state(rng) for _ in range(states)), strict=True))
    Q, V, A = (np.array(y) for y in zip(*(x.theirs(*y)[:3] for y in zip(q, v, a, strict=True)), strict=True))
    calls = {"rnea": pin.rnea, "aba": pin.aba, "rnea_derivatives": pin.computeRNEADerivatives,
             "aba_derivatives": pin.computeABADerivatives}  # fmt: skip
    for name in METHODS:
        found = []
        for p in (x.p, x.special):
            method = getattr(p, name)
            out = method(q, v, a)
            found.append(microseconds(lambda f=method, o=out: f(q, v, a, out=o), states))
        theirs = microseconds(lambda f=calls[name]: [f(x.model, x.data, *y) for y in zip(Q, V, A, strict=True)], states)
        print(f"  {name:<18}{found[0]:>8.2f}{found[1]:>8.2f}{theirs:>8.2f}   {theirs / min(found):.1f} times")


def main() -> None:
    """Compare all files."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("fixed", nargs="*")
    parser.add_argument("--floating", nargs="*", default=[])
    parser.add_argument("--states", type=int, default=10_000)
    given = parser.parse_args()
    for path, floating in [(x, False) for x in given.fixed] + [(x, True) for x in given.floating]:
        x = Pair(path, floating)
        worst = ", ".join(f"{k} {e:.0e}" for k, e in agreement(x, STATES).items())
        print(f"{x.model.name}, {x.model.nv} velocities: {worst}")
        print(f"  {'us for each state':<18}{'general':>8}{'special':>8}{'pin':>8}")
        times(x, given.states)


if __name__ == "__main__":
    main()
