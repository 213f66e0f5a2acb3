"""Sensitivities of motions against plain runs, and against finite differences of such runs at the same tolerance.

CPU time, warm. ``kernel``: the compiled loops alone, of one run and of a run with its changes; ``a parameter`` is what
each parameter adds, in plain runs. ``whole call``: `m.sensitivity` against as many `m.simulate` as forward differences
take, one more than there are parameters, each with parameters of its own; what central differences take is twice that.
Errors are those of the quantities at the end, as parts of the largest derivative of each, against rtol = 1e-12; the
differences' steps are the best of three. Usage: ``python sensitivity.py``.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import timing  # isort: skip  (before numpy: it fixes the thread counts)
import contest
import numpy as np

import flyball as fb
from flyball.derivatives.equation_derivatives import EquationDerivatives, MechanismState, values_with_complex_step
from flyball.engine.entry_point import INTEGRATE
from flyball.numerics.integrators.butcher_tableaux import tableau
from flyball.sensitivity.parameter_derivatives import (
    ConstrainedSystem,
    ParameterDirection,
    changes_in_motion_coordinates,
    initial_changes,
    parameter_scale,
)
from flyball.sensitivity.variational_equations import VariationalIntegration
from flyball.simulation.initial_state import find_initial_state
from flyball.simulation.integration_options import default_integration
from flyball.simulation.simulate import clock_for, run_compiled_loop
from mechanisms import example

RTOL, ATOL = 1e-9, 1e-11
STEPS = (1e-3, 1e-4, 1e-5)  # of the parameters
COLUMNS = {
    "what": "what",
    "parameters": "parameters",
    "steps": "steps",
    "plain": "kernel [ms]",
    "each": "a parameter",
    "call": "whole call",
    "forward": "error",
    "error": "of differences",
}


def chain(n: int) -> fb.Mechanism:
    """A pendulum chain let go from the horizontal."""
    p = {"m": 1.0, "l": 0.1, "g": 9.81, "J": 1e-3, "c": 1e-3}
    m = fb.Mechanism(f"chain of {n}", planar=True, gravity=(0, "-g"), parameters=p)
    before = "ground"
    for k in range(n):
        m.add(fb.Body(f"b{k}", mass="m", inertia="J", position=(f"{k + 0.5}*l", 0)))
        m.add(fb.Revolute(f"J{k}", before, f"b{k}", at=(f"{k}*l", 0)))
        m.add(fb.TorsionalSpringDamper(f"d{k}", joint=f"J{k}", damping="c"))
        before = f"b{k}"
    return m


def bricard() -> fb.Mechanism:
    """Bricard's mechanism with gravity and the masses of its five moving rods as parameters."""
    old = example("bricard.toml")
    masses = {f"m{k}": b.mass for k, b in enumerate(old.bodies)}
    m = fb.Mechanism(old.name, gravity=(0, 0, "-g"), parameters={"g": 9.81, **masses})
    m.add(*(replace(b, mass=name) for b, name in zip(old.bodies, masses, strict=True)), *old.joints)
    return m


def best(run: Callable[[], object], rounds: int = 3) -> float:
    """Least CPU seconds of some calls, after one that does not count."""
    run()
    return min(timing.cpu(run) for _ in range(rounds))


CASES = (
    ("andrews", 0.03, ("K1.angle", "K7.angle"), 10),
    ("governor", 0.2, ("slider.z", "energy.kinetic"), 4),
    ("bricard", 1.0, ("energy.kinetic",), 6),
    ("chain10", 1.0, ("b9.x", "b9.y"), 5),
    ("chain100", 0.2, ("b99.x", "b99.y"), 5),
)


def mechanism(name: str) -> fb.Mechanism:
    """The mechanism of a case."""
    if name.startswith("chain"):
        return chain(int(name[5:]))
    return bricard() if name == "bricard" else example(f"{name}.toml")


def kernels(m: fb.Mechanism, to: Sequence[str], t_end: float, coordinates: str) -> tuple[float, float, str]:
    """Seconds of the compiled loop of one run, of that with changes, and the steps of both."""
    m, times = m.snapshot(), np.array([0.0, t_end])
    o = default_integration(coordinates, RTOL, ATOL)
    start = find_initial_state(m, 0.0, None, None, coordinates)
    base, layer = start.base, start.assembly.compiled
    x = MechanismState.moving(base.compiled, 0.0, base.q, base.v)
    e = EquationDerivatives(x)
    directions = [ParameterDirection(e, name) for name in to]
    values = [d.values if layer is base.compiled else values_with_complex_step(layer, d.name) for d in directions]
    pairs = initial_changes(m, {}, base, x, directions, ConstrainedSystem(x))
    changes = [
        np.array(c)
        for c in zip(
            *(changes_in_motion_coordinates(start, *of) for of in zip(directions, values, pairs, strict=True)),
            strict=True,
        )
    ]
    loop = VariationalIntegration(
        start, clock_for(start, 0.0, t_end, times, o), values, [parameter_scale(m, {}, name) for name in to]
    )
    steps = []

    def plain() -> None:
        clock = clock_for(start, 0.0, t_end, times, o)
        run_compiled_loop(start.assembly, clock, tableau("dop853"), lambda fraction, note="": None, INTEGRATE)
        steps[:] = [int(clock.count.accepted)]

    def varied() -> None:
        loop.run(*changes)

    seconds = best(plain), best(varied)
    return *seconds, f"{steps[0]} / {int(loop.ended.count.accepted)}"


def differences(m: fb.Mechanism, to: Sequence[str], of: Sequence[str], t_end: float, h: float) -> np.ndarray:
    """Central differences at the end, (of, to)."""
    env = m.environment()
    out = []
    for name in to:
        size = parameter_scale(m, {}, name)
        sides = [
            m.simulate(t_end, outputs=2, rtol=RTOL, atol=ATOL, parameters={name: env[name] + s * h * size})
            for s in (1, -1)
        ]
        out.append([(sides[0].curve(k)[1][-1] - sides[1].curve(k)[1][-1]) / (2 * h * size) for k in of])
    return np.array(out).T


def row(name: str, t_end: float, of: Sequence[str], count: int, coordinates: str) -> dict[str, object]:
    """One case."""
    m = mechanism(name)
    to = list(m.environment())[:count]
    sizes = np.array([parameter_scale(m, {}, p) for p in to])
    plain, varied, steps = kernels(m, to, t_end, coordinates)
    asked = {"analysis": "motion", "t_end": t_end, "outputs": 2, "coordinates": coordinates}
    tried = [0]

    def once() -> None:
        tried[0] += 1
        value = m.environment()[to[0]] * (1.0 + 1e-7 * tried[0])
        r = m.simulate(t_end, outputs=2, rtol=RTOL, atol=ATOL, parameters={to[0]: value}, coordinates=coordinates)
        [r.curve(k) for k in of]

    def sens(rtol: float = RTOL) -> np.ndarray:
        return m.sensitivity(of, to, rtol=rtol, atol=rtol / 100, **asked).derivatives[-1] * sizes

    exact = sens(1e-12)
    largest = np.abs(exact).max(axis=1, keepdims=True)
    error = np.abs((sens() - exact) / largest).max()
    least = min(np.abs((differences(m, to, of, t_end, h) * sizes - exact) / largest).max() for h in STEPS)
    return {
        "what": f"{m.name}, {coordinates}",
        "parameters": len(to),
        "steps": steps,
        "plain": 1e3 * plain,
        "each": (varied / plain - 1.0) / len(to),
        "call": best(sens) / (best(once) * (len(to) + 1)),
        "forward": error,
        "error": least,
    }


def main() -> None:
    """Command line."""
    arguments = contest.parser(__doc__).parse_args()
    layers = ("joint", "absolute") if arguments.coordinates == "auto" else (arguments.coordinates,)
    rows = []
    for case in CASES:
        for coordinates in layers:
            rows.append(row(*case, coordinates))
            print(f"{rows[-1]['what']}: done", flush=True)
    print(timing.table(rows, COLUMNS))
    timing.write_json(arguments.json, rows)


if __name__ == "__main__":
    main()
