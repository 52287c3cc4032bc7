"""Laws of the groups."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

import lgvi
from lgvi import se3, so3

RANDOM = np.random.default_rng(3)
VECTORS = RANDOM.uniform(-1.5, 1.5, size=(4, 5, 3))
TWISTS = RANDOM.uniform(-1.5, 1.5, size=(4, 5, 6))


def series(matrix: np.ndarray) -> np.ndarray:
    """The exponential by its power series, of matrices halved ten times and squared as often."""
    scaled = matrix / 1024.0
    term = total = np.broadcast_to(np.eye(matrix.shape[-1]), matrix.shape)
    for order in range(1, 12):
        term = term @ scaled / order
        total = total + term
    for _ in range(10):
        total = total @ total
    return total


def test_exponentials_are_those_of_matrices() -> None:
    np.testing.assert_allclose(so3.exp(VECTORS), series(so3.hat(VECTORS)), atol=1e-12)
    twist = np.zeros((4, 5, 4, 4))
    twist[..., :3, :3] = so3.hat(TWISTS[..., 3:])
    twist[..., :3, 3] = TWISTS[..., :3]
    np.testing.assert_allclose(se3.exp(TWISTS), series(twist), atol=1e-12)


def test_logarithms_are_inverse() -> None:
    np.testing.assert_allclose(so3.log(so3.exp(VECTORS)), VECTORS, atol=1e-14)
    np.testing.assert_allclose(se3.log(se3.exp(TWISTS)), TWISTS, atol=1e-13)
    half = so3.log(np.diag([1.0, -1.0, -1.0]))
    np.testing.assert_allclose(np.abs(half), [np.pi, 0, 0], atol=1e-15)


def test_poses_compose_as_matrices_and_act_on_points() -> None:
    a, b = se3.exp(TWISTS[0]), se3.exp(TWISTS[1:])
    np.testing.assert_allclose(se3.compose(a, b), a @ b, atol=1e-14)
    identity = np.broadcast_to(np.eye(4), a.shape)
    np.testing.assert_allclose(se3.compose(a, se3.inverse(a)), identity, atol=1e-14)
    points = VECTORS[0]
    homogeneous = np.concatenate([points, np.ones((5, 1))], axis=1)
    np.testing.assert_allclose(se3.act(a, points), np.einsum("nij,nj->ni", a, homogeneous)[:, :3], atol=1e-14)
    assert se3.act(a[0], VECTORS).shape == (4, 5, 3)


def test_adjoints_carry_twists() -> None:
    t, xi = se3.exp(TWISTS[0]), TWISTS[1]
    carried = np.einsum("nij,nj->ni", se3.adjoint(t), xi)
    np.testing.assert_allclose(t @ se3.exp(xi) @ se3.inverse(t), se3.exp(carried), atol=1e-13)


def test_jacobians_are_derivatives() -> None:
    step = 1e-6
    for exp, left_jacobian, arguments in [
        (so3.exp, so3.left_jacobian, VECTORS),
        (se3.exp, se3.left_jacobian, TWISTS),
    ]:
        change = step * RANDOM.normal(size=arguments.shape)
        moved = np.einsum("...ij,...j->...i", left_jacobian(arguments), change)
        exact = exp(arguments + change) @ np.linalg.inv(exp(arguments))
        np.testing.assert_allclose(exact, exp(moved), atol=1e-10)


def test_quaternions_are_rotations() -> None:
    rotation = so3.exp(VECTORS)
    quaternion = so3.to_quaternion(rotation)
    np.testing.assert_allclose(np.linalg.norm(quaternion, axis=-1), 1.0, rtol=1e-14)
    np.testing.assert_allclose(so3.from_quaternion(quaternion), rotation, atol=1e-14)
    np.testing.assert_array_equal(so3.vee(so3.hat(VECTORS)), VECTORS)


def test_any_leading_dimensions_do() -> None:
    assert so3.exp([0.0, 0.0, 1.0]).shape == (3, 3)
    assert so3.exp(np.zeros((0, 3))).shape == (0, 3, 3)
    assert se3.exp(np.zeros((2, 3, 4, 6))).shape == (2, 3, 4, 4, 4)
    for shape in [(4,), (), (3, 2)]:
        with pytest.raises(ValueError, match="expected"):
            so3.exp(np.zeros(shape))
    with pytest.raises(ValueError):
        se3.compose(np.zeros((2, 4, 4)), np.zeros((3, 4, 4)))


def test_what_is_no_rotation_is_refused_with_its_defect() -> None:
    rotation = so3.exp(VECTORS).reshape(20, 3, 3)
    rows: list[tuple[Callable[[np.ndarray], np.ndarray], str]] = [
        (lambda r: r + 1e-3, r"\|RᵀR − I\| is [1-9]\.\de-3, expected at most 1e-4"),
        (lambda r: -r, "this is a reflection, its determinant is −1, expected 1"),
        (lambda r: 2.0 * r, r"\|RᵀR − I\| is 5\.2e0"),
        (lambda r: np.full((3, 3), np.nan), r"\|RᵀR − I\| is NaN"),
    ]
    for spoil, defect in rows:
        wrong = rotation.copy()
        wrong[7] = spoil(wrong[7])
        for function in (so3.log, so3.to_quaternion):
            with pytest.raises(lgvi.RotationError, match=f"`r`, row 7 of 20: .*no rotation matrix.*{defect}"):
                function(wrong)
        pose = np.tile(np.eye(4), (20, 1, 1))
        pose[:, :3, :3] = wrong
        for unary in (se3.log, se3.inverse, se3.adjoint):
            with pytest.raises(lgvi.RotationError, match=f"row 7 of 20: .*{defect}"):
                unary(pose)
        for operand, one, other in [("a", pose, np.eye(4)), ("b", np.eye(4), pose)]:
            with pytest.raises(lgvi.RotationError, match=f"`{operand}`, row 7 of 20: .*{defect}"):
                se3.compose(one, other)
        with pytest.raises(lgvi.RotationError, match=f"`t`, row 7 of 20: .*{defect}"):
            se3.act(pose, [1.0, 0.0, 0.0])
    # What rounding of decimals leaves is accepted.
    np.testing.assert_allclose(so3.log(rotation.round(6)), VECTORS.reshape(20, 3), atol=1e-5)
    with pytest.raises(lgvi.RotationError, match=r"the last row of the pose is \[0\.0, 0\.0, 0\.0, 2\.0\]"):
        se3.inverse(np.diag([1.0, 1.0, 1.0, 2.0]))


@pytest.mark.parametrize("quaternion", [[0, 0, 0, 1.0 + 2e-4], [0, 0, 0, 0], [1, 1, 1, 1], [0, 0, np.nan, 1], [0, 0, 0, 1e200]])
def test_what_is_no_unit_quaternion_is_refused_with_its_norm(quaternion: list[float]) -> None:
    with pytest.raises(lgvi.RotationError, match=r"no unit quaternion: its norm is \S+, expected 1 to within 1e-4"):
        so3.from_quaternion(quaternion)
