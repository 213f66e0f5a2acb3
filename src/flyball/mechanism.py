"""``Mechanism``: the description with every analysis as a method."""

from __future__ import annotations

import os
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from .model.model import Model

if TYPE_CHECKING:
    from .analysis.assembly.start import Assembly
    from .analysis.check import Report
    from .analysis.mass import MassReport
    from .analysis.mobility import Mobility
    from .results.comparison import Comparison
    from .results.equilibrium import Equilibrium
    from .results.inverse import InverseDynamics
    from .results.linear import LinearModel
    from .results.modes import Modes
    from .results.optimum import Optimum
    from .results.result import Result
    from .results.root_locus import RootLocus
    from .results.sensitivity import Sensitivity
    from .results.series import EquilibriumSeries
    from .results.singularities import Singularities


class Mechanism(Model):
    """A mechanism: described once, then asked anything. See `Model` for what it takes.

    Nothing that an analysis finds is stored in it, so sweeps are loops.
    """

    def simulate(self, t_end: float, **options: Any) -> Result:
        """Motion from ``t_start`` (0) to ``t_end``; see `flyball.analysis.simulate.simulate` for the options."""
        from .analysis.simulate import simulate

        return simulate(self, t_end, **options)

    def compare(self, t_end: float, **options: Any) -> Comparison:
        """The same motion by several formulations of its equations: drift, energy and cost of each.

        See `flyball.analysis.compare.compare` for the options.
        """
        from .analysis.compare import compare

        return compare(self, t_end, **options)

    def kinematics(self, times: int | Sequence[float] = 501, **options: Any) -> Result:
        """Motion that drivers prescribe; see `flyball.analysis.kinematics.kinematics` for the options."""
        from .analysis.kinematics import kinematics

        return kinematics(self, times, **options)

    def inverse_dynamics(
        self, times: int | Sequence[float] = 501, motion: Any = None, **options: Any
    ) -> InverseDynamics:
        """Efforts and reactions; see `flyball.analysis.inverse_dynamics.inverse_dynamics` for the options."""
        from .analysis.inverse_dynamics import inverse_dynamics

        return inverse_dynamics(self, times, motion, **options)

    def assemble(self, **options: Any) -> Assembly:
        """Consistent positions and velocities near those described."""
        from .analysis.assemble import assemble

        return assemble(self, **options)

    def equilibrium(self, **options: Any) -> Equilibrium:
        """A static equilibrium near the mechanism as described, and whether it is stable.

        See `flyball.analysis.equilibrium.equilibrium` for the options.
        """
        from .analysis.equilibrium import equilibrium

        return equilibrium(self, **options)

    def linearize(self, inputs: Sequence[str] = (), outputs: Sequence[str] = (), **options: Any) -> LinearModel:
        """Linear equations about an equilibrium or a steady motion, with named inputs and outputs.

        See `flyball.analysis.linearize.linearize` for the options.
        """
        from .analysis.linearize import linearize

        return linearize(self, inputs, outputs, **options)

    def modes(self, **options: Any) -> Modes:
        """Natural motions about an equilibrium or a steady motion; see `flyball.analysis.modes.modes`."""
        from .analysis.modes import modes

        return modes(self, **options)

    def equilibria(self, parameter: str, values: Sequence[float], **options: Any) -> EquilibriumSeries:
        """Equilibria over values of a parameter, each following from the one before.

        See `flyball.analysis.series.equilibria` for the options.
        """
        from .analysis.series import equilibria

        return equilibria(self, parameter, values, **options)

    def root_locus(self, parameter: str, values: Sequence[float], **options: Any) -> RootLocus:
        """Eigenvalues over values of a parameter; see `flyball.analysis.root_locus.root_locus` for the options."""
        from .analysis.root_locus import root_locus

        return root_locus(self, parameter, values, **options)

    def sensitivity(self, of: Sequence[str] = (), to: Sequence[str] = (), **options: Any) -> Sensitivity:
        """Derivatives of kinematics, reactions, equilibria, eigenvalues or motions by parameters.

        See `flyball.analysis.sensitivity.sensitivity` for the options.
        """
        from .analysis.sensitivity import sensitivity

        return sensitivity(self, of, to, **options)

    def optimize(self, of: Sequence[str], to: Any, **options: Any) -> Optimum:
        """Parameters for which quantities come nearest to a target; see `flyball.analysis.optimize.optimize`."""
        from .analysis.optimize import optimize

        return optimize(self, of, to, **options)

    def check(self) -> Report:
        """Freedoms, redundancies, assembly and mass properties, without simulating."""
        from .analysis.check import check

        return check(self)

    def mobility(self, **options: Any) -> Mobility:
        """Freedoms and redundant sets by name, with cures; see `flyball.analysis.mobility.mobility` for the options."""
        from .analysis.mobility import mobility

        return mobility(self, **options)

    def mass_properties(self, **options: Any) -> MassReport:
        """Masses, inertias and principal axes; see `flyball.analysis.mass.mass_properties` for the options."""
        from .analysis.mass import mass_properties

        return mass_properties(self, **options)

    def singularities(self, driver: str, range: Any, **options: Any) -> Singularities:
        """Singular positions over a range of a driver; see `flyball.analysis.singularities.singularities`."""
        from .analysis.singularities import singularities

        return singularities(self, driver, range, **options)

    def save(self, path: str | os.PathLike) -> None:
        """Write the description to a TOML file; `flyball.load` reads it back exactly."""
        from .model.io import save

        save(self, path)

    def _repr_html_(self) -> str:
        from .view.described import described

        return described(self)
