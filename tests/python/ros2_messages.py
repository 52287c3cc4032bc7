"""ROS messages of any type as plain values and back, for peers on rclpy.

A plain value is what JSON has: a message is an object of its fields, an array a list, a `byte` a number. JSON has no
infinity: null stands for it.
"""

import importlib
import math

from rosidl_parser.definition import AbstractNestedType, BasicType, NamespacedType

# What ROS 2 gives a message without fields; Python's classes hide it.
EMPTY = "structure_needs_at_least_one_member"


def interface(name):
    """The class of a message, service or action, by `package/kind/Type`; parts of services and actions are messages."""
    package, kind, name = name.split("/")
    name, *parts = name.split("_")
    found = getattr(importlib.import_module(f"{package}.{kind}"), name)
    for part in parts:
        if kind == "action" and part in ("SendGoal", "GetResult"):
            part = f"Impl.{part}Service"
        elif part == "FeedbackMessage":
            part = f"Impl.{part}"
        for each in part.split("."):
            found = getattr(found, each)
    return found


def fields(message):
    """Names and types of a message's fields."""
    return zip(message.get_fields_and_field_types(), message.SLOT_TYPES, strict=True)


def filled(kind, value):
    """A new message of the class `kind` whose fields have the values that `value(name, type)` gives."""
    return kind(**{name: value(name, slot) for name, slot in fields(kind)})


def from_plain(kind, plain):
    """The message of the class `kind` that a plain value stands for."""

    def parsed(slot, value):
        if isinstance(slot, NamespacedType):
            return from_plain(interface("/".join([*slot.namespaces, slot.name])), value)
        if isinstance(slot, AbstractNestedType):
            return [parsed(slot.value_type, each) for each in value]
        if isinstance(slot, BasicType) and slot.typename == "octet":
            return bytes([value])
        return math.inf if value is None else value

    return filled(kind, lambda name, slot: parsed(slot, plain[name]))


def to_plain(value):
    """The plain value of a message, or of a field's value."""
    if hasattr(value, "SLOT_TYPES"):
        return {name: to_plain(getattr(value, name)) for name, _ in fields(value)} or {EMPTY: 0}
    if isinstance(value, bytes):
        return value[0]
    if hasattr(value, "tolist"):
        value = value.tolist()
    if isinstance(value, list | tuple):
        return [to_plain(each) for each in value]
    return None if isinstance(value, float) and math.isinf(value) else value
