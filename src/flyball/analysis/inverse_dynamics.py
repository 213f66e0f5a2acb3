"""Inverse dynamics: what drives have to do for a given motion, and what all joints carry.

The motion is kinematics (``kinematics``): the same loop that follows the drivers solves M vdot = f + G^T lam for the
multipliers, of which those of the drivers are their efforts. Where constraints depend on one another, lam is one of
many answers; what is common to all of them is told apart by the self-stresses of every position (``determinacy``).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ..errors import ModelError
from ..model.body import Body, Driver, Frame
from ..model.model import Model, listing, suggest
from ..model.sensor import Sensor
from ..model.table import Table
from ..results.inverse import Drive, InverseDynamics
from ..results.result import Result
from .freedom.determinacy import determinacy
from .kinematics import KinematicsOptions, kinematics, wanted_times
from .untouched import refuse_contact
from .watched import KNOWN

FEWEST = 4  # samples that make a curve with two continuous derivatives


@dataclass(frozen=True, kw_only=True)
class InverseDynamicsOptions(KinematicsOptions):
    """What `Mechanism.inverse_dynamics` is asked."""

    motion: Mapping[str, Any] | None


def inverse_dynamics(model: Model, o: InverseDynamicsOptions) -> InverseDynamics:
    """Forces and torques of drives, and reactions, for a given motion: see `Mechanism.inverse_dynamics`."""
    refuse_contact(model, "inverse_dynamics", KNOWN)
    model = model.copy() if o.motion else model.snapshot()
    labels = {d.name: d.name for d in model.drivers}
    if o.motion:
        outputs, begin = wanted_times(o.times, o.t_start, o.t_end)
        model.initial = []
        for label, how in o.motion.items():
            first = _add(model, label, how, outputs, labels)
            begin = max(begin, first) if o.t_start is None else begin
        if isinstance(o.times, (int, np.integer)) and outputs[0] < begin:
            outputs = np.linspace(begin, outputs[-1], int(o.times))
        o = replace(o, t_start=begin, times=outputs.tolist(), t_end=None)
    result = kinematics(model, o)
    drives = {labels[d.name]: _drive(result, d) for d in model.drivers}
    return InverseDynamics(result, drives, determinacy(result))


def _add(model: Model, label: str, how: Any, times: np.ndarray, labels: dict[str, str]) -> float:
    """Add the driver of one coordinate; returns when what drives it begins."""
    coordinate = _coordinate(model, label)
    name = f"{label.replace('.', ' ')} drive"
    law, first = how, -np.inf
    if not isinstance(how, (str, int, float)) and not callable(how):
        t, x = _samples(label, how, times)
        table = f"motion_{len(labels) + 1}"
        t, x = _longer(t, x)
        model.add(Table(table, x=tuple(t.tolist()), y=tuple(x.tolist())))
        law, first = f"{table}(t)", float(t[1])
    model.add(Driver(name, coordinate=coordinate, law=law))
    labels[name] = label
    return first


def _coordinate(model: Model, label: str) -> str:
    """The coordinate that a name of the motion means."""
    if "." in label:
        return label
    if not isinstance(e := model.find(label), Sensor):
        known = [x.name for x in model.sensors if isinstance(x, Sensor)]
        raise ModelError(
            f"motion of {label!r}: there is no sensor of that name{suggest(label, known)}; {listing(known)}. Name a "
            f"sensor of a coordinate, or a coordinate such as 'A.angle'"
        )
    found = model.measured(e)
    if found is None or found[0] != "coordinate" or found[2] != 0:
        raise ModelError(
            f"motion of {label!r}: the sensor measures {e.of!r}; only positions and angles of joints, bodies and "
            f"frames can be driven"
        )
    return found[1]


def _samples(label: str, how: Any, times: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Times and values of samples, checked."""
    try:
        pair = isinstance(how, tuple) and len(how) == 2 and np.ndim(how[0]) == 1
        t, x = (np.asarray(part, float) for part in (how if pair else (times, how)))
    except (TypeError, ValueError):
        raise ModelError(
            f"motion of {label!r}: give an expression of t, samples at the times, or a pair (times, samples), not "
            f"{how!r}"
        ) from None
    if t.ndim != 1 or t.shape != x.shape:
        raise ModelError(f"motion of {label!r}: {x.size} samples do not fit {t.size} times; give one for each")
    if len(t) < FEWEST:
        raise ModelError(f"motion of {label!r}: {len(t)} samples make no smooth motion; give {FEWEST} or more")
    if not (np.isfinite(t).all() and np.isfinite(x).all() and (np.diff(t) > 0).all()):
        raise ModelError(f"motion of {label!r}: samples must be finite and their times ascend")
    if t[0] > times[0] or t[-1] < times[-1]:
        raise ModelError(
            f"motion of {label!r}: its samples reach from {t[0]:g} s to {t[-1]:g} s, the times asked for from "
            f"{times[0]:g} s to {times[-1]:g} s; nothing says how it moves outside"
        )
    return t, x


def _longer(t: np.ndarray, x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The same spline with a point more at either end, so that the ends of the samples are inside it."""
    from scipy.interpolate import CubicSpline

    curve = CubicSpline(t, x)  # not-a-knot: its first and last pieces go on as they are
    more = np.r_[2 * t[0] - t[1], t, 2 * t[-1] - t[-2]]
    return more, curve(more)


def _drive(result: Result, driver: Driver) -> Drive:
    """What a driver does and how fast its coordinate moves."""
    model = result.model
    owner, what = model.coordinate(driver.coordinate, driver)
    view = result[owner.name]
    if not isinstance(owner, (Body, Frame)):
        rate = getattr(view, f"{what}_rate")
    elif what == "angle":
        rate = view.angular_velocity
    else:
        rate = view.velocity[:, "xyz".index(what)]
    unit, effort = result[driver.name].quantity("effort")
    return Drive(driver.name, driver.coordinate, unit, np.asarray(effort), np.asarray(rate))
