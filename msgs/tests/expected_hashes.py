"""Writes expected_hashes.json: the RIHS01 hash of every message type of this crate as PyPI `rosbags` computes it.

Standard types are taken from its ROS 2 Jazzy store, not from ../vendor; ours from ../msg. Run in this folder:

    pip install -r ../../tests/python/requirements.txt && python expected_hashes.py
"""

import json
from pathlib import Path

from rosbags.typesys import Stores, get_types_from_msg, get_typestore

here = Path(__file__).resolve().parent
store = get_typestore(Stores.ROS2_JAZZY)
names = [f"{path.parts[-3]}/msg/{path.stem}" for path in here.glob("../vendor/*/msg/*.msg")]
for path in here.glob("../msg/*.msg"):
    name = f"lgvi_msgs/msg/{path.stem}"
    store.register(get_types_from_msg(path.read_text(), name))
    names.append(name)

hashes = {name: store.hash_rihs01(name) for name in sorted(names)}
(here / "expected_hashes.json").write_text(json.dumps(hashes, indent=1) + "\n")
