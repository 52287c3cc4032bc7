#!/usr/bin/env python3
"""Prints samples of message types as ROS 2 serializes them, a JSON line each: type, plain value, and CDR in hexadecimal.

    ros2_samples.py --count 3 geometry_msgs/msg/Pose lgvi_msgs/action/PlanManeuver_Goal

The values are random, but the same each time: sequences of 0 to 3 elements, strings beyond ASCII, integers up to their
bounds.
"""

import argparse
import json
import random

import numpy
from rclpy.serialization import deserialize_message, serialize_message
from rosidl_parser.definition import AbstractString, Array, BasicType, BoundedSequence, NamespacedType, UnboundedSequence

from ros2_messages import filled, interface, to_plain

LETTERS = "abcdefgh/_ é∑"
LONGEST = 9


def sample(kind, source):
    """A message of random values."""

    def value(slot):
        match slot:
            case NamespacedType():
                return sample(interface("/".join([*slot.namespaces, slot.name])), source)
            case Array():
                return [value(slot.value_type) for _ in range(slot.size)]
            case BoundedSequence():
                return [value(slot.value_type) for _ in range(source.randint(0, min(3, slot.maximum_size)))]
            case UnboundedSequence():
                return [value(slot.value_type) for _ in range(source.randint(0, 3))]
            case AbstractString():
                return "".join(source.choices(LETTERS, k=source.randint(0, LONGEST)))
            case BasicType(typename="boolean"):
                return source.random() < 0.5
            case BasicType(typename="octet"):
                return source.randbytes(1)
            case BasicType(typename="float"):
                return numpy.float32(source.gauss() * 10.0 ** source.randint(-30, 30)).item()
            case BasicType(typename="double"):
                return source.gauss() * 10.0 ** source.randint(-300, 300)
            case BasicType():
                bounds = numpy.iinfo(slot.typename)
                return source.choice([int(bounds.min), int(bounds.max), source.randint(bounds.min, bounds.max)])

    return filled(kind, lambda _, slot: value(slot))


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("types", nargs="+", metavar="TYPE")
    parser.add_argument("--count", type=int, default=1, help="samples of each type")
    args = parser.parse_args()
    for name in args.types:
        kind = interface(name)
        for index in range(args.count):
            message = sample(kind, random.Random(f"{name} {index}"))
            data = serialize_message(message)
            assert deserialize_message(data, kind) == message, name
            print(json.dumps({"type": name, "value": to_plain(message), "cdr": data.hex()}))


if __name__ == "__main__":
    main()
