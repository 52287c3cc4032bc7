"""The group SE(3) of poses, vectorised over leading dimensions.

A pose T maps body coordinates ρ to R ρ + x. It is a homogeneous matrix ``[[R, x], [0, 1]]``, so that ``a @ b`` composes two
of them too. A twist is six numbers: translation first, then rotation (rad). Poses whose R is no rotation to the tolerance of
`lgvi.RotationError`, or whose last row is not 0, 0, 0, 1, are refused by it. Functions compute with the nearest rotation.
"""

from __future__ import annotations

from numpy.typing import ArrayLike

from lgvi import _lgvi
from lgvi._arrays import Floats, apply, apply_to_pairs

__all__ = ["act", "adjoint", "compose", "exp", "inverse", "left_jacobian", "log"]


def exp(xi: ArrayLike) -> Floats:
    """Return the pose exp(ξ).

    Parameters
    ----------
    xi : array_like, shape (..., 6)
        Twists.

    Returns
    -------
    ndarray, shape (..., 4, 4)

    Examples
    --------
    A screw motion: one meter along the axis that it turns about.

    >>> from lgvi import se3
    >>> print(se3.exp([0.0, 0.0, 1.0, 0.0, 0.0, 1.0])[:3, 3].round(15))
    [0. 0. 1.]
    """
    return apply(_lgvi.se3_exp, "xi", xi, (6,), (4, 4))


def log(t: ArrayLike) -> Floats:
    """Return the twist with the smallest rotation whose exponential is the pose.

    Parameters
    ----------
    t : array_like, shape (..., 4, 4)

    Returns
    -------
    ndarray, shape (..., 6)
    """
    return apply(_lgvi.se3_log, "t", t, (4, 4), (6,))


def compose(a: ArrayLike, b: ArrayLike) -> Floats:
    """Return the pose that applies `b` first, then `a`. Leading dimensions are broadcast.

    Parameters
    ----------
    a, b : array_like, shape (..., 4, 4)

    Returns
    -------
    ndarray, shape (..., 4, 4)
    """
    return apply_to_pairs(_lgvi.se3_compose, ("a", a, (4, 4)), ("b", b, (4, 4)), (4, 4))


def inverse(t: ArrayLike) -> Floats:
    """Return the inverse pose.

    Parameters
    ----------
    t : array_like, shape (..., 4, 4)

    Returns
    -------
    ndarray, shape (..., 4, 4)
    """
    return apply(_lgvi.se3_inverse, "t", t, (4, 4), (4, 4))


def act(t: ArrayLike, p: ArrayLike) -> Floats:
    """Return R p + x. Leading dimensions are broadcast.

    Parameters
    ----------
    t : array_like, shape (..., 4, 4)
    p : array_like, shape (..., 3)

    Returns
    -------
    ndarray, shape (..., 3)
    """
    return apply_to_pairs(_lgvi.se3_act, ("t", t, (4, 4)), ("p", p, (3,)), (3,))


def adjoint(t: ArrayLike) -> Floats:
    """Return Ad with T exp(ξ) T⁻¹ = exp(Ad ξ).

    Parameters
    ----------
    t : array_like, shape (..., 4, 4)

    Returns
    -------
    ndarray, shape (..., 6, 6)
    """
    return apply(_lgvi.se3_adjoint, "t", t, (4, 4), (6, 6))


def left_jacobian(xi: ArrayLike) -> Floats:
    """Return J with exp(ξ + δ) = exp(J δ) exp(ξ) to first order.

    Parameters
    ----------
    xi : array_like, shape (..., 6)
        Twists.

    Returns
    -------
    ndarray, shape (..., 6, 6)
    """
    return apply(_lgvi.se3_left_jacobian, "xi", xi, (6,), (6, 6))
