"""``Mechanism``, the description with every analysis as a method, and the functions that read it from files.

`load` reads a mechanism from a model file (TOML or Python), `load_result` a result from a result file.
"""

from __future__ import annotations

import os
from pathlib import Path
from typing import TYPE_CHECKING

from .errors import ModelError
from .mechanism_methods import (
    DesignMethods,
    MobilityMethods,
    MotionMethods,
    StaticsMethods,
    SymbolicMethods,
    on_one_thread,
)
from .model.model import Model
from .model.output_files import DESCRIPTION, ROBOT, file_extension

if TYPE_CHECKING:
    from .results.result import Result


class Mechanism(MotionMethods, StaticsMethods, DesignMethods, MobilityMethods, SymbolicMethods, Model):
    """A mechanism: one description, to which elements are added, and on which every analysis can be run.

    No analysis stores its results in it, so parameter sweeps are plain loops.

    Parameters
    ----------
    name : str
        Its name, in results and messages.
    planar : bool
        Whether everything moves in the x-y plane (three velocities a body) or in space (six).
    gravity : vector [m/s^2]
        Acceleration of gravity in world axes; none if not given. A component may be a law of ``t`` and parameters,
        ``"-9.81*(1 + 0.1*sin(t))"``: a field that changes, or the motion of a base to which the world is fixed.
        Potential energy is that of gravity at t = 0, the work of its change is ``run.energy.work["gravity"]``.
    parameters : dict
        Named numbers, usable in every expression of the mechanism.
    """

    def save(self, path: str | os.PathLike) -> None:
        """Write the description to a TOML file; `flyball.load` reads it back exactly.

        A path that ends in ``.urdf`` gets URDF, if joints form a tree: revolute, prismatic, fixed and planar joints
        with their stops, damping and friction. One that ends in ``.xml`` or ``.mjcf`` gets a model of MuJoCo, with
        closed loops too. What a format does not have is listed in a `ModelWarning`, or refused.
        """
        ending = file_extension(path, (*DESCRIPTION, *ROBOT))
        if ending in (".xml", ".mjcf"):
            from .robots.mjcf_writer import save_mjcf

            return save_mjcf(self, Path(path))
        if ending == ".urdf":
            from .robots.urdf_writer import save_urdf

            return save_urdf(self, Path(path))
        from .model.model_files import save

        return save(self, path)

    def _repr_html_(self) -> str:
        from .view.reference_picture import mechanism_html

        return mechanism_html(self)


for _family in (
    MotionMethods,
    StaticsMethods,
    DesignMethods,
    MobilityMethods,
    SymbolicMethods,
):  # so that Python's own messages show the name that the user called
    for _name, _method in list(vars(_family).items()):
        if not _name.startswith("_") and callable(_method):
            _method.__qualname__ = f"Mechanism.{_name}"
            setattr(_family, _name, on_one_thread(_method, by_scipy=_family is StaticsMethods))


def load(path: str | os.PathLike, *, floating: bool = False) -> Mechanism:
    """Read a mechanism from a model file: TOML as `Mechanism.save` writes it, Python, or a robot in URDF or MJCF.

    A file ``*.py`` is executed, as on the command line; it defines ``m``, ``mechanism`` or ``mechanism()``. A file
    ``*.urdf`` is a robot: its links are bodies, a link without mass that is fixed to another is a frame. A file
    ``*.xml`` or ``*.mjcf`` is a model of MuJoCo, whose own reader is needed (the package mujoco). What of them has no
    meaning here is listed in a `ModelWarning`.

    Parameters
    ----------
    path : str or path
    floating : bool
        Of a robot: whether its root link moves freely; by default it is fixed to ground.

    Raises
    ------
    ModelError
        If there is no such file or it does not describe a valid mechanism; the message names the file, the line and the
        element.
    """
    try:
        given = Path(path)
    except TypeError:
        raise ModelError(f"the path of a model file is a text or a path, not {path!r}") from None
    if given.suffix.lower() == ".py":
        from .model.model_files import load_python

        return load_python(given, Mechanism)
    if given.suffix.lower() in (".xml", ".mjcf"):
        from .robots.mjcf import load_mjcf

        return load_mjcf(given, Mechanism)
    if given.suffix.lower() == ".urdf":
        from .robots.urdf import load_urdf

        return load_urdf(given, Mechanism, floating)
    from .model.model_files import load

    if floating:
        raise ModelError(f"{given}: floating=True is for robots in URDF; add or leave out the joints to ground here")
    return load(given, Mechanism)


def load_result(path: str | os.PathLike) -> Result:
    """Read a result from a NetCDF file, as `Result.save` writes it; nothing is simulated or compiled.

    Raises
    ------
    ModelError
        If there is no such file, or it is not a result of flyball.
    """
    from .results.result_loading import read_result

    try:
        given = Path(path)
    except TypeError:
        raise ModelError(f"the path of a result file is a text or a path, not {path!r}") from None
    return read_result(given, Mechanism)
