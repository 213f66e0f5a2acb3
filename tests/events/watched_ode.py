"""The watched loop on equations of a test's own, run as plain Python: no mechanism, nothing compiled."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from flyball.numerics.event_location.event_steps import finish_step_with_events, start_event_segment
from flyball.numerics.event_location.guards import (
    EVENT_FOUND,
    START,
    GuardState,
    allocate_guard_state,
    predict_sensed,
)
from flyball.numerics.integrators import time_loop as ex
from flyball.numerics.integrators.butcher_tableaux import tableau
from flyball.numerics.integrators.explicit_runge_kutta import run_explicit_task
from flyball.numerics.integrators.time_loop import TRY_STEP, advance


class Equations(NamedTuple):
    """y'' = f(t, q, v) with y = (q, v), and guards g(t, q, v)."""

    f: Callable
    g: Callable
    latest: list  # time and state last evaluated


def derivative(t, y, dy, S, W):
    n = len(y) // 2
    dy[:n], dy[n:] = y[n:], S.f(t, y[:n], y[n:])
    S.latest[:] = [t, y.copy()]
    W.count.stage += 1
    for j in np.flatnonzero(W.compared_stages == W.count.stage):
        W.compared_values[j] = S.g(t, y[:n], y[n:])
    return 0


def arrive(t, y, dy, S, W):
    return derivative(t, y, dy, S, W), 0.0


def tangent(y, e, S, W):
    return None


def inspect(t, h, span, first, seen, S, W):
    return 0, 0.0, 0.0


def report(t, y, out, S, W):
    out[0], out[1:] = t, y
    return 0


def watch(t, y, S, W, out):
    S.latest[:] = [t, y.copy()]
    n = len(y) // 2
    out[:] = S.g(t, y[:n], y[n:])
    return 0


def note(S, W, end):
    t, y = S.latest
    n = len(y) // 2
    W.moving[end] = y[:n], y[n:], S.f(t, y[:n], y[n:])
    out = W.guards.start if end == START else W.guards.end
    out[:] = S.g(t, y[:n], y[n:])


def look(t, h, x, S, W, out):
    predict_sensed(W, x, h)
    out[:] = S.g(t + x * h, W.sensed[0, : W.moving.shape[2]], W.sensed[1, : W.moving.shape[2]])


def ask(own, S, W, R, c, task):
    if task == TRY_STEP:
        W.count.stage = 0
    return run_explicit_task(own, S, W, R, c, task)


def run(f, g, y, t_end, way, act=None, times=(), rtol=1e-10, method="dop853", most=10_000, h_max=np.inf, kept=()):
    """Events (t, fired, y before) of y'' = f(t, q, v), rows of output; ``act(t, y, fired)`` changes y, True: stop."""
    R, y = tableau(method), np.array(y, float)
    n = len(y) // 2
    S = Equations(f, lambda *a: np.asarray(g(*a), float), [0.0, y])
    W: GuardState = allocate_guard_state(
        np.array(way),
        np.array(kept or [0] * len(way)),
        R.c,
        R.order_i[1],
        n,
        [],
        [],
        (np.zeros((2, 2 * n)), np.zeros(0)),
    )
    real, count = ex.StepReals.blank(), ex.StepCounts.blank()
    real.t_end, real.rtol, real.atol, real.span, real.largest = t_end, rtol, 1e-2 * rtol, t_end, t_end
    real.h_max = min(h_max, t_end)
    count.quota, count.limit, count.controlled = 1000, most, 2 * n
    Y = ex.StateVectors.blank(2 * n)
    Y[0], Y.unit = y, 1.0
    K = np.zeros((len(R.c) + 1, 2 * n))
    c = ex.StepState(real, count, np.array(times, float), Y, K, np.zeros(0, np.int64), np.zeros((6, 0)))
    out, rows, events = np.zeros((64, 1 + 2 * n)), [], []
    callbacks = (
        ask,
        (derivative, arrive, tangent, inspect),
        report,
        start_event_segment,
        finish_step_with_events,
        watch,
        note,
        look,
    )
    while True:
        used = advance(callbacks, S, W, R, c, out)
        rows.append(out[:used].copy())
        status = count.status
        if status == EVENT_FOUND:
            events.append((real.t, tuple(np.flatnonzero(W.fired)), Y[0].copy()))
            if act is not None and act(real.t, Y[0], events[-1][1]):
                break
            count.started = 0
        elif status != ex.RUNNING:
            assert status == ex.DONE, status
            break
    return events, np.concatenate(rows), W, c
