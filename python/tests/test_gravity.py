"""Forces and gravity on arrays."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import ArrayLike

import lgvi


def scene() -> lgvi.Scene:
    return lgvi.rigid_bodies(
        [2.0, 3.0],
        [1.0, 1.5, 2.0],
        position_m=[[1.0, 0.0, 0.0], [-1.0, 0.5, 0.0]],
        gravity={"mutual": {"constant": 0.5}, "central": {"gm": 2.0}},
        duration_s=1.0,
        steps=100,
    )


def test_gravity_is_that_of_newton_and_the_gradient_of_its_potential() -> None:
    random = np.random.default_rng(1)
    position = random.normal(size=(20, 2, 3))
    attitude = np.tile([0.0, 0.0, 0.0, 1.0], (20, 2, 1))
    force, moment, potential = scene().gravity(position, attitude)
    mass = np.array([2.0, 3.0])
    apart = position[:, 1] - position[:, 0]
    pull = 0.5 * 2.0 * 3.0 * apart / np.linalg.norm(apart, axis=1, keepdims=True) ** 3
    radius = np.linalg.norm(position, axis=2, keepdims=True)
    expected = -2.0 * mass[:, None] * position / radius**3 + np.stack([pull, -pull], axis=1)
    np.testing.assert_allclose(force, expected, rtol=1e-12)
    np.testing.assert_array_equal(moment, 0.0)
    step = 1e-5
    for body, axis in [(0, 0), (1, 2)]:
        change = np.zeros_like(position)
        change[:, body, axis] = step
        difference = scene().gravity(position + change, attitude)[2] - scene().gravity(position - change, attitude)[2]
        np.testing.assert_allclose(-difference / (2 * step), force[:, body, axis], rtol=1e-6, atol=1e-8)
    np.testing.assert_allclose(scene().fly().energy_j[0], scene().gravity(scene().fly().position_m[:1], attitude[:1])[2])


@pytest.mark.parametrize(
    ("position", "attitude"),
    [
        (np.zeros((1, 3)), np.ones((1, 2, 4))),
        (np.zeros((1, 2, 3)), np.ones((2, 2, 4))),
        (np.ones((1, 1, 3)), np.ones((1, 1, 4))),
    ],
)
def test_arrays_of_other_shapes_are_refused(position: np.ndarray, attitude: np.ndarray) -> None:
    with pytest.raises(ValueError, match="expected"):
        scene().gravity(position, attitude)


@pytest.mark.parametrize("attitude", [np.zeros(4), np.full(4, np.nan), np.ones(4), [0.0, 0.0, 0.0, 1.0 + 2e-4]])
def test_quaternions_of_another_norm_are_refused(attitude: ArrayLike) -> None:
    attitudes = np.tile([0.0, 0.0, 0.0, 1.0], (3, 2, 1))
    attitudes[2, 1] = attitude
    with pytest.raises(lgvi.RotationError, match=r"`attitude_xyzw\[2, 1\]`: .* is no unit quaternion: its norm is"):
        scene().gravity(np.ones((3, 2, 3)), attitudes)


def test_a_force_of_python_has_the_order_of_the_integrator() -> None:
    """A spring, whose motion is a cosine."""

    def spring(state: lgvi.State) -> np.ndarray:
        return np.concatenate([-state.position_m[0], np.zeros(3)])

    errors = []
    for steps in (20, 40):
        flight = lgvi.rigid_bodies(
            1.0, [1, 1, 1], position_m=[1, 0, 0], duration_s=2.0, steps=steps, integrator={"name": "nystrom", "order": 4}
        ).fly(force=spring)
        errors.append(abs(flight.position_m[-1, 0, 0] - np.cos(2.0)))
    assert 3.5 < np.log2(errors[0] / errors[1]) < 4.5
    assert errors[1] < 1e-6


def test_a_central_force_of_python_is_that_of_the_scene() -> None:
    start = {"position_m": [1.0, 0, 0], "velocity_m_s": [0, 1.1, 0], "duration_s": 1.0, "steps": 50}
    own = lgvi.rigid_bodies(1.0, [1, 1, 1], gravity={"central": {"gm": 1.0}}, **start)  # type: ignore[arg-type]
    free = lgvi.rigid_bodies(1.0, [1, 1, 1], **start)  # type: ignore[arg-type]

    def center(state: lgvi.State) -> dict[str, np.ndarray]:
        x = state.position_m[0]
        return {"body_0": np.concatenate([-x / np.linalg.norm(x) ** 3, np.zeros(3)])}

    by_python = free.fly(force=center)
    np.testing.assert_allclose(by_python.position_m, own.fly().position_m, atol=1e-14)
    between = free.fly(t_eval=[0.333, 0.7771], force=center)
    np.testing.assert_allclose(between.position_m, own.fly(t_eval=[0.333, 0.7771]).position_m, atol=1e-14)
