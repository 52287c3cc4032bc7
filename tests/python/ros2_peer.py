#!/usr/bin/env python3
"""A ROS 2 Jazzy node on rclpy and Fast DDS that meets lgvi nodes as any other ROS node would.

    ros2_peer.py graph /lgvi_propagator
    ros2_peer.py departure /lgvi_propagator
    ros2_peer.py dump /lgvi_propagator
    ros2_peer.py echo /lgvi_propagator/scene lgvi_msgs/msg/Scene --qos latched
    ros2_peer.py publish /lgvi_propagator/control_sequence lgvi_msgs/msg/ControlSequence --file control.json
    ros2_peer.py call /lgvi_propagator/step lgvi_msgs/srv/Step '{"steps": 3}'
    ros2_peer.py calls '[["/lgvi_propagator/step", "lgvi_msgs/srv/Step", {"steps": 3}], …]'
    ros2_peer.py act /lgvi_planner/plan_maneuver lgvi_msgs/action/PlanManeuver '{"first_step": 0, …}' --cancel-after 3

Prints what it hears as JSON lines; messages as ros2_messages.py has them. Exits with 0 when it is done and with 1 when
the time is over, and says on stderr when it has found its counterpart. To add a case, write a function under @case.
"""

import argparse
import json
import sys
import time
from pathlib import Path

import rclpy
import yaml
from rcl_interfaces.srv import GetParameters, ListParameters
from rclpy.action import ActionClient
from rclpy.duration import Duration
from rclpy.parameter import parameter_value_to_python
from rclpy.qos import DurabilityPolicy, HistoryPolicy, QoSProfile, ReliabilityPolicy

from ros2_messages import from_plain, interface, to_plain

DEPTH = 10_000

# The graph is known when it has not changed for so long (s).
SETTLED = 0.5


def qos(reliability, durability):
    return QoSProfile(history=HistoryPolicy.KEEP_LAST, depth=DEPTH, reliability=reliability, durability=durability)


QOS = {
    "best-effort": qos(ReliabilityPolicy.BEST_EFFORT, DurabilityPolicy.VOLATILE),
    "reliable": qos(ReliabilityPolicy.RELIABLE, DurabilityPolicy.VOLATILE),
    "latched": qos(ReliabilityPolicy.RELIABLE, DurabilityPolicy.TRANSIENT_LOCAL),
}

CASES = {}


def case(*arguments):
    """Makes a function of a peer and its arguments a subcommand; each argument is (name or flag, options)."""

    def register(function):
        CASES[function.__name__] = (function, arguments)
        return function

    return register


class Peer:
    """A ROS node, and the time that it has."""

    def __init__(self, timeout):
        rclpy.init(args=[])
        self.node = rclpy.create_node("ros2_peer")
        self.deadline = time.monotonic() + timeout

    def until(self, awaited, condition):
        """Works until there is what is awaited, and returns it."""
        while not (found := condition()):
            if time.monotonic() > self.deadline:
                sys.exit(f"ros2_peer: waited in vain for {awaited}")
            rclpy.spin_once(self.node, timeout_sec=0.02)
        return found

    def matched(self, awaited, condition):
        """As `until`, and says so on stderr."""
        self.until(awaited, condition)
        print("matched", file=sys.stderr, flush=True)

    def answer(self, awaited, future):
        """The result of a future."""
        self.until(awaited, future.done)
        return future.result()

    def left(self):
        """What is left of the time."""
        return Duration(seconds=max(self.deadline - time.monotonic(), 0.0))


def say(value):
    print(json.dumps(value), flush=True)


@case(("name", {}), ("--topics", {"type": int, "default": 1, "help": "how many are awaited"}))
def graph(peer, args):
    """Prints what ROS knows of a node: topics it publishes and subscribes to, services and actions, with their types."""
    namespace, _, name = args.name.rpartition("/")
    namespace = namespace or "/"
    node = peer.node
    peer.until(args.name, lambda: (name, namespace) in node.get_node_names_and_namespaces())

    def known():
        return {
            "publishers": dict(node.get_publisher_names_and_types_by_node(name, namespace)),
            "subscriptions": dict(node.get_subscriber_names_and_types_by_node(name, namespace)),
            "services": dict(node.get_service_names_and_types_by_node(name, namespace)),
        }

    def settled():
        nonlocal latest, since
        now = time.monotonic()
        if (found := known()) != latest:
            latest, since = found, now
        return now - since > SETTLED

    peer.matched("its topics", lambda: len(known()["publishers"]) >= args.topics)
    latest, since = known(), time.monotonic()
    peer.until("the end of its discovery", settled)
    say(latest)


@case(("topic", {}), ("type", {}), ("--qos", {"choices": QOS, "default": "reliable"}), ("--count", {"type": int, "default": 1}))
def echo(peer, args):
    """Prints messages of a topic."""
    heard = []
    subscription = peer.node.create_subscription(interface(args.type), args.topic, heard.append, QOS[args.qos])
    peer.matched(f"a publisher of {args.topic}", subscription.get_publisher_count)
    peer.until(f"{args.count} messages on {args.topic}", lambda: len(heard) >= args.count)
    for message in heard:
        say(to_plain(message))


@case(("topic", {}), ("type", {}), ("--qos", {"choices": QOS, "default": "latched"}), ("--file", {"type": Path, "required": True}))
def publish(peer, args):
    """Publishes a message and waits until it has arrived."""
    kind = interface(args.type)
    publisher = peer.node.create_publisher(kind, args.topic, QOS[args.qos])
    peer.matched(f"a subscription to {args.topic}", publisher.get_subscription_count)
    publisher.publish(from_plain(kind, json.loads(args.file.read_text())))
    if not publisher.wait_for_all_acked(peer.left()):
        sys.exit("ros2_peer: not acknowledged")


@case(("service", {}), ("type", {}), ("request", {"type": json.loads}))
def call(peer, args):
    """Calls a service and prints its response."""
    respond(peer, args.service, args.type, args.request)


@case(("calls", {"type": json.loads, "metavar": "[[SERVICE, TYPE, REQUEST], …]"}))
def calls(peer, args):
    """Calls services one after the other and prints their responses."""
    for service, kind, request in args.calls:
        respond(peer, service, kind, request)


def respond(peer, service, kind, request):
    """Has a service called, and prints its response."""
    kind = interface(kind)
    client = peer.node.create_client(kind, service)
    peer.matched(f"the service {service}", client.service_is_ready)
    response = peer.answer("the response", client.call_async(from_plain(kind.Request, request)))
    say(to_plain(response))


@case(("action", {}), ("type", {}), ("goal", {"type": json.loads}), ("--cancel-after", {"type": int, "metavar": "FEEDBACK"}))
def act(peer, args):
    """Sends a goal; prints whether it is accepted, feedback, the reply to its cancellation, and the result."""
    kind = interface(args.type)
    client = ActionClient(peer.node, kind, args.action)
    peer.matched(f"the action {args.action}", client.server_is_ready)
    heard = []

    def hear(message):
        heard.append(message)
        say({"feedback": to_plain(message.feedback)})

    sent = client.send_goal_async(from_plain(kind.Goal, args.goal), feedback_callback=hear)
    goal = peer.answer("the answer to the goal", sent)
    say({"accepted": goal.accepted})
    if not goal.accepted:
        return
    if args.cancel_after is not None:
        peer.until("feedback", lambda: len(heard) >= args.cancel_after)
        reply = peer.answer("the answer to the cancellation", goal.cancel_goal_async())
        say({"canceling": [info.goal_id == goal.goal_id for info in reply.goals_canceling]})
    outcome = peer.answer("the result", goal.get_result_async())
    say({"status": outcome.status, "result": to_plain(outcome.result)})


@case(("node", {}))
def dump(peer, args):
    """Prints a node's parameters as `ros2 param dump` does."""

    def asked(service, kind, request):
        client = peer.node.create_client(kind, f"{args.node}/{service}")
        peer.matched(f"the service {service} of {args.node}", client.service_is_ready)
        return peer.answer("the response", client.call_async(request))

    names = sorted(asked("list_parameters", ListParameters, ListParameters.Request()).result.names)
    values = asked("get_parameters", GetParameters, GetParameters.Request(names=names)).values
    parameters = dict(zip(names, map(parameter_value_to_python, values), strict=True))
    print(yaml.dump({args.node: {"ros__parameters": parameters}}, default_flow_style=False))


@case(("node", {}))
def departure(peer, args):
    """Prints for how long a node's topics and services are listed after the node itself is not (s)."""
    node, below = peer.node, args.node + "/"

    def named():
        return any(f"{space.rstrip('/')}/{name}" == args.node for name, space in node.get_node_names_and_namespaces())

    def listed():
        lists = node.get_topic_names_and_types(), node.get_service_names_and_types()
        return [name for names in lists for name, _ in names if name.startswith(below)]

    peer.matched(f"{args.node} and its endpoints", lambda: named() and len(listed()) > 10)
    peer.until(f"the end of {args.node}", lambda: not named())
    left = time.monotonic()
    peer.until(f"the end of the endpoints of {args.node}", lambda: not listed())
    say(time.monotonic() - left)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--timeout", type=float, default=25.0, metavar="S")
    commands = parser.add_subparsers(dest="case", required=True)
    for name, (function, arguments) in CASES.items():
        command = commands.add_parser(name, help=function.__doc__)
        for flag, options in arguments:
            command.add_argument(flag, **options)
    args = parser.parse_args()
    peer = Peer(args.timeout)
    CASES[args.case][0](peer, args)


if __name__ == "__main__":
    main()
