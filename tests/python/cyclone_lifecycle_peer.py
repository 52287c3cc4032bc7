#!/usr/bin/env python3
"""A stranger that leads a managed node of lgvi as rmw_cyclonedds_cpp does, over the loopback interface.

    cyclone_lifecycle_peer.py --domain 7 /lgvi_propagator

Takes a JSON line for each call, a list of the service and its arguments, and prints the reply as a JSON line:

    ["get_state"]               likewise get_available_states, get_available_transitions, get_transition_graph
    ["change_state", 1, ""]     number and label of a transition; the label counts if there is one
    ["event"]                   waits for the next message on transition_event

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
from cyclone_peer import CYCLE, QOS, waited_for  # sets Cyclone DDS's configuration

from cyclonedds.domain import DomainParticipant
from cyclonedds.idl import IdlStruct
from cyclonedds.idl.annotations import final
from cyclonedds.idl.types import int64, sequence, uint8, uint64
from cyclonedds.sub import DataReader
from cyclonedds.topic import Topic

MSG = "lifecycle_msgs.msg.dds_."
SRV = "lifecycle_msgs.srv.dds_."


@dataclass
@final
class State(IdlStruct, typename=f"{MSG}State_"):
    id: uint8
    label: str


@dataclass
@final
class Transition(IdlStruct, typename=f"{MSG}Transition_"):
    id: uint8
    label: str


@dataclass
@final
class TransitionDescription(IdlStruct, typename=f"{MSG}TransitionDescription_"):
    transition: Transition
    start_state: State
    goal_state: State


@dataclass
@final
class TransitionEvent(IdlStruct, typename=f"{MSG}TransitionEvent_"):
    timestamp: uint64
    transition: Transition
    start_state: State
    goal_state: State


def part(name, fields):
    """A request or a reply, which begin with the client's name and the number of the request."""
    annotations = {"client": uint64, "number": int64, **dict(fields)}
    namespace = {"__annotations__": annotations, "__module__": __name__}
    made = types.new_class(name, (IdlStruct,), {"typename": f"{SRV}{name}_"}, lambda own: own.update(namespace))
    return final(dataclass(made))


# What has no member has this one in IDL.
EMPTY = [("structure_needs_at_least_one_member", uint8)]
TRANSITIONS = ("GetAvailableTransitions", EMPTY, [("available_transitions", sequence[TransitionDescription])])
SERVICES = {
    "change_state": ("ChangeState", [("transition", Transition)], [("success", bool)]),
    "get_state": ("GetState", EMPTY, [("current_state", State)]),
    "get_available_states": ("GetAvailableStates", EMPTY, [("available_states", sequence[State])]),
    "get_available_transitions": TRANSITIONS,
    "get_transition_graph": TRANSITIONS,
}


def call(services, line, deadline):
    name, *given = line
    services[name].send(Transition(*given) if given else 0)
    reply = dataclasses.asdict(answer(services[name], deadline))
    del reply["client"], reply["number"]
    show(**reply)


def event(reader, deadline):
    while time.monotonic() < deadline:
        for sample in reader.take(1):
            if isinstance(sample, TransitionEvent):
                show(**dataclasses.asdict(sample))
                return
        time.sleep(CYCLE)
    sys.exit("cyclone_lifecycle_peer: no event")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("node", help="fully qualified name")
    parser.add_argument("--domain", type=int, default=int(os.environ.get("ROS_DOMAIN_ID") or 0))
    parser.add_argument("--timeout", type=float, default=30.0, metavar="S")
    args = parser.parse_args()

    deadline = time.monotonic() + args.timeout
    participant = DomainParticipant(args.domain)
    parts = {}
    for name, request, reply in SERVICES.values():
        parts.setdefault(name, (part(f"{name}_Request", request), part(f"{name}_Response", reply)))
    services = {
        service: Service(participant, f"{args.node}/{service}", *parts[name])
        for service, (name, _, _) in SERVICES.items()
    }
    topic = Topic(participant, f"rt{args.node}/transition_event", TransitionEvent, qos=QOS["reliable"])
    events = DataReader(participant, topic, qos=QOS["reliable"])

    def found():
        return events.get_matched_publications() and all(service.found() for service in services.values())

    if not waited_for(deadline, found):
        missing = [name for name, service in services.items() if not service.found()]
        sys.exit(f"cyclone_lifecycle_peer: not found: {missing}")
    show(found=args.node)
    for line in sys.stdin:
        line = json.loads(line)
        if line == ["event"]:
            event(events, deadline)
        else:
            call(services, line, deadline)


if __name__ == "__main__":
    main()
