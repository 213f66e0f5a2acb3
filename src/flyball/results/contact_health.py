"""How well contacts were solved."""

from __future__ import annotations

from dataclasses import asdict, dataclass, field
from typing import Any

PASSED = 0.5  # overlap, over the size of the smallest body, from which on bodies are pushed out on the other side


@dataclass(frozen=True)
class ContactHealth:
    """Figures of contact over a whole run.

    Attributes
    ----------
    solver : str
        What solved the contacts, and why it was chosen.
    impacts : str
        Law of impacts, and whether they come together or one after the other.
    most : int
        Contacts in one step, at most.
    worst_overlap : float [m]
        Deepest overlap after any step.
    overlap_at_start : float [m]
        Deepest overlap as described.
    residual : float [m/s]
        Largest velocity left in any solve that should vanish.
    force_residual : float
        Largest part of an impulse that was left, over the largest impulse of its solve.
    tolerance : float [m/s]
        What the residual was asked to be.
    solves, iterations, unconverged : int
        How many solves of velocities there were, all iterations, and how many solves were cut off with more left than
        what gravity makes in a step.
    worst_at : float or None [s]
        Time of the largest residual.
    size : float [m]
        Of the smallest body that touches, which overlaps are compared with.
    halved, reduced, impacted, endless : int
        Steps that were divided; impacts that gave back less than their law says, of how many; steps in which the
        sequence of impacts did not end.
    notes : tuple of str
        What else has to be said: a law of impacts that was softened, a position without unique forces (Painleve).
    """

    solver: str = ""
    impacts: str = ""
    most: int = 0
    worst_overlap: float = 0.0
    overlap_at_start: float = 0.0
    residual: float = 0.0
    force_residual: float = 0.0
    tolerance: float = 0.0
    solves: int = 0
    iterations: int = 0
    unconverged: int = 0
    worst_at: float | None = None
    size: float = 0.0
    notes: tuple[str, ...] = field(default_factory=tuple)
    halved: int = 0
    reduced: int = 0
    impacted: int = 0
    endless: int = 0

    def lines(self) -> list[tuple[str, str]]:
        """Labels and texts for people."""
        out = [("contact", f"{self.most} contacts at most")]
        if self.solver:
            out.append(("contact solver", self.solver))
        if self.impacts:
            out.append(("impacts", self.impacts))
        out.append(("worst overlap", f"{self.worst_overlap:.2g} m"))
        out.append(("contact residual", f"{self.residual:.2e} m/s, {self.force_residual:.2e} of the largest force"))
        if self.solves:
            left = f", {self.unconverged} not converged" if self.unconverged else ""
            out.append(("contact solves", f"{self.solves}, {self.iterations / self.solves:.3g} iterations each{left}"))
        return out

    @property
    def doubts(self) -> tuple[str, ...]:
        """Reasons to think that the motion is wrong."""
        out = []
        if self.endless:
            out.append(
                f"in {self.endless} of {self.solves} steps the sequence of impacts did not end, and the last were "
                f"taken as inelastic: take shorter steps, method=fb.Stepping(step=...), with fewer impacts in each"
            )
        if self.size > 0.0 and self.worst_overlap > max(PASSED * self.size, 1.01 * self.overlap_at_start):
            out.append(
                f"bodies overlap by up to {self.worst_overlap:.2g} m, more than half of the smallest body "
                f"({self.size:.2g} m), and may have passed through each other: take shorter steps, "
                f"method=fb.Stepping(step=...)"
            )
        return tuple(out)

    def warnings(self) -> tuple[str, ...]:
        """Reasons to look at the motion twice."""
        out = list(self.notes)
        if self.halved:
            out.append(
                f"{self.halved} steps were taken in shorter ones, as joints could not follow: give shorter steps"
            )
        if self.reduced:
            law = self.impacts.partition(",")[0]
            out.append(
                f"{self.reduced} of {self.impacted} impacts gave back less than {law}'s law says, which would have "
                f"made energy there"
            )
        if self.unconverged:
            when = f", the worst at t = {self.worst_at:.4g} s" if self.worst_at is not None else ""
            share = f"{self.unconverged} of {self.solves} contact solves were cut off before they had converged{when}"
            out.append(
                f"{share}: forces are rough there; take shorter steps, or allow more by "
                f"method=fb.Stepping(iterations=...)"
            )
        if self.size > 0.0 and self.worst_overlap > max(0.02 * self.size, 1.01 * self.overlap_at_start):
            part = f"{100.0 * self.worst_overlap / self.size:.2g} per cent of the smallest body"
            out.append(f"bodies overlap by up to {self.worst_overlap:.2g} m, {part}; take shorter steps")
        if self.size > 0.0 and self.overlap_at_start > 1e-3 * self.size:
            out.append(f"bodies overlap by {self.overlap_at_start:.2g} m as described; they are pushed apart at first")
        return tuple(out)

    def as_dict(self) -> dict[str, Any]:
        """Plain data."""
        return asdict(self)

    @classmethod
    def from_dict(cls, data: dict[str, Any]) -> ContactHealth:
        """What `as_dict` gave."""
        return cls(**(data | {"notes": tuple(data.get("notes", ()))}))
