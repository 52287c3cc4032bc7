"""Ensembles in parts: the table is that of one run, whoever flies and whoever dies."""

from __future__ import annotations

import multiprocessing
import os
import secrets
import signal
import subprocess
import sys
import tempfile
import time
import urllib.request
from collections.abc import Callable, Iterator
from concurrent.futures import Executor, ProcessPoolExecutor
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

import lgvi
from lgvi import distributed
from lgvi._parts import Store

pq = pytest.importorskip("pyarrow.parquet")
pytest.importorskip("fsspec")

SAMPLES = 300
PART = 16
PARTS = 19


@pytest.fixture(scope="module")
def scene() -> lgvi.Scene:
    """A maneuver with a thousand steps, so that a plan is made, too."""
    return lgvi.Scene.example("dispersed_capture")


@pytest.fixture(scope="module")
def whole(scene: lgvi.Scene) -> lgvi.Table:
    """The ensemble in one run."""
    return scene.ensemble(SAMPLES)


def check(table: Any, whole: lgvi.Table) -> None:
    """Check that two tables have the same bits."""
    assert table.column_names == list(whole)
    for name, column in whole.items():
        found = table[name].to_numpy()
        if column.dtype.kind == "f":
            found, column = found.view(np.uint64), column.view(np.uint64)
        np.testing.assert_array_equal(found, column, err_msg=name)


def contents(directory: Path) -> dict[str, bytes]:
    return {file.name: file.read_bytes() for file in directory.iterdir()}


def test_parts_are_the_rows_of_one_run_and_are_not_flown_again(
    scene: lgvi.Scene, whole: lgvi.Table, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    done: list[float] = []
    report = distributed.run(scene, SAMPLES, path="new/capture", part=PART, progress=done.append)
    assert report == distributed.Report(SAMPLES, flown=PARTS, kept=0)
    assert done == [(count + 1) / PARTS for count in range(PARTS)]
    directory = tmp_path / "new" / "capture"
    check(pq.read_table(directory), whole)
    before = contents(directory)
    assert min(before) == "samples_0000000000_0000000016.parquet"
    assert max(before) == "samples_0000000288_0000000300.parquet"
    (directory / min(before)).unlink()
    assert distributed.run(scene, SAMPLES, path=directory, part=PART) == distributed.Report(SAMPLES, 1, PARTS - 1)
    assert contents(directory) == before


def test_a_killed_run_goes_on(scene: lgvi.Scene, whole: lgvi.Table, tmp_path: Path) -> None:
    run = f"""
import os, signal, lgvi
from lgvi import distributed

def progress(fraction):
    if fraction > 0.5:
        os.kill(os.getpid(), signal.SIGKILL)

scene = lgvi.Scene.example("dispersed_capture")
distributed.run(scene, {SAMPLES}, path={str(tmp_path)!r}, part={PART}, progress=progress)
"""
    assert subprocess.run([sys.executable, "-c", run], timeout=120).returncode == -signal.SIGKILL
    # What a process leaves behind that is killed while it writes.
    (tmp_path / ".samples_0000000288_0000000300.parquet.0123").write_bytes(b"PAR1")
    kept = PARTS // 2 + 1
    report = distributed.run(scene, SAMPLES, path=tmp_path, part=PART)
    assert report == distributed.Report(SAMPLES, flown=PARTS - kept, kept=kept)
    check(pq.read_table(tmp_path), whole)


def test_processes_fly_parts(scene: lgvi.Scene, whole: lgvi.Table, tmp_path: Path) -> None:
    with ProcessPoolExecutor(2, mp_context=multiprocessing.get_context("spawn")) as executor:
        report = distributed.run(scene, SAMPLES, path=tmp_path, engine=executor, part=PART)
        assert report.flown == PARTS
        check(pq.read_table(tmp_path), whole)
        # An exception of a worker comes through and ends the run.
        (tmp_path / "samples_0000000016_0000000032.parquet").write_bytes(b"PAR1")
        with pytest.raises(lgvi.EnsembleError, match="samples_0000000016_0000000032.parquet is damaged"):
            distributed.run(scene, SAMPLES, path=tmp_path, engine=executor, part=PART)


def sticking() -> Callable[[str], int]:
    """A function, which is sent to workers by value, that lets its process stick in the next part that it flies.

    The process does not write the part, but a file as a mark.
    """

    def stick(marker: str) -> int:
        import lgvi._parts

        def write(*arguments: object) -> None:
            Path(marker).touch()
            while True:
                time.sleep(1.0)

        lgvi._parts.Store.write = write  # type: ignore[assignment, method-assign]
        return os.getpid()

    return stick


def killing(victim: int, marker: Path, count: Callable[[], int]) -> Callable[[float], None]:
    """After the first part, kill a process that is stuck in another; `count` tells how many parts there are."""

    def kill(fraction: float) -> None:
        if fraction != 1 / PARTS:
            return
        until = time.monotonic() + 60
        while not marker.exists():
            assert time.monotonic() < until, "the victim flies no part"
            time.sleep(0.01)
        os.kill(victim, signal.SIGKILL)
        marker.unlink()
        assert 0 < count() < PARTS, "it dies in the middle"

    return kill


def fly_and_kill(scene: lgvi.Scene, directory: Path, path: str, options: dict[str, Any], count: Callable[[], int]) -> None:
    """Fly on two workers of Dask, one of which is killed in its first part; `count` tells how many parts there are."""
    dask = pytest.importorskip("distributed")
    cluster = dask.LocalCluster(
        n_workers=2,
        threads_per_worker=1,
        host="127.0.0.1",
        dashboard_address="127.0.0.1:0",
        local_directory=directory,
    )
    with cluster, dask.Client(cluster) as client:
        marker = directory / "stuck"
        worker = min(client.run(os.getpid))
        (victim,) = client.run(sticking(), str(marker), workers=[worker]).values()
        assert victim != os.getpid()
        kill = killing(victim, marker, count)
        report = distributed.run(
            scene, SAMPLES, path=path, engine=client, part=PART, storage_options=options, progress=kill
        )
        assert report == distributed.Report(SAMPLES, flown=PARTS, kept=0)
        assert not marker.exists(), "a worker was killed"
        assert victim not in client.run(os.getpid).values()


def test_dask_flies_the_parts_of_a_killed_worker_again(
    scene: lgvi.Scene, whole: lgvi.Table, tmp_path: Path
) -> None:
    parts = tmp_path / "dask_parts"
    fly_and_kill(scene, tmp_path / "dask", str(parts), {}, lambda: len(list(parts.glob("samples_*"))))
    check(pq.read_table(parts), whole)
    distributed.run(scene, SAMPLES, path=tmp_path / "parts", part=PART)
    assert contents(parts) == contents(tmp_path / "parts")


def processes() -> dict[int, int]:
    """The processes that have not ended, with their parents."""
    found: dict[int, int] = {}
    for file in Path("/proc").glob("[0-9]*/stat"):
        try:
            state, parent, *_ = file.read_text().rpartition(")")[2].split()
        except (FileNotFoundError, ProcessLookupError):
            continue
        if state != "Z":
            found[int(file.parent.name)] = int(parent)
    return found


def descendants() -> set[int]:
    """The processes that this one and its children have started."""
    parents, found = processes(), {os.getpid()}
    while new := {child for child, parent in parents.items() if parent in found} - found:
        found |= new
    return found


@pytest.fixture
def ray(monkeypatch: pytest.MonkeyPatch) -> Iterator[Any]:
    """Ray with two workers on loopback, which leaves no process behind."""
    monkeypatch.setenv("RAY_ENABLE_WINDOWS_OR_OSX_CLUSTER", "0")  # Nobody else can join.
    monkeypatch.setenv("RAY_AUTH_TOKEN", secrets.token_hex(32))
    monkeypatch.setenv("RAY_USAGE_STATS_ENABLED", "0")
    module = pytest.importorskip("ray")
    before = descendants()
    # Paths of sockets are short.
    with tempfile.TemporaryDirectory(prefix="ray") as directory:
        module.init(num_cpus=2, include_dashboard=False, log_to_driver=False, logging_level="ERROR", _temp_dir=directory)
        own = descendants() - before
        try:
            assert module.util.get_node_ip_address() == "127.0.0.1"
            yield module
        finally:
            own |= descendants() - before
            module.shutdown()
    until = time.monotonic() + 60
    while (left := own.intersection(processes())) and time.monotonic() < until:
        time.sleep(0.1)
    assert not left


def test_ray_flies_the_parts_of_a_killed_worker_again(
    scene: lgvi.Scene, whole: lgvi.Table, tmp_path: Path, ray: Any
) -> None:
    parts = tmp_path / "ray_parts"

    marker = tmp_path / "stuck"
    victim = ray.get(ray.remote(sticking()).remote(str(marker)))
    assert victim in descendants()
    kill = killing(victim, marker, lambda: len(list(parts.glob("samples_*"))))
    report = distributed.run(scene, SAMPLES, path=parts, engine="ray", part=PART, progress=kill)
    assert report == distributed.Report(SAMPLES, flown=PARTS, kept=0)
    assert not marker.exists(), "a worker was killed"
    assert victim not in processes()
    check(pq.read_table(parts), whole)
    distributed.run(scene, SAMPLES, path=tmp_path / "parts", part=PART)
    assert contents(parts) == contents(tmp_path / "parts")
    # An exception of a worker comes through and ends the run.
    (parts / "samples_0000000016_0000000032.parquet").write_bytes(b"PAR1")
    with pytest.raises(lgvi.EnsembleError, match="samples_0000000016_0000000032.parquet is damaged") as caught:
        distributed.run(scene, SAMPLES, path=parts, engine="ray", part=PART)
    assert type(caught.value) is lgvi.EnsembleError


class OneByOne:
    """What of Ray flies parts, which end one after the other."""

    exceptions = SimpleNamespace(RayTaskError=RuntimeError)

    def __init__(self) -> None:
        self.begun: list[lgvi._parts.Part] = []
        self.ended = self.looked_at = self.most = 0
        self.cancelled: list[lgvi._parts.Part] = []

    def cluster_resources(self) -> dict[str, float]:
        return {"CPU": 3.0}

    def put(self, task: Any) -> Any:
        return task

    def remote(self, **options: Any) -> Callable[[Any], Any]:
        def begin(part: lgvi._parts.Part, task: Any) -> lgvi._parts.Part:
            self.begun.append(part)
            return part

        return lambda function: SimpleNamespace(remote=begin)

    def wait(self, waiting: list[lgvi._parts.Part]) -> tuple[list[lgvi._parts.Part], list[lgvi._parts.Part]]:
        self.most = max(self.most, len(waiting))
        self.looked_at += len(waiting)
        self.ended += 1
        return waiting[:1], waiting[1:]

    def get(self, done: list[lgvi._parts.Part]) -> list[bool]:
        return [True for _ in done]

    def cancel(self, part: lgvi._parts.Part) -> None:
        self.cancelled.append(part)


def test_ray_has_a_window_of_parts() -> None:
    parts = [(first, first + 1) for first in range(10_000)]
    ray = OneByOne()
    assert list(distributed._with_ray(ray, None, parts)) == [True] * len(parts)  # type: ignore[arg-type]
    assert ray.begun == parts and ray.most == 12 and ray.looked_at <= 12 * len(parts)
    assert not ray.cancelled
    # What has begun is cancelled when the run is ended.
    ray = OneByOne()
    flown = distributed._with_ray(ray, None, parts)  # type: ignore[arg-type]
    assert next(flown)
    flown.close()  # type: ignore[attr-defined]
    assert ray.cancelled == parts[1:12]


def test_ray_that_is_not_installed_is_named_before_anything_is_flown(
    scene: lgvi.Scene, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "ray", None)
    monkeypatch.setattr(distributed, "_ready", lambda *arguments: pytest.fail("it plans"))
    with pytest.raises(ImportError, match=r"lgvi\[ray\]"):
        distributed.run(scene, 40, path=tmp_path / "capture", engine="ray")
    assert not list(tmp_path.iterdir())


@pytest.fixture
def bucket() -> Iterator[tuple[str, dict[str, Any]]]:
    """A bucket of an S3 server on loopback: its URL and the storage options."""
    server_module = pytest.importorskip("moto.server")
    s3fs = pytest.importorskip("s3fs")
    server = server_module.ThreadedMotoServer(ip_address="127.0.0.1", port=0, verbose=False)
    server.start()
    try:
        host, port = server.get_host_and_port()
        url = f"http://{host}:{port}"
        # The servers of a process share their objects.
        urllib.request.urlopen(f"{url}/moto-api/reset", data=b"").close()
        options = {"key": "key", "secret": "secret", "endpoint_url": url}
        s3fs.S3FileSystem(**options).mkdir("flights")
        yield "s3://flights/capture", options
    finally:
        server.stop()


def test_an_object_store_has_each_part_by_one_put(
    scene: lgvi.Scene, whole: lgvi.Table, bucket: tuple[str, dict[str, Any]]
) -> None:
    import s3fs

    path, options = bucket
    for flown in [3, 0]:
        report = distributed.run(scene, SAMPLES, path=path, part=100, storage_options=options)
        assert report == distributed.Report(SAMPLES, flown, 3 - flown)
    system = s3fs.S3FileSystem(**options)
    system.invalidate_cache()
    objects = system.ls(path, detail=True)
    assert len(objects) == 3
    # The tag of an upload in several parts has their number after a dash.
    assert all("-" not in entry["ETag"] for entry in objects)
    check(pq.read_table("flights/capture", filesystem=system), whole)


def test_an_object_store_has_the_bytes_of_a_directory_when_a_worker_was_killed(
    scene: lgvi.Scene, whole: lgvi.Table, bucket: tuple[str, dict[str, Any]], tmp_path: Path
) -> None:
    import s3fs

    path, options = bucket
    system = s3fs.S3FileSystem(**options)

    def names() -> list[str]:
        system.invalidate_cache()
        found: list[str] = system.glob(f"{path}/samples_*")
        return found

    fly_and_kill(scene, tmp_path / "dask", path, options, lambda: len(names()))
    check(pq.read_table("flights/capture", filesystem=system), whole)
    distributed.run(scene, SAMPLES, path=tmp_path / "parts", part=PART)
    objects = {name.rpartition("/")[2]: system.cat_file(name) for name in names()}
    assert objects == contents(tmp_path / "parts")


def test_parts_of_other_ensembles_are_refused(scene: lgvi.Scene, tmp_path: Path) -> None:
    distributed.run(scene, 40, path=tmp_path, part=PART)
    changes: list[tuple[dict[str, Any], str]] = [
        ({"seed": 7}, "its identity is"),
        ({"samples": 48}, "samples_0000000032_0000000040.parquet, which is no part of 48 samples"),
        ({"part": 20}, "samples_0000000000_0000000016.parquet, which is no part of 40 samples, 20 a part"),
    ]
    for keywords, message in changes:
        with pytest.raises(lgvi.EnsembleError, match=message):
            distributed.run(scene, **{"samples": 40, "path": tmp_path, "part": PART, **keywords})
    first, second, _ = sorted(tmp_path.iterdir())
    first.write_bytes(second.read_bytes())
    with pytest.raises(lgvi.EnsembleError, match="other samples than 0 to 15"):
        distributed.run(scene, 40, path=tmp_path, part=PART)


def test_parts_of_long_flights_have_fewer_samples(
    spin: lgvi.Scene, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """They have at most 2²⁶ steps of a body, but at least 32 samples."""
    dispersed = lgvi.Scene.from_toml(spin.text + "\n[ensemble]\nsamples = 65\nseed = 1\n")
    for steps, size in [(100, 1024), (1 << 16, 1024), ((1 << 16) + 1, 512), (1 << 20, 64), ((1 << 21) + 1, 32)]:
        about = dispersed.with_values({"run.steps": steps}).ensemble(range=(0, 1)).about
        assert about["part"] == size, steps
    flown: list[tuple[int, int]] = []

    def fly(task: distributed._Task, part: tuple[int, int]) -> bool:
        flown.append(part)
        return True

    monkeypatch.setattr(distributed._Task, "fly", fly)
    distributed.run(dispersed.with_values({"run.steps": 1 << 20}), path=tmp_path)
    assert flown == [(0, 64), (64, 65)]


def test_damaged_parts_are_refused(scene: lgvi.Scene, tmp_path: Path) -> None:
    distributed.run(scene, 4, path=tmp_path)
    (file,) = tmp_path.iterdir()
    good, table = file.read_bytes(), scene.ensemble(4)
    refused = 0
    positions = range(0, len(good), len(good) // 80)
    for position in positions:
        file.write_bytes(good[:position] + bytes([good[position] ^ 1]) + good[position + 1 :])
        try:
            distributed.run(scene, 4, path=tmp_path)
        except lgvi.EnsembleError:
            refused += 1
        else:
            # What a damaged file is kept for is whole.
            check(pq.read_table(file), table)
    assert refused > len(positions) // 2
    file.write_bytes(good[:-1])
    with pytest.raises(lgvi.EnsembleError, match="damaged"):
        distributed.run(scene, 4, path=tmp_path)


def test_what_cannot_be_flown_in_parts(scene: lgvi.Scene, spin: lgvi.Scene, tmp_path: Path) -> None:
    with pytest.raises(lgvi.EnsembleError, match="`part` is 0, expected at least 1"):
        distributed.run(scene, 40, path=tmp_path, part=0)
    for engine in ["processes", None, Executor]:
        with pytest.raises(TypeError, match="`engine` is"):
            distributed.run(scene, 40, path=tmp_path, engine=engine)
    with pytest.raises(lgvi.EnsembleError, match="ensemble"):
        distributed.run(spin, path=tmp_path)
    (tmp_path / "file").touch()
    with pytest.raises(OSError):
        distributed.run(scene, 40, path=tmp_path / "file" / "capture")
    assert [file.name for file in tmp_path.iterdir()] == ["file"]


def test_a_worker_that_flies_another_ensemble_is_refused(scene: lgvi.Scene, tmp_path: Path) -> None:
    about = scene.ensemble(40, range=(0, 1)).about
    longer = scene.with_values({"run.steps": 500})
    task = distributed._Task(longer.name, longer.text, about, Store(str(tmp_path)), threads=1)
    with pytest.raises(lgvi.EnsembleError, match="another version"):
        task.fly((0, 16))
    assert not list(tmp_path.iterdir())
