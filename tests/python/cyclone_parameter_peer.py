#!/usr/bin/env python3
"""A stranger that sees and sets the parameters of lgvi nodes as rmw_cyclonedds_cpp does, over the loopback interface.

    cyclone_parameter_peer.py --domain 7 /lgvi_propagator

Takes a JSON line for each call, a list of the service and its arguments, and prints the reply as a JSON line:

    ["list_parameters", ["gains"], 1]
    ["get_parameters", ["rate"]]                    likewise get_parameter_types, describe_parameters, get_logger_levels
    ["set_parameters", [["rate", 2.5]]]             likewise set_parameters_atomically
    ["set_logger_levels", [["", 10]]]
    ["event"]                                       waits for the node's next message on /parameter_events

Exits with 0 when its input ends, with 1 when the time is over. Types and names are written from the ROS 2 conventions,
not taken from lgvi. Needs PyPI cyclonedds 11.0.1.
"""

import argparse
import dataclasses
import json
import os
import sys
import time
import types
from dataclasses import dataclass

from cyclone_action_peer import Service, answer, show
from cyclone_peer import CYCLE, QOS, Time, waited_for  # sets Cyclone DDS's configuration

from cyclonedds.domain import DomainParticipant
from cyclonedds.idl import IdlStruct
from cyclonedds.idl.annotations import final
from cyclonedds.idl.types import float64, int64, sequence, uint8, uint32, uint64
from cyclonedds.sub import DataReader
from cyclonedds.topic import Topic

MSG = "rcl_interfaces.msg.dds_."
SRV = "rcl_interfaces.srv.dds_."


@dataclass
@final
class ParameterValue(IdlStruct, typename=f"{MSG}ParameterValue_"):
    type: uint8 = 0
    bool_value: bool = False
    integer_value: int64 = 0
    double_value: float64 = 0.0
    string_value: str = ""
    byte_array_value: sequence[uint8] = ()
    bool_array_value: sequence[bool] = ()
    integer_array_value: sequence[int64] = ()
    double_array_value: sequence[float64] = ()
    string_array_value: sequence[str] = ()


FIELDS = [field.name for field in dataclasses.fields(ParameterValue)]


@dataclass
@final
class Parameter(IdlStruct, typename=f"{MSG}Parameter_"):
    name: str
    value: ParameterValue


@dataclass
@final
class FloatingPointRange(IdlStruct, typename=f"{MSG}FloatingPointRange_"):
    from_value: float64
    to_value: float64
    step: float64


@dataclass
@final
class IntegerRange(IdlStruct, typename=f"{MSG}IntegerRange_"):
    from_value: int64
    to_value: int64
    step: uint64


@dataclass
@final
class ParameterDescriptor(IdlStruct, typename=f"{MSG}ParameterDescriptor_"):
    name: str
    type: uint8
    description: str
    additional_constraints: str
    read_only: bool
    dynamic_typing: bool
    floating_point_range: sequence[FloatingPointRange, 1]
    integer_range: sequence[IntegerRange, 1]


@dataclass
@final
class ListParametersResult(IdlStruct, typename=f"{MSG}ListParametersResult_"):
    names: sequence[str]
    prefixes: sequence[str]


@dataclass
@final
class SetParametersResult(IdlStruct, typename=f"{MSG}SetParametersResult_"):
    successful: bool
    reason: str


@dataclass
@final
class LoggerLevel(IdlStruct, typename=f"{MSG}LoggerLevel_"):
    name: str
    level: uint32


@dataclass
@final
class SetLoggerLevelsResult(IdlStruct, typename=f"{MSG}SetLoggerLevelsResult_"):
    successful: bool
    reason: str


@dataclass
@final
class ParameterEvent(IdlStruct, typename=f"{MSG}ParameterEvent_"):
    stamp: Time
    node: str
    new_parameters: sequence[Parameter]
    changed_parameters: sequence[Parameter]
    deleted_parameters: sequence[Parameter]


def part(name, fields):
    """A request or a reply, which begin with the client's name and the number of the request."""
    annotations = {"client": uint64, "number": int64, **dict(fields)}
    namespace = {"__annotations__": annotations, "__module__": __name__}
    made = types.new_class(name, (IdlStruct,), {"typename": f"{SRV}{name}_"}, lambda own: own.update(namespace))
    return final(dataclass(made))


NAMES = [("names", sequence[str])]
PARAMETERS = [("parameters", sequence[Parameter])]
SERVICES = {
    "list_parameters": (
        "ListParameters",
        [("prefixes", sequence[str]), ("depth", uint64)],
        [("result", ListParametersResult)],
    ),
    "get_parameters": ("GetParameters", NAMES, [("values", sequence[ParameterValue])]),
    "get_parameter_types": ("GetParameterTypes", NAMES, [("types", sequence[uint8])]),
    "describe_parameters": ("DescribeParameters", NAMES, [("descriptors", sequence[ParameterDescriptor])]),
    "set_parameters": ("SetParameters", PARAMETERS, [("results", sequence[SetParametersResult])]),
    "set_parameters_atomically": ("SetParametersAtomically", PARAMETERS, [("result", SetParametersResult)]),
    "get_logger_levels": ("GetLoggerLevels", NAMES, [("levels", sequence[LoggerLevel])]),
    "set_logger_levels": (
        "SetLoggerLevels",
        [("levels", sequence[LoggerLevel])],
        [("results", sequence[SetLoggerLevelsResult])],
    ),
}


def to_value(value):
    """Python's types are told from each other as `ros2 param set` does it."""
    if value is None:
        return ParameterValue()
    kinds = {bool: 1, int: 2, float: 3, str: 4}
    if isinstance(value, list):
        number = 5 + kinds[type(value[0])] if value else 6
    else:
        number = kinds[type(value)]
    return ParameterValue(type=number, **{FIELDS[number]: value})


def plain(value):
    """What a value says, without what it does not say."""
    return None if value["type"] == 0 else value[FIELDS[value["type"]]]


def arguments(service, given):
    if service.startswith("set_parameters"):
        return [[Parameter(name, to_value(value)) for name, value in given[0]]]
    if service == "set_logger_levels":
        return [[LoggerLevel(name, level) for name, level in given[0]]]
    return given


def call(services, line, deadline):
    name, *given = line
    service = services[name]
    service.send(*arguments(name, given))
    reply = dataclasses.asdict(answer(service, deadline))
    del reply["client"], reply["number"]
    if name == "get_parameters":
        reply["values"] = [plain(value) for value in reply["values"]]
    show(**reply)


def event(reader, node, deadline):
    while time.monotonic() < deadline:
        for sample in reader.take(1):
            if isinstance(sample, ParameterEvent) and sample.node == node:
                kinds = {"new": sample.new_parameters, "changed": sample.changed_parameters}
                shown = {
                    kind: {each.name: plain(dataclasses.asdict(each.value)) for each in parameters}
                    for kind, parameters in kinds.items()
                }
                show(sec=sample.stamp.sec, deleted=len(sample.deleted_parameters), **shown)
                return
        time.sleep(CYCLE)
    sys.exit("cyclone_parameter_peer: no event")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("node", help="fully qualified name")
    parser.add_argument("--domain", type=int, default=int(os.environ.get("ROS_DOMAIN_ID") or 0))
    parser.add_argument("--timeout", type=float, default=30.0, metavar="S")
    args = parser.parse_args()

    deadline = time.monotonic() + args.timeout
    participant = DomainParticipant(args.domain)
    services = {
        service: Service(
            participant,
            f"{args.node}/{service}",
            part(f"{name}_Request", request),
            part(f"{name}_Response", reply),
        )
        for service, (name, request, reply) in SERVICES.items()
    }
    # ROS 2's QoS of events: reliable and volatile.
    topic = Topic(participant, "rt/parameter_events", ParameterEvent, qos=QOS["reliable"])
    events = DataReader(participant, topic, qos=QOS["reliable"])

    def found():
        return events.get_matched_publications() and all(service.found() for service in services.values())

    if not waited_for(deadline, found):
        missing = [name for name, service in services.items() if not service.found()]
        sys.exit(f"cyclone_parameter_peer: not found: {missing}")
    show(found=args.node)
    for line in sys.stdin:
        line = json.loads(line)
        if line == ["event"]:
            event(events, args.node, deadline)
        else:
            call(services, line, deadline)


if __name__ == "__main__":
    main()
