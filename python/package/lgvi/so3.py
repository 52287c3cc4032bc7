"""The rotation group SO(3), vectorised over leading dimensions.

Rotation matrices map body coordinates to inertial ones. Angles are in rad. Transcendental functions are those of the Rust
crate `libm`, so that results are the same bits everywhere. Matrices that are no rotations and quaternions that are no unit
quaternions to the tolerance of `lgvi.RotationError` are refused by it. Functions compute with the nearest rotation.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from lgvi import _lgvi
from lgvi._arrays import Floats, apply

__all__ = ["exp", "from_quaternion", "hat", "left_jacobian", "log", "to_quaternion", "vee"]


def exp(v: ArrayLike) -> Floats:
    """Return the rotation by the angle |v| about v.

    Parameters
    ----------
    v : array_like, shape (..., 3)
        Rotation vectors (rad).

    Returns
    -------
    ndarray, shape (..., 3, 3)

    Examples
    --------
    >>> from lgvi import so3
    >>> print(so3.exp([0.0, 0.0, 3.141592653589793 / 2]).round(15))
    [[ 0. -1.  0.]
     [ 1.  0.  0.]
     [ 0.  0.  1.]]
    """
    return apply(_lgvi.so3_exp, "v", v, (3,), (3, 3))


def log(r: ArrayLike) -> Floats:
    """Return the rotation vector, of length at most π, of a rotation. It is accurate at every angle, including 0 and π.

    Parameters
    ----------
    r : array_like, shape (..., 3, 3)

    Returns
    -------
    ndarray, shape (..., 3)
    """
    return apply(_lgvi.so3_log, "r", r, (3, 3), (3,))


def left_jacobian(v: ArrayLike) -> Floats:
    """Return J with exp(v + δ) = exp(J δ) exp(v) to first order.

    Parameters
    ----------
    v : array_like, shape (..., 3)
        Rotation vectors (rad).

    Returns
    -------
    ndarray, shape (..., 3, 3)
    """
    return apply(_lgvi.so3_left_jacobian, "v", v, (3,), (3, 3))


def to_quaternion(r: ArrayLike) -> Floats:
    """Return the unit quaternion x, y, z, w of a rotation. Its largest component is positive.

    Parameters
    ----------
    r : array_like, shape (..., 3, 3)

    Returns
    -------
    ndarray, shape (..., 4)
    """
    return apply(_lgvi.so3_to_quaternion, "r", r, (3, 3), (4,))


def from_quaternion(q: ArrayLike) -> Floats:
    """Return the rotation of a unit quaternion x, y, z, w.

    Parameters
    ----------
    q : array_like, shape (..., 4)

    Returns
    -------
    ndarray, shape (..., 3, 3)
    """
    return apply(_lgvi.so3_from_quaternion, "q", q, (4,), (3, 3))


def hat(v: ArrayLike) -> Floats:
    """Return the matrix S(v) with S(v) y = v × y.

    Parameters
    ----------
    v : array_like, shape (..., 3)

    Returns
    -------
    ndarray, shape (..., 3, 3)
    """
    x, y, z = np.moveaxis(_vectors(v), -1, 0)
    zero = np.zeros_like(x)
    rows = [[zero, -z, y], [z, zero, -x], [-y, x, zero]]
    return np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)


def vee(s: ArrayLike) -> Floats:
    """Return the vector v of the matrix S(v); of another matrix, that of its antisymmetric part.

    Parameters
    ----------
    s : array_like, shape (..., 3, 3)

    Returns
    -------
    ndarray, shape (..., 3)
    """
    array = np.asarray(s, dtype=float)
    if array.shape[-2:] != (3, 3):
        raise ValueError(f"`s` has the shape {array.shape}, expected (..., 3, 3)")
    skew = 0.5 * (array - np.swapaxes(array, -1, -2))
    return np.stack([skew[..., 2, 1], skew[..., 0, 2], skew[..., 1, 0]], axis=-1)


def _vectors(v: ArrayLike) -> NDArray[np.float64]:
    array = np.asarray(v, dtype=float)
    if array.shape[-1:] != (3,):
        raise ValueError(f"`v` has the shape {array.shape}, expected (..., 3)")
    return array
