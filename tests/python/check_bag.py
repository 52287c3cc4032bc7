"""Reads a bag with two independent implementations, `rosbags` and `mcap` + `mcap_ros2`, and compares every value.

    pip install -r requirements.txt
    python check_bag.py BAG              # one JSON object: counts, types, custom data
    python check_bag.py BAG --dump       # every message as a JSON line
    python check_bag.py BAG --dump /tf   # those of a topic

Exits with 1 and says where if the two readers disagree, or if the bag and its metadata.yaml do.
"""

import argparse
import json
import math
import struct
import sys
from pathlib import Path

import numpy
from mcap.reader import make_reader
from mcap_ros2.decoder import DecoderFactory
from rosbags.highlevel import AnyReader
from rosbags.rosbag2 import Reader
from rosbags.typesys import Stores, get_types_from_msg, get_typestore
from ruamel.yaml import YAML


class Disagreement(Exception):
    """The bag is not what it should be."""


def plain(value):
    """A decoded message of either library as dictionaries, lists and numbers."""
    if isinstance(value, (bool, int, float, str)):
        return value
    if isinstance(value, numpy.generic):
        return value.item()
    if isinstance(value, (bytes, bytearray)):
        return list(value)
    if isinstance(value, (list, tuple, numpy.ndarray)):
        return [plain(element) for element in value]
    fields = getattr(value, "__dataclass_fields__", None) or value.__slots__
    return {
        name: plain(getattr(value, name)) for name in fields if not name.isupper() and not name.startswith("_")
    }


def same(left, right, where):
    """Compares two plain values, floats by their bits."""
    if isinstance(left, dict) and isinstance(right, dict) and left.keys() == right.keys():
        for name in left:
            same(left[name], right[name], f"{where}.{name}")
    elif isinstance(left, list) and isinstance(right, list) and len(left) == len(right):
        for index, pair in enumerate(zip(left, right)):
            same(*pair, f"{where}[{index}]")
    elif isinstance(left, float) and isinstance(right, float):
        if struct.pack("<d", left) != struct.pack("<d", right):
            raise Disagreement(f"{where}: {left!r} and {right!r}")
    elif type(left) is not type(right) or left != right:
        raise Disagreement(f"{where}: {left!r} and {right!r}")


def finite(value):
    """JSON knows no NaN and no infinity: they become {"float": "nan"} and the like."""
    if isinstance(value, dict):
        return {name: finite(element) for name, element in value.items()}
    if isinstance(value, list):
        return [finite(element) for element in value]
    if isinstance(value, float) and not math.isfinite(value):
        return {"float": repr(float(value))}
    return value


def rosbags_messages(bag):
    """(topic, log time, raw, value) of each message, definitions taken from the bag."""
    with AnyReader([bag]) as reader:
        for connection, time, raw in reader.messages():
            yield connection.topic, time, bytes(raw), plain(reader.deserialize(raw, connection.msgtype))


def mcap_messages(bag):
    """The same by the other library."""
    for file in sorted(bag.glob("*.mcap")):
        with file.open("rb") as stream:
            reader = make_reader(stream, validate_crcs=True, decoder_factories=[DecoderFactory()])
            for _, channel, message, value in reader.iter_decoded_messages(log_time_order=True):
                yield channel.topic, message.log_time, message.data, plain(value)


def check_definitions(bag):
    """The hash of each definition in the bag, computed by rosbags, is the one that the bag gives."""
    for file in bag.glob("*.mcap"):
        with file.open("rb") as stream:
            summary = make_reader(stream).get_summary()
        for channel in summary.channels.values():
            schema = summary.schemas[channel.schema_id]
            store = get_typestore(Stores.EMPTY)
            store.register(get_types_from_msg(schema.data.decode(), schema.name))
            computed, given = store.hash_rihs01(schema.name), channel.metadata["topic_type_hash"]
            if computed != given:
                raise Disagreement(f"{channel.topic}: hash {given}, its definition gives {computed}")


def check_metadata(bag):
    """metadata.yaml, which the bag's file must repeat."""
    yaml = YAML(typ="safe")
    metadata = yaml.load((bag / "metadata.yaml").read_text())["rosbag2_bagfile_information"]
    with (bag / metadata["relative_file_paths"][-1]).open("rb") as stream:
        records = [record for record in make_reader(stream).iter_metadata() if record.name == "rosbag2"]
    if not records or yaml.load(records[-1].metadata["serialized_metadata"]) != metadata:
        raise Disagreement("metadata.yaml differs from the metadata in the bag's file")
    return metadata


def check(bag, dump):
    """Compares all messages; calls `dump` with each."""
    check_definitions(bag)
    metadata = check_metadata(bag)
    counts = {}
    ours, theirs = rosbags_messages(bag), mcap_messages(bag)
    for number, left in enumerate(ours):
        right = next(theirs, None)
        if right is None:
            raise Disagreement(f"message {number} of {left[0]} is read by rosbags only")
        where = f"message {number} of {left[0]}"
        same(list(left[:2]), list(right[:2]), where)
        if left[2] != right[2]:
            raise Disagreement(f"{where}: raw data differs")
        same(left[3], right[3], where)
        counts[left[0]] = counts.get(left[0], 0) + 1
        dump(left[0], left[1], left[3])
    if (right := next(theirs, None)) is not None:
        raise Disagreement(f"a message of {right[0]} is read by mcap only")

    with Reader(bag) as reader:
        for connection in reader.connections:
            if connection.msgcount != counts.get(connection.topic, 0):
                raise Disagreement(
                    f"{connection.topic}: metadata.yaml says {connection.msgcount} messages,"
                    f" read {counts.get(connection.topic, 0)}"
                )
        return {
            "counts": {connection.topic: connection.msgcount for connection in reader.connections},
            "types": {connection.topic: connection.msgtype for connection in reader.connections},
            "hashes": {connection.topic: connection.digest for connection in reader.connections},
            "start_time": reader.start_time,
            "end_time": reader.end_time,
            "custom": metadata["custom_data"] or {},
            "ros_distro": reader.ros_distro,
        }


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("bag", type=Path)
    parser.add_argument("--dump", metavar="TOPIC", nargs="?", const="", help="print messages: all, or a topic's")
    arguments = parser.parse_args()

    def dump(topic, time, message):
        if arguments.dump in ("", topic):
            print(json.dumps({"topic": topic, "time": time, "message": finite(message)}))

    try:
        summary = check(arguments.bag, dump)
    except Disagreement as error:
        sys.exit(f"{arguments.bag}: {error}")
    if arguments.dump is None:
        print(json.dumps(summary))


if __name__ == "__main__":
    main()
