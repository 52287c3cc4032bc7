"""What flights return is what other functions take, even where an integrator leaves SO(3)."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import lgvi
from lgvi import se3, so3

# Errors of a step are large, and those that leave SO(3) do so visibly.
STEPS = 240
METHODS: list[Any] = [
    "lgvi",
    "lie_euler",
    {"name": "lgvi", "rotor": "exact"},
    "lgvi_lagrangian",
    {"name": "composition", "order": 4},
    {"name": "nystrom", "order": 6},
    {"name": "galerkin", "degree": 2},
    "explicit_midpoint",
    "implicit_midpoint",
    "crouch_grossman",
    "runge_kutta4",
    {"name": "fehlberg78", "tolerance": 1e-5},
    {"name": "dormand_prince853", "tolerance": 1e-5},
    {"name": "taylor", "tolerance": 1e-5},
]
FREE: list[Any] = [{"name": "euler_poincare", "degree": 2}, "closed_form"]


def orbit(integrator: Any, steps: int, **keywords: Any) -> lgvi.Scene:
    """Two bodies that turn and attract each other; a single free one for methods of free bodies."""
    count = 1 if integrator in FREE else 2
    return lgvi.rigid_bodies(
        [2.0, 3.0][:count],
        [1.0, 1.5, 2.0],
        position_m=[[1.0, 0.0, 0.0], [-1.0, 0.0, 0.0]][:count],
        velocity_m_s=[[0.0, 0.6, 0.0], [0.0, -0.4, 0.0]][:count],
        angular_velocity_rad_s=[0.5, 1.0, 0.1],
        gravity=None if integrator in FREE else {"mutual": {"constant": 0.5}},
        duration_s=4.0,
        steps=steps,
        integrator=integrator,
        **keywords,
    )


@pytest.mark.parametrize("integrator", METHODS + FREE, ids=str)
def test_attitudes_of_flights_are_taken_by_other_functions(integrator: Any) -> None:
    scene = orbit(integrator, STEPS)
    flight = scene.fly()
    norm = np.linalg.norm(flight.attitude_xyzw, axis=-1)
    np.testing.assert_allclose(norm, 1.0, rtol=0.0, atol=4e-16)
    # The nearest rotation differs by at most half of |RᵀR − I|, to first order, and rounding.
    defect = flight.orthogonality_error.max() + 1e-14
    rotation = so3.from_quaternion(flight.attitude_xyzw)
    np.testing.assert_allclose(rotation, flight.rotation, rtol=0.0, atol=2.0 * defect)
    again = so3.exp(so3.log(flight.rotation))
    np.testing.assert_allclose(again, flight.rotation, rtol=0.0, atol=defect)
    pose = np.tile(np.eye(4), (*flight.rotation.shape[:2], 1, 1))
    pose[..., :3, :3], pose[..., :3, 3] = flight.rotation, flight.position_m
    composed = pose
    for _ in range(20):
        composed = se3.compose(composed, pose)
    left = composed[..., :3, :3]
    np.testing.assert_allclose(left @ np.swapaxes(left, -1, -2), np.broadcast_to(np.eye(3), left.shape), atol=1e-13)
    np.testing.assert_allclose(se3.compose(se3.inverse(pose), pose)[..., :3, :3], np.broadcast_to(np.eye(3), left.shape), atol=1e-14)
    force, _, potential = scene.gravity(flight.position_m, flight.attitude_xyzw)
    assert force.shape == flight.position_m.shape and potential.shape == flight.time_s.shape
    if integrator not in FREE:
        assert (potential < 0).all()
    # A flight begins where another one ends.
    orbit(integrator, STEPS, attitude_xyzw=flight.attitude_xyzw[-1])


def test_an_integrator_leaves_the_group_by_more_than_scenes_accept() -> None:
    """Otherwise the test above shows nothing."""
    for method in ("explicit_midpoint", METHODS[-3], METHODS[-2]):
        assert 1e-6 < orbit(method, STEPS).fly().orthogonality_error.max() < 1e-4


def test_numbers_of_single_precision_are_rotations() -> None:
    vectors = np.random.default_rng(5).uniform(-1.5, 1.5, size=(50, 3))
    rotation = so3.exp(vectors).astype(np.float32)
    quaternion = so3.to_quaternion(so3.exp(vectors)).astype(np.float32)
    np.testing.assert_allclose(so3.log(rotation), vectors, atol=1e-6)
    np.testing.assert_allclose(so3.log(so3.from_quaternion(quaternion)), vectors, atol=1e-6)


def test_the_nearest_rotation_is_taken() -> None:
    """Of a matrix M that is the polar factor U Vᵀ of its singular values."""
    random = np.random.default_rng(7)
    matrix = so3.exp(random.uniform(-1.5, 1.5, size=(50, 3))) + random.uniform(-1e-5, 1e-5, size=(50, 3, 3))
    left, _, right = np.linalg.svd(matrix)
    np.testing.assert_allclose(so3.exp(so3.log(matrix)), left @ right, rtol=0.0, atol=1e-14)
