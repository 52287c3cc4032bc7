#!/usr/bin/env python3
"""A stranger that calls services and actions of lgvi nodes as rmw_cyclonedds_cpp does, over the loopback interface.

    cyclone_action_peer.py --domain 7 --cancel-all /planner/plan_maneuver
    cyclone_action_peer.py --domain 7 --plan /planner/plan_maneuver
    cyclone_action_peer.py --domain 7 --plan /planner/plan_maneuver --cancel-after 3

The first calls one service, `cancel_goal`, and prints the reply. The second sends a goal and prints, a JSON line each,
whether it was accepted, the feedback, the reply to its cancellation (after so many feedback messages) and the result.
With --deaf it sends a goal, says "sent" on stderr and waits to be killed.

Exits with 0 when it is done, with 1 when the time is over. Types and names are written from the ROS 2 conventions, not
taken from lgvi. Needs PyPI cyclonedds 11.0.1.
"""

import argparse
import dataclasses
import json
import os
import random
import sys
import time
import uuid
from dataclasses import dataclass, field

from cyclone_peer import CYCLE, QOS, ControlSequence, Time, waited_for  # sets Cyclone DDS's configuration

from cyclonedds.domain import DomainParticipant
from cyclonedds.idl import IdlStruct
from cyclonedds.idl.annotations import final
from cyclonedds.idl.types import array, float64, int8, int64, sequence, uint8, uint32, uint64
from cyclonedds.pub import DataWriter
from cyclonedds.sub import DataReader
from cyclonedds.topic import Topic

PLAN = "lgvi_msgs.action.dds_.PlanManeuver_"


@dataclass
@final
class UUID(IdlStruct, typename="unique_identifier_msgs.msg.dds_.UUID_"):
    uuid: array[uint8, 16]


@dataclass
@final
class GoalInfo(IdlStruct, typename="action_msgs.msg.dds_.GoalInfo_"):
    goal_id: UUID
    stamp: Time


@dataclass
@final
class Goal(IdlStruct, typename=f"{PLAN}Goal_"):
    first_step: uint64
    deadline: float64
    warm: bool


@dataclass
@final
class Result(IdlStruct, typename=f"{PLAN}Result_"):
    success: bool
    reason: uint8
    message: str
    cost: float64
    violation: float64
    stationarity: float64
    condition: float64
    sufficient: bool
    duration: float64
    controls: ControlSequence


@dataclass
@final
class Feedback(IdlStruct, typename=f"{PLAN}Feedback_"):
    iteration: uint32
    trials: uint32
    step_length: float64
    violation: float64
    stationarity: float64
    cost: float64
    phase: str


@dataclass
@final
class FeedbackMessage(IdlStruct, typename=f"{PLAN}FeedbackMessage_"):
    goal_id: UUID
    feedback: Feedback


# Requests and replies begin with the client's name and the number of the request.


@dataclass
@final
class CancelRequest(IdlStruct, typename="action_msgs.srv.dds_.CancelGoal_Request_"):
    client: uint64
    number: int64
    goal_info: GoalInfo


@dataclass
@final
class CancelReply(IdlStruct, typename="action_msgs.srv.dds_.CancelGoal_Response_"):
    client: uint64
    number: int64
    return_code: int8
    goals_canceling: sequence[GoalInfo]


@dataclass
@final
class SendRequest(IdlStruct, typename=f"{PLAN}SendGoal_Request_"):
    client: uint64
    number: int64
    goal_id: UUID
    goal: Goal


@dataclass
@final
class SendReply(IdlStruct, typename=f"{PLAN}SendGoal_Response_"):
    client: uint64
    number: int64
    accepted: bool
    stamp: Time


@dataclass
@final
class ResultRequest(IdlStruct, typename=f"{PLAN}GetResult_Request_"):
    client: uint64
    number: int64
    goal_id: UUID


@dataclass
@final
class ResultReply(IdlStruct, typename=f"{PLAN}GetResult_Response_"):
    client: uint64
    number: int64
    status: int8
    result: Result


@dataclass
class Service:
    """A client of a service: sends requests, and finds its own replies."""

    participant: DomainParticipant
    name: str
    request: type
    reply: type
    client: int = field(default_factory=lambda: random.getrandbits(64))
    number: int = 0

    def __post_init__(self):
        # ROS 2's services are reliable and volatile.
        qos = QOS["reliable"]
        requests = Topic(self.participant, f"rq{self.name}Request", self.request, qos=qos)
        replies = Topic(self.participant, f"rr{self.name}Reply", self.reply, qos=qos)
        self.writer = DataWriter(self.participant, requests, qos=qos)
        self.reader = DataReader(self.participant, replies, qos=qos)

    def found(self):
        return self.writer.get_matched_subscriptions() and self.reader.get_matched_publications()

    def send(self, *fields):
        self.number += 1
        self.writer.write(self.request(self.client, self.number, *fields))

    def take(self):
        """The reply to the latest request, if it is there."""
        for sample in self.reader.take(100):
            if isinstance(sample, self.reply) and (sample.client, sample.number) == (self.client, self.number):
                return sample
        return None


class Action:
    """A client of the action PlanManeuver."""

    def __init__(self, participant, name):
        self.send_goal = Service(participant, f"{name}/_action/send_goal", SendRequest, SendReply)
        self.cancel_goal = Service(participant, f"{name}/_action/cancel_goal", CancelRequest, CancelReply)
        self.get_result = Service(participant, f"{name}/_action/get_result", ResultRequest, ResultReply)
        topic = Topic(participant, f"rt{name}/_action/feedback", FeedbackMessage, qos=QOS["reliable"])
        self.feedback = DataReader(participant, topic, qos=QOS["reliable"])

    def found(self):
        services = (self.send_goal, self.cancel_goal, self.get_result)
        return all(service.found() for service in services) and self.feedback.get_matched_publications()


def show(**what):
    print(json.dumps(what, default=list), flush=True)


def shown(reply):
    return dataclasses.asdict(reply)


def answer(service, deadline):
    """Waits for the reply to the latest request."""
    while time.monotonic() < deadline:
        reply = service.take()
        if reply is not None:
            return reply
        time.sleep(CYCLE)
    sys.exit(f"cyclone_action_peer: no reply from {service.name}")


def cancel_all(action, deadline):
    action.cancel_goal.send(GoalInfo(UUID([0] * 16), Time(0, 0)))
    show(cancelled=shown(answer(action.cancel_goal, deadline)))


def plan(action, first_step, cancel_after, deadline):
    goal_id = UUID(list(uuid.uuid4().bytes))
    action.send_goal.send(goal_id, Goal(first_step, 2.5, True))
    accepted = answer(action.send_goal, deadline)
    show(accepted=shown(accepted), goal_id=goal_id.uuid)
    if not accepted.accepted:
        return
    action.get_result.send(goal_id)
    count = 0
    while time.monotonic() < deadline:
        for sample in action.feedback.take(100):
            if isinstance(sample, FeedbackMessage) and bytes(sample.goal_id.uuid) == bytes(goal_id.uuid):
                show(feedback=dataclasses.asdict(sample.feedback))
                count += 1
                if count == cancel_after:
                    action.cancel_goal.send(GoalInfo(goal_id, Time(0, 0)))
                    show(cancelled=shown(answer(action.cancel_goal, deadline)))
        reply = action.get_result.take()
        if reply is not None:
            show(result=shown(reply))
            return
        time.sleep(CYCLE)
    sys.exit("cyclone_action_peer: no result")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--domain", type=int, default=int(os.environ.get("ROS_DOMAIN_ID") or 0))
    what = parser.add_mutually_exclusive_group(required=True)
    what.add_argument("--cancel-all", metavar="ACTION", help="cancel all goals")
    what.add_argument("--plan", metavar="ACTION", help="send a goal and wait for its result")
    what.add_argument("--deaf", metavar="ACTION", help="send a goal and take nothing")
    parser.add_argument("--first-step", type=int, default=0)
    parser.add_argument("--cancel-after", type=int, metavar="COUNT", help="cancel after so many feedback messages")
    parser.add_argument("--timeout", type=float, default=30.0, metavar="S")
    args = parser.parse_args()

    deadline = time.monotonic() + args.timeout
    action = Action(DomainParticipant(args.domain), args.cancel_all or args.plan or args.deaf)
    if not waited_for(deadline, action.found):
        sys.exit("cyclone_action_peer: no server found")
    if args.cancel_all:
        cancel_all(action, deadline)
    elif args.plan:
        plan(action, args.first_step, args.cancel_after, deadline)
    else:
        action.send_goal.send(UUID([9] * 16), Goal(args.first_step, 0.0, False))
        print("sent", file=sys.stderr, flush=True)
        time.sleep(args.timeout)


if __name__ == "__main__":
    main()
