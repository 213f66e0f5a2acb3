"""Optimisation of parameters with exact derivatives: tuning, synthesis of linkages, fits to measurements."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, fields
from typing import Any

import numpy as np

from ..analysis_options import AnalysisOptions, name_list, require_positive
from ..analysis_options import require_count as at_least
from ..errors import AnalysisError, Interrupted, ModelError
from ..model.expressions import number
from ..model.model import Model, listing, suggest
from ..model.quantities import single_quantity
from ..model.unsupported_elements import refuse_unsupported
from ..progress import ReportProgress, progress_bar
from ..results.measurements import Measurements, read_measurements
from ..results.sensitivity_and_optimum import Fit, Optimum
from .sensitivity import DerivativeOptions, SensitivityOptions, sensitivity

DIFFERENCE_STEP = 1e-6  # relative step of the quantities for the gradient of a user's function
# Cost of parameters with which the mechanism cannot be assembled, relative to the first cost.
FAILURE_COST = 1e3

Bounds = Mapping[str, tuple[float | str | None, float | str | None]]


@dataclass(frozen=True, kw_only=True)
class OptimizeOptions(DerivativeOptions):
    """Arguments of `Mechanism.optimize`."""

    of: tuple[str, ...]
    to: Sequence[str] | Bounds
    target: Any
    minimize: Callable[[np.ndarray], float] | None
    weights: Any
    evaluations: int
    tolerance: float
    progress: bool | Callable[[float], None]

    def __post_init__(self) -> None:
        super().__post_init__()
        if not isinstance(self.to, Mapping):
            object.__setattr__(self, "to", name_list(self.to, "to"))
        if not self.to:
            raise ModelError("to names the parameters, for instance to=['crank'] or to={'crank': (0.1, '30 cm')}")
        for name, bounds in self.to.items() if isinstance(self.to, Mapping) else ():
            if isinstance(bounds, str) or not isinstance(bounds, Sequence) or len(bounds) != 2:
                raise ModelError(
                    f"bounds of {name!r} are two numbers or None, for instance (0.1, None), not {bounds!r}"
                )
        weights = _number_array(self.weights, "weights")
        if not np.isfinite(weights).all():
            raise ModelError(f"weights are finite numbers, not {self.weights!r}")
        object.__setattr__(self, "weights", weights)
        if (self.target is None) == (self.minimize is None):
            raise ModelError("give either a target or a function to minimize")
        if self.minimize is not None and not (np.ndim(self.weights) == 0 and self.weights == 1.0):
            raise ModelError("weights apply to the differences from a target; with minimize they have no effect")
        at_least(self.evaluations, "evaluations")
        require_positive(self.tolerance, "tolerance")

    def sensitivity(self, parameters: Mapping[str, float]) -> SensitivityOptions:
        """Options of the sensitivity analysis at other values of the parameters."""
        return SensitivityOptions(
            of=self.of,
            to=tuple(self.to),
            analysis=self.analysis,
            t=self.t,
            t_end=self.t_end,
            outputs=self.outputs,
            parameters={**(self.parameters or {}), **parameters},
            about=self.about,
            rtol=self.rtol,
            atol=self.atol,
            coordinates=self.coordinates,
            verify=False,
        )


ZERO_SLOPE_MESSAGE = (
    "every derivative is zero at the start, which may be a minimum or not: start from other values to check"
)
LIMIT_MESSAGE = "as many analyses as evaluations= allows"
FIT_MESSAGES = {  # by the status of SciPy's least_squares
    0: LIMIT_MESSAGE,
    1: "no change of the parameters makes it less",
    2: "the cost falls by less than the tolerance",
    3: "the parameters change by less than the tolerance",
    4: "the cost and the parameters change by less than the tolerance",
}
SEARCH_MESSAGES = {  # by the status of L-BFGS-B
    0: "no change of the parameters makes it less by more than the tolerance",
    1: LIMIT_MESSAGE,
    2: (
        "no smaller value was found along the slope: the function has a kink there, or rounding is as large as the "
        "tolerance"
    ),
}


def optimize(model: Model, o: OptimizeOptions) -> Optimum:
    """Find optimal parameters: see `Mechanism.optimize`."""
    refuse_unsupported(model, "optimize", controlled=True)
    with progress_bar(o.progress, "optimizing") as tell:
        search = ParameterSearch(model, o, tell)
        try:
            return search.fit(o.target, o.weights) if o.minimize is None else search.minimum(o.minimize)
        except KeyboardInterrupt as stopped:
            interruption = search.interruption()
            if interruption is None:
                raise
            raise interruption from stopped


class ParameterSearch:
    """Quantities and their derivatives as functions of scaled parameters."""

    def __init__(self, model: Model, o: OptimizeOptions, report_progress: ReportProgress) -> None:
        env = model.environment(o.parameters)
        for name in o.to:
            if name not in env:
                raise ModelError(
                    f"{model.name!r} has no parameter {name!r}{suggest(name, list(env))}; {listing(list(env))}"
                )
        self.model, self.options, self.names, self.tell = model, o, tuple(o.to), report_progress
        self.start = np.array([env[name] for name in self.names])
        self.scale = np.where(self.start != 0.0, np.abs(self.start), 1.0)
        self.low, self.high = (self._bounds(o.to, k) for k in (0, 1))
        for k in np.flatnonzero(self.low >= self.high):
            raise ModelError(
                f"the bounds of {self.names[k]!r} leave no value between them; give others, or leave it out"
            )
        self._known: tuple[np.ndarray, Any] | None = None
        self.count = 0
        self._best: tuple[float, np.ndarray, Any] | None = None
        self._first = 0.0
        self._refused: list[str] = []  # reasons why trials could not be computed

    def _bounds(self, to: Sequence[str] | Bounds, k: int) -> np.ndarray:
        out = np.full(len(self.names), np.inf if k else -np.inf)
        if isinstance(to, Mapping):
            for i, name in enumerate(self.names):
                bound = to[name][k]
                if bound is not None:
                    out[i] = number(bound, {}, None, f"bound of {name!r}") / self.scale[i]
        x = self.start / self.scale
        wrong = np.flatnonzero(x > out) if k else np.flatnonzero(x < out)
        if len(wrong):
            i = wrong[0]
            raise ModelError(
                f"parameter {self.names[i]!r} starts at {self.start[i]:g}, outside its bound {out[i] * self.scale[i]:g}"
            )
        return out

    def at(self, x: np.ndarray) -> Any:
        """Sensitivities at scaled parameters; the last result is cached."""
        if self._known is None or not np.array_equal(self._known[0], x):
            values = dict(zip(self.names, (x * self.scale).tolist(), strict=True))
            self.count += 1
            try:
                found = sensitivity(self.model, self.options.sensitivity(values))
            except AnalysisError as error:
                named = ", ".join(f"{name} = {value:.6g}" for name, value in values.items())
                error.args = (f"with {named}: {error}", *error.args[1:])
                self._refused.append(str(error))
                raise
            self.tell(
                self.count / self.options.evaluations, f"{self.count} of at most {self.options.evaluations} analyses"
            )
            self._known = x.copy(), found
        return self._known[1]

    def _weighed(self, x: np.ndarray, cost: float) -> None:
        """Store the parameters if their cost is the lowest so far."""
        if self._best is None:
            self._first = cost
        if self._best is None or cost < self._best[0]:
            self._best = cost, x.copy(), self.at(x)

    def interruption(self) -> Interrupted | None:
        """The error for the user's interrupt, with the best parameters so far; None if there are none."""
        if self._best is None:
            return None
        cost, x, found = self._best
        self._known = x, found
        message = f"interrupted by the user after {self.count} analyses; the best by then is kept"
        return Interrupted(message, self._optimum(x, cost, self._first, False, message))

    def fit(self, target: Any, weights: Any) -> Optimum:
        """Fit the quantities to a target by least squares."""
        from scipy.optimize import least_squares

        x0 = self.start / self.scale
        first = self.at(x0)
        goal = _target_array(target, first.values, self.options.of or first.of, self.options.analysis)

        def split(r: np.ndarray) -> np.ndarray:
            return r if np.isrealobj(r) else np.concatenate([r.real, r.imag])

        def residuals(found: Any) -> np.ndarray:
            return split((np.asarray(weights) * (found.values - goal)).ravel())

        begin = residuals(first)
        size = float(np.abs(begin).max(initial=0.0)) or 1.0

        def residual(x: np.ndarray) -> np.ndarray:
            try:
                r = residuals(self.at(x))
            except AnalysisError:
                return np.full(len(begin), FAILURE_COST * size)
            self._weighed(x, 0.5 * float(r @ r))
            return r

        def jacobian(x: np.ndarray) -> np.ndarray:
            found = self.at(x)
            J = np.asarray(weights)[..., None] * found.derivatives if np.ndim(weights) else weights * found.derivatives
            return np.array([split(J[..., k].ravel()) for k in range(len(x))]).T * self.scale

        r = least_squares(
            residual, x0, jacobian, bounds=(self.low, self.high), xtol=self.options.tolerance,
            ftol=self.options.tolerance, gtol=1e-15, max_nfev=self.options.evaluations,
        )  # fmt: skip
        flat = r.nfev == 1 and r.cost > 0.0 and not np.any(r.grad)
        out = self._optimum(
            r.x,
            float(r.cost),
            0.5 * float(begin @ begin),
            r.status > 0,
            ZERO_SLOPE_MESSAGE if flat else FIT_MESSAGES[r.status],
        )
        out.success &= not flat
        out.start_values, out.target = first.values, np.broadcast_to(goal, first.values.shape)
        return out

    def minimum(self, function: Callable[[np.ndarray], float]) -> Optimum:
        """Minimise a function of the quantities."""
        from scipy.optimize import minimize

        x0 = self.start / self.scale
        begin = self.at(x0).values
        try:
            first = float(function(begin))
        except (TypeError, ValueError) as error:
            raise ModelError(
                f"minimize: {function!r} must make one number of an array {begin.shape}, quantities at times; "
                f"{type(error).__name__}: {error}"
            ) from error

        def cost(x: np.ndarray) -> tuple[float, np.ndarray]:
            try:
                found = self.at(x)
            except AnalysisError:
                return FAILURE_COST * (abs(first) or 1.0), np.zeros(len(x))
            slope, value = _difference_gradient(function, found.values), float(function(found.values))
            self._weighed(x, value)
            return value, np.einsum("ij,ijk->k", slope.conj(), found.derivatives).real * self.scale

        bounds = list(zip(self.low, self.high, strict=True))
        tolerance = self.options.tolerance
        options = {"maxfun": self.options.evaluations, "ftol": tolerance, "gtol": tolerance}
        r = minimize(cost, x0, jac=True, method="L-BFGS-B", bounds=bounds, options=options)
        flat = r.nfev == 1 and not np.any(r.jac)
        out = self._optimum(
            r.x,
            float(r.fun),
            first,
            bool(r.success) and not flat,
            ZERO_SLOPE_MESSAGE if flat else SEARCH_MESSAGES[r.status],
        )
        out.start_values = begin
        return out

    def _optimum(self, x: np.ndarray, cost: float, first: float, success: bool, message: str) -> Optimum:
        found = self.at(x)
        best, start = (dict(zip(self.names, v.tolist(), strict=True)) for v in (x * self.scale, self.start))
        near = 1e-9 * (1.0 + np.abs(x))
        message = message.rstrip(".")
        if self._refused:
            count = len(self._refused)
            trials = f"{count} {'trial' if count == 1 else 'trials'} of {self.count} could not be computed"
            message += f"; {trials} and the search stepped back; the last {self._refused[-1]}"
        at_bound = tuple(
            n for n, b in zip(self.names, (x - self.low < near) | (self.high - x < near), strict=True) if b
        )
        return Optimum(
            best, start, cost, first, success, message, self.count, self.options.of or found.of, found.t,
            found.values, at_bound, found.units,
        )  # fmt: skip


def _target_array(target: Any, values: np.ndarray, of: Sequence[str], analysis: str) -> np.ndarray:
    """The target in the shape of the quantities; eigenvalues in any order, one of each complex pair suffices.

    Raises
    ------
    ModelError
        If its shape does not match.
    """
    parts = [number(x, {}, None, "target") if isinstance(x, str) else x for x in np.asarray(target, object).ravel()]
    goal = _number_array(parts, "target", complex if analysis == "modes" else float)
    if not np.isfinite(goal).all():
        raise ModelError(f"target: finite numbers are wanted, not {target!r}")
    if analysis == "modes":
        order = np.lexsort((values[0].real, values[0].imag))
        if len(goal) < values.shape[1]:
            goal = np.concatenate([goal, np.conj(goal[goal.imag != 0.0])])
        if len(goal) == values.shape[1]:
            out = np.empty_like(goal)
            out[order] = goal[np.lexsort((goal.real, goal.imag))]
            return out[None]
    elif goal.size == values.size and np.shape(target) in (values.shape, values.shape[1:], values.shape[:1]):
        return goal.reshape(values.shape)
    times = f" at {len(values)} times" if len(values) > 1 else ""
    raise ModelError(
        f"the target has the shape {np.shape(target)}, which does not fit {', '.join(of)}{times}; give one number for "
        f"each quantity{', a row for each time (outputs=)' if times else ''}"
    )


def _number_array(values: Any, name: str, kind: type = float) -> np.ndarray:
    """Convert to an array of numbers.

    Raises
    ------
    ModelError
        If that is not possible.
    """
    try:
        return np.array(values, kind)
    except (TypeError, ValueError, OverflowError):
        raise ModelError(f"{name}: {values!r} are no numbers") from None


def _difference_gradient(function: Callable[[np.ndarray], float], values: np.ndarray) -> np.ndarray:
    """Derivatives of a function by the quantities, by central differences.

    Steps are relative to the largest value of each quantity. For complex quantities the derivatives by real and
    imaginary part are the real and imaginary part of the result.
    """
    out, size = np.zeros(values.shape, values.dtype), np.abs(values).max(axis=0)
    size[size == 0.0] = 1.0
    for i in np.ndindex(values.shape):
        h = DIFFERENCE_STEP * size[i[1:]]
        for way in (1.0, 1.0j) if np.iscomplexobj(values) else (1.0,):
            up, down = values.copy(), values.copy()
            up[i] += h * way
            down[i] -= h * way
            out[i] += way * (function(up) - function(down)) / (2.0 * h)
    return out


# Fits to measurements: nonlinear least squares with weights 1 / sigma of each curve. The covariance of the estimates is
# s^2 (J^T J)^-1 with the weighted Jacobian J and the variance s^2 of the weighted residuals, 1 where sigma is known;
# intervals are those of Student's distribution (Seber and Wild, Nonlinear Regression, 1989, sections 2.1 and 5.1).

NOT_DETERMINED = 1e-7  # smallest singular value of the scaled Jacobian, relative to the largest: below it is rounding


@dataclass(frozen=True, kw_only=True)
class FitOptions(AnalysisOptions):
    """Arguments of `Mechanism.fit`."""

    data: str | os.PathLike | Mapping[str, Any]
    to: Sequence[str] | Bounds
    noise: Mapping[str, float | str] | None
    confidence: float
    parameters: Mapping[str, float] | None
    rtol: float | None
    atol: float | None
    coordinates: str
    evaluations: int
    tolerance: float
    progress: bool | Callable[[float], None]

    def __post_init__(self) -> None:
        super().__post_init__()
        if not 0.0 < self.confidence < 1.0:
            raise ModelError(f"confidence is a probability between 0 and 1, such as 0.95, not {self.confidence!r}")

    def optimization(self, m: Measurements, weights: np.ndarray, parameters: Mapping[str, float]) -> OptimizeOptions:
        """Return the options of the least squares with these weights (n, of), from other values of the parameters."""
        given = ("to", "rtol", "atol", "coordinates", "evaluations", "tolerance", "progress")
        own = {k: getattr(self, k) for k in given}
        first = min(0.0, float(m.t[0]))
        return OptimizeOptions(
            **own, of=m.names, target=np.where(m.known, m.values, 0.0), minimize=None, weights=weights,
            analysis="motion", t=first, t_end=float(m.t[-1]), outputs=m.t.tolist(), about=None,
            parameters={**(self.parameters or {}), **parameters},
        )  # fmt: skip


def fit(model: Model, o: FitOptions) -> Fit:
    """Fit parameters to measurements: see `Mechanism.fit`."""
    refuse_unsupported(model, "fit", controlled=True)
    m = read_measurements(model, o.data)
    given = _noise(model, m, o.noise)
    finite = np.where(m.known, m.values, np.nan)
    ranges = np.nanmax(finite, axis=0) - np.nanmin(finite, axis=0)
    sigma = np.array([given.get(name, 0.0) for name in m.names])
    sigma = np.where(sigma > 0.0, sigma, np.where(ranges > 0.0, ranges, 1.0))
    found = optimize(model, o.optimization(m, np.where(m.known, 1.0 / sigma, 0.0), {}))
    if not given:  # again, with weights from the residuals
        first, sigma = found, _noise_of_residuals(m, found, sigma, len(o.to))
        found = optimize(model, o.optimization(m, np.where(m.known, 1.0 / sigma, 0.0), first.parameters))
        found.start, found.start_values = first.start, first.start_values
        begin = np.where(m.known, (first.start_values - m.values) / sigma, 0.0)
        found.start_cost = 0.5 * float((begin**2).sum())
        found.evaluations += first.evaluations
        sigma = _noise_of_residuals(m, found, sigma, len(o.to))
    J = sensitivity(model, o.optimization(m, np.ones(1), {}).sensitivity(found.parameters)).derivatives
    return _with_intervals(o, m, found, J, sigma, bool(given))


def _noise(model: Model, m: Measurements, noise: Mapping[str, float | str] | None) -> dict[str, float]:
    """Return given standard deviations in SI units: of all curves, or none."""
    out = {}
    for name, x in (noise or {}).items():
        if name not in m.names:
            raise ModelError(f"noise: {name!r} is not among the data{suggest(name, list(m.names))}")
        out[name] = number(x, {}, single_quantity(model, name).unit, f"noise of {name!r}")
        require_positive(out[name], f"noise of {name!r}")
    if out and len(out) < len(m.names):
        missing = next(name for name in m.names if name not in out)
        raise ModelError(f"give the noise of every curve, also of {missing!r}, or of none")
    return out


def _noise_of_residuals(m: Measurements, found: Optimum, sigma: np.ndarray, parameters: int) -> np.ndarray:
    """Estimate the standard deviation of each curve's noise; each curve has its share of the parameters."""
    r = np.where(m.known, m.values - found.values, 0.0)
    counts = m.known.sum(axis=0)
    freedom = np.maximum(counts - parameters * counts / counts.sum(), 1.0)
    estimate = np.sqrt((r**2).sum(axis=0) / freedom)
    return np.where(estimate > 0.0, estimate, sigma)


def _with_intervals(
    o: FitOptions, m: Measurements, found: Optimum, derivatives: np.ndarray, sigma: np.ndarray, known: bool
) -> Fit:
    """Return the fit with the confidence intervals of its parameters."""
    from scipy.stats import norm
    from scipy.stats import t as student

    names = list(found.parameters)
    J = (derivatives / sigma[:, None])[m.known]
    r = ((m.values - found.values) / sigma)[m.known]
    size = np.linalg.norm(J, axis=0)
    freedom = len(r) - len(names)
    if freedom < (0 if known else 1):
        raise AnalysisError(f"{len(r)} measured values do not determine {len(names)} parameters and their uncertainty")
    _, s, V = np.linalg.svd(J / np.where(size > 0.0, size, 1.0), full_matrices=False)
    if not size.all() or s[-1] <= NOT_DETERMINED * s[0]:
        weak = [n for n, x in zip(names, np.abs(V[-1]), strict=True) if x > 0.5 * np.abs(V[-1]).max()]
        raise AnalysisError(
            f"the data do not determine {' and '.join(weak)}{' separately' if len(weak) > 1 else ''}: leave one out, "
            "or measure a motion that depends on them in different ways"
        )
    variance = 1.0 if known else float(r @ r) / freedom
    covariance = variance * (V.T / s**2) @ V / np.outer(size, size)
    errors = np.sqrt(np.diag(covariance))
    tail = 0.5 + 0.5 * o.confidence
    wide = float(norm.ppf(tail) if known else student.ppf(tail, freedom)) * errors
    best = np.array(list(found.parameters.values()))
    kept = {f.name: getattr(found, f.name) for f in fields(found)} | {"target": np.where(m.known, m.values, np.nan)}
    return Fit(
        **kept,
        intervals=dict(zip(names, zip((best - wide).tolist(), (best + wide).tolist(), strict=True), strict=True)),
        standard_errors=dict(zip(names, errors.tolist(), strict=True)),
        covariance=covariance,
        confidence=o.confidence,
        noise=dict(zip(m.names, (sigma * np.sqrt(variance)).tolist(), strict=True)),
    )
