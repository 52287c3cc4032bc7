#!/usr/bin/env python3
"""A stranger on the network: talks to lgvi nodes through Cyclone DDS alone, over the loopback interface.

Prints each received sample as a JSON line, or sends one control sequence:

    cyclone_peer.py --domain 7 --odometry /lgvi_propagator/odometry/chaser --count 10
    cyclone_peer.py --domain 7 --tf /tf --count 10 --qos best-effort
    cyclone_peer.py --domain 7 --send-control /lgvi_propagator/control_sequence --file control.json

Exits with 0 when it is done, with 1 when the time is over, and says on stderr when it has found its counterpart.
Types and names are written from the ROS 2 conventions, not taken from lgvi. Needs PyPI cyclonedds 11.0.1.
"""

import argparse
import dataclasses
import json
import math
import os
import sys
import time
import typing
from dataclasses import dataclass

CONFIGURATION = """
<CycloneDDS><Domain id="any">
  <General>
    <Interfaces><NetworkInterface name="lo"/></Interfaces>
    <AllowMulticast>false</AllowMulticast>
  </General>
  <Discovery>
    <ParticipantIndex>auto</ParticipantIndex>
    <Peers><Peer address="localhost"/></Peers>
  </Discovery>
</Domain></CycloneDDS>
"""
os.environ.setdefault("CYCLONEDDS_URI", CONFIGURATION)

from cyclonedds.core import Policy, Qos  # noqa: E402  (reads the configuration)
from cyclonedds.domain import DomainParticipant  # noqa: E402
from cyclonedds.idl import IdlStruct  # noqa: E402
from cyclonedds.idl.annotations import final  # noqa: E402
from cyclonedds.idl.types import array, float64, int32, sequence, uint32, uint64  # noqa: E402
from cyclonedds.pub import DataWriter  # noqa: E402
from cyclonedds.sub import DataReader  # noqa: E402
from cyclonedds.topic import Topic  # noqa: E402
from cyclonedds.util import duration  # noqa: E402

CYCLE = 0.005


@dataclass
@final
class Time(IdlStruct, typename="builtin_interfaces.msg.dds_.Time_"):
    sec: int32
    nanosec: uint32


@dataclass
@final
class Header(IdlStruct, typename="std_msgs.msg.dds_.Header_"):
    stamp: Time
    frame_id: str


@dataclass
@final
class Vector3(IdlStruct, typename="geometry_msgs.msg.dds_.Vector3_"):
    x: float64
    y: float64
    z: float64


@dataclass
@final
class Point(IdlStruct, typename="geometry_msgs.msg.dds_.Point_"):
    x: float64
    y: float64
    z: float64


@dataclass
@final
class Quaternion(IdlStruct, typename="geometry_msgs.msg.dds_.Quaternion_"):
    x: float64
    y: float64
    z: float64
    w: float64


@dataclass
@final
class Pose(IdlStruct, typename="geometry_msgs.msg.dds_.Pose_"):
    position: Point
    orientation: Quaternion


@dataclass
@final
class PoseWithCovariance(IdlStruct, typename="geometry_msgs.msg.dds_.PoseWithCovariance_"):
    pose: Pose
    covariance: array[float64, 36]


@dataclass
@final
class Twist(IdlStruct, typename="geometry_msgs.msg.dds_.Twist_"):
    linear: Vector3
    angular: Vector3


@dataclass
@final
class TwistWithCovariance(IdlStruct, typename="geometry_msgs.msg.dds_.TwistWithCovariance_"):
    twist: Twist
    covariance: array[float64, 36]


@dataclass
@final
class Odometry(IdlStruct, typename="nav_msgs.msg.dds_.Odometry_"):
    header: Header
    child_frame_id: str
    pose: PoseWithCovariance
    twist: TwistWithCovariance


@dataclass
@final
class Transform(IdlStruct, typename="geometry_msgs.msg.dds_.Transform_"):
    translation: Vector3
    rotation: Quaternion


@dataclass
@final
class TransformStamped(IdlStruct, typename="geometry_msgs.msg.dds_.TransformStamped_"):
    header: Header
    child_frame_id: str
    transform: Transform


@dataclass
@final
class TFMessage(IdlStruct, typename="tf2_msgs.msg.dds_.TFMessage_"):
    transforms: sequence[TransformStamped]


@dataclass
@final
class BodyState(IdlStruct, typename="lgvi_msgs.msg.dds_.BodyState_"):
    name: str
    position: array[float64, 3]
    linear_momentum: array[float64, 3]
    attitude: array[float64, 9]
    angular_momentum: array[float64, 3]


@dataclass
@final
class ControlLimits(IdlStruct, typename="lgvi_msgs.msg.dds_.ControlLimits_"):
    force: array[float64, 3]
    moment: array[float64, 3]
    force_norm: float64
    moment_norm: float64


@dataclass
@final
class ControlSequence(IdlStruct, typename="lgvi_msgs.msg.dds_.ControlSequence_"):
    header: Header
    body: str
    first_step: uint64
    step_size: float64
    force: sequence[Vector3]
    moment: sequence[Vector3]
    reference: sequence[BodyState]
    feedback: sequence[float64]
    limits: ControlLimits
    moment_in_frame: bool
    wheel_torque: sequence[float64]
    thrust: sequence[float64]


PLAIN_CDR = Policy.DataRepresentation(use_cdrv0_representation=True, use_xcdrv2_representation=False)
RELIABLE = Policy.Reliability.Reliable(duration(seconds=1))
QOS = {
    "best-effort": Qos(
        PLAIN_CDR, Policy.Reliability.BestEffort, Policy.Durability.Volatile, Policy.History.KeepAll
    ),
    "reliable": Qos(PLAIN_CDR, RELIABLE, Policy.Durability.Volatile, Policy.History.KeepAll),
    "latched": Qos(PLAIN_CDR, RELIABLE, Policy.Durability.TransientLocal, Policy.History.KeepAll),
}


def topic(participant, name, kind, qos):
    return Topic(participant, f"rt{name}", kind, qos=qos)


def control_from_json(data):
    """Builds a control sequence from the JSON form of the ROS message; JSON has no infinity, null stands for it."""

    def build(kind, fields):
        hints = typing.get_type_hints(kind)
        return kind(**{
            name: build(hints[name], value) if dataclasses.is_dataclass(hints[name]) else value
            for name, value in fields.items()
        })

    vectors = {name: [Vector3(**vector) for vector in data[name]] for name in ("force", "moment")}
    reference = [BodyState(**state) for state in data["reference"]]

    def bound(value):
        return [bound(each) for each in value] if isinstance(value, list) else math.inf if value is None else value

    limits = {name: bound(value) for name, value in data["limits"].items()}
    return build(ControlSequence, {**data, **vectors, "reference": reference, "limits": limits})


def waited_for(deadline, condition):
    while not condition():
        if time.monotonic() > deadline:
            return False
        time.sleep(CYCLE)
    return True


def receive(participant, name, kind, qos, count, deadline):
    reader = DataReader(participant, topic(participant, name, kind, qos), qos=qos)
    if not waited_for(deadline, reader.get_matched_publications):
        return "no publisher found"
    print("matched", file=sys.stderr, flush=True)
    received = 0
    while received < count:
        if time.monotonic() > deadline:
            return f"received {received} of {count} samples"
        for sample in reader.take(count - received):
            if isinstance(sample, kind):
                print(json.dumps(dataclasses.asdict(sample)), flush=True)
                received += 1
        time.sleep(CYCLE)
    return None


def send(participant, name, data, qos, deadline):
    kind = ControlSequence
    writer = DataWriter(participant, topic(participant, name, kind, qos), qos=qos)
    if not waited_for(deadline, writer.get_matched_subscriptions):
        return "no subscription found"
    print("matched", file=sys.stderr, flush=True)
    writer.write(control_from_json(data))
    left = max(deadline - time.monotonic(), 0.0)
    if not writer.wait_for_acks(duration(seconds=left)):
        return "not acknowledged"
    return None


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--domain", type=int, default=int(os.environ.get("ROS_DOMAIN_ID") or 0))
    what = parser.add_mutually_exclusive_group(required=True)
    what.add_argument("--odometry", metavar="TOPIC", help="print nav_msgs/Odometry")
    what.add_argument("--tf", metavar="TOPIC", help="print tf2_msgs/TFMessage")
    what.add_argument("--control", metavar="TOPIC", help="print lgvi_msgs/ControlSequence")
    what.add_argument("--send-control", metavar="TOPIC", help="send one lgvi_msgs/ControlSequence")
    parser.add_argument("--qos", choices=QOS, help="by default reliable to print, latched to send")
    parser.add_argument("--count", type=int, default=1, help="samples to print")
    parser.add_argument("--file", type=argparse.FileType(), default=sys.stdin, help="the control sequence as JSON")
    parser.add_argument("--timeout", type=float, default=30.0, metavar="S")
    args = parser.parse_args()

    deadline = time.monotonic() + args.timeout
    participant = DomainParticipant(args.domain)
    if args.send_control:
        failure = send(participant, args.send_control, json.load(args.file), QOS[args.qos or "latched"], deadline)
    else:
        name, kind = next(
            (name, kind)
            for name, kind in ((args.odometry, Odometry), (args.tf, TFMessage), (args.control, ControlSequence))
            if name
        )
        failure = receive(participant, name, kind, QOS[args.qos or "reliable"], args.count, deadline)
    if failure:
        sys.exit(f"cyclone_peer: {failure}")


if __name__ == "__main__":
    main()
