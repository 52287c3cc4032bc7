#!/usr/bin/env python3
"""Prints the Python that the tests use, `target/python-env`; sets it up first where requirements.txt asks for it.

Needs nothing but Python 3 with venv and pip. Any number of processes may call it at the same time.
"""

import contextlib
import fcntl
import hashlib
import subprocess
import sys
from pathlib import Path

HERE = Path(__file__).resolve().parent
ROOT = HERE.parents[1]


@contextlib.contextmanager
def held(environment):
    """Keeps other processes from an environment, and colcon from the Python packages in it."""
    environment.parent.mkdir(parents=True, exist_ok=True)
    (environment.parent / "COLCON_IGNORE").touch()
    with environment.with_suffix(".lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        yield


def once(stamp, inputs, make):
    """Makes something, unless its stamp says that it was made by this Python from the same inputs."""
    wanted = hashlib.sha256(b"\0".join([sys.version.encode(), *inputs])).hexdigest()
    if not stamp.exists() or stamp.read_text() != wanted:
        stamp.unlink(missing_ok=True)
        make()
        stamp.write_text(wanted)


def interpreter(environment, requirements, *options):
    """The Python of an environment that has exactly what is required."""
    python = environment / "bin" / "python"

    def set_up():
        subprocess.run([sys.executable, "-m", "venv", "--clear", environment], check=True, stdout=sys.stderr)
        install = [python, "-m", "pip", "install", "--quiet", "--disable-pip-version-check", *options]
        subprocess.run([*install, "--requirement", requirements], check=True, stdout=sys.stderr)

    once(environment / "requirements.sha256", [requirements.read_bytes()], set_up)
    return python


def main():
    environment = ROOT / "target" / "python-env"
    with held(environment):
        print(interpreter(environment, HERE / "requirements.txt"))


if __name__ == "__main__":
    main()
