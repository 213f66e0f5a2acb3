"""Of processes that need the same kernel at once one compiles it."""

import multiprocessing
import os
import signal
import subprocess
import sys
import time
from concurrent.futures import ThreadPoolExecutor

import pytest

from flyball.compiler import turns
from flyball.compiler.turns import Turn
from tests.program.copied import Copy

pytestmark = pytest.mark.skipif(turns.fcntl is None, reason="this system has no such locks")

HOLD = """
import sys, time
from flyball.compiler.turns import Turn
turn = Turn(sys.argv[1])
print(turn.take(), flush=True)
time.sleep(600)
"""


@pytest.fixture
def holder(tmp_path):
    """A process that has the turn of a path until it is killed."""
    path = tmp_path / "x.turn"
    process = subprocess.Popen([sys.executable, "-c", HOLD, path], stdout=subprocess.PIPE, text=True)
    assert process.stdout.readline() == "False\n"
    yield path, process
    process.kill()
    process.wait()
    process.stdout.close()


def test_a_turn_ends_with_the_process_that_has_it(holder):
    path, process = holder
    os.kill(process.pid, signal.SIGKILL)
    turn = Turn(path)
    begun = time.monotonic()
    turn.take()
    assert time.monotonic() - begun < turns.PATIENCE / 10
    assert not turn.take(), "nobody has it any more"
    turn.give()


def test_nobody_waits_for_ever(holder, monkeypatch):
    path, process = holder
    monkeypatch.setattr(turns, "PATIENCE", 0.1)
    turn = Turn(path)
    assert turn.take(), "somebody has it, and goes on with it"
    assert process.poll() is None
    turn.give()


def test_where_files_cannot_be_locked_there_are_no_turns(tmp_path, monkeypatch):
    one, other = (Turn(tmp_path / "nowhere" / "x.turn") for _ in range(2))
    assert not one.take()
    assert not other.take()

    def refused(file, how):
        raise OSError(95, "Operation not supported")

    monkeypatch.setattr(turns.fcntl, "flock", refused)
    one, other = (Turn(tmp_path / "x.turn") for _ in range(2))
    assert not one.take()
    assert not other.take()
    one.give(), other.give()
    monkeypatch.setattr(turns, "fcntl", None)
    assert not one.take()


@pytest.mark.skipif("fork" not in multiprocessing.get_all_start_methods(), reason="this system has no fork")
def test_a_fork_does_not_keep_the_turn(tmp_path):
    """It has the file open as well."""
    turn, other = Turn(tmp_path / "x.turn"), Turn(tmp_path / "x.turn")
    turn.take()
    go_on, ended = os.pipe()
    child = os.fork()
    if child == 0:
        os.close(ended)
        os.read(go_on, 1)
        os._exit(0)
    turn.give()
    assert not other.take()
    other.give()
    os.close(ended)
    os.close(go_on)
    os.waitpid(child, 0)


SMALL = """
import time
import numpy as np
from flyball.numerics.ldl import analyse, factor_kernel
P, _ = analyse(1, np.zeros(0, int), np.zeros(0, int))
L, D, Y = np.zeros(len(P.Li)), np.zeros(1), np.zeros(1)
args = P, np.full(len(P.Ai) + 1, 4.0), L, D, Y
{}
factor_kernel(*args)
print(json.dumps(cache_counts() | {{"inverse": D[0]}}))
"""
SLOW = """
from numba.core.dispatcher import _FunctionCompiler
compiled = _FunctionCompiler.compile
def slowly(*given):
    open({mark!r}, "w").close()
    time.sleep(2.0)
    return compiled(*given)
compiler = factor_kernel.dispatcher._compiler
compiler.compile = lambda *given: slowly(compiler, *given)
"""


@pytest.fixture(scope="module")
def package(tmp_path_factory):
    return Copy(tmp_path_factory.mktemp("copied"))


def together(copy, first, second, mark):
    """What the second of two processes says, which begins when the first compiles, and the first one's future."""
    with ThreadPoolExecutor(2) as pool:
        one = pool.submit(copy.run, SMALL.format(first))
        until = time.monotonic() + 120.0
        while not mark.exists() and not one.done() and time.monotonic() < until:
            time.sleep(0.02)
        return copy.run(SMALL.format(second)), one


def test_the_second_takes_what_the_first_has_compiled(package, tmp_path):
    copy, mark = package.with_cache(tmp_path), tmp_path / "compiles"
    second, one = together(copy, SLOW.format(mark=str(mark)), "", mark)
    first = one.result()
    assert mark.exists()
    assert (first["misses"], first["hits"]) == (1, 0)
    assert (second["misses"], second["hits"]) == (0, 1)
    assert first["inverse"] == second["inverse"] == 0.25


def test_one_that_ends_while_it_compiles_leaves_it_to_the_next(package, tmp_path):
    copy, mark = package.with_cache(tmp_path), tmp_path / "compiles"
    dies = SLOW.format(mark=str(mark)).replace("time.sleep(2.0)", "sys.modules['os']._exit(1)")
    second, one = together(copy, dies, "", mark)
    with pytest.raises(AssertionError):
        one.result()
    assert (second["misses"], second["inverse"]) == (1, 0.25)
