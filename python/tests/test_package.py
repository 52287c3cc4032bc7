"""The package as its users see it."""

from __future__ import annotations

import copy
import doctest
import importlib.metadata
import inspect
import json
import pickle
import sys
import threading
from pathlib import Path

import numpy as np
import pytest

import lgvi
import lgvi.bodies
import lgvi.controls
import lgvi.distributed
import lgvi.errors
import lgvi.results
from lgvi import _lgvi


@pytest.mark.parametrize("module", [lgvi, lgvi.so3, lgvi.se3, lgvi.bodies, lgvi.controls, lgvi.distributed])
def test_examples_of_docstrings_hold(module: object) -> None:
    failed, tried = doctest.testmod(module)  # type: ignore[arg-type]
    assert tried > 0 and failed == 0


def test_everything_public_has_a_docstring() -> None:
    for name in lgvi.__all__:
        thing = getattr(lgvi, name)
        if inspect.isclass(thing) or inspect.isfunction(thing):
            assert inspect.getdoc(thing), name
    assert inspect.getdoc(lgvi.distributed.run) and inspect.getdoc(lgvi.distributed.Report)
    for thing in [lgvi.Scene, lgvi.Trajectory, lgvi.Plan, lgvi.Simulation, lgvi.State, lgvi.Bag]:
        for name, member in inspect.getmembers(thing):
            if not name.startswith("_"):
                assert inspect.getdoc(member), f"{thing.__name__}.{name}"


def test_stubs_have_what_the_module_has() -> None:
    stubs = (Path(lgvi.__file__).parent / "_lgvi.pyi").read_text()
    for name, member in vars(_lgvi).items():
        if inspect.isclass(member):
            _, _, body = stubs.partition(f"class {name}:")
            body, _, _ = body.partition("\n@final")
            for attribute in vars(member):
                assert attribute.startswith("_") or f"def {attribute}(" in body, f"{name}.{attribute}"
        elif inspect.isbuiltin(member):
            assert f"def {name}(" in stubs, name


def test_the_interpreter_is_free_during_a_flight() -> None:
    scene = lgvi.rigid_bodies(1.0, [1.0, 2.0, 3.0], angular_velocity_rad_s=[1, 1, 1], duration_s=1.0, steps=5_000_000)
    started = threading.Event()
    ended: list[int] = []

    def fly() -> None:
        started.set()
        scene.fly(t_eval=[1.0])
        ended.append(1)

    interval = sys.getswitchinterval()
    # A thread keeps the interpreter until it gives it away by itself.
    sys.setswitchinterval(1000.0)
    try:
        thread = threading.Thread(target=fly)
        thread.start()
        started.wait()
        during = not ended
        thread.join()
    finally:
        sys.setswitchinterval(interval)
    assert during
    assert ended


def test_scenes_are_made_anew_from_their_text(spin: lgvi.Scene) -> None:
    for other in [pickle.loads(pickle.dumps(spin)), copy.deepcopy(spin), lgvi.Scene.from_toml(spin.text)]:
        np.testing.assert_array_equal(other.fly().rotation, spin.fly().rotation)


def test_values_are_changed_and_the_rest_stays(inclination: lgvi.Scene) -> None:
    changed = inclination.with_values({"run.steps": 10, "bodies.spacecraft.position": np.array([2.0, 0.0, 0.0])})
    assert (inclination.steps, changed.steps) == (1000, 10)
    assert changed.fly().position_m[0, 0].tolist() == [2.0, 0.0, 0.0]
    comments = [line for line in inclination.text.splitlines() if line.startswith("#")]
    assert comments and all(line in changed.text for line in comments)


def test_an_explanation_says_what_flies(inclination: lgvi.Scene) -> None:
    explanation = inclination.explain()
    assert "Lie–Euler" in str(explanation)
    assert explanation.data["steps"] == 1000
    assert explanation.warnings == []


def test_an_explanation_warns(scenes: Path) -> None:
    long = lgvi.Scene.load(scenes / "two_dumbbells.toml").with_values({"run.steps": 30}).explain()
    assert any("rad in a step" in warning for warning in long.warnings)


def test_a_trajectory_is_a_dataset_of_xarray(spin: lgvi.Scene) -> None:
    xarray = pytest.importorskip("xarray")
    flight = spin.fly()
    dataset = xarray.Dataset.from_dict(flight.to_dict())
    assert dataset.position_m.dims == ("time_s", "body", "axis")
    assert dataset.sel(body="body_0", axis="y").angular_velocity_rad_s[0] == 1.0
    np.testing.assert_array_equal(dataset.energy_j, flight.energy_j)
    assert dataset.energy_j.data.base is not None or dataset.energy_j.data is flight.energy_j


def test_invariants_are_those_of_the_states(spin: lgvi.Scene) -> None:
    flight = spin.fly()
    inertia = np.array([1.0, 2.0, 3.0])
    rate = flight.angular_velocity_rad_s[:, 0]
    energy = 0.5 * (inertia * rate**2).sum(axis=1) + 0.5 * 2.0 * (flight.velocity_m_s[:, 0] ** 2).sum(axis=1)
    np.testing.assert_allclose(flight.energy_j, energy, rtol=1e-14)
    momentum = np.einsum("nij,nj->ni", flight.rotation[:, 0], inertia * rate)
    np.testing.assert_allclose(flight.angular_momentum_kg_m2_s, momentum, atol=1e-14)
    np.testing.assert_allclose(momentum, momentum[:1].repeat(len(flight), axis=0), atol=1e-13)
    assert flight.energy_j is flight.energy_j and not flight.energy_j.flags.writeable
    assert flight.orthogonality_error.max() < 1e-14
    np.testing.assert_allclose(lgvi.so3.from_quaternion(flight.attitude_xyzw), flight.rotation, atol=1e-15)


def test_bodies_dock(scenes: Path) -> None:
    flight = lgvi.Scene.load(scenes / "docking.toml").fly()
    (docked,) = flight.docked
    assert set(docked["bodies"]) == {"station", "chaser"}
    assert 0 < docked["time_s"] < flight.time_s[-1]


def test_arrays_of_objects_are_read_only_and_results_are_not(inclination: lgvi.Scene) -> None:
    short = inclination.with_values({"run.steps": 20})
    plan, flight = short.plan(), short.fly()
    for thing in [plan, flight, flight.state(0), short.simulation().state()]:
        arrays = {name: getattr(thing, name) for name in dir(thing) if not name.startswith("_")}
        arrays = {name: array for name, array in arrays.items() if isinstance(array, np.ndarray)}
        assert len(arrays) >= 5
        for name, array in arrays.items():
            assert not array.flags.writeable, f"{type(thing).__name__}.{name}"
            with pytest.raises(ValueError, match="read-only"):
                array[...] = 0.0
    for array in (*short.gravity(np.ones((1, 1, 3)), [[[0, 0, 0, 1.0]]]), lgvi.so3.exp([0.0, 0.0, 1.0])):
        assert array.flags.writeable


def test_the_wheel_says_what_is_linked_in_and_under_which_licenses() -> None:
    files = importlib.metadata.files("lgvi") or []
    (bill,) = [file for file in files if file.parent.name == "sboms"]
    components = json.loads(bill.read_text())["components"]
    assert {"nalgebra", "numpy", "pyo3"} < {component["name"] for component in components}
    assert all(component["licenses"] for component in components)
    assert [file.name for file in files if file.parent.name == "licenses"] == ["LICENSE"]


def test_wheels_turn_the_body(scenes: Path) -> None:
    text = (scenes / "wheel_slew.toml").read_text()
    text = text[: text.index("[[bodies.sensors]]")]
    gravity = text[text.index("[gravity.central]") : text.index("[[bodies]]")]
    text = text.replace(gravity, "").replace("velocity = [0.0, 946.0, 7553.0]", "velocity = [0, 0, 0]")
    scene = lgvi.Scene.from_toml(text.replace("position = [6878137.0, 0.0, 0.0]", "position = [0, 0, 0]"))
    count = scene.text.count("[[bodies.wheels]]")
    torque = np.full((50, count), 1e-4)
    still, pushed = scene.fly(t_eval=[10.0]), scene.fly(
        t_eval=[10.0], controls=lgvi.Controls(wheel_torque_n_m=torque, hold_steps=10)
    )
    assert np.abs(pushed.angular_velocity_rad_s - still.angular_velocity_rad_s).max() > 1e-8
    np.testing.assert_allclose(
        pushed.angular_momentum_kg_m2_s, still.angular_momentum_kg_m2_s, rtol=0, atol=1e-13
    )


def test_wheels_are_in_the_trajectory(scenes: Path, spin: lgvi.Scene) -> None:
    """Each obeys I (ω + a·Ω)˙ = u; the sum of angular momenta of body and wheels is constant."""
    scene = lgvi.rigid_bodies(1.0, [2.0, 3.0, 4.0], angular_velocity_rad_s=[0.1, 0.2, 0.3], duration_s=1.0, steps=100)
    axes, inertia = np.array([[1.0, 0.0, 0.0], [0.0, 0.6, 0.8]]), np.array([0.01, 0.02])
    wheels = [
        {"name": name, "axis": axis, "inertia": part, "speed": 50.0, "viscous_friction": 1e-3}
        for name, axis, part in zip("ab", axes, inertia, strict=True)
    ]
    scene = scene.with_values({"bodies[0].wheels": wheels})
    torque = np.tile([0.3, -0.2], (100, 1))
    flight = scene.fly(controls=lgvi.Controls(wheel_torque_n_m=torque))
    assert flight.wheels == ("body_0.a", "body_0.b")
    speed, applied = flight.wheel_speed_rad_s, flight.wheel_torque_n_m
    assert speed.shape == applied.shape == flight.wheel_angle_rad.shape == (101, 2)
    np.testing.assert_allclose(speed[0], 50.0, rtol=1e-14)
    np.testing.assert_array_equal(applied[0], 0.0)
    # Motors and friction, which is that of the mean speed to second order.
    np.testing.assert_allclose(applied[1:], torque - 1e-3 * (speed[1:] + speed[:-1]) / 2, atol=1e-5)
    axial = inertia * (speed + flight.angular_velocity_rad_s[:, 0] @ axes.T)
    np.testing.assert_allclose(np.diff(axial, axis=0), 0.01 * applied[1:], atol=1e-14)
    slope = np.gradient(flight.wheel_angle_rad, flight.time_s, axis=0)
    np.testing.assert_allclose(slope[1:-1], speed[1:-1], rtol=1e-4)
    matrix = np.diag([2.0, 3.0, 4.0]) - np.einsum("k,ki,kj->ij", inertia, axes, axes)
    momentum = flight.angular_velocity_rad_s[:, 0] @ matrix + axial @ axes
    inertial = np.einsum("nij,nj->ni", flight.rotation[:, 0], momentum)
    np.testing.assert_allclose(inertial, flight.angular_momentum_kg_m2_s, atol=1e-13)
    xarray = pytest.importorskip("xarray")
    dataset = xarray.Dataset.from_dict(flight.to_dict())
    np.testing.assert_array_equal(dataset.wheel_speed_rad_s.sel(wheel="body_0.b"), speed[:, 1])
    assert spin.fly().wheels == () and spin.fly().wheel_speed_rad_s.shape == (101, 0)
    assert "wheel_speed_rad_s" not in spin.fly().to_dict()["data_vars"]
