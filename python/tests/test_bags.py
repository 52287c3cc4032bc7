"""Bags that nodes have recorded."""

from __future__ import annotations

import shutil
from pathlib import Path

import numpy as np
import pytest

import lgvi


def test_tables_have_types_and_rows(bags: Path) -> None:
    bag = lgvi.Bag(bags / "two_dumbbells")
    state = bag.table("/lgvi_propagator/state")
    assert bag.topics["/lgvi_propagator/state"] == "lgvi_msgs/msg/SystemState"
    assert state.rows == bag.message_counts["/lgvi_propagator/state"]
    assert state["step"].dtype == np.uint64 and state["bodies.0.position.0"].dtype == np.float64
    assert set(state["bodies.0.name"]) == {"dumbbell1"}
    scene = bag.table("/lgvi_propagator/scene")
    assert scene["text"].dtype == object and scene["text"][0] == bag.scene().text
    assert state.about == {"topic": "/lgvi_propagator/state", "type": "lgvi_msgs/msg/SystemState"}
    assert set(bag.tables()) == set(bag.topics)
    with pytest.raises(lgvi.BagError, match="no topic /none"):
        bag.table("/none")


def test_tables_are_those_of_pandas_and_arrow(bags: Path) -> None:
    pandas, pyarrow = pytest.importorskip("pandas"), pytest.importorskip("pyarrow")
    bag = lgvi.Bag(bags / "inclination_change")
    for table in bag.tables().values():
        frame, arrow = table.to_pandas(), table.to_arrow()
        assert list(frame) == arrow.column_names == list(table)
        assert len(frame) == arrow.num_rows == table.rows
    odometry = bag.table("/lgvi_propagator/odometry/spacecraft")
    taken = pyarrow.RecordBatchReader.from_stream(odometry).read_all()
    assert taken.column("pose.pose.position.x").to_pylist() == list(odometry["pose.pose.position.x"])
    assert isinstance(odometry.to_pandas(), pandas.DataFrame)
    # Lists of varying length stay lists.
    controls = bag.table("/lgvi_planner/control_sequence", max_elements=1)
    assert len(controls["feedback"][0]) in (0, 72 * 1000)


@pytest.mark.parametrize("name", ["two_dumbbells", "inclination_replan", "interventions"])
def test_recorded_flights_are_repeated_to_the_last_bit(bags: Path, name: str) -> None:
    verdict = lgvi.Bag(bags / name).verify()
    assert verdict["outcome"] == "agrees" and verdict["difference"] is None
    assert verdict["states"] > 0 and verdict["missing"] == 0
    assert "agree bit for bit" in verdict["text"]


def test_half_a_bag_is_refused(bags: Path, tmp_path: Path) -> None:
    shutil.copytree(bags / "free_body", tmp_path / "bag")
    (file,) = (tmp_path / "bag").glob("*.mcap")
    data = file.read_bytes()
    file.write_bytes(data[: len(data) // 2])
    with pytest.raises(lgvi.BagError):
        lgvi.Bag(tmp_path / "bag").verify()


def test_a_damaged_bag_is_recovered(bags: Path, tmp_path: Path) -> None:
    shutil.copytree(bags / "two_dumbbells", tmp_path / "damaged")
    (file,) = (tmp_path / "damaged").glob("*.mcap")
    data = file.read_bytes()
    file.write_bytes(data[:-200])
    recovery = lgvi.Bag.recover(tmp_path / "damaged", tmp_path / "recovered")
    assert Path(recovery["bag"]) == tmp_path / "recovered"
    assert recovery["messages"]["/lgvi_propagator/state"] > 0
    assert lgvi.Bag(tmp_path / "recovered").verify()["outcome"] in ("agrees", "incomplete")
    with pytest.raises(lgvi.BagError, match="exists"):
        lgvi.Bag.recover(tmp_path / "damaged", tmp_path / "recovered")
    with pytest.raises(FileNotFoundError):
        lgvi.Bag.recover(tmp_path / "none", tmp_path / "other")


def test_interrupted_by_its_progress(bags: Path) -> None:
    bag = lgvi.Bag(bags / "two_dumbbells")

    def refuse(part: float) -> None:
        raise RuntimeError("enough")

    with pytest.raises(RuntimeError, match="enough"):
        bag.verify(progress=refuse)
