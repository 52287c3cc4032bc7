"""Every combination of some values in one table."""

from __future__ import annotations

import csv
import shlex
import threading
import tomllib
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np
import pytest

import lgvi


def ends(table: lgvi.Table, row: int, quantity: str, body: str = "body_0") -> np.ndarray:
    return np.array([table[f"{body}.final.{quantity}.{axis}"][row] for axis in "xyz"])


def test_rows_are_the_flights_of_the_combinations(scenes: Path) -> None:
    scene = lgvi.Scene.load(scenes / "two_dumbbells.toml").with_values({"run.duration": 1.0})
    methods = ["lgvi", {"name": "nystrom", "order": 4}]
    table = scene.sweep({"run.integrator": methods, "run.steps": np.array([50, 100])})
    assert list(table)[:5] == ["flight", "run.integrator", "run.steps", "steps", "failure"]
    assert table["flight"].tolist() == [0, 1, 2, 3]
    assert table["run.integrator"][0] == "lgvi" and "nystrom" in table["run.integrator"][2]
    assert table["run.steps"].tolist() == table["steps"].tolist() == [50, 100, 50, 100]
    assert not table["failure"].any()
    row = 0
    for method in methods:
        for steps in (50, 100):
            flight = scene.with_values({"run.integrator": method, "run.steps": steps}).fly()
            for index, body in enumerate(flight.bodies):
                np.testing.assert_array_equal(ends(table, row, "position", body), flight.position_m[-1, index])
                np.testing.assert_array_equal(ends(table, row, "velocity", body), flight.velocity_m_s[-1, index])
            row += 1
    other = scene.sweep({"run.integrator": methods, "run.steps": (50, 100)}, threads=1)
    assert list(other) == list(table)
    for name, column in table.items():
        np.testing.assert_array_equal(other[name], column)


def test_the_table_is_that_of_the_command_line(scenes: Path) -> None:
    """The fixture is what a command has written to `sweep.csv`, after a line with this command."""
    command, *lines = (Path(__file__).parent / "sweep.csv").read_text().splitlines()
    name, subcommand, file, *options = shlex.split(command.removeprefix("# "))
    assert (name, subcommand) == ("lgvi", "sweep")
    given: dict[str, dict[str, Any]] = {"--set": {}, "--vary": {}}
    for option, setting in zip(options[::2], options[1::2], strict=True):
        key, value = setting.split("=", 1)
        given[option][key] = tomllib.loads(f"value = {value}")["value"]
    table = lgvi.Scene.load(scenes.parent / file).with_values(given["--set"]).sweep(given["--vary"])
    names, *rows = csv.reader(lines)
    assert list(table) == names and table.rows == len(rows) == 8
    for name, cells in zip(names, zip(*rows, strict=True), strict=True):
        column = table[name]
        # The texts of numbers are those of the same bits.
        assert column.tolist() == [column.dtype.type(cell) for cell in cells], name


def test_columns_have_the_type_of_what_varies(spin: lgvi.Scene) -> None:
    nominal = "bodies[0].name"
    cases: list[tuple[str, Any, Any, str]] = [
        ("run.steps", [10, 20], [10, 20], "i"),
        ("run.duration", [1.0, 2], [1.0, 2.0], "f"),
        ("run.duration", np.array([1.0, 2.0]), [1.0, 2.0], "f"),
        ("title", ["1", "02"], ["1", "02"], "U"),
        ("title", ["true", "nan"], ["true", "nan"], "U"),
        (nominal, ["a", "b"], ["a", "b"], "U"),
        ("bodies[0].position", [[1, 2, 3], [4.5, 5, 6]], ["[1, 2, 3]", "[4.5, 5, 6]"], "U"),
        ("run.integrator", ["lgvi", {"name": "nystrom", "order": 4}], ["lgvi", '{ name = "nystrom", order = 4 }'], "U"),
    ]
    for key, values, expected, kind in cases:
        column = spin.sweep({key: values})[key]
        assert (column.tolist(), column.dtype.kind) == (expected, kind), key
    short = lgvi.Scene.example("inclination_change").with_values({"run.steps": 20})
    column = short.sweep({"maneuver.feedback": [True, False]})["maneuver.feedback"]
    assert (column.tolist(), column.dtype.kind) == ([True, False], "b")


def test_keys_are_those_of_any_mapping(spin: lgvi.Scene) -> None:
    values = MappingProxyType({"run.steps": 20})
    assert spin.with_values(values).steps == 20
    assert spin.sweep(MappingProxyType({"run.steps": [20]}))["steps"].tolist() == [20]


def test_maneuvers_are_planned(inclination: lgvi.Scene) -> None:
    table = inclination.sweep({"run.steps": [40, 60]})
    assert (table["miss.position"] < 1e-9).all()
    for row, steps in enumerate((40, 60)):
        scene = inclination.with_values({"run.steps": steps})
        flight = scene.fly(controls=scene.plan())
        np.testing.assert_array_equal(ends(table, row, "position", "spacecraft"), flight.position_m[-1, 0])


def test_a_flight_that_fails_is_a_row(scenes: Path) -> None:
    table = lgvi.Scene.load(scenes / "free_body.toml").sweep({"run.steps": [10, 10_000]})
    assert table["failure"][0].startswith("body: ") and not table["failure"][1]
    assert table["steps"][0] < 10 and table["steps"][1] == 10_000
    unfit = lgvi.Scene.load(scenes / "two_dumbbells.toml").with_values({"run.steps": 2})
    methods = [{"name": "taylor", "tolerance": 1e-12}, {"name": "auto", "tolerance": 1e-14}]
    table = unfit.sweep({"run.integrator": methods})
    assert "out of reach" in table["failure"][1]
    assert np.isnan(table["change.energy"]).tolist() == [False, True]


def test_values_that_are_no_scene_are_named(spin: lgvi.Scene) -> None:
    with pytest.raises(lgvi.SceneError, match=r"with run\.duration=1\.0, run\.steps=0: .*steps") as caught:
        spin.sweep({"run.duration": [1.0], "run.steps": [100, 0]})
    assert (caught.value.key, caught.value.value) == ("run.steps", "0")
    with pytest.raises(lgvi.SceneError, match="no `moon`") as caught:
        spin.sweep({"bodies.moon.mass": [1, 2]})
    assert (caught.value.key, caught.value.value) == ("bodies.moon.mass", "1")
    with pytest.raises(lgvi.SceneError, match="no values") as caught:
        spin.sweep({"run.steps": []})
    assert (caught.value.key, caught.value.value, caught.value.expected) == ("run.steps", None, "at least one value")
    with pytest.raises(ValueError, match="120000 combinations, expected at most 100000"):
        spin.sweep({"run.steps": range(1, 401), "bodies[0].mass": range(1, 301)})
    with pytest.raises(ValueError, match="threads"):
        spin.sweep({"run.steps": [1]}, threads=10**6)
    wrong: list[Any] = [{"run.steps": 100}, {"run.integrator": "lgvi"}, {"run.steps": [None]}, {1: [1]}, ["run.steps"]]
    for vary in wrong:
        with pytest.raises(TypeError):
            spin.sweep(vary)


def test_progress_and_its_exception(spin: lgvi.Scene) -> None:
    parts: list[float] = []
    caller = threading.get_ident()
    callers: set[int] = set()

    def progress(part: float) -> None:
        parts.append(part)
        callers.add(threading.get_ident())

    spin.sweep({"run.steps": [10, 20]}, progress=progress)
    assert parts == sorted(parts) and parts[-1] == 1.0
    assert callers == {caller}

    # Flights of which one ends and the other does not.
    def refuse(part: float) -> None:
        assert part in (0.0, 0.5)
        if part == 0.5:
            raise RuntimeError("enough")

    with pytest.raises(RuntimeError, match="enough"):
        spin.sweep({"run.steps": [10, 2**62]}, threads=2, progress=refuse)


def test_nothing_varies(spin: lgvi.Scene) -> None:
    table = spin.sweep({})
    assert table.rows == 1
    np.testing.assert_array_equal(ends(table, 0, "angular_velocity"), spin.fly().angular_velocity_rad_s[-1, 0])
