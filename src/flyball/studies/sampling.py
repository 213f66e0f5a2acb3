"""Points of a study: grids, lists, samples (Monte Carlo, Latin hypercube, Sobol, Saltelli), one row a run."""

from __future__ import annotations

import itertools
import re
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from ..errors import ModelError
from ..model.expressions import number
from ..model.messages import listing, suggest
from ..model.model import Model
from ..model.units import same_kind

LISTED_DESIGNS, SAMPLED_DESIGNS = ("grid", "list"), ("random", "latin", "sobol", "saltelli")
DESIGNS = (*LISTED_DESIGNS, *SAMPLED_DESIGNS)
MAX_RUNS = 20_000_000  # largest number of runs
DISTRIBUTIONS = {  # name -> (meaning of its arguments, SciPy distribution)
    "uniform": ("low, high", lambda stats, a, b: stats.uniform(a, b - a)),
    "loguniform": ("low, high", lambda stats, a, b: stats.loguniform(a, b)),
    "normal": ("mean, standard deviation", lambda stats, a, b: stats.norm(a, b)),
    "lognormal": ("median, standard deviation of the logarithm", lambda stats, a, b: stats.lognorm(b, scale=a)),
}
DISTRIBUTION_TEXT = re.compile(r"\s*(\w+)\s*\((.*)\)\s*")


def sample_points(
    model: Model, vary: Mapping[str, Any], design: str, samples: int | None, seed: int | None
) -> tuple[np.ndarray, tuple[np.ndarray, ...]]:
    """(points (runs, parameters) in SI units, axes of a grid or none).

    Raises
    ------
    ModelError
        If a parameter does not exist, or its specification is invalid.
    """
    env = model.environment()
    for name in vary:
        if name not in env:
            raise ModelError(
                f"{model.name!r} has no parameter {name!r}{suggest(name, list(env))}; {listing(list(env))}"
            )
    if design in LISTED_DESIGNS:
        axes = tuple(_listed_values(model, name, x) for name, x in vary.items())
        if design == "grid":
            _refuse_many(int(np.prod([len(a) for a in axes], dtype=float)))
            return np.array(list(itertools.product(*axes)), float).reshape(-1, len(axes)), axes
        if len({len(a) for a in axes}) > 1:
            told = ", ".join(f"{name!r} {len(a)}" for name, a in zip(vary, axes, strict=True))
            raise ModelError(f"design='list' takes the values run by run: as many for each parameter, not {told}")
        return np.column_stack(axes), ()
    n, d = int(samples or 0), len(vary)
    _refuse_many(n * (d + 2) if design == "saltelli" else n)
    laws = [_distribution(model, name, x) for name, x in vary.items()]
    u = _unit_cube_points(design, n, 2 * d if design == "saltelli" else d, 0 if seed is None else seed)
    x = np.column_stack([laws[k % d].ppf(u[:, k]) for k in range(u.shape[1])])
    if not np.isfinite(x).all():
        name = list(vary)[int(np.flatnonzero(~np.isfinite(x).all(axis=0))[0]) % d]
        raise ModelError(f"the distribution of {name!r} gives values that are not finite")
    return (_saltelli_samples(x[:, :d], x[:, d:]) if design == "saltelli" else x), ()


def _refuse_many(n: int) -> None:
    if n > MAX_RUNS:
        raise ModelError(
            f"a study of {n:,} runs: {MAX_RUNS:,} are the most; take fewer values, or a design with samples="
        )


def _listed_values(model: Model, name: str, given: Any) -> np.ndarray:
    """Values of a parameter that are given as a list."""
    if isinstance(given, str) or hasattr(given, "ppf") or not isinstance(given, (Sequence, np.ndarray)):
        raise ModelError(
            f"vary {name!r}: a grid takes a list of values, not {given!r}; ranges and distributions go with "
            f"design='random', 'latin', 'sobol' or 'saltelli', and samples="
        )
    if isinstance(given, tuple) and len(given) == 2:
        raise ModelError(
            f"vary {name!r}: {given!r} is a range (low, high), which goes with design='random', 'latin', 'sobol' or "
            f"'saltelli', and samples=; of two values give a list, {list(given)!r}"
        )
    texts = [x for x in given if isinstance(x, str)]
    for text in texts[1:]:
        same_kind(texts[0], text, f"vary {name!r}: the first of its values")
    found = np.array([_parameter_value(model, name, x) for x in given], float)
    if not len(found):
        raise ModelError(f"vary {name!r}: there are no values")
    return found


def _parameter_value(model: Model, name: str, given: Any) -> float:
    """A finite value of a parameter in SI units."""
    value = model.environment({name: given})[name] if isinstance(given, str) else given
    try:
        found = float("nan") if isinstance(value, (bool, np.bool_)) else float(value)
    except (TypeError, ValueError):
        found = float("nan")
    if not np.isfinite(found):
        raise ModelError(f"vary {name!r}: {given!r} is no finite number")
    return found


def _distribution(model: Model, name: str, given: Any) -> Any:
    """A distribution: SciPy's own, a pair (low, high), or a text such as ``"normal(10, 0.5)"``."""
    from scipy import stats

    if hasattr(given, "ppf"):
        if (size := np.size(given.ppf(0.5))) != 1:
            raise ModelError(f"vary {name!r}: {size} distributions are given in place of one; its numbers are arrays")
        return given
    if isinstance(given, str) and (found := DISTRIBUTION_TEXT.fullmatch(given)):
        kind, texts = found[1], found[2].split(",")
        if kind not in DISTRIBUTIONS:
            raise ModelError(
                f"vary {name!r}: no distribution {kind!r}{suggest(kind, DISTRIBUTIONS)}; {listing(list(DISTRIBUTIONS))}"
            )
        if len(texts) != 2:
            raise ModelError(f"vary {name!r}: {kind} takes ({DISTRIBUTIONS[kind][0]}), not ({found[2]})")
    elif not isinstance(given, str) and isinstance(given, (Sequence, np.ndarray)) and len(given) == 2:
        kind, texts = "uniform", list(given)
    else:
        raise ModelError(
            f"vary {name!r}: a sample is drawn from (low, high), a distribution of scipy.stats, or a text such "
            f"as 'normal(10, 0.5)', not from {given!r}"
        )
    a = _parameter_value(model, name, texts[0].strip() if isinstance(texts[0], str) else texts[0])
    plain = kind == "lognormal"
    b = float(number(texts[1], {}, None, f"vary {name!r}")) if plain else _parameter_value(model, name, texts[1])
    _check_distribution(name, kind, a, b)
    return DISTRIBUTIONS[kind][1](stats, a, b)


def _check_distribution(name: str, kind: str, a: float, b: float) -> None:
    """Refuse an invalid distribution."""
    if kind in ("uniform", "loguniform") and not a < b:
        raise ModelError(f"vary {name!r}: the lower end {a:g} must be smaller than the upper one {b:g}")
    if kind in ("loguniform", "lognormal") and not a > 0.0:
        raise ModelError(f"vary {name!r}: {kind} is of positive numbers, got {a:g}")
    if kind in ("normal", "lognormal") and not b > 0.0:
        raise ModelError(f"vary {name!r}: a standard deviation must be greater than 0, got {b:g}")


def _unit_cube_points(design: str, n: int, d: int, seed: int) -> np.ndarray:
    """Points of the unit cube (n, d); SciPy's generators for all designs but plain random ones."""
    rng = np.random.default_rng(seed)
    if design == "random":
        return rng.random((n, d))
    from scipy.stats import qmc

    if design in ("sobol", "saltelli") and n & (n - 1):
        below = 1 << (n.bit_length() - 1)
        raise ModelError(
            f"samples={n}: points of Sobol are balanced if there is a power of two of them; take {below} or {2 * below}"
        )
    kind = qmc.LatinHypercube if design == "latin" else qmc.Sobol
    try:
        made = kind(d, rng=rng)
    except TypeError:  # SciPy before 1.15
        made = kind(d, seed=rng)
    return made.random(n)


def _saltelli_samples(A: np.ndarray, B: np.ndarray) -> np.ndarray:
    """The samples A, B, and for each parameter A with that parameter's column of B (Saltelli et al. 2010)."""
    mixed = []
    for k in range(A.shape[1]):
        mixed.append(A.copy())
        mixed[k][:, k] = B[:, k]
    return np.vstack([A, B, *mixed])
