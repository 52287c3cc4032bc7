"""Workers of Dask on this machine: what a second one gains, and what an empty task costs.

    target/python/env/bin/python python/benchmarks/workers.py
"""

from __future__ import annotations

import statistics
import tempfile
import time
from pathlib import Path

from dask.distributed import Client, LocalCluster

import lgvi
from lgvi import distributed

PART = 1024
SAMPLES = 20 * PART
TURNS = 9
TASKS = 3000


def seconds(client: Client, directory: Path, samples: int, part: int) -> float:
    scene = lgvi.Scene.example("dispersed_capture")
    start = time.perf_counter()
    distributed.run(scene, samples, path=directory, engine=client, part=part)
    return time.perf_counter() - start


def cluster(workers: int) -> LocalCluster:
    return LocalCluster(n_workers=workers, threads_per_worker=1, host="127.0.0.1", dashboard_address="127.0.0.1:0")


def main() -> None:
    with cluster(1) as one, cluster(2) as two, Client(one) as a, Client(two) as b, tempfile.TemporaryDirectory() as temporary:
        root = Path(temporary)
        for index, client in enumerate([a, b]):
            # Every worker makes its plan.
            seconds(client, root / f"first_{index}", 128, 16)
        ratios = []
        for turn in range(TURNS):
            alone, both = (seconds(client, root / f"{turn}_{index}", SAMPLES, PART) for index, client in enumerate([a, b]))
            ratios.append(alone / both)
            print(f"{SAMPLES} samples: one worker {alone:.2f} s, two workers {both:.2f} s")
        size = statistics.median(file.stat().st_size for file in (root / "0_0").iterdir())
        start = time.perf_counter()
        b.gather(b.map(abs, range(TASKS), pure=False))
        empty = (time.perf_counter() - start) / TASKS
    print(f"ratio {statistics.median(ratios):.2f} ({min(ratios):.2f} to {max(ratios):.2f})")
    print(f"an empty task of Dask {1e3 * empty:.2f} ms; a sample {size / PART:.0f} bytes")


if __name__ == "__main__":
    main()
