#!/usr/bin/env python3
"""Prints the Python that the tests use, `target/python-env`; sets it up first where requirements.txt asks for it.

Needs nothing but Python 3 with venv and pip. Any number of processes may call it at the same time.
"""

import fcntl
import hashlib
import subprocess
import sys
from pathlib import Path

HERE = Path(__file__).resolve().parent
REQUIREMENTS = HERE / "requirements.txt"
ENVIRONMENT = HERE.parents[1] / "target" / "python-env"
STAMP = ENVIRONMENT / "requirements.sha256"


def wanted():
    """What the environment's stamp says when it is up to date."""
    return hashlib.sha256(REQUIREMENTS.read_bytes() + sys.version.encode()).hexdigest()


def set_up(python):
    """Makes the environment, or brings one that is there up to date."""
    subprocess.run([sys.executable, "-m", "venv", ENVIRONMENT], check=True, stdout=sys.stderr)
    install = [python, "-m", "pip", "install", "--quiet", "--disable-pip-version-check"]
    subprocess.run([*install, "--requirement", REQUIREMENTS], check=True, stdout=sys.stderr)
    STAMP.write_text(wanted())


def main():
    python = ENVIRONMENT / "bin" / "python"
    ENVIRONMENT.parent.mkdir(parents=True, exist_ok=True)
    with ENVIRONMENT.with_suffix(".lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        if not STAMP.exists() or STAMP.read_text() != wanted():
            set_up(python)
    print(python)


if __name__ == "__main__":
    main()
