"""What a mechanism is: assembled, its freedoms, its masses, the positions where it locks or branches."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from ..analysis.assembly.start import Assembly
    from ..model.model import Model
    from ..results.check import Report
    from ..results.mass import MassReport
    from ..results.mobility import Mobility
    from ..results.singularities import Branch, Singularities
else:
    Model = object  # a mechanism is one; signatures alone load nothing


class Freedom(Model):
    """Positions, freedoms and masses of a mechanism."""

    def assemble(self, *, t: float | str = 0.0, parameters: Mapping[str, float | str] | None = None) -> Assembly:
        """Find positions and velocities that fulfil all constraints, near those described.

        Parameters
        ----------
        t : float or str [s]
            Time at which laws of drivers are taken.
        parameters : mapping, optional
            Values of parameters in place of the model's, in SI units or with a unit.

        Returns
        -------
        Assembly

        Raises
        ------
        AssemblyError
            If no closed position, or no consistent velocity, is found; the message names the joints that disagree and
            by how much.
        """
        from ..analysis.assemble import assemble
        from ..analysis.options import AssembleOptions

        o = AssembleOptions.asked(locals())
        return assemble(self, t=o.t, parameters=o.parameters)

    def check(self) -> Report:
        """Freedoms, redundant joints, assembly, mass properties and warnings, without simulating.

        Returns
        -------
        Report

        Raises
        ------
        AssemblyError
            If the mechanism cannot be assembled.
        """
        from ..analysis.check import check

        return check(self)

    def mobility(
        self,
        *,
        t: float | str = 0.0,
        parameters: Mapping[str, float | str] | None = None,
        inertia: bool = False,
    ) -> Mobility:
        """Freedoms by name, redundant constraints and their cures, special dimensions and singular positions.

        Parameters
        ----------
        t : float or str [s]
            Time at which the mechanism is assembled. One that cannot be is looked at in the best position found: the
            constraints that contradict one another are those that depend on one another there.
        parameters : mapping, optional
            Values of parameters in place of the model's, in SI units or with a unit.
        inertia : bool
            Refuse bodies that can move without any inertia: where forces are to move them, they could not.

        Returns
        -------
        Mobility

        Raises
        ------
        ModelError
            If a body can move without any inertia and may not.
        AssemblyError
            If velocities disagree though positions do not depend on one another.
        """
        from ..analysis.mobility import mobility
        from ..analysis.options import MobilityOptions

        o = MobilityOptions.asked(locals())
        return mobility(self, t=o.t, parameters=o.parameters, inertia=o.inertia)

    def mass_properties(
        self, *, drawn: bool = False, parameters: Mapping[str, float | str] | None = None
    ) -> MassReport:
        """Mass, centre of mass, inertia, principal moments and axes of every body and of all together.

        Parameters
        ----------
        drawn : bool
            Where bodies are: as drawn, or (if false) after assembly at t = 0.
        parameters : mapping, optional
            Values of parameters in place of the model's, in SI units or with a unit.

        Returns
        -------
        MassReport

        Raises
        ------
        AssemblyError
            If it cannot be assembled; as drawn it can be looked at all the same.
        """
        from ..analysis.mass import MassOptions, mass_properties

        return mass_properties(self, MassOptions.asked(locals()))

    def singularities(
        self,
        driver: str,
        range: Sequence[float | str],
        *,
        t: float | str = 0.0,
        parameters: Mapping[str, float | str] | None = None,
        branch: Branch | int | None = None,
        step: float = 0.1,
        steps: int = 5000,
    ) -> Singularities:
        """Follow a driven motion and find every position where the driven Jacobian loses rank.

        From the assembled position the curve of positions is followed by arc length, both ways, with the driver's law
        replaced by a value of its coordinate, until that leaves the range or the curve closes. Where the driver locks
        up the curve turns back, and is followed on the other side. Other drivers stay at what they ask for at ``t``.

        Parameters
        ----------
        driver : str
            Name of the driver whose coordinate is varied.
        range : (float or str, float or str)
            From and to, of the driver's coordinate [rad] or [m], or with a unit: ``("0 deg", "360 deg")``.
        t : float or str [s]
            Time at which laws are taken.
        parameters : mapping, optional
            Values of parameters in place of the model's, in SI units or with a unit.
        branch : Branch or int, optional
            Start from the singular position that this branch was found at, along it; where the mechanism is drawn in a
            singular position, the number of its branch to follow (the first if not told).
        step : float [1]
            The longest step along the curve: radians, and lengths as parts of the mechanism's.
        steps : int
            The most steps in each direction.

        Returns
        -------
        Singularities

        Raises
        ------
        ModelError
            If there is no such driver, no such branch, the range is none, or constraints restrain velocities only.
        AssemblyError
            If the mechanism cannot be assembled as described.
        MobilityError
            If freedoms are left besides the driver, or none is left to it.
        SingularityError
            If the range is not reached, saying where the mechanism locks up.
        NotConverged
            If the curve cannot be followed.
        """
        from ..analysis.singularities import SingularitiesOptions, singularities

        return singularities(self, SingularitiesOptions.asked(locals()))
