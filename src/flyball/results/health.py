"""How well a motion was computed: what every result says about itself."""

from __future__ import annotations

from dataclasses import asdict, dataclass, field
from typing import Any


@dataclass
class Health:
    """Figures that tell whether a result can be trusted."""

    success: bool
    message: str
    violation: float  # largest |g| at a reported time [m or rad]
    velocity_violation: float  # largest |G v - nu| at a reported time [m/s or rad/s]
    steps: int
    rejected: int
    evaluations: int
    factorisations: int
    seconds: float  # wall time, assembly included [s]
    freedoms: int
    redundant: tuple[str, ...] = ()  # joints whose constraints depend on one another
    undetermined: dict[str, tuple[str, ...]] = field(default_factory=dict)  # joint -> reaction components
    energy_drift: float = float("nan")  # largest deviation from the energy balance [J]
    options: dict[str, Any] = field(default_factory=dict)

    def as_dict(self) -> dict[str, Any]:
        """Plain data."""
        return asdict(self)

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
