#!/usr/bin/env python3
"""A stranger that watches over nodes: prints /diagnostics as JSON lines, through Cyclone DDS alone.

    cyclone_diagnostics_peer.py --domain 7

Each line is a diagnostic_msgs/DiagnosticArray and `received`, the time of its reception on a clock that goes steadily.
What was published before is asked for too, so that all that a durable publisher has sent is seen. Says on stderr when it
has found a publisher; ends when its input does. Types and names are written from the ROS 2 conventions, not taken from
lgvi. Needs PyPI cyclonedds 11.0.1.
"""

import argparse
import dataclasses
import json
import os
import select
import sys
import time
from dataclasses import dataclass

from cyclone_peer import CYCLE, QOS, Header  # sets Cyclone DDS's configuration

from cyclonedds.domain import DomainParticipant
from cyclonedds.idl import IdlStruct
from cyclonedds.idl.annotations import final
from cyclonedds.idl.types import sequence, uint8
from cyclonedds.sub import DataReader
from cyclonedds.topic import Topic

MSG = "diagnostic_msgs.msg.dds_."


@dataclass
@final
class KeyValue(IdlStruct, typename=f"{MSG}KeyValue_"):
    key: str
    value: str


@dataclass
@final
class DiagnosticStatus(IdlStruct, typename=f"{MSG}DiagnosticStatus_"):
    level: uint8
    name: str
    message: str
    hardware_id: str
    values: sequence[KeyValue]


@dataclass
@final
class DiagnosticArray(IdlStruct, typename=f"{MSG}DiagnosticArray_"):
    header: Header
    status: sequence[DiagnosticStatus]


def input_has_ended():
    readable, _, _ = select.select([sys.stdin], [], [], CYCLE)
    return bool(readable) and not sys.stdin.readline()


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--domain", type=int, default=int(os.environ.get("ROS_DOMAIN_ID") or 0))
    args = parser.parse_args()

    participant = DomainParticipant(args.domain)
    qos = QOS["latched"]
    reader = DataReader(participant, Topic(participant, "rt/diagnostics", DiagnosticArray, qos=qos), qos=qos)
    found = False
    while not input_has_ended():
        if not found and reader.get_matched_publications():
            found = True
            print("matched", file=sys.stderr, flush=True)
        for sample in reader.take(100):
            if isinstance(sample, DiagnosticArray):
                print(json.dumps(dataclasses.asdict(sample) | {"received": time.monotonic()}), flush=True)


if __name__ == "__main__":
    main()
