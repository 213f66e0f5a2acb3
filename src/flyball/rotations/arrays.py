"""Between arrays, whose last axes hold vectors and matrices, and the tuples of the formulas."""

from __future__ import annotations

from typing import Any

import numpy as np


def split(a: np.ndarray) -> tuple[Any, ...]:
    """Components along the last axis; of a single vector plain numbers, with which the formulas are much faster."""
    if a.ndim == 1:
        return tuple(a.tolist())
    return tuple(a[..., i] for i in range(a.shape[-1]))


def joined(components: tuple[Any, ...]) -> np.ndarray:
    """Vectors (..., n) from their n components."""
    if not any(isinstance(c, np.ndarray) for c in components):
        return np.array(components)
    return np.stack(np.broadcast_arrays(*components), axis=-1)


def columns(vectors: tuple[Any, ...]) -> np.ndarray:
    """Matrices from their columns, each a tuple of components."""
    return np.swapaxes(rows(vectors), -1, -2)


def rows(vectors: tuple[Any, ...]) -> np.ndarray:
    """Matrices from their rows, each a tuple of components."""
    n = len(vectors[0])
    flat = joined(tuple(x for v in vectors for x in v))
    return flat.reshape(*flat.shape[:-1], len(vectors), n)


def skew(a: np.ndarray) -> np.ndarray:
    """Matrices S of the cross product, S b = a x b, of vectors (..., 3)."""
    x, y, z = split(a)
    o = 0.0 * x
    return rows(((o, -z, y), (z, o, -x), (-y, x, o)))


def times(matrix: np.ndarray, vector: np.ndarray) -> np.ndarray:
    """Matrices times vectors, leading axes broadcast."""
    return (matrix @ vector[..., None])[..., 0]
