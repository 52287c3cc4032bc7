"""Writes expected_hashes.json: the RIHS01 hash of every message type of this crate as PyPI `rosbags` computes it.

Standard types are taken from its ROS 2 Jazzy store, not from ../vendor; ours from ../msg. Run in this folder:

    pip install -r ../../tests/python/requirements.txt && python expected_hashes.py
"""

import json
from pathlib import Path

from rosbags.typesys import Stores, get_types_from_msg, get_typestore

# rosbags knows no services: theirs are from the .json files that ROS 2 Jazzy installs beside the .srv files.
SERVICES = {
    "action_msgs/srv/CancelGoal_Request": "RIHS01_3d3c84653c1f96918086887e1dcb236faec88b81a5b14fd4cf4840065bcdf8af",
    "action_msgs/srv/CancelGoal_Response": "RIHS01_35e682cf3f510e83c70a82a4aac888496dedee56773bf9d8e5e0aa81f9e1c960",
}

here = Path(__file__).resolve().parent
store = get_typestore(Stores.ROS2_JAZZY)
names = [f"{path.parts[-3]}/msg/{path.stem}" for path in here.glob("../vendor/*/msg/*.msg")]


def register(name, text):
    """Takes in the text of a message, by the name in the ROS 2 form."""
    store.register(get_types_from_msg(text, name))
    names.append(name)


for path in here.glob("../msg/*.msg"):
    register(f"lgvi_msgs/msg/{path.stem}", path.read_text())

IDENTITY = "unique_identifier_msgs/msg/UUID goal_id\n"
for path in sorted(here.glob("../action/*.action")):
    name = f"lgvi_msgs/action/{path.stem}"
    for part, text in zip(("Goal", "Result", "Feedback"), path.read_text().split("---\n"), strict=True):
        register(f"{name}_{part}", text)
    register(f"{name}_SendGoal_Request", f"{IDENTITY}{name}_Goal goal\n")
    register(f"{name}_SendGoal_Response", "bool accepted\nbuiltin_interfaces/msg/Time stamp\n")
    register(f"{name}_GetResult_Request", IDENTITY)
    register(f"{name}_GetResult_Response", f"int8 status\n{name}_Result result\n")
    register(f"{name}_FeedbackMessage", f"{IDENTITY}{name}_Feedback feedback\n")

hashes = {name: store.hash_rihs01(name) for name in names} | SERVICES
(here / "expected_hashes.json").write_text(json.dumps(hashes, indent=1, sort_keys=True) + "\n")
