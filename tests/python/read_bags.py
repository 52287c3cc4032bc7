"""Reads bags with `rosbags`, all of them in one process, and prints how many messages of each topic they have.

    python read_bags.py BAG...    # one JSON object: bag to topic to [messages, last log time]

The last message of each topic is decoded.
"""

import json
import sys
from pathlib import Path

from rosbags.highlevel import AnyReader
from rosbags.rosbag2 import Reader


def read(bag):
    """Messages of each topic and the last one's log time."""
    found = {}
    with AnyReader([bag]) as reader:
        last = {}
        for connection, time, raw in reader.messages():
            count, _ = found.get(connection.topic, (0, 0))
            found[connection.topic] = (count + 1, time)
            last[connection.topic] = (connection, raw)
        for connection, raw in last.values():
            reader.deserialize(raw, connection.msgtype)
    with Reader(bag) as reader:
        if reader.message_count != sum(count for count, _ in found.values()):
            sys.exit(f"{bag}: metadata.yaml says {reader.message_count} messages, read {found}")
    return found


def main():
    print(json.dumps({bag: read(Path(bag)) for bag in sys.argv[1:]}))


if __name__ == "__main__":
    main()
