"""Workers of Dask on this machine: what a second one gains, and what a part costs apart from its flights.

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

SAMPLES = 20 * 1024
TURNS = 5
# Parts that are there already cost their scheduling and their check alone.
SMALL = 1000


def seconds(client: Client, directory: Path, **keywords: int) -> float:
    start = time.perf_counter()
    distributed.run(lgvi.Scene.example("dispersed_capture"), path=directory, engine=client, **keywords)
    return time.perf_counter() - start


def main() -> None:
    times: dict[int, list[float]] = {1: [], 2: []}
    with tempfile.TemporaryDirectory() as temporary:
        for turn in range(TURNS + 1):
            for workers, found in times.items():
                cluster = LocalCluster(
                    n_workers=workers, threads_per_worker=1, host="127.0.0.1", dashboard_address=None, silence_logs=50
                )
                with cluster, Client(cluster) as client:
                    root = Path(temporary) / f"{turn}_{workers}"
                    seconds(client, root / "first", samples=workers * 64, part=16)
                    found.append(seconds(client, root / "parts", samples=SAMPLES))
                    if turn == TURNS and workers == 2:
                        seconds(client, root / "small", samples=SMALL, part=1)
                        kept = seconds(client, root / "small", samples=SMALL, part=1)
        size = statistics.median(file.stat().st_size for file in (root / "parts").iterdir())
    one, two = (statistics.median(found[1:]) for found in times.values())
    ratios = sorted(one / two for one, two in zip(times[1][1:], times[2][1:], strict=True))
    print(f"one worker {one:.2f} s, two workers {two:.2f} s for {SAMPLES} samples")
    print(f"ratio {statistics.median(ratios):.2f} ({ratios[0]:.2f} to {ratios[-1]:.2f})")
    print(f"a part that is there: {kept / SMALL * 1e3:.2f} ms; a part of 1024 samples: {size / 1e3:.0f} kB")


if __name__ == "__main__":
    main()
