"""Plots of linear models: Bode plots, root loci, eigenvalues, poles and zeros in the complex plane.

The frequencies of a Bode plot, and its phase without jumps, follow from poles and zeros.
"""

from __future__ import annotations

import os
from collections.abc import Sequence
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np

from .figures import hidden_counts
from .plotting import (
    DASH_STYLES,
    LEGEND_BESIDE,
    PALETTE,
    UNIT_TEXTS,
    axis_label,
    finish_figure,
    new_figure,
    plot_style,
    set_title,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from ..results.linear_model import LinearModel
    from ..results.modes import Modes


BODE_POINTS, LARGE_MODEL_POINTS = 500, 150  # number of frequencies for a large model
LARGE_MODEL_POLES = 10  # number of poles of a large model that are shown
MAX_DECADES = 8.0  # largest number of frequencies
ORIGIN_PART = 1e-7  # relative to the largest pole or zero: smaller ones are at the origin
CANCELLATION_PART = 1e-6  # relative distance of a pole and a zero that cancel
MIN_DAMPING_RATIO = 1e-4  # damping ratio of resonances: sharper ones are drawn with this value


def bode_frequencies(model: LinearModel, pairs: Sequence[tuple[str, str]]) -> np.ndarray:
    """Angular frequencies [rad/s], a decade beyond poles and zeros of (input, output) pairs, denser at resonances."""
    if model.large:
        roots = model.descriptor.nearest(LARGE_MODEL_POLES)
    else:
        roots = np.concatenate([np.concatenate(zeros_and_poles(model, *pair)) for pair in pairs])
    if model.period is not None:  # z = exp(s period)
        roots = np.log(roots[np.abs(roots) > ORIGIN_PART].astype(complex)) / model.period
    size = np.abs(roots)
    roots = roots[size > ORIGIN_PART * size.max(initial=0.0)]
    size = np.abs(roots) if len(roots) else np.ones(1)
    low, high = np.log10(size.min()) - 1.0, np.log10(size.max()) + 1.0
    even = np.logspace(max(low, high - MAX_DECADES), high, LARGE_MODEL_POINTS if model.large else BODE_POINTS)
    resonant = roots[(roots.imag > 0.0) & (np.abs(roots.real) < 0.5 * np.abs(roots))]
    u = np.sinh(
        np.linspace(-6.0, 6.0, 14 if model.large else 42)
    )  # even number: the peak itself of an undamped resonance is infinite
    near = [abs(r) * (1.0 + max(abs(r.real) / abs(r), MIN_DAMPING_RATIO) * u) for r in resonant]
    tops = [np.array([r.imag]) for r in resonant if abs(r.real) > MIN_DAMPING_RATIO * abs(r)]
    every = np.concatenate([even, *near, *tops])
    most = np.inf if model.period is None else np.pi / model.period  # no further features beyond it
    return np.unique(np.minimum(every[(every >= even[0]) & (every <= even[-1])], most))


def zeros_and_poles(model: LinearModel, input: str, output: str) -> tuple[np.ndarray, np.ndarray]:
    """Return zeros and poles [1/s] of a transfer function that do not cancel; none if the output does not respond."""
    found, all_poles, _ = model.transfer(input, output)
    zeros, poles = list(found[np.isfinite(found)]), list(all_poles)
    largest = max(map(abs, poles), default=0.0)
    for zero in list(zeros):
        gaps = [abs(zero - pole) for pole in poles]
        k = int(np.argmin(gaps)) if gaps else 0
        if gaps and gaps[k] <= CANCELLATION_PART * max(abs(zero), 1e-2 * largest):
            zeros.remove(zero)
            del poles[k]
    return np.array(zeros, complex), np.array(poles, complex)


def phase(model: LinearModel, input: str, output: str, omega: np.ndarray, response: np.ndarray) -> np.ndarray:
    """Return the phase [rad] of a response, without jumps, starting between -pi and pi.

    Every pole and zero contributes an angle that changes monotonically with frequency, so that full turns are known for
    any resonance. Roots on the imaginary axis are treated as damped. Those of a large model are unknown; its phase is
    assumed to change by less than half a turn from one frequency to the next.
    """
    if model.large:
        return _unwrapped_phase(response)
    zeros, poles = zeros_and_poles(model, input, output)
    largest = max(np.abs(zeros).max(initial=0.0), np.abs(poles).max(initial=0.0))
    turned = np.zeros(len(omega))
    for sign, roots in ((1.0, zeros), (-1.0, poles)):
        for root in roots:
            on_axis = abs(root.real) <= ORIGIN_PART * largest
            angle = np.arctan2(omega - root.imag, 0.0 if on_axis else abs(root.real))
            turned += sign * (angle if on_axis or root.real < 0.0 else np.pi - angle)
    own = np.where(np.isfinite(response) & (np.abs(response) > 0.0), np.angle(response), np.nan)
    if not np.isfinite(own).any():
        return own
    offset = np.nanmedian(np.angle(np.exp(1j * (own - turned))))  # sign of the gain
    out = own + 2.0 * np.pi * np.round((turned + offset - own) / (2.0 * np.pi))
    return _principal_start(out)


def _principal_start(phase: np.ndarray) -> np.ndarray:
    """Return the phase shifted by full turns to start between -pi and pi."""
    first = phase[np.isfinite(phase)][:1]
    return phase - 2.0 * np.pi * np.ceil((first - np.pi * (1.0 - 1e-6)) / (2.0 * np.pi)) if len(first) else phase


def _unwrapped_phase(response: np.ndarray) -> np.ndarray:
    """Return the phase unwrapped from one frequency to the next.

    A change by half a turn is a decrease at a pole, where the response is large, and an increase at a zero.
    """
    known = np.flatnonzero(np.isfinite(response) & (np.abs(response) > 0.0))
    size, turn = np.log(np.abs(response[known])), np.angle(response[known])
    steps = np.angle(np.exp(1j * np.diff(turn)))
    beside = size[1:] + size[:-1] - np.r_[size[:1], size[:-2]] - np.r_[size[2:], size[-1:]]
    half = np.abs(np.abs(steps) - np.pi) < ORIGIN_PART
    steps[half] = np.where(beside[half] > 0.0, -np.pi, np.pi)
    out = np.full(len(response), np.nan)
    out[known] = np.cumsum(np.r_[turn[:1], steps])
    return _principal_start(out)


STABLE_COLOR = "#eaf4ee"  # stable half plane
AXIS_COLOR = "#8a8a8a"
UNSTABLE_COLOR = PALETTE[1]
DAMPING_RATIOS = (0.05, 0.1, 0.2, 0.3, 0.5, 0.7, 0.9)
MAX_BRANCHES = 24  # number of distinguishable branches or labels
DISTANCE_LIMIT = 5.0  # relative to the usual distance from the origin: branches beyond are cut off
ZERO_REAL_PART = 1e-6  # relative to the largest eigenvalue: smaller real parts count as zero


def bode_plot(
    model: LinearModel,
    input: str | None = None,
    output: str | None = None,
    omega: Sequence[float] | None = None,
    path: str | os.PathLike | None = None,
) -> Any:
    """Magnitude and phase of frequency responses over frequency; see `LinearModel.bode`.

    Parameters
    ----------
    model : LinearModel
    input : str, optional
        The only one if not given.
    output : str, optional
        All of them if not given.
    omega : sequence of float, optional
        Angular frequencies [rad/s]; by default a decade beyond all poles and zeros, closer where they resonate.
    path : path, optional
        Write a PNG, SVG or PDF file instead of returning the figure.

    Raises
    ------
    ModelError
        If there is no such input or output, or the file cannot be written.
    """
    i = model.input_index(input)
    several = output is None and len(model.outputs) > 1
    chosen = list(range(len(model.outputs))) if several else [model.output_index(output)]
    pair = [(model.inputs[i], model.outputs[k]) for k in chosen]
    w = bode_frequencies(model, pair) if omega is None else np.asarray(omega, float)
    responses = [model.response(w.tolist(), *names) for names in pair]
    with np.errstate(divide="ignore", invalid="ignore"):
        size = [np.where(np.abs(G) > 0.0, 20.0 * np.log10(np.abs(G)), np.nan) for G in responses]
    angle = [np.degrees(phase(model, *names, w, G)) for names, G in zip(pair, responses, strict=True)]
    units = [_unit_ratio(model.output_units[k], model.input_units[i]) for k in chosen]
    with plot_style():
        drawing = new_figure(5.6)
        upper, lower = drawing.subplots(2, 1, sharex=True)
        for ax, curves in ((upper, size), (lower, angle)):
            for n, (values, under) in enumerate(zip(curves, hidden_counts(curves), strict=True)):
                label = axis_label(pair[n][1], units[n])
                ax.plot(w, values, label=label, linestyle=DASH_STYLES[max(under, n // len(PALETTE)) % len(DASH_STYLES)])
        _frequency_axes(upper, lower, w, angle)
        if several:
            upper.legend(**LEGEND_BESIDE)
        upper.set_ylabel("magnitude [dB]" if several or not units[0] else f"magnitude [dB of {units[0]}]")
        drawing.align_ylabels((upper, lower))
        what = "all outputs" if several else pair[0][1]
        set_title(drawing, f"{model.name}: {what} by {model.inputs[i]}")
        return finish_figure(drawing, path)


def _frequency_axes(upper: Axes, lower: Axes, w: np.ndarray, angles: Sequence[np.ndarray]) -> None:
    """Set frequency axes in rad/s below and in Hz above, and phase ticks that divide a turn."""
    from matplotlib.ticker import MultipleLocator

    finite = np.concatenate([a[np.isfinite(a)] for a in angles])
    upper.set_xscale("log")
    upper.margins(x=0.0)
    hertz: Any = (lambda x: x / (2.0 * np.pi), lambda x: x * (2.0 * np.pi))
    above = upper.secondary_xaxis("top", functions=hertz)
    above.set_xlabel("frequency [Hz]")
    upper.spines["top"].set_visible(True)
    if not len(finite):
        upper.set_title("no response: the output does not depend on the input")
    lower.set_xlabel("angular frequency [rad/s]")
    lower.set_ylabel("phase [deg]")
    low, high = (finite.min(), finite.max()) if len(finite) else (-180.0, 0.0)
    step = 45.0 if high - low <= 200.0 else 90.0
    while (high - low) / step > 8:
        step *= 2.0
    lower.yaxis.set_major_locator(MultipleLocator(step))
    level = 0.5 * step if high - low < 2.0 else 0.0
    bottom, top = step * np.floor((low - level + 1.0) / step), step * np.ceil((high + level - 1.0) / step)
    lower.set_ylim(bottom - 8.0, top + 8.0)
    for ax in (upper, lower):
        ax.grid(True, which="minor", axis="x", linewidth=0.4)


def _unit_ratio(output: str, input: str) -> str:
    """Return the unit of an output divided by that of an input."""
    above, below = UNIT_TEXTS.get(output, output), UNIT_TEXTS.get(input, input)
    if not above or below in ("-", ""):
        return above
    return f"{above.replace('-', '1')}/{f'({below})' if set(below) & set('/ ') else below}"


def root_locus_plot(
    roots: np.ndarray,
    gains: Sequence[float] | np.ndarray,
    parameter_name: str,
    title: str,
    path: str | os.PathLike | None = None,
    known: Sequence[Any] | None = None,
    *,
    sampled: bool = False,
) -> Any:
    """Eigenvalues over a gain or parameter as branches, from a cross to a dot; the stable half plane is shaded.

    The parameter value at each crossing of the imaginary axis is labelled, interpolated between the given ones.

    Parameters
    ----------
    roots : ndarray (values, n) complex [1/s]
        Sorted so that columns are branches.
    gains : sequence of float
    parameter_name : str
    title : str
    path : path, optional
        Write a PNG, SVG or PDF file instead of returning the figure.
    known : sequence of Crossing, optional
        The crossings, where they need not be interpolated.
    sampled : bool
        Whether they are multipliers of a sampled loop: the unit circle is shaded in place of the half plane.
    """
    roots, values = np.asarray(roots), np.asarray(gains, float)
    with plot_style():
        drawing = new_figure(5.4)
        ax = drawing.subplots()
        for k, branch in enumerate(roots.T):
            color = PALETTE[k % len(PALETTE)]
            ax.plot(*_branch_line(branch), color=color)
            ax.plot(branch.real[:1], branch.imag[:1], "x", color=color, markersize=7, markeredgewidth=1.8)
            ax.plot(branch.real[-1:], branch.imag[-1:], "o", color=color, markersize=5.5)
        _limit_to_branches(ax, roots)
        if known is None:
            _mark_crossings(ax, roots, values, parameter_name)
        for c in known or ():
            _mark_ring(ax, c.eigenvalue, f"{parameter_name} = {c.value:.5g}")
        for mark, own in (("x", values[:1]), ("o", values[-1:])):
            for g in own:
                ax.plot([], [], mark, color="#555555", label=f"{parameter_name} = {g:.4g}")
        ax.legend(**LEGEND_BESIDE)
        if sampled:
            unit_circle(ax)
        else:
            plane(ax)
        set_title(drawing, title)
        return finish_figure(drawing, path)


def _branch_line(branch: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return a branch's line; it meets the real axis at a right angle."""
    on_axis = np.abs(branch.imag) <= 1e-9 * np.abs(branch).max(initial=0.0)
    k = np.flatnonzero(on_axis[1:] != on_axis[:-1])
    foot = np.where(on_axis[k], branch.real[k + 1], branch.real[k])
    return np.insert(branch.real, k + 1, foot), np.insert(branch.imag, k + 1, 0.0)


def _limit_to_branches(ax: Axes, roots: np.ndarray) -> None:
    """Return limits that show the branches, without parts that go to infinity."""
    every = roots[np.isfinite(roots)]
    usual = DISTANCE_LIMIT * float(np.median(np.abs(every))) if every.size else 1.0
    ends = np.abs(roots[[0, -1]]) if len(roots) else np.zeros(0)
    usual = max(usual, 1.3 * float(ends[0].max(initial=0.0)) if len(ends) else 0.0)
    near = every[np.abs(every) <= usual] if every.size else np.zeros(1, complex)
    if len(near) < len(every):
        ax.set_title("branches continue outside the plot")
    limits_around(ax, near)


def limits_around(ax: Axes, points: np.ndarray) -> None:
    """Return limits around points and the imaginary axis, with a finite width if all lie on a line."""
    size = float(np.abs(points).max(initial=0.0)) or 1.0
    wide = float(np.abs(points.real).max(initial=0.0))
    wide = wide if wide > 1e-3 * size else 0.1 * size
    x0, x1 = min(points.real.min(initial=0.0), -0.25 * wide), max(points.real.max(initial=0.0), 0.15 * wide)
    y0, y1 = points.imag.min(initial=0.0), points.imag.max(initial=0.0)
    y1 = y1 if y1 > 0.05 * size else 0.5 * size
    room = 0.08 * (x1 - x0), 0.08 * (y1 - y0)
    ax.set_xlim(x0 - room[0], x1 + room[0])
    ax.set_ylim(y0 - room[1], y1 + room[1])


def plane(ax: Axes) -> None:
    """Draw the complex plane's axes, and shade the stable half plane."""
    low, high = ax.get_xlim()
    ax.axvspan(low, 0.0, color=STABLE_COLOR, zorder=0, linewidth=0)
    ax.axvline(0.0, color=AXIS_COLOR, linewidth=0.9, zorder=1)
    ax.axhline(0.0, color=AXIS_COLOR, linewidth=0.9, zorder=1)
    ax.set_xlim(low, high)
    ax.set_xlabel("real part [1/s]")
    ax.set_ylabel("imaginary part [rad/s]")
    ax.text(0.01, 0.015, "stable", transform=ax.transAxes, color="#3c7a56", fontsize=9)


def unit_circle(ax: Axes) -> None:
    """Draw the axes of the plane of multipliers, and shade the unit circle, within which deviations die away."""
    from matplotlib.patches import Circle

    ax.add_patch(Circle((0.0, 0.0), 1.0, facecolor=STABLE_COLOR, edgecolor=AXIS_COLOR, linewidth=0.9, zorder=0))
    ax.axvline(0.0, color=AXIS_COLOR, linewidth=0.9, zorder=1)
    ax.axhline(0.0, color=AXIS_COLOR, linewidth=0.9, zorder=1)
    low, high = ax.get_xlim()
    ax.set_xlim(min(low, -1.1), max(high, 1.1))
    low, high = ax.get_ylim()
    ax.set_ylim(min(low, -1.1), max(high, 1.1))
    ax.set_aspect("equal")
    ax.set_xlabel("real part")
    ax.set_ylabel("imaginary part")


def _mark_crossings(ax: Axes, roots: np.ndarray, gains: np.ndarray, name: str) -> None:
    """Mark crossings of the imaginary axis by a ring and the parameter value.

    Near a meeting of two branches on the real axis they follow a square root: there only the bracketing values are
    given.
    """
    least = ZERO_REAL_PART * np.abs(roots).max(initial=0.0)
    seen: list[complex] = []
    for branch in roots.T:
        off = np.flatnonzero(np.abs(branch.real) > least)
        for k, n in pairwise(off):
            a, b = branch[k], branch[n]
            if a.real * b.real > 0.0:
                continue
            f = a.real / (a.real - b.real)
            meet = (abs(a.imag) <= least) != (abs(b.imag) <= least)
            at = complex(0.0, 0.0 if meet else (a + f * (b - a)).imag)
            if (
                at.imag < -least
                or any(abs(at - x) < 0.02 * abs(ax.get_ylim()[1]) for x in seen)
                or len(seen) >= MAX_BRANCHES
            ):
                continue
            seen.append(at)
            value = f"≈ {gains[k] + f * (gains[n] - gains[k]):.4g}"
            _mark_ring(ax, at, f"{name} from {gains[k]:.4g} to {gains[n]:.4g}" if meet else f"{name} {value}")


def _mark_ring(ax: Axes, at: complex, text: str) -> None:
    ax.plot([at.real], [at.imag], "o", markersize=10, markerfacecolor="none", markeredgecolor=UNSTABLE_COLOR, zorder=4)
    box = {"color": "white", "alpha": 0.8, "pad": 0.5}
    ax.annotate(
        text, (at.real, at.imag), (9, 9), textcoords="offset points", bbox=box, color=UNSTABLE_COLOR, fontsize=9
    )


def eigenvalues(modes: Modes, path: str | os.PathLike | None = None) -> Any:
    """Eigenvalues in the upper half of the complex plane, with lines of equal damping ratio; see `Modes.plot`."""
    w = modes.eigenvalues
    kinds = np.array(modes.kinds)
    looks = {
        "oscillation": ("o", PALETTE[0], "full"),
        "decay": ("o", PALETTE[2], "full"),
        "unstable": ("^", UNSTABLE_COLOR, "full"),
        "rigid": ("s", PALETTE[6], "none"),
    }
    with plot_style():
        drawing = new_figure(5.4)
        ax = drawing.subplots()
        near = _displayed_eigenvalues(w, kinds)
        limits_around(ax, w[near])
        _damping_rays(ax)
        for kind, (mark, color, fill) in looks.items():
            own = w[near & (kinds == kind)]
            if len(own):
                label = f"{kind} ({len(own)})"
                style: dict[str, Any] = {"marker": mark, "color": color, "fillstyle": fill, "markersize": 8}
                ax.plot(own.real, own.imag, linestyle="none", label=label, zorder=4, **style)
        _mode_numbers(ax, w, kinds, near)
        ax.set_title(
            "one of each complex pair; numbers as in the table of modes; rays: damping ratio" + _omitted_text(w[~near])
        )
        if len(w):
            ax.legend(**LEGEND_BESIDE)
        plane(ax)
        set_title(drawing, f"{modes.point.model.name}: eigenvalues")
        return finish_figure(drawing, path)


def _displayed_eigenvalues(w: np.ndarray, kinds: np.ndarray) -> np.ndarray:
    """Return which eigenvalues are shown: without those so fast that the others could not be distinguished."""
    size = np.abs(w)
    slow = size[(kinds == "oscillation") | (kinds == "unstable")]
    return (kinds != "decay") | (size <= (2.0 * DISTANCE_LIMIT * slow.max() if len(slow) else np.inf))


def _omitted_text(w: np.ndarray) -> str:
    """Return a note on those that are not shown."""
    return f"\nnot shown: {len(w)} decaying faster, at {w.real.max():.4g} to {w.real.min():.4g} 1/s" if len(w) else ""


def _damping_rays(ax: Axes) -> None:
    """Draw lines of equal damping ratio from the origin, with labels at the border; few enough to be legible."""
    low, top = ax.get_xlim()[0], ax.get_ylim()[1]
    wide, high = -low, top
    last = None
    for ratio in DAMPING_RATIOS:
        x, y = ratio, np.sqrt(1.0 - ratio**2)
        reach = min(wide / x, high / y)
        end = np.array([-x * reach / wide, y * reach / high])  # relative to the quadrant
        if last is not None and np.abs(end - last).max() < 0.1:
            continue
        last = end
        ax.plot([0.0, -x * reach], [0.0, y * reach], color="#b9c6bf", linewidth=0.8, linestyle=(0, (4, 3)), zorder=1)
        side = end[1] < 0.999
        ax.annotate(
            f"{ratio:g}",
            (-x * reach, y * reach),
            (3, 2) if side else (-3, -9),
            textcoords="offset points",
            ha="left" if side else "right",
            fontsize=8,
            color="#6f8578",
        )


def _mode_numbers(ax: Axes, w: np.ndarray, kinds: np.ndarray, near: np.ndarray) -> None:
    """Write the modes' numbers beside them; coincident ones share a label."""
    (x0, x1), (y0, y1) = ax.get_xlim(), ax.get_ylim()
    places: list[tuple[complex, list[int]]] = []
    for k in np.flatnonzero(near)[:MAX_BRANCHES].tolist():
        value = w[k]
        at = complex((value.real - x0) / (x1 - x0), (value.imag - y0) / (y1 - y0))
        for there, numbers in places:
            if abs(at - there) < 0.03:
                numbers.append(k)
                break
        else:
            places.append((at, [k]))
    for _, numbers in places:
        value = w[numbers[0]]
        text = ", ".join(map(str, numbers)) if len(numbers) < 5 else f"{numbers[0]} ... {numbers[-1]}"
        color = UNSTABLE_COLOR if "unstable" in kinds[numbers] else "#333333"
        ax.annotate(text, (value.real, value.imag), (7, 5), textcoords="offset points", fontsize=9, color=color)


MAX_POLE_LABELS = 24  # number of legible numbers beside the marks


def pole_zero_plot(model: LinearModel, path: str | os.PathLike | None = None) -> Any:
    """Eigenvalues as crosses, of a single input and output its zeros as rings; see `LinearModel.plot`."""
    w, zeros = model.eigenvalues, np.zeros(0, complex)
    if len(model.inputs) == len(model.outputs) == 1:
        zeros = model.transfer()[0]
    with plot_style():
        picture = new_figure(5.4)
        ax = picture.subplots()
        limits_around(ax, np.r_[w, w.conj(), zeros])
        once, count = np.unique(w, return_counts=True)
        ax.plot(w.real, w.imag, "x", color=PALETTE[0], markersize=9, markeredgewidth=1.8, label="eigenvalues", zorder=4)
        if len(zeros):
            ring: dict[str, Any] = {"markerfacecolor": "none", "markeredgecolor": PALETTE[2], "markersize": 9}
            ax.plot(zeros.real, zeros.imag, "o", label=f"zeros of {model.outputs[0]} by {model.inputs[0]}", **ring)
        for at, n in list(zip(once, count, strict=True))[:MAX_POLE_LABELS]:
            if n > 1:
                ax.annotate(f"{n}-fold", (at.real, at.imag), (8, 6), textcoords="offset points", fontsize=9)
        if len(w):
            ax.legend(**LEGEND_BESIDE)
        plane(ax)
        set_title(
            picture, f"{model.name}: linear model" + (f", seen from {model.seen_from}" if model.seen_from else "")
        )
        return finish_figure(picture, path)
