"""Pictures of linear models: Bode plots, root loci, eigenvalues in the complex plane."""

from __future__ import annotations

import os
from collections.abc import Sequence
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np

from .drawing import BESIDE, DASHES, PALETTE, PRETTY, handed_out, headed, new_figure, styled, titled
from .figures import hidden
from .frequencies import frequencies, phase

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from ..results.linear import LinearModel
    from ..results.modes import Modes

STABLE = "#eaf4ee"  # the half plane of what dies away
AXIS = "#8a8a8a"
BAD = PALETTE[1]
RATIOS = (0.05, 0.1, 0.2, 0.3, 0.5, 0.7, 0.9)
MOST = 24  # branches or labels that can be told apart
FAR = 5.0  # times the usual distance from the origin: branches are followed no further than this
TOUCHING = 1e-6  # real parts below this part of the largest eigenvalue are none


def bode(
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
        The only one if not named.
    output : str, optional
        All of them if not named.
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
    w = frequencies(model, pair) if omega is None else np.asarray(omega, float)
    responses = [model.response(w.tolist(), *names) for names in pair]
    with np.errstate(divide="ignore", invalid="ignore"):
        size = [np.where(np.abs(G) > 0.0, 20.0 * np.log10(np.abs(G)), np.nan) for G in responses]
    angle = [np.degrees(phase(model, *names, w, G)) for names, G in zip(pair, responses, strict=True)]
    units = [_ratio(model.output_units[k], model.input_units[i]) for k in chosen]
    with styled():
        drawing = new_figure(5.6)
        upper, lower = drawing.subplots(2, 1, sharex=True)
        for ax, curves in ((upper, size), (lower, angle)):
            for n, (values, under) in enumerate(zip(curves, hidden(curves), strict=True)):
                label = titled(pair[n][1], units[n])
                ax.plot(w, values, label=label, linestyle=DASHES[max(under, n // len(PALETTE)) % len(DASHES)])
        _over_frequency(upper, lower, w, angle)
        if several:
            upper.legend(**BESIDE)
        upper.set_ylabel("magnitude [dB]" if several or not units[0] else f"magnitude [dB of {units[0]}]")
        drawing.align_ylabels((upper, lower))
        what = "all outputs" if several else pair[0][1]
        headed(drawing, f"{model.name}: {what} by {model.inputs[i]}")
        return handed_out(drawing, path)


def _over_frequency(upper: Axes, lower: Axes, w: np.ndarray, angles: Sequence[np.ndarray]) -> None:
    """Frequencies along both axes, in rad/s below and in Hz above; phases in steps that divide a turn."""
    from matplotlib.ticker import MultipleLocator

    finite = np.concatenate([a[np.isfinite(a)] for a in angles])
    upper.set_xscale("log")
    upper.margins(x=0.0)
    hertz: Any = (lambda x: x / (2.0 * np.pi), lambda x: x * (2.0 * np.pi))
    above = upper.secondary_xaxis("top", functions=hertz)
    above.set_xlabel("frequency [Hz]")
    upper.spines["top"].set_visible(True)
    if not len(finite):
        upper.set_title("no answer: the output does not follow the input")
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


def _ratio(output: str, input: str) -> str:
    """Unit of an output over that of an input."""
    above, below = PRETTY.get(output, output), PRETTY.get(input, input)
    if not above or below in ("-", ""):
        return above
    return f"{above.replace('-', '1')}/{f'({below})' if set(below) & set('/ ') else below}"


def root_locus(
    roots: np.ndarray,
    gains: Sequence[float] | np.ndarray,
    parameter_name: str,
    title: str,
    path: str | os.PathLike | None = None,
    known: Sequence[Any] | None = None,
) -> Any:
    """Eigenvalues over a gain or parameter as branches, from a cross to a dot; the stable half plane is shaded.

    Where a branch crosses into the other half plane, the value there is written, interpolated between those given.

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
    """
    roots, values = np.asarray(roots), np.asarray(gains, float)
    with styled():
        drawing = new_figure(5.4)
        ax = drawing.subplots()
        for k, branch in enumerate(roots.T):
            color = PALETTE[k % len(PALETTE)]
            ax.plot(*_line(branch), color=color)
            ax.plot(branch.real[:1], branch.imag[:1], "x", color=color, markersize=7, markeredgewidth=1.8)
            ax.plot(branch.real[-1:], branch.imag[-1:], "o", color=color, markersize=5.5)
        _bounded(ax, roots)
        if known is None:
            _crossings(ax, roots, values, parameter_name)
        for c in known or ():
            _ringed(ax, c.eigenvalue, f"{parameter_name} = {c.value:.5g}")
        for mark, own in (("x", values[:1]), ("o", values[-1:])):
            for g in own:
                ax.plot([], [], mark, color="#555555", label=f"{parameter_name} = {g:.4g}")
        ax.legend(**BESIDE)
        plane(ax)
        headed(drawing, title)
        return handed_out(drawing, path)


def _line(branch: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """A branch's line; where it comes to or leaves the real axis it does so at a right angle."""
    on_axis = np.abs(branch.imag) <= 1e-9 * np.abs(branch).max(initial=0.0)
    k = np.flatnonzero(on_axis[1:] != on_axis[:-1])
    foot = np.where(on_axis[k], branch.real[k + 1], branch.real[k])
    return np.insert(branch.real, k + 1, foot), np.insert(branch.imag, k + 1, 0.0)


def _bounded(ax: Axes, roots: np.ndarray) -> None:
    """Limits that show where the branches are, without those parts that run off to infinity."""
    every = roots[np.isfinite(roots)]
    usual = FAR * float(np.median(np.abs(every))) if every.size else 1.0
    ends = np.abs(roots[[0, -1]]) if len(roots) else np.zeros(0)
    usual = max(usual, 1.3 * float(ends[0].max(initial=0.0)) if len(ends) else 0.0)
    near = every[np.abs(every) <= usual] if every.size else np.zeros(1, complex)
    if len(near) < len(every):
        ax.set_title("branches that leave the picture go on")
    framed(ax, near)


def framed(ax: Axes, points: np.ndarray) -> None:
    """Limits around points and the imaginary axis; lines have some width even where all lie on one of them."""
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
    """The complex plane's axes, and the half of it where motions die away."""
    low, high = ax.get_xlim()
    ax.axvspan(low, 0.0, color=STABLE, zorder=0, linewidth=0)
    ax.axvline(0.0, color=AXIS, linewidth=0.9, zorder=1)
    ax.axhline(0.0, color=AXIS, linewidth=0.9, zorder=1)
    ax.set_xlim(low, high)
    ax.set_xlabel("real part [1/s]")
    ax.set_ylabel("imaginary part [rad/s]")
    ax.text(0.01, 0.015, "stable", transform=ax.transAxes, color="#3c7a56", fontsize=9)


def _crossings(ax: Axes, roots: np.ndarray, gains: np.ndarray, name: str) -> None:
    """Where branches cross the imaginary axis: a ring, and the value there.

    Near where two meet on the real axis they move as a square root does: there it is only said between which values.
    """
    least = TOUCHING * np.abs(roots).max(initial=0.0)
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
            if at.imag < -least or any(abs(at - x) < 0.02 * abs(ax.get_ylim()[1]) for x in seen) or len(seen) >= MOST:
                continue
            seen.append(at)
            value = f"≈ {gains[k] + f * (gains[n] - gains[k]):.4g}"
            _ringed(ax, at, f"{name} from {gains[k]:.4g} to {gains[n]:.4g}" if meet else f"{name} {value}")


def _ringed(ax: Axes, at: complex, text: str) -> None:
    ax.plot([at.real], [at.imag], "o", markersize=10, markerfacecolor="none", markeredgecolor=BAD, zorder=4)
    box = {"color": "white", "alpha": 0.8, "pad": 0.5}
    ax.annotate(text, (at.real, at.imag), (9, 9), textcoords="offset points", bbox=box, color=BAD, fontsize=9)


def eigenvalues(modes: Modes, path: str | os.PathLike | None = None) -> Any:
    """Eigenvalues in the upper half of the complex plane, with lines of equal damping ratio; see `Modes.plot`."""
    w = modes.eigenvalues
    kinds = np.array(modes.kinds)
    looks = {
        "oscillation": ("o", PALETTE[0], "full"),
        "decay": ("o", PALETTE[2], "full"),
        "unstable": ("^", BAD, "full"),
        "rigid": ("s", PALETTE[6], "none"),
    }
    with styled():
        drawing = new_figure(5.4)
        ax = drawing.subplots()
        near = _telling(w, kinds)
        framed(ax, w[near])
        _rays(ax)
        for kind, (mark, color, fill) in looks.items():
            own = w[near & (kinds == kind)]
            if len(own):
                label = f"{kind} ({len(own)})"
                style: dict[str, Any] = {"marker": mark, "color": color, "fillstyle": fill, "markersize": 8}
                ax.plot(own.real, own.imag, linestyle="none", label=label, zorder=4, **style)
        _numbered(ax, w, kinds, near)
        ax.set_title("one of each complex pair; numbers as in the table of modes; rays: damping ratio" + _far(w[~near]))
        if len(w):
            ax.legend(**BESIDE)
        plane(ax)
        headed(drawing, f"{modes.point.model.name}: eigenvalues")
        return handed_out(drawing, path)


def _telling(w: np.ndarray, kinds: np.ndarray) -> np.ndarray:
    """Which eigenvalues are shown: without those that decay so fast that the others could not be told apart."""
    size = np.abs(w)
    slow = size[(kinds == "oscillation") | (kinds == "unstable")]
    return (kinds != "decay") | (size <= (2.0 * FAR * slow.max() if len(slow) else np.inf))


def _far(w: np.ndarray) -> str:
    """Word of those that are not shown."""
    return f"\nnot shown: {len(w)} decaying faster, at {w.real.max():.4g} to {w.real.min():.4g} 1/s" if len(w) else ""


def _rays(ax: Axes) -> None:
    """Lines of equal damping ratio from the origin, labelled where they leave the picture; few enough to be read."""
    low, top = ax.get_xlim()[0], ax.get_ylim()[1]
    wide, high = -low, top
    last = None
    for ratio in RATIOS:
        x, y = ratio, np.sqrt(1.0 - ratio**2)
        reach = min(wide / x, high / y)
        end = np.array([-x * reach / wide, y * reach / high])  # in parts of the quadrant
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


def _numbered(ax: Axes, w: np.ndarray, kinds: np.ndarray, near: np.ndarray) -> None:
    """The modes' numbers beside them; those in the same place share a label."""
    (x0, x1), (y0, y1) = ax.get_xlim(), ax.get_ylim()
    places: list[tuple[complex, list[int]]] = []
    for k in np.flatnonzero(near)[:MOST].tolist():
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
        color = BAD if "unstable" in kinds[numbers] else "#333333"
        ax.annotate(text, (value.real, value.imag), (7, 5), textcoords="offset points", fontsize=9, color=color)
