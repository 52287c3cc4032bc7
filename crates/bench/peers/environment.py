#!/usr/bin/env python3
"""Prints the Python that has the benchmarks' peers, `target/bench-env`; sets it up first where requirements.txt asks for it.

Needs nothing but Python 3 with venv and pip. Takes wheels only: nothing is built.
"""

import sys
from pathlib import Path

HERE = Path(__file__).resolve().parent
ROOT = HERE.parents[2]
sys.path.insert(0, str(ROOT / "tests" / "python"))

from environment import held, interpreter  # noqa: E402


def main():
    environment = ROOT / "target" / "bench-env"
    with held(environment):
        print(interpreter(environment, HERE / "requirements.txt", "--only-binary", ":all:"))


if __name__ == "__main__":
    main()
