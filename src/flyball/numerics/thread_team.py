"""Threads that share the chunks of compiled loops.

A chunk is one call of a kernel with a task number. `call_chunks` makes such calls with consecutive tasks; any thread of
the team makes any of them, so kernels must give the same result in any order: chunks neither write what another chunk
of the same call reads or writes, nor depend on the number of threads. The calling thread takes chunks too, so that it
never waits for a thread that has not begun: on a processor with one core, or with other cores busy, it makes all calls
itself. It waits only for chunks that other threads have taken, and gives its core away after `SPINS` looks.

Threads of a team run within ``with team:``, which surrounds one call of compiled code. Between loops they look for
work `SPINS` times, then sleep for `SLEEP` microseconds between looks.

A team is an array of integers, in cache lines of eight: its own address, and seven places for addresses of kernels; the
ticket (number of the loop, number of its chunks, next chunk); the number of chunks made; whether to stop; and stored
calls (`formulas.store_call`).
"""

from __future__ import annotations

import ctypes
import os
import threading
from typing import Any

import numpy as np

from ..compiler.formulas import (
    STORED_CALL_WORDS,
    atomic_add,
    atomic_load,
    atomic_replace,
    atomic_store,
    formula,
    run_stored_call,
    store_call,
)
from ..compiler.kernels import kernel

OWN, TICKET, MADE, STOP, YIELD, SLEEPING, JOB = (8 * k for k in range(7))  # places in a team's array
WORD = 8  # bytes
SPINS = 20_000  # looks for work before sleeping: some 20 us
SLEEP = 50  # [us]
LOOP_SHIFT, COUNT_SHIFT, CHUNK_MASK = 32, 16, (1 << 16) - 1  # of the ticket: loop, number of chunks, next chunk


@formula
def take_chunk(team):
    """Take the next chunk of the present loop; -1 if none is left."""
    while True:
        ticket = atomic_load(team + WORD * TICKET)
        chunk = ticket & CHUNK_MASK
        if chunk >= (ticket >> COUNT_SHIFT) & CHUNK_MASK:
            return -1
        if atomic_replace(team + WORD * TICKET, ticket, ticket + 1):
            return chunk


@formula
def call_chunks(team, address, tables, first, count):
    """Call the kernel at ``address`` with structures and count tasks, beginning with first, on all threads of a team.

    Parameters
    ----------
    team : Int1
        See `new_team`.
    address : int
    tables : tuple of structures
    first, count : int
    """
    own = team[OWN]
    store_call(own + WORD * JOB, address, tables)
    team[JOB - 1] = first
    atomic_store(own + WORD * MADE, 0)
    loop = (atomic_load(own + WORD * TICKET) >> LOOP_SHIFT) + 1
    atomic_store(own + WORD * TICKET, loop << LOOP_SHIFT | count << COUNT_SHIFT)
    chunk = take_chunk(own)
    while chunk >= 0:
        run_stored_call(own + WORD * JOB, first + chunk)
        atomic_add(own + WORD * MADE, 1)
        chunk = take_chunk(own)
    looks = 0
    while atomic_load(own + WORD * MADE) < count:
        looks += 1
        if looks > SPINS:
            run_stored_call(own + WORD * YIELD, 0)


@kernel
def help_team(team: int) -> int:
    """Make chunks until the team at this address stops."""
    looks = 0
    while atomic_load(team + WORD * STOP) == 0:
        chunk = take_chunk(team)
        if chunk >= 0:
            run_stored_call(team + WORD * JOB, atomic_load(team + WORD * (JOB - 1)) + chunk)
            atomic_add(team + WORD * MADE, 1)
            looks = 0
        else:
            looks += 1
            if looks > SPINS:
                run_stored_call(team + WORD * SLEEPING, 0)
    return 0


def new_team() -> np.ndarray:
    """Create the memory of a team: without `HelperThreads`, the calling thread makes all chunks."""
    whole = np.zeros(JOB + STORED_CALL_WORDS + 8, np.int64)
    begin = -(whole.ctypes.data // WORD) % 8
    team = whole[begin : begin + JOB + STORED_CALL_WORDS]
    team[OWN] = team.ctypes.data
    team[YIELD], team[SLEEPING], team[SLEEPING + 2] = _waiting_functions()
    team[SLEEPING + 1] = 1  # argument
    return team


def _waiting_functions() -> tuple[int, int, int]:
    """Addresses of the system's functions that give the core away and that sleep, and the argument of the latter."""
    if os.name == "nt":
        library: Any = ctypes.WinDLL("kernel32")  # type: ignore[attr-defined]
        return _function_address(library.SwitchToThread), _function_address(library.Sleep), 1  # [ms]
    library = ctypes.CDLL(None)
    return _function_address(library.sched_yield), _function_address(library.usleep), SLEEP


def _function_address(function: Any) -> int:
    return int(ctypes.cast(function, ctypes.c_void_p).value or 0)


def _help(team: np.ndarray) -> None:
    """Run a helper; its frame keeps the memory of the team."""
    help_team.call(int(team[OWN]))


class HelperThreads:
    """The other threads of a team, running within ``with``.

    Parameters
    ----------
    team : ndarray
        See `new_team`.
    count : int
        Number of threads besides the calling one.
    """

    def __init__(self, team: np.ndarray, count: int) -> None:
        self.team, self.count = team, count
        self._threads: list[threading.Thread] = []

    def __enter__(self) -> None:
        """Start the threads."""
        self.team[STOP] = 0
        try:
            for _ in range(self.count):
                thread = threading.Thread(target=_help, args=(self.team,), daemon=True)
                self._threads.append(thread)
                thread.start()
        except BaseException:  # Ctrl-C too
            self.__exit__()
            raise

    def __exit__(self, *_: object) -> None:
        """Stop the threads."""
        self.team[STOP] = 1
        while self._threads:
            thread = self._threads[-1]
            if thread.ident is not None:
                thread.join()
            self._threads.pop()


def available_cores() -> int:
    """Number of cores that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def default_threads() -> int:
    """Number of threads of a computation: ``OMP_NUM_THREADS``, or the cores that this process may use.

    1 in a thread other than Python's main one: many such computations may run at once.
    """
    if threading.current_thread() is not threading.main_thread():
        return 1
    given = os.environ.get("OMP_NUM_THREADS", "").split(",")[0].strip()
    return max(1, int(given)) if given.isdecimal() else available_cores()
