"""Writes bags with PyPI rosbags, one for each version and compression, as an outsider makes them.

python write_bags.py DIRECTORY
"""

import sys
from pathlib import Path

from rosbags.rosbag2 import CompressionFormat, CompressionMode, StoragePlugin, Writer
from rosbags.typesys import Stores, get_typestore

MESSAGES = 100


def write(path: Path, version: int, mode: CompressionMode, storage: StoragePlugin) -> None:
    store = get_typestore(Stores.ROS2_JAZZY)
    text = store.types["std_msgs/msg/String"]
    writer = Writer(path, version=version, storage_plugin=storage)
    writer.set_compression(mode, CompressionFormat.ZSTD)
    writer.set_custom_data("made_by", "rosbags")
    with writer:
        chatter = writer.add_connection("/chatter", text.__msgtype__, typestore=store)
        writer.add_connection("/silent", "geometry_msgs/msg/Pose", typestore=store)
        for number in range(MESSAGES):
            data = store.serialize_cdr(text(f"message {number}"), text.__msgtype__)
            writer.write(chatter, 1_700_000_000_000_000_000 + number * 10_000_000, data)


def main() -> None:
    directory = Path(sys.argv[1])
    for version in (8, 9):
        for mode in CompressionMode:
            name = f"mcap_{version}_{mode.name.lower()}"
            write(directory / name, version, mode, StoragePlugin.MCAP)
    write(directory / "sqlite3", 9, CompressionMode.NONE, StoragePlugin.SQLITE3)


main()
