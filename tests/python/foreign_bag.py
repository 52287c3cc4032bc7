#!/usr/bin/env python3
"""A stranger's bag: made by PyPI rosbags, of a type that lgvi does not know, or received on Cyclone DDS while it is played.

    foreign_bag.py write <bag directory> <count>
    foreign_bag.py listen /robot/readings <count>

Prints each reading that was received as a JSON line.
"""

import dataclasses
import json
import os
import sys
import time
from dataclasses import dataclass

import cyclone_peer  # noqa: F401  (sets Cyclone DDS up)
from cyclonedds.core import Policy, Qos
from cyclonedds.domain import DomainParticipant
from cyclonedds.idl import IdlStruct
from cyclonedds.idl.annotations import final
from cyclonedds.idl.types import float64, sequence, uint32
from cyclonedds.sub import DataReader
from cyclonedds.topic import Topic
from cyclonedds.util import duration

TOPIC = "/robot/readings"
NAME = "robot_msgs/msg/Reading"
TEXT = "uint32 number\nstring unit\nfloat64[] values\n"
START = 1_700_000_000_000_000_000
STEP = 1_000_000


@dataclass
@final
class Reading(IdlStruct, typename="robot_msgs.msg.dds_.Reading_"):
    number: uint32
    unit: str
    values: sequence[float64]


def write(directory, count):
    import numpy
    from rosbags.rosbag2 import StoragePlugin, Writer
    from rosbags.typesys import Stores, get_types_from_msg, get_typestore

    store = get_typestore(Stores.ROS2_JAZZY)
    store.register(get_types_from_msg(TEXT, NAME))
    reading = store.types[NAME]
    with Writer(directory, version=9, storage_plugin=StoragePlugin.MCAP) as writer:
        connection = writer.add_connection(TOPIC, NAME, typestore=store)
        for number in range(count):
            values = numpy.arange(number % 4, dtype=numpy.float64) / 3
            data = store.serialize_cdr(reading(number=number, unit="m/s", values=values), NAME)
            writer.write(connection, START + number * STEP, data)


def listen(topic, count):
    qos = Qos(
        Policy.Reliability.Reliable(duration(seconds=1)), Policy.Durability.Volatile, Policy.History.KeepAll
    )
    participant = DomainParticipant(int(os.environ["ROS_DOMAIN_ID"]))
    reader = DataReader(participant, Topic(participant, f"rt{topic}", Reading), qos=qos)
    found, end = 0, time.monotonic() + 60
    while found < count and time.monotonic() < end:
        for sample in reader.take(N=count):
            print(json.dumps(dataclasses.asdict(sample)))
            found += 1
        time.sleep(0.005)
    sys.exit(found < count)


if sys.argv[1] == "write":
    write(sys.argv[2], int(sys.argv[3]))
else:
    listen(sys.argv[2], int(sys.argv[3]))
