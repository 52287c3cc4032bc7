"""Writes expected_hashes.json: the RIHS01 hash of every message, service and action type of this crate.

They are those that rosidl computes, the ROS 2 tool itself: for the standard packages as they are installed with ROS 2
Jazzy, for ours, rosbag2_interfaces and tf2_msgs when colcon builds them. PyPI `rosbags` computes those of messages once more, the standard
ones from a Jazzy store of its own; if the two differ, nothing is written. Run in this folder:

    python3 ../../tests/python/ros_environment.py && $(python3 ../../tests/python/environment.py) expected_hashes.py
"""

import json
import sys
from pathlib import Path

from rosbags.typesys import Stores, get_types_from_msg, get_typestore

here = Path(__file__).resolve().parent
installed = here.parents[1] / "target" / "ros-jazzy" / "share"
# Event messages are within services: they have no types in this crate.
EVENT = "_Event"
# rosbags has a type of its own for `char`; in ROS 2 it is uint8.
DIFFERENT = {"service_msgs/msg/ServiceEventInfo"}


def by_rosidl(path):
    """The hashes of an interface file's types: of the interface itself and of those that belong to it."""
    package = path.parents[1].resolve().name
    package = "lgvi_msgs" if package == "msgs" else package
    name = f"{package}/{path.parent.name}/{path.stem}"
    hashes = json.loads((installed / name).with_suffix(".json").read_text())["type_hashes"]
    return {
        entry["type_name"]: entry["hash_string"]
        for entry in hashes
        if entry["type_name"] == name or entry["type_name"].startswith(f"{name}_")
        if not entry["type_name"].endswith(EVENT)
    }


def by_rosbags(names):
    """The hashes of messages in `msg`."""
    store = get_typestore(Stores.ROS2_JAZZY)
    for path in here.glob("../msg/*.msg"):
        store.register(get_types_from_msg(path.read_text(), f"lgvi_msgs/msg/{path.stem}"))
    return {name: store.hash_rihs01(name) for name in names if "/msg/" in name and name not in DIFFERENT}


files = [path for kind in ("msg", "srv", "action") for path in here.glob(f"../**/{kind}/*.{kind}")]
hashes = {name: hash for path in files for name, hash in by_rosidl(path).items()}
for name, found in by_rosbags(hashes).items():
    if found != hashes[name]:
        sys.exit(f"{name} is {hashes[name]} by rosidl and {found} by rosbags")
(here / "expected_hashes.json").write_text(json.dumps(hashes, indent=1, sort_keys=True) + "\n")
