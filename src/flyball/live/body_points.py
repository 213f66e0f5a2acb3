"""A point of a body: its position, its Jacobian, and its effective mass against a force."""

from __future__ import annotations

import math

import numpy as np
import scipy.linalg

from ..assembly.compiled_mechanism import CompiledMechanism
from ..results.energy_balance import connected_parts

RANK_TOLERANCE = 1e-9
"""Constraints whose part independent of the others is smaller than this, relative to the largest, are dependent."""
MIN_MOBILITY = 1e-12
"""Mobility of a point, relative to that of its body alone, below which constraints hold it: the rest is rounding."""


def point_kinematics(c: CompiledMechanism, body: str, at: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return position, arm from the mass centre and Jacobian of a point, as last evaluated.

    Parameters
    ----------
    c : CompiledMechanism
        In absolute coordinates.
    body : str
    at : ndarray (3,) [m]
        In the reference frame of the body.

    Returns
    -------
    position, arm : ndarray (3,) [m]
        In the world.
    jacobian : ndarray (3, nv)
        Of its velocity in the world.
    """
    b, tree = c.structure.place[body], c.values.system.tree
    R = c.work.bodies.rotation[b].reshape(3, 3)
    arm = R @ (at - c.values.bodies[body].com.real)
    J = np.zeros((3, c.structure.nv))
    shifts = 2 if c.structure.model.planar else 3
    first, n = int(tree.v[b]), int(tree.nv[b])
    J[:shifts, first : first + shifts] = np.eye(shifts)
    if n > shifts:
        cross = -np.cross(arm, np.eye(3)).T  # column k: axis k x arm
        J[:, first + shifts : first + n] = (cross @ R)[:, -(n - shifts) :]
    return c.work.bodies.position[b] + arm, arm, J


def effective_mass(c: CompiledMechanism, body: str, at: np.ndarray) -> float:
    """Return the least effective mass of a point over all directions of a force [kg], as last evaluated.

    Joints and drivers hold; contacts, stops and friction do not, and rotors add nothing: the actual one is not less.
    It is 1 / (largest eigenvalue of J W J^T), where W is the inverse mass matrix reduced by the constraints.

    Returns
    -------
    float
        Infinite if joints and drivers leave the point no motion.
    """
    root = c.inverse_mass_root(np.ones(c.structure.nv), dense=True)
    alone = root.T @ point_kinematics(c, body, at)[2].T
    left, G = alone, (c.jacobian() / c.row_units[:, None]) @ root
    if len(G):
        left = alone - G.T @ scipy.linalg.lstsq(G.T, alone, cond=RANK_TOLERANCE, lapack_driver="gelsy")[0]
    mobility, largest = (float(np.linalg.norm(x, 2)) ** 2 for x in (left, alone))
    return math.inf if mobility <= MIN_MOBILITY * largest else 1.0 / mobility


def connected_mass(c: CompiledMechanism, body: str) -> float:
    """Return the mass of all bodies that joints and forces connect with a body, itself included [kg]."""
    part = connected_parts(c.values.system)
    return float(c.values.system.bodies.mass.real[part == part[c.structure.place[body]]].sum())
