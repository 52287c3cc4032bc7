#!/usr/bin/env python3
"""Writes a bag of types that no ROS package has, with `rosbags`: every kind of field, both byte orders, odd values.

    odd_bag.py BAG
"""

import argparse
import math
from pathlib import Path

import numpy
from rosbags.rosbag2 import StoragePlugin, Writer
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

DEFINITIONS = {
    "odd_msgs/msg/Nothing": "uint8 ONLY_A_CONSTANT=1\n",
    "odd_msgs/msg/Point": "float64 x\nfloat32 y 0.5\n",
    "odd_msgs/msg/Named": "string name\nPoint[<=3] path\nbyte[] raw\nNothing nothing\n",
    "odd_msgs/msg/Odd": """\
# Every kind of field.
bool flag true
byte one
char letter
int8 i8
uint8 u8
int16 i16
uint16 u16
int32 i32
uint32 u32
int64 i64
uint64 u64
float32 f32
float64 f64
string GREETING="hello # not a comment"
string text
string<=8 short
Nothing nothing
bool[3] flags
uint8[16] identity
int8[] levels
uint16[] always_two
float32[100] many
float64[] any_number
string[] words
string[2] pair
Point[2] corners
Point[] points
Named[] named
builtin_interfaces/Time sequence
""",
}
TOPIC_TYPE = "odd_msgs/msg/Odd"


def store():
    """Our types, beside those of ROS 2 Jazzy."""
    typestore = get_typestore(Stores.ROS2_JAZZY)
    types = {}
    for name, text in DEFINITIONS.items():
        types.update(get_types_from_msg(text, name))
    typestore.register(types)
    return typestore


def message(types, index):
    """The message of a number: lengths differ from one to the next."""
    odd, named, nothing, time = (
        types[name]
        for name in (TOPIC_TYPE, "odd_msgs/msg/Named", "odd_msgs/msg/Nothing", "builtin_interfaces/msg/Time")
    )
    values = [0.1, -0.0, math.nan, math.inf, -math.inf, 5e-324, 1e300]
    value = values[index % len(values)]
    high = index % 2

    def point(x):
        return types["odd_msgs/msg/Point"](x=x, y=float(numpy.float32(value if abs(value) < 1 else 0.1)))

    def path(name, length):
        return named(
            name=name,
            path=[point(float(step)) for step in range(length)],
            raw=numpy.arange(length, dtype=numpy.uint8),
            nothing=nothing(),
        )

    return odd(
        flag=bool(high),
        # rosbags takes it for a signed one.
        one=127,
        letter=65,
        i8=-128,
        u8=255,
        i16=-(2**15),
        u16=2**16 - 1,
        i32=-(2**31),
        u32=2**32 - 1,
        i64=-(2**63) + index,
        u64=2**64 - 1 - index,
        f32=float(numpy.float32(0.1)),
        f64=value,
        text=["", "plain", 'quoted "text", and\na line', "é∑😀", "NaN", "[1]", " space "][index % 7],
        short="éé"[: 1 + high],
        nothing=nothing(),
        flags=numpy.array([True, False, bool(high)]),
        identity=numpy.arange(16, dtype=numpy.uint8) + index,
        levels=numpy.array([-1, 0, 127][: index % 4], dtype=numpy.int8),
        always_two=numpy.array([index, 65535], dtype=numpy.uint16),
        many=numpy.linspace(0, 1, 100, dtype=numpy.float32),
        any_number=numpy.array(values[: index % 5]),
        words=["a,b", 'c"d', ""][: index % 4],
        pair=["left", f"right {index}"],
        corners=[point(1.0), point(value)],
        points=[point(float(step)) for step in range(index % 3)],
        named=[path(f"path {step}", step) for step in range(3)],
        sequence=time(sec=-index, nanosec=index),
    )


def write(bag):
    """A topic of each byte order, one without messages, and one of a message without fields."""
    typestore = store()
    with Writer(bag, version=9, storage_plugin=StoragePlugin.MCAP) as writer:
        writer.set_custom_data("origin", "odd_bag.py")

        def connection(topic, msgtype=TOPIC_TYPE):
            return writer.add_connection(topic, msgtype, typestore=typestore)

        little, big = connection("/odd/little"), connection("/odd/big")
        connection("/odd/silent")
        empty = connection("/odd/empty", "std_msgs/msg/Empty")
        for index in range(20):
            time = 1_700_000_000_000_000_001 + index
            odd = message(typestore.types, index)
            writer.write(little, time, typestore.serialize_cdr(odd, TOPIC_TYPE, little_endian=True))
            writer.write(big, time, typestore.serialize_cdr(odd, TOPIC_TYPE, little_endian=False))
            nothing = typestore.types["std_msgs/msg/Empty"]()
            writer.write(empty, time, typestore.serialize_cdr(nothing, "std_msgs/msg/Empty"))


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("bag", type=Path)
    write(parser.parse_args().bag)
