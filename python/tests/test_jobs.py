"""The templates of packaging/jobs: their shards have all samples exactly once."""

from __future__ import annotations

import os
import re
import subprocess
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import pytest
import yaml

SHARD = re.compile(r"ensemble run (\S+) --samples (\d+) --range (\d+)\.\.(\d+) (?:--threads (\d+) )?--output (\S+)")


@pytest.fixture
def path(tmp_path: Path) -> str:
    """A PATH on which `lgvi` prints what it is to do, and `srun` runs here."""
    for name, script in [("lgvi", 'echo "$@"'), ("srun", '[ "$1" = --cpus-per-task=4 ] && shift && exec "$@"')]:
        file = tmp_path / name
        file.write_text(f"#!/bin/sh\n{script}\n")
        file.chmod(0o755)
    return f"{tmp_path}:{os.environ['PATH']}"


def shard(command: Sequence[str], variables: Mapping[str, str]) -> tuple[str, ...]:
    result = subprocess.run(command, env=dict(variables), capture_output=True, text=True, timeout=60, check=True)
    match = SHARD.fullmatch(result.stdout.strip())
    assert match, result.stdout
    return match.groups()


def check(shards: Sequence[tuple[str, ...]], samples: int) -> None:
    """Each of the samples is in exactly one shard, and their sizes differ by one at most."""
    assert {int(shard[1]) for shard in shards} == {samples}
    ranges = [range(int(shard[2]), int(shard[3])) for shard in shards]
    assert [sample for part in ranges for sample in part] == list(range(samples))
    assert max(map(len, ranges)) - min(map(len, ranges)) <= 1
    assert len({shard[5] for shard in shards}) == len(shards)


@pytest.mark.parametrize(("samples", "shards"), [(1000, 7), (10_000, 16), (5, 5), (1, 1)])
def test_a_slurm_array_has_all_samples_once(root: Path, path: str, samples: int, shards: int) -> None:
    script = root / "packaging" / "jobs" / "slurm_array"
    subprocess.run(["bash", "-n", script], check=True)
    command = ["bash", str(script), "scene.toml", str(samples), str(shards), "out"]
    flown = [
        shard(command, {"PATH": path, "SLURM_ARRAY_TASK_ID": str(index), "SLURM_CPUS_PER_TASK": "4"})
        for index in range(shards)
    ]
    check(flown, samples)
    assert {(entry[0], entry[4]) for entry in flown} == {("scene.toml", "4")}


def job(root: Path) -> dict[str, Any]:
    with (root / "packaging" / "jobs" / "kubernetes.yaml").open() as file:
        read: dict[str, Any] = yaml.safe_load(file)
    return read


def test_a_kubernetes_job_has_all_samples_once(root: Path, path: str) -> None:
    specification = job(root)["spec"]
    (container,) = specification["template"]["spec"]["containers"]
    variables = {entry["name"]: entry["value"] for entry in container["env"]}
    assert specification["completionMode"] == "Indexed"
    assert specification["completions"] == int(variables["SHARDS"])
    for samples, shards in [(variables["SAMPLES"], variables["SHARDS"]), ("1000", "7"), ("5", "5")]:
        numbers = {"PATH": path, "SAMPLES": samples, "SHARDS": shards}
        flown = [
            shard(container["command"] + container["args"], numbers | {"JOB_COMPLETION_INDEX": str(index)})
            for index in range(int(shards))
        ]
        check(flown, int(samples))


def test_a_kubernetes_job_mounts_what_it_names(root: Path) -> None:
    pod = job(root)["spec"]["template"]["spec"]
    (container,) = pod["containers"]
    mounts = {mount["name"]: mount["mountPath"] for mount in container["volumeMounts"]}
    assert set(mounts) == {volume["name"] for volume in pod["volumes"]}
    (script,) = container["args"]
    assert all(f"{path}/" in script for path in mounts.values())
