"""How well a motion was computed: what every result says about itself."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, fields
from typing import Any


@dataclass
class Health:
    """Figures that tell whether a result can be trusted.

    Those that take time to find (freedoms by rank, undetermined reactions, the energy balance) are found when first
    asked for.
    """

    success: bool
    message: str
    violation: float  # largest |g| at a reported time [m or rad]
    velocity_violation: float  # largest |G v - nu| at a reported time [m/s or rad/s]
    steps: int
    rejected: int
    evaluations: int
    factorisations: int
    seconds: float  # wall time, assembly included [s]
    options: dict[str, Any] = field(default_factory=dict)
    late: dict[str, Callable[[], Any]] = field(default_factory=dict, repr=False, compare=False)

    def _found(self, name: str) -> Any:
        value = self.late[name]
        if callable(value):
            value = self.late[name] = value()
        return value

    @property
    def freedoms(self) -> int:
        """Freedoms by rank, at the start."""
        return self._found("mobility").freedoms

    @property
    def redundant(self) -> tuple[str, ...]:
        """Joints whose constraints depend on one another."""
        return self._found("mobility").redundant

    @property
    def undetermined(self) -> dict[str, tuple[str, ...]]:
        """Joint -> reaction components (world axes) that redundancy leaves undetermined."""
        return self._found("mobility").undetermined

    @property
    def energy_drift(self) -> float:
        """Largest deviation from the energy balance [J]."""
        return self._found("energy_drift")

    def as_dict(self) -> dict[str, Any]:
        """Plain data."""
        plain = {f.name: getattr(self, f.name) for f in fields(self) if f.name != "late"}
        return plain | {k: getattr(self, k) for k in ("freedoms", "redundant", "undetermined", "energy_drift")}

    def lines(self) -> list[tuple[str, str]]:
        """Label and text of what a reader wants to see first."""
        out = [
            ("status", "done" if self.success else self.message),
            ("freedoms", str(self.freedoms)),
            ("steps", f"{self.steps} accepted, {self.rejected} refused"),
            ("energy balance", f"{self.energy_drift:.2e} J largest deviation"),
            ("violation", f"{self.violation:.2e} of positions, {self.velocity_violation:.2e} of velocities"),
            ("time used", f"{self.seconds:.2f} s"),
        ]
        if self.redundant:
            out.insert(2, ("redundant", ", ".join(self.redundant)))
        if self.undetermined:
            text = "; ".join(f"{k}: {', '.join(v)}" for k, v in self.undetermined.items())
            out.insert(3, ("reactions not determined", text))
        return out

    def __str__(self) -> str:
        width = max(len(k) for k, _ in self.lines())
        return "\n".join(f"{k:<{width}}  {v}" for k, v in self.lines())
