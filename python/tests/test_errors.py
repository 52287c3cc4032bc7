"""Bad input is an exception with the value and what was expected; nothing panics or hangs."""

from __future__ import annotations

import pickle
import signal
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import lgvi


def test_a_value_out_of_range_is_named_with_file_line_key_and_expectation(scenes: Path, tmp_path: Path) -> None:
    text = (scenes / "free_body.toml").read_text().replace("mass = 1.0", "mass = -1.0")
    file = tmp_path / "wrong.toml"
    file.write_text(text)
    with pytest.raises(lgvi.SceneError, match="mass") as caught:
        lgvi.Scene.load(file)
    error = caught.value
    assert error.file == str(file)
    assert error.key == "bodies[0].mass"
    assert error.value == "-1.0"
    assert error.expected == "a finite number > 0"
    assert error.line is not None and "mass" in text.splitlines()[error.line - 1]


def test_files_and_texts_that_are_no_scenes(tmp_path: Path) -> None:
    with pytest.raises(FileNotFoundError, match=r"none\.toml"):
        lgvi.Scene.load(tmp_path / "none.toml")
    with pytest.raises(FileNotFoundError):
        lgvi.Bag(tmp_path / "none")
    with pytest.raises(lgvi.SceneError, match="TOML") as caught:
        lgvi.Scene.from_toml("title = 't'\nrun = ")
    assert (caught.value.key, caught.value.line) == (None, 2)
    (tmp_path / "binary.toml").write_bytes(b"\xff\x00")
    with pytest.raises(lgvi.SceneError, match=r"binary\.toml") as caught:
        lgvi.Scene.load(tmp_path / "binary.toml")
    assert caught.value.file == str(tmp_path / "binary.toml")
    with pytest.raises(lgvi.BagError):
        lgvi.Bag(tmp_path / "binary.toml")


def test_dictionaries_that_are_no_scenes() -> None:
    endless: list[Any] = []
    endless.extend([endless, endless])
    for wrong, kind in [
        ({"title": object()}, TypeError),
        ({1: 2}, TypeError),
        ({"title": endless}, ValueError),
        ({"title": 2**70}, OverflowError),
        ({"title": "t", "bodies": []}, lgvi.SceneError),
    ]:
        with pytest.raises(kind):
            lgvi.Scene.from_dict(wrong)  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("attitude", "defect"),
    [
        ([0.0, 0.0, 0.0, 1.0 + 1e-8], "a unit quaternion: its norm is 1.00000001, expected 1 to within 1e-9"),
        ([0.0, 0.0, 0.0, 0.0], "a unit quaternion: its norm is 0"),
        (np.eye(3) + 1e-8, r"a rotation matrix by rows: \|RᵀR − I\| is"),
        (-np.eye(3), "a rotation matrix by rows: this is a reflection"),
    ],
)
def test_attitudes_that_are_none(spin: lgvi.Scene, attitude: Any, defect: str) -> None:
    value = dict(zip("xyzw", attitude, strict=True)) if len(attitude) == 4 else attitude
    with pytest.raises(lgvi.SceneError, match=defect) as caught:
        spin.with_values({"bodies[0].attitude": value})
    assert caught.value.key == "bodies[0].attitude"
    if len(attitude) == 4:
        with pytest.raises(lgvi.SceneError, match=defect):
            lgvi.rigid_bodies(1.0, [1, 1, 1], attitude_xyzw=attitude, duration_s=1.0, steps=1)


def test_keys_that_cannot_be_set(spin: lgvi.Scene) -> None:
    with pytest.raises(lgvi.SceneError, match="no `moon`") as caught:
        spin.with_values({"bodies.moon.mass": 1.0})
    assert caught.value.key == "bodies.moon.mass"
    with pytest.raises(lgvi.SceneError, match="steps"):
        spin.with_values({"run.steps": 0})
    with pytest.raises(lgvi.SceneError, match=r"run\.integrator"):
        spin.with_values({"run.integrator": {"name": "nystrom", "order": 5}})


@pytest.mark.parametrize(
    "times", [[-1.0], [np.nan], [np.inf], [2.0, 1.0], [10.1], [[1.0]], "now", [1j], [None]]
)
def test_times_that_no_flight_has(spin: lgvi.Scene, times: Any) -> None:
    with pytest.raises(ValueError, match="t_eval"):
        spin.fly(t_eval=times)


@pytest.mark.parametrize(
    "wrench",
    [[1.0], np.zeros((2, 6)), [np.nan] * 6, [0, 0, 0, np.inf, 0, 0], "push", {"moon": [0] * 6}, {"body_0": [0]}],
)
def test_wrenches_that_do_not_fit(spin: lgvi.Scene, wrench: Any) -> None:
    with pytest.raises(ValueError):
        spin.fly(controls=lambda t, state: wrench)
    with pytest.raises(ValueError):
        spin.simulation().apply(wrench)


@pytest.mark.parametrize(
    ("controls", "expected"),
    [
        (lgvi.Controls(), "empty"),
        (lgvi.Controls(force_n=[[1.0, 2.0]]), "shape"),
        (lgvi.Controls(force_n=[[np.nan, 0, 0]]), "NaN"),
        (lgvi.Controls(force_n=[[1, 2, 3]], moment_n_m=[[1, 2, 3]] * 2), "same number"),
        (lgvi.Controls(force_n=[[1, 2, 3]], hold_steps=0), "step_size"),
        (lgvi.Controls(force_n=[[1, 2, 3]], first_step=100), "first_step"),
        (lgvi.Controls(force_n=[[1, 2, 3]], body="moon"), "moon"),
        (lgvi.Controls(force_n=[[1, 2, 3]], frame="moon"), "frame"),
        (lgvi.Controls(wheel_torque_n_m=[[1]]), "shape"),
        (lgvi.Controls(force_n=[[1, 2, 3]], wheel_torque_n_m=[[1]]), "beside"),
    ],
)
def test_controls_that_do_not_fit(spin: lgvi.Scene, controls: lgvi.Controls, expected: str) -> None:
    with pytest.raises(ValueError, match=expected):
        spin.fly(controls=controls)


@pytest.mark.parametrize("wrong", [3, "plan", [3], object()])
def test_what_is_no_control(spin: lgvi.Scene, wrong: Any) -> None:
    with pytest.raises(TypeError, match="controls"):
        spin.fly(controls=wrong)


@pytest.mark.parametrize("period", [0.0, -1.0, 0.15, np.nan, np.inf, 1e9])
def test_periods_that_are_no_steps(spin: lgvi.Scene, period: float) -> None:
    with pytest.raises(ValueError, match="period_s"):
        spin.fly(controls=lambda t, state: None, period_s=period)


def test_exceptions_of_functions_come_through(spin: lgvi.Scene) -> None:
    class Own(Exception):
        pass

    def fail(*arguments: object) -> None:
        raise Own

    for keywords in [{"controls": fail}, {"force": fail}]:
        with pytest.raises(Own):
            spin.fly(**keywords)  # type: ignore[arg-type]
    simulation = None
    try:
        simulation = spin.simulation(force=fail)
        with pytest.raises(Own):
            simulation.step()
    except Own:
        # Some integrators evaluate forces when they begin.
        assert simulation is None
    long = spin.with_values({"run.steps": 50_000_000})
    with pytest.raises(Own):
        long.fly(t_eval=[10.0], progress=fail)


def test_a_step_that_cannot_be_made_says_which() -> None:
    scene = lgvi.rigid_bodies(
        [1.0, 1.0],
        [1.0, 1.0, 1.0],
        position_m=[[1.0, 0.0, 0.0], [-1.0, 0.0, 0.0]],
        gravity={"mutual": {"constant": 1.0}},
        duration_s=10.0,
        steps=100,
    ).with_values({"bodies[0].radius": 0.25, "bodies[1].radius": 0.25})
    with pytest.raises(lgvi.FlightError, match="body_0") as caught:
        scene.fly()
    assert 0 < caught.value.step < 100
    assert caught.value.time_s == caught.value.step * scene.step_s
    simulation = scene.simulation()
    with pytest.raises(lgvi.FlightError):
        simulation.step(1000)
    assert simulation.steps == caught.value.step


def test_flights_that_would_not_fit_into_memory(spin: lgvi.Scene) -> None:
    with pytest.raises(ValueError, match="t_eval"):
        spin.with_values({"run.steps": 10**12}).fly()


# Asks for the arrays of a flight while there is no memory for them, and again once there is.
CROWDED = """
import resource
import lgvi, numpy as np

scene = lgvi.rigid_bodies(1.0, [2.0, 3.0, 4.0], angular_velocity_rad_s=[0.1, 1.0, 0.1], duration_s=1.0, steps=1_500_000)
if WHEELS:
    scene = scene.with_values({"bodies[0].wheels": [{"name": "a", "axis": [1.0, 0.0, 0.0], "inertia": 0.01}]})
times = np.linspace(0.0, 1.0, 1_500_001)
limit = int(open("/proc/self/statm").read().split()[0]) * resource.getpagesize() + (1 << 30)
resource.setrlimit(resource.RLIMIT_AS, (limit, limit))

def fill():
    ballast = []
    try:
        while True:
            ballast.append(bytearray(4 << 20))
    except MemoryError:
        return ballast

def refused(make):
    try:
        make()
    except MemoryError:
        return True
    return False

ballast = fill()
assert refused(lambda: scene.fly(t_eval=times))
ballast = None
flight = scene.fly(t_eval=times)
names = [name for name in dir(flight) if name.endswith(("_s", "_m", "_n", "_j", "_xyzw", "_rad", "_error", "rotation"))]
names = [name for name in names if WHEELS or not name.startswith("wheel")]
ballast = fill()
assert [name for name in names if not refused(lambda: getattr(flight, name))] == []
ballast = None
print(len(names), flight.rotation.shape, flight.energy_j.shape, flight.wheel_speed_rad_s.shape)
"""


@pytest.mark.parametrize(("wheels", "arrays"), [(False, 12), (True, 15)])
def test_results_that_would_not_fit_into_memory(wheels: bool, arrays: int) -> None:
    """In a process of its own, which is not aborted."""
    script = CROWDED.replace("WHEELS", str(wheels))
    run = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, timeout=120)
    assert run.returncode == 0, run.stderr
    assert run.stdout == f"{arrays} (1500001, 1, 3, 3) (1500001,) (1500001, {int(wheels)})\n"


@pytest.mark.parametrize("count", [3 * 10**12, 2**60])
@pytest.mark.parametrize(
    "use",
    [
        "spin.fly(t_eval=huge())",
        "spin.fly(t_eval=huge(dtype=bool))",
        "spin.fly(t_eval=huge(dtype=complex))",
        "spin.fly(t_eval=range(count))",
        "spin.fly(controls=lgvi.Controls(force_n=huge(3)))",
        "spin.fly(controls=lgvi.Controls(moment_n_m=huge(3)))",
        "spin.fly(controls=lambda t, state: huge(6))",
        "spin.simulation().apply(huge(6))",
        "spin.simulation().apply({'body_0': huge()})",
        "spin.gravity(huge(1, 3), huge(1, 4))",
        "spin.with_values({'run.steps': huge()})",
        "spin.sweep({'run.steps': huge()})",
        "spin.sweep({'run.steps': range(count)})",
        "lgvi.Scene.from_dict({'bodies': huge()})",
        "lgvi.rigid_bodies(huge(), [1, 1, 1], duration_s=1, steps=1)",
        "lgvi.rigid_bodies(1, huge(3), duration_s=1, steps=1)",
        "lgvi.so3.exp(huge(3))",
        "lgvi.so3.hat(huge(3))",
        "lgvi.so3.log(huge(3, 3))",
        "lgvi.so3.from_quaternion(huge(4))",
        "lgvi.se3.compose(huge(4, 4), np.eye(4))",
        "lgvi.se3.act(np.eye(4), huge(3))",
        "lgvi._lgvi.so3_exp(huge(3))",
        "lgvi._lgvi.se3_act(huge(16), huge(3))",
    ],
)
def test_arrays_that_would_not_fit_into_memory(spin: lgvi.Scene, use: str, count: int) -> None:
    """Arrays whose strides are 0 have any number of elements. A process that is aborted fails the test run."""

    def huge(*shape: int, dtype: type = float) -> np.ndarray:
        row = count // max(int(np.prod(shape)), 1)
        return np.broadcast_to(np.zeros((), dtype), (row, *shape))

    with pytest.raises((MemoryError, ValueError)):
        eval(use, {"spin": spin, "huge": huge, "count": count, "lgvi": lgvi, "np": np})


def test_ensembles_that_cannot_be_flown(spin: lgvi.Scene, scenes: Path) -> None:
    with pytest.raises(lgvi.EnsembleError, match="ensemble"):
        spin.ensemble()
    scene = lgvi.Scene.load(scenes / "dispersed_capture.toml")
    for keywords in [{"samples": 0}, {"samples": 10, "range": (5, 11)}, {"range": (5, 5)}]:
        with pytest.raises(lgvi.EnsembleError, match="expected"):
            scene.ensemble(**keywords)  # type: ignore[arg-type]
    fly: list[Callable[[], object]] = [
        lambda: scene.ensemble(threads=1025),
        lambda: spin.sweep({"run.steps": [1]}, threads=1025),
    ]
    for refused in fly:
        with pytest.raises(ValueError, match="`threads`: 1025 threads, expected at most 1024") as caught:
            refused()
        assert type(caught.value) is ValueError
    with pytest.raises(OverflowError):
        scene.ensemble(samples=-1)
    other = scene.with_values({"run.steps": 100}).plan()
    with pytest.raises(lgvi.EnsembleError, match="other units"):
        scene.ensemble(samples=10, plan=other)


def test_plans_that_are_not_there(spin: lgvi.Scene, inclination: lgvi.Scene) -> None:
    with pytest.raises(lgvi.PlanError, match="no maneuver") as caught:
        spin.plan()
    assert caught.value.reason == "refused"
    limited = lgvi.Scene.from_toml(
        inclination.text.replace(
            "[maneuver.target]", '[[maneuver.constraints]]\nkind = "force_norm"\nlimit = 1e-3\n[maneuver.target]'
        )
    )
    with pytest.raises(lgvi.PlanError) as caught:
        limited.plan()
    assert caught.value.reason in ("infeasible", "not_converged")
    with pytest.raises(ValueError, match="another scene"):
        inclination.plan(spin.simulation().state())
    other = inclination.with_values({"run.steps": 100})
    with pytest.raises(ValueError, match="other units"):
        other.plan(other.simulation().state(), warm=inclination.plan())


def test_a_refused_wrench_changes_nothing() -> None:
    scene = lgvi.rigid_bodies([1.0, 2.0], [1.0, 1.0, 1.0], duration_s=1.0, steps=10)
    pushed, still = scene.simulation(), scene.simulation()
    wrenches = np.ones((2, 6))
    wrenches[1, 3] = np.nan
    for wrench in (wrenches, dict(zip(["body_0", "body_1"], wrenches.tolist(), strict=True))):
        with pytest.raises(lgvi.ControlError, match="the wrench on body_1 at step 0"):
            pushed.apply(wrench, steps=5)
    pushed.step(5)
    still.step(5)
    np.testing.assert_array_equal(pushed.state().velocity_m_s, still.state().velocity_m_s)
    np.testing.assert_array_equal(pushed.state().rotation, still.state().rotation)


def test_exceptions_of_what_is_handed_over_as_an_array_come_through(spin: lgvi.Scene) -> None:
    class Own(Exception):
        pass

    class Array:
        def __init__(self, error: type[BaseException]) -> None:
            self.error = error

        def __array__(self, *arguments: Any, **keywords: Any) -> np.ndarray:
            raise self.error("from the array")

    for raised, expected in [
        (KeyboardInterrupt, KeyboardInterrupt),
        (Own, Own),
        (MemoryError, MemoryError),
        (TypeError, ValueError),
    ]:
        with pytest.raises(expected, match="from the array"):
            spin.fly(t_eval=Array(raised))


def test_steps_that_cannot_be_counted(spin: lgvi.Scene) -> None:
    simulation = spin.simulation()
    simulation.step(0)
    with pytest.raises(OverflowError):
        simulation.step(-1)
    with pytest.raises(lgvi.ControlError, match="steps"):
        simulation.apply([0] * 6, steps=0)
    with pytest.raises(IndexError):
        spin.fly().state(101)
    with pytest.raises(ValueError, match="expected one of"):
        lgvi.Scene.example("moon")


def test_control_c_ends_a_flight() -> None:
    script = (
        "import lgvi\n"
        "scene = lgvi.rigid_bodies(1.0, [1, 2, 3], duration_s=1.0, steps=10**12)\n"
        "scene.fly(t_eval=[1.0], progress=lambda part: print('flying', flush=True))\n"
    )
    with subprocess.Popen(
        [sys.executable, "-c", script], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    ) as process:
        assert process.stdout is not None
        assert process.stdout.readline() == "flying\n"
        process.send_signal(signal.SIGINT)
        _, errors = process.communicate(timeout=60)
    assert "KeyboardInterrupt" in errors
    assert process.returncode == -signal.SIGINT


def test_errors_come_from_other_processes_as_they_are() -> None:
    for error in [
        lgvi.SceneError("text", "file", 1, "key", "value", "expected"),
        lgvi.FlightError("text", 3, 0.5),
        lgvi.PlanError("text", "infeasible"),
        lgvi.EnsembleError("text"),
        lgvi.RotationError("text"),
    ]:
        other = pickle.loads(pickle.dumps(error))
        assert (type(other), str(other), vars(other)) == (type(error), "text", vars(error))
