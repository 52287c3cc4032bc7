"""Measures what Python adds to flights and steps, beside the same flights in Rust alone.

Needs a release build of the package in the interpreter that runs this, and cargo. Prints ratios of shortest times; both sides
alternate, so that what else the machine does meets both.
"""

from __future__ import annotations

import subprocess
import sys
import tempfile
import timeit
from pathlib import Path

import lgvi

ROUNDS = 8
FLIGHTS = 8
HERE = Path(__file__).resolve().parents[1]


def program() -> Path:
    """Build the flights in Rust."""
    build = ["cargo", "build", "--release", "--locked", "--example", "rust_alone", "--manifest-path", str(HERE / "Cargo.toml")]
    subprocess.run(build, check=True)
    return HERE.parent / "target" / "release" / "examples" / "rust_alone"


def main() -> None:
    """Measure and print."""
    rust = program()
    scenes = [
        ("two_dumbbells", {"run.steps": 500_000, "run.duration": 1000.0, "publish.state_every": 100}),
        ("binary_asteroid", {"run.integrator": {"name": "nystrom", "order": 8}}),
        ("free_body", {"run.steps": 500_000, "publish.state_every": 10}),
        ("rocks", {"run.integrator": "lgvi", "run.steps": 2000}),
    ]
    with tempfile.TemporaryDirectory() as directory:
        for name, values in scenes:
            scene = lgvi.Scene.example(name).with_values(values)
            file = Path(directory) / f"{name}.toml"
            file.write_text(scene.text)
            scene.fly(t_eval=[0.0])
            alone, python = float("inf"), float("inf")
            for _ in range(ROUNDS):
                run = subprocess.run([rust, file, str(FLIGHTS)], check=True, capture_output=True, text=True)
                alone = min(alone, float(run.stdout))
                python = min(python, *timeit.repeat(scene.fly, number=1, repeat=FLIGHTS))
            print(f"{name}: fly {1e3 * python:.2f} ms, {python / alone:.4f} of the time in Rust alone")
    scene = lgvi.Scene.example("free_body")
    simulation = scene.simulation()
    number = 100_000
    single = min(timeit.repeat(simulation.step, number=number, repeat=ROUNDS)) / number
    many = min(timeit.repeat(lambda: simulation.step(number), number=1, repeat=ROUNDS)) / number
    print(f"free_body: step() adds {1e9 * (single - many):.0f} ns to a step of {1e9 * many:.0f} ns")


if __name__ == "__main__":
    sys.exit(main())
