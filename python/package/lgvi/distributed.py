"""Ensembles on several machines.

The samples are cut into parts. Each part is flown by one task of an engine and written as one Parquet file, which appears as
a whole. All parts together are one table, with the rows of `Scene.ensemble`, whoever has flown them.

Needs fsspec and pyarrow (``pip install lgvi[distributed]``), for Dask its package ``distributed`` (``lgvi[dask]``), for Ray its
package ``ray`` (``lgvi[ray]``), and for object stores the package that fsspec names, such as s3fs.

Examples
--------
>>> import tempfile
>>> import lgvi
>>> from lgvi import distributed
>>> scene = lgvi.Scene.example("dispersed_capture")
>>> with tempfile.TemporaryDirectory() as directory:
...     print(distributed.run(scene, samples=50, path=directory, part=20))
...     print(distributed.run(scene, samples=50, path=directory, part=20))
Report(samples=50, flown=3, kept=0)
Report(samples=50, flown=0, kept=3)
"""

from __future__ import annotations

import functools
import itertools
import os
import sys
from collections.abc import Callable, Iterator, Mapping
from concurrent import futures
from dataclasses import dataclass
from os import PathLike
from typing import Any

from lgvi._lgvi import Plan, Scene
from lgvi._parts import Part, Store, cut, file_name
from lgvi.errors import EnsembleError

__all__ = ["Report", "run"]

# How often Dask and Ray try a part again that has raised an exception, such as one of an object store.
_RETRIES = 3

# Parts that Ray has at a time for each processor of its cluster, which may grow.
_PER_CPU = 4


@dataclass(frozen=True)
class Report:
    """What a run has done.

    Attributes
    ----------
    samples : int
        Samples of the ensemble, all of which are there.
    flown, kept : int
        Parts that the run has flown, and parts that were there.
    """

    samples: int
    flown: int
    kept: int


def run(
    scene: Scene,
    samples: int | None = None,
    seed: int | None = None,
    *,
    path: str | PathLike[str],
    engine: Any = "threads",
    part: int | None = None,
    storage_options: Mapping[str, Any] | None = None,
    progress: Callable[[float], object] | None = None,
) -> Report:
    """Fly an ensemble in parts, and write each to `path` as the Parquet file ``samples_<first>_<end>.parquet``.

    Parts that are there are checked and not flown again, so that the same call continues a run that was ended. The rows are
    those of `Scene.ensemble`, bit for bit, and do not depend on the engine, its workers or their failures.

    Parameters
    ----------
    scene : Scene
        A scene with an ``ensemble`` table. A maneuver is planned once in each process.
    samples, seed : int, optional
        Number of samples of the ensemble and its seed; those of the scene by default.
    path : path_like
        A directory, or a URL that fsspec can open, such as ``s3://bucket/capture``. In a local directory a file is written
        under another name and renamed, in an object store it is one PUT.
    engine : {"threads", "ray"}, concurrent.futures.Executor or distributed.Client
        Who flies: this process with a thread a core, one part after the other; or the workers of Ray, of an executor or of
        Dask, a thread a part. Ray is the cluster of ``ray.init``. Dask and Ray fly the parts of dead workers again, and those
        that raised exceptions up to three times.
    part : int, optional
        Samples of a part. By default as many as in those of ``lgvi ensemble run``: 1024, and fewer of long flights, so that they
        have at most 2²⁶ steps of a body, but 32 at least.
    storage_options : mapping, optional
        What fsspec needs to open `path`.
    progress : callable, optional
        Called with the completed fraction after each part. An exception in it ends the run.

    Raises
    ------
    EnsembleError
        The scene has no ``ensemble`` table, a number is out of its range, `path` has damaged parts or others than those of
        this ensemble, or a worker has another version of lgvi.
    TypeError
        The engine is none of those.
    ImportError
        The package of Ray is not installed.
    """
    if part is not None and part < 1:
        raise EnsembleError(f"`part` is {part}, expected at least 1")
    fly_all = _engine(engine)
    _, plan = _ready(scene.name, scene.text)
    # The first sample tells the identity of the ensemble.
    about = scene.ensemble(samples, seed, range=(0, 1), plan=plan, threads=1).about
    size = about["part"] if part is None else part
    store = Store(_absolute(os.fspath(path)), dict(storage_options or {}))
    parts = cut(about["samples"], size)
    strangers = store.files().difference(map(file_name, parts))
    if strangers:
        raise EnsembleError(
            f"{store.path} has {min(strangers)}, which is no part of {about['samples']} samples, {size} a part"
        )
    task = _Task(scene.name, scene.text, about, store, threads=0 if engine == "threads" else 1)
    flown = 0
    for done, new in enumerate(fly_all(task, parts), 1):
        flown += new
        if progress is not None:
            progress(done / len(parts))
    return Report(about["samples"], flown, len(parts) - flown)


def _absolute(path: str) -> str:
    """Make a local path absolute: workers may be in other directories."""
    return path if "://" in path or "::" in path else os.path.abspath(path)


@dataclass(frozen=True)
class _Task:
    """What a worker needs to know of the ensemble."""

    name: str
    text: str
    about: Mapping[str, Any]
    store: Store
    threads: int

    def fly(self, part: Part) -> bool:
        """Fly the part if it is not there, and return whether it was flown."""
        if self.store.has(part, self.about):
            return False
        scene, plan = _ready(self.name, self.text)
        samples, seed = self.about["samples"], self.about["seed"]
        table = scene.ensemble(samples, seed, range=part, plan=plan, threads=self.threads)
        if table.about != self.about:
            raise EnsembleError(f"a worker flies {table.about}, expected {self.about}; has it another version of lgvi?")
        self.store.write(part, table)
        return True


@functools.lru_cache(maxsize=1)
def _ready(name: str, text: str) -> tuple[Scene, Plan | None]:
    """Return a scene and its plan, which is made once in a process."""
    scene = Scene.from_toml(text, name)
    return scene, scene.plan() if scene.explain().data["maneuver"] else None


# Flies parts and yields for each, in any order, whether it was flown.
_FlyAll = Callable[[_Task, list[Part]], Iterator[bool]]


def _engine(engine: Any) -> _FlyAll:
    if engine == "threads":
        return lambda task, parts: map(task.fly, parts)
    if engine == "ray":
        try:
            import ray
        except ImportError as error:
            raise ImportError('`engine` is "ray", which needs its package: pip install "lgvi[ray]"') from error
        return functools.partial(_with_ray, ray)
    if isinstance(engine, futures.Executor):
        return functools.partial(_with_executor, engine)
    # There is no client of Dask unless its package has been imported.
    dask = sys.modules.get("distributed")
    if dask is not None and isinstance(engine, dask.Client):
        return functools.partial(_with_dask, dask, engine)
    raise TypeError(f'`engine` is {engine!r}, expected "threads", "ray", a concurrent.futures.Executor or a distributed.Client')


def _with_executor(executor: futures.Executor, task: _Task, parts: list[Part]) -> Iterator[bool]:
    waiting = [executor.submit(task.fly, part) for part in parts]
    try:
        for future in futures.as_completed(waiting):
            yield future.result()
    finally:
        for future in waiting:
            future.cancel()


def _with_dask(dask: Any, client: Any, task: _Task, parts: list[Part]) -> Iterator[bool]:
    # As the result of a task, the scene is sent to each worker once, and made again if those that hold it die.
    shared = client.submit(_itself, task, pure=False)
    waiting = client.map(_fly, parts, task=shared, pure=False, retries=_RETRIES)
    try:
        for future in dask.as_completed(waiting):
            yield future.result()
    finally:
        client.cancel(waiting)


def _with_ray(ray: Any, task: _Task, parts: list[Part]) -> Iterator[bool]:
    # Retries are those of dead workers, too.
    fly = ray.remote(max_retries=_RETRIES, retry_exceptions=True)(_fly)
    shared = ray.put(task)
    left = iter(parts)
    waiting: list[Any] = []
    try:
        while True:
            # Each call of `wait` looks at all that it is given.
            window = _PER_CPU * max(int(ray.cluster_resources().get("CPU", 1)), 1)
            for part in itertools.islice(left, max(window - len(waiting), 0)):
                waiting.append(fly.remote(part, shared))
            if not waiting:
                return
            done, waiting = ray.wait(waiting)
            yield from ray.get(done)
    except ray.exceptions.RayTaskError as error:
        raise error.cause from error
    finally:
        for part in waiting:
            ray.cancel(part)


def _itself(task: _Task) -> _Task:
    return task


def _fly(part: Part, task: _Task) -> bool:
    return task.fly(part)
