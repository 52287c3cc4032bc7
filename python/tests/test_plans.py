"""Maneuvers."""

from __future__ import annotations

import tomllib
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

import lgvi


def test_a_plan_is_flown_to_its_target(inclination: lgvi.Scene) -> None:
    plan = inclination.plan()
    assert plan.certificate["sufficient"] and plan.certificate["terminal"] < 1e-12
    assert (plan.body, plan.first_step, plan.last_step, len(plan)) == ("spacecraft", 0, 1000, 1000)
    assert plan.force_n.shape == plan.moment_n_m.shape == (1000, 3)
    assert plan.gain.shape == (1000, 6, 12)
    flight = inclination.fly(controls=plan)
    np.testing.assert_allclose(flight.position_m[:, 0], plan.position_m, atol=1e-12)
    np.testing.assert_allclose(flight.velocity_m_s[:, 0], plan.velocity_m_s, atol=1e-12)
    np.testing.assert_allclose(flight.attitude_xyzw[:, 0], plan.attitude_xyzw, atol=1e-12)
    np.testing.assert_allclose(flight.angular_velocity_rad_s[:, 0], plan.angular_velocity_rad_s, atol=1e-10)
    np.testing.assert_allclose(flight.time_s, plan.time_s)
    # The same controls as arrays.
    again = inclination.fly(controls=lgvi.Controls(force_n=plan.force_n, moment_n_m=plan.moment_n_m))
    np.testing.assert_array_equal(again.position_m, flight.position_m)


def test_thrusters_are_commands(scenes: Path) -> None:
    scene = lgvi.Scene.load(scenes / "thruster_rendezvous.toml").with_values({"run.steps": 60})
    plan = scene.plan()
    assert plan.thrust_n.shape == (60, 12)
    assert plan.thrust_n.min() >= 0.0 and plan.thrust_n.max() <= 1.0 + 1e-6
    flight = scene.fly(controls=plan)
    np.testing.assert_allclose(flight.position_m[:, 1], plan.position_m, rtol=0.0, atol=1e-5)
    assert plan.gain.shape == (60, 12, 12)
    table = "[ensemble]\nsamples = 2\nseed = 1\nactuator_error = 0.02\n"
    samples = lgvi.Scene.from_toml(f"{scene.text}\n{table}").ensemble(plan=plan)
    assert (np.abs(samples["actuator_factor.11"] - 1.0) > 1e-6).all()
    assert (samples["miss.position"] > 1e-3).all() and (samples["miss.position"] < 40.0).all()


def test_forces_of_thrusters_are_in_the_inertial_frame(scenes: Path) -> None:
    scene = lgvi.Scene.load(scenes / "thruster_rendezvous.toml").with_values({"run.steps": 60})
    plan = scene.plan()
    (chaser,) = [body for body in tomllib.loads(scene.text)["bodies"] if body["name"] == plan.body]
    directions = np.array([thruster["direction"] for thruster in chaser["thrusters"]])
    rotation = lgvi.so3.from_quaternion(plan.attitude_xyzw[:-1])
    expected = np.einsum("nij,nj->ni", rotation, plan.thrust_n @ directions)
    np.testing.assert_allclose(plan.force_n, expected, atol=1e-12)
    # Axes of body and inertial frame differ.
    assert np.abs(plan.force_n - plan.thrust_n @ directions).max() > 0.1


def test_wheels_are_commands(scenes: Path) -> None:
    scene = lgvi.Scene.load(scenes / "wheel_slew_plan.toml").with_values({"run.steps": 120})
    plan = scene.plan()
    assert plan.wheel_torque_n_m.shape == (120, 4) and plan.thrust_n.shape == (120, 0)
    assert np.abs(plan.wheel_torque_n_m).max() <= 9e-4 * (1.0 + 1e-6)
    assert plan.gain.shape == (120, 4, 12)
    flight = scene.fly(controls=plan)
    np.testing.assert_allclose(flight.attitude_xyzw[:, 0], plan.attitude_xyzw, rtol=0.0, atol=1e-12)


def test_gains_correct_a_disturbed_start(scenes: Path) -> None:
    """With the gains applied by hand, a disturbed flight misses the target by less than in open loop."""
    scene = lgvi.Scene.load(scenes / "inclination_change.toml")
    plan = scene.plan()
    start = np.array(scene.fly(t_eval=[0.0]).position_m[0, 0])
    disturbed = scene.with_values({"bodies.spacecraft.position": start + [1e-3, -2e-3, 1e-3]})

    mass = 1.0
    reference = scene.fly(controls=plan)

    def law(t: float, state: lgvi.State) -> NDArray[np.float64]:
        assert state.step is not None
        k = state.step
        turn = lgvi.so3.log(reference.rotation[k, 0].T @ state.rotation[0])
        inertia = np.array([0.009, 0.0315, 0.0315])
        deviation = np.concatenate(
            [
                state.position_m[0] - reference.position_m[k, 0],
                mass * (state.velocity_m_s[0] - reference.velocity_m_s[k, 0]),
                turn,
                inertia * (state.angular_velocity_rad_s[0] - reference.angular_velocity_rad_s[k, 0]),
            ]
        )
        correction = plan.gain[k] @ deviation
        control = np.concatenate([plan.force_n[k], plan.moment_n_m[k]])
        corrected: NDArray[np.float64] = control - correction
        return corrected

    target = reference.position_m[-1, 0]
    open_loop = disturbed.fly(controls=plan).position_m[-1, 0] - target
    closed = disturbed.fly(controls=law).position_m[-1, 0] - target
    assert np.linalg.norm(closed) < 0.01 * np.linalg.norm(open_loop)


def test_errors_of_actuators_change_controls_and_not_applied_wrenches(scenes: Path) -> None:
    scene = lgvi.Scene.load(scenes / "inclination_replan.toml")
    wrench = np.array([0.3, -0.2, 0.1, 1e-3, 2e-3, -1e-3])

    def change(act: Callable[[lgvi.Simulation], None]) -> NDArray[np.float64]:
        """What a step with the wrench adds to the velocity."""
        free, acted = scene.simulation(), scene.simulation()
        act(acted)
        free.step()
        acted.step()
        added: NDArray[np.float64] = acted.state().velocity_m_s[0] - free.state().velocity_m_s[0]
        return added

    exact = wrench[:3] * scene.step_s  # of a mass of 1 kg
    applied = change(lambda simulation: simulation.apply(wrench))
    accepted = change(lambda simulation: simulation.accept(lgvi.Controls(wrench[None, :3], wrench[None, 3:])))
    assert np.linalg.norm(applied - exact) < 1e-4 * np.linalg.norm(exact)
    assert 1e-3 < np.linalg.norm(accepted - exact) / np.linalg.norm(exact) < 0.05


def test_the_rest_of_a_maneuver_is_planned_anew(inclination: lgvi.Scene) -> None:
    plan = inclination.plan()
    simulation = inclination.simulation()
    simulation.accept(plan)
    simulation.step(300)
    # A push that nobody has planned.
    simulation.apply([3.0, 0.0, 0.0, 0.0, 0.0, 0.0], steps=50)
    simulation.step(50)
    state = simulation.state()
    cold, warm = inclination.plan(state), inclination.plan(state, warm=plan)
    assert (warm.first_step, warm.last_step) == (350, 1000)
    assert warm.iterations <= cold.iterations
    np.testing.assert_allclose(warm.cost, cold.cost, rtol=1e-10)
    np.testing.assert_allclose(warm.position_m[0], state.position_m[0], rtol=1e-15)
    simulation.accept(warm)
    simulation.step(650)
    arrived = simulation.state()
    np.testing.assert_allclose(arrived.position_m[0], plan.position_m[-1], atol=1e-11)
    np.testing.assert_allclose(arrived.velocity_m_s[0], plan.velocity_m_s[-1], atol=1e-11)
    with pytest.raises(lgvi.PlanError, match="two steps"):
        inclination.plan(arrived)


def test_the_rest_of_a_maneuver_by_wheels_needs_the_plan_that_is_flown_until_then(scenes: Path) -> None:
    scene = lgvi.Scene.load(scenes / "wheel_slew_plan.toml").with_values({"run.steps": 120})
    plan = scene.plan()
    simulation = scene.simulation()
    simulation.accept(plan)
    simulation.step(40)
    state = simulation.state()
    with pytest.raises(lgvi.PlanError, match="what the wheels store"):
        scene.plan(state)
    rest = scene.plan(state, warm=plan)
    np.testing.assert_allclose(rest.wheel_torque_n_m, plan.wheel_torque_n_m[40:], rtol=0.0, atol=1e-7)
    text = scene.text.replace("mass = 20.0", "mass = 21.0")
    assert text != scene.text
    with pytest.raises(ValueError, match="another mass"):
        lgvi.Scene.from_toml(text).plan(state, warm=plan)
