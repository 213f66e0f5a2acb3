"""Code made for a mechanism belongs to a process: what threads share, what is pickled, what others find on disk."""

from __future__ import annotations

import os
import pickle
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pytest

from flyball.simulation.initial_state import find_initial_state
from flyball.simulation.solver_switching import CodeSelection
from tests.mechanisms import four_bar

ROOT = Path(__file__).resolve().parents[2]
WISH = {"specialize": True, "progress": False, "outputs": 21}


def test_threads_share_it():
    """Each with scratch of its own: the same digits as one after the other."""
    m = four_bar()
    ends = [0.2 + 0.1 * k for k in range(8)]
    with ThreadPoolExecutor(4) as pool:
        together = list(pool.map(lambda t: m.simulate(t, **WISH), ends))
    for t, r in zip(ends, together, strict=True):
        alone = m.simulate(t, **WISH)
        assert np.array_equal(alone.q, r.q)
        assert np.array_equal(alone.vdot, r.vdot)


def test_results_are_pickled_without_it():
    r = four_bar().simulate(0.3, **WISH)
    again = pickle.loads(pickle.dumps(r))
    assert again.health.engine == r.health.engine
    assert np.array_equal(again.vdot, r.vdot)
    assert not again.values.system.flat.any()
    assert not r.values.system.flat.any()
    on = again.model.simulate(0.4, start=again, **WISH)
    assert on.health.success


def test_what_a_motion_runs_on_is_pickled_without_it():
    c = find_initial_state(four_bar().snapshot(), 0.0, None, None, "auto").assembly.compiled
    CodeSelection(c, True)
    assert c.system.flat.any()
    again = pickle.loads(pickle.dumps(c))
    assert not again.system.flat.any()
    assert again.generated is None
    assert not c.values.system.flat.any()


CODE = """
import sys
sys.path[:] = {path!r}
from flyball.simulation.solver_switching import CodeSelection
from flyball.simulation.initial_state import find_initial_state
from tests.mechanisms import four_bar
r = four_bar().simulate(0.3, specialize=True, progress=False, outputs=21)
print(r.health.engine)
print(repr(r.q[-1].tolist()))
"""


def test_other_processes_find_it_on_disk():
    """Two, one after the other: what this one has in memory may have left the disk since."""
    first, second = (_elsewhere() for _ in range(2))
    assert second[0] == "made for this mechanism: found on disk"
    assert first[1] == second[1] == repr(four_bar().simulate(0.3, **WISH).q[-1].tolist())


def _elsewhere() -> list[str]:
    said = subprocess.run(
        [sys.executable, "-c", CODE.format(path=[str(ROOT), *sys.path])], capture_output=True, text=True, timeout=120
    )
    return said.stdout.splitlines()


@pytest.mark.skipif(not hasattr(os, "fork"), reason="this system has no fork")
def test_a_fork_goes_on_with_it():
    m = four_bar()
    r = m.simulate(0.3, **WISH)
    read, write = os.pipe()
    child = os.fork()
    if child == 0:
        try:
            os.write(write, pickle.dumps(m.simulate(0.3, **WISH).q[-1]))
        finally:
            os._exit(0)
    os.close(write)
    with os.fdopen(read, "rb") as pipe:
        q = pickle.loads(pipe.read())
    os.waitpid(child, 0)
    assert np.array_equal(q, r.q[-1])
