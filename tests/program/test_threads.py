"""Dense algebra of analyses runs on one thread, whatever the process is set to, and the setting is left as it was."""

import threading
from functools import cache

import pytest
from threadpoolctl import ThreadpoolController

import flyball as fb

TWO = 2


@cache
def libraries() -> ThreadpoolController:
    """All loaded libraries of dense algebra; it takes a while to find them."""
    import scipy.linalg  # noqa: F401

    return ThreadpoolController().select(user_api="blas")


def threads() -> set[int]:
    """Of all libraries."""
    return {x.num_threads for x in libraries().lib_controllers}


@pytest.fixture
def two() -> object:
    """A process that is set to two threads."""
    threads()
    with ThreadpoolController().limit(limits=TWO, user_api="blas"):
        if threads() != {TWO}:
            pytest.skip("this library has no threads that can be set")
        yield


def falling(seen: list[set[int]]) -> fb.Mechanism:
    """A pendulum under a force that looks how many there are."""

    def force(t: float) -> float:
        seen.append(threads())
        return 0.0

    m = fb.Mechanism("pendulum", planar=True, gravity=(0, -10))
    m.add(fb.Body("rod", mass=1, inertia=0.1, position=(0, -1)), fb.Revolute("A", "ground", "rod", at=(0, 0)))
    m.add(fb.PointForce("push", "rod", at=(0, -1), force=(force, 0)))
    return m


def test_an_analysis_has_one_thread_and_gives_back_what_there_were(two):
    seen: list[set[int]] = []
    falling(seen).simulate(0.01)
    assert set.union(*seen) == {1}
    assert threads() == {TWO}
    with pytest.raises(fb.ModelError):
        falling(seen).simulate(0.01, method="none")
    assert threads() == {TWO}


def test_other_threads_of_python_leave_the_setting_alone(two):
    """It is one of the process: two that change it at a time would set it back to what the other has set."""
    seen: list[set[int]] = []
    beside = threading.Thread(target=lambda: falling(seen).simulate(0.01))
    beside.start()
    beside.join()
    assert set.union(*seen) == {TWO}
    assert threads() == {TWO}
