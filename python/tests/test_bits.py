"""The same bits as the nodes, and each time."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import lgvi


def recorded(bag: lgvi.Bag, field: str, count: int) -> np.ndarray:
    table = bag.table("/lgvi_propagator/state")
    bodies = len(bag.scene().bodies)
    columns = [[table[f"bodies.{body}.{field}.{index}"] for index in range(count)] for body in range(bodies)]
    return np.moveaxis(np.array(columns), 2, 0)


@pytest.mark.parametrize("name", ["two_dumbbells", "free_body", "pendulum", "inclination_change", "orbital_capture"])
def test_flights_are_those_that_the_nodes_have_recorded(bags: Path, name: str) -> None:
    bag = lgvi.Bag(bags / name)
    scene = bag.scene()
    steps = bag.table("/lgvi_propagator/state")["step"]
    plan = scene.plan() if "maneuver" in scene.text else None
    flight = scene.fly(t_eval=steps * scene.step_s, controls=plan)
    np.testing.assert_array_equal(flight.position_m, recorded(bag, "position", 3))
    rotation = recorded(bag, "attitude", 9).reshape(*flight.rotation.shape)
    np.testing.assert_array_equal(flight.rotation, rotation)


def test_samples_do_not_depend_on_the_times_that_are_asked_for(spin: lgvi.Scene) -> None:
    whole = spin.fly()
    some = spin.fly(t_eval=[0.0, 0.25, 5.0, 7.77, 10.0])
    for sample, step in [(0, 0), (2, 50), (4, 100)]:
        np.testing.assert_array_equal(some.rotation[sample], whole.rotation[step])


def test_simulations_and_flights_are_the_same(spin: lgvi.Scene) -> None:
    simulation = spin.simulation()
    simulation.step(60)
    simulation.step()
    np.testing.assert_array_equal(simulation.state().rotation, spin.fly().rotation[61])
    assert simulation.steps == 61
    assert simulation.time_s == spin.fly().time_s[61]


def test_a_constant_wrench_is_the_same_by_every_way(spin: lgvi.Scene) -> None:
    wrench = np.array([1.0, 0.0, -2.0, 0.1, 0.2, 0.3])
    rows = np.tile(wrench, (100, 1))
    by_array = spin.fly(controls=lgvi.Controls(force_n=rows[:, :3], moment_n_m=rows[:, 3:]))
    by_function = spin.fly(controls=lambda t, state: wrench, period_s=1.0)
    simulation = spin.simulation()
    simulation.apply(wrench, steps=100)
    simulation.step(100)
    np.testing.assert_array_equal(by_array.rotation, by_function.rotation)
    np.testing.assert_array_equal(by_array.position_m[-1], simulation.state().position_m)
    # v = F t / m, whatever the attitude is.
    np.testing.assert_allclose(by_array.velocity_m_s[-1, 0], [5.0, 0.0, -10.0], rtol=1e-13)
    np.testing.assert_array_equal(by_array.force_n[0], 0.0)
    np.testing.assert_array_equal(by_array.force_n[1:, 0], rows[:, :3])
    np.testing.assert_allclose(by_array.moment_n_m[1:, 0], rows[:, 3:])


def test_applied_wrenches_act_beside_controls_and_each_other(spin: lgvi.Scene) -> None:
    rows = np.arange(600.0).reshape(100, 6) / 1000.0
    simulation = spin.simulation()
    simulation.accept(lgvi.Controls(force_n=rows[:, :3], moment_n_m=rows[:, 3:]))
    simulation.step(10)
    simulation.apply([1.0, 0.0, 0.0, 0.0, 0.0, 2.0], steps=30)
    simulation.step(20)
    simulation.apply({"body_0": [0.0, 3.0, 0.0, 0.5, 0.0, 0.0]}, steps=20)
    simulation.step(70)
    rows[10:40] += [1.0, 0.0, 0.0, 0.0, 0.0, 2.0]
    rows[30:50] += [0.0, 3.0, 0.0, 0.5, 0.0, 0.0]
    flight = spin.fly(controls=lgvi.Controls(force_n=rows[:, :3], moment_n_m=rows[:, 3:]))
    np.testing.assert_allclose(simulation.state().velocity_m_s[0], flight.velocity_m_s[-1, 0], rtol=1e-14)
    np.testing.assert_allclose(simulation.state().rotation, flight.rotation[-1], atol=1e-13)


def test_ensembles_do_not_depend_on_threads_and_ranges(scenes: Path) -> None:
    scene = lgvi.Scene.load(scenes / "dispersed_capture.toml").with_values({"run.steps": 50})
    whole = scene.ensemble(samples=100, threads=1)
    part = scene.ensemble(samples=100, threads=2, range=(30, 60))
    assert list(part["index"]) == list(range(30, 60))
    for name, column in part.items():
        np.testing.assert_array_equal(column, whole[name][30:60])
    other = scene.ensemble(samples=100, seed=7, range=(30, 60))
    assert (other["miss.position"] != part["miss.position"]).all()


def test_an_ensemble_has_the_nominal_flight_where_nothing_deviates(inclination: lgvi.Scene) -> None:
    scene = lgvi.Scene.from_toml(inclination.text + "\n[ensemble]\nsamples = 2\nseed = 1\n")
    table = scene.ensemble()
    flight = scene.with_values({"run.skip": "nothing"}).fly(controls=scene.plan())
    final = [table[f"spacecraft.final.position.{axis}"] for axis in "xyz"]
    np.testing.assert_allclose(np.transpose(final), [flight.position_m[-1, 0]] * 2, atol=1e-13)
    assert not table["failure"].any()
