"""Executes a ROS 2 launch file against a stand-in for the `launch` package.

Prints the command lines of the processes that it would start, as a JSON array of arrays.
Usage: compose_launch.py FILE [name:=value …]
"""

import json
import runpy
import sys
import types


class Substitution:
    """Something that becomes text when the launch arguments are known."""

    def __init__(self, parts):
        self.parts = parts

    def perform(self, arguments):
        return text(self.parts, arguments)


class LaunchConfiguration(Substitution):
    def perform(self, arguments):
        return arguments[self.parts]


class PythonExpression(Substitution):
    def perform(self, arguments):
        return str(eval(text(self.parts, arguments), {"__builtins__": {}}))


class DeclareLaunchArgument:
    def __init__(self, name, default_value=None, description=""):
        self.name, self.default_value, self.description = name, default_value, description


class IfCondition:
    def __init__(self, predicate):
        self.predicate = predicate

    def holds(self, arguments):
        return text(self.predicate, arguments).lower() in ("true", "1")


class ExecuteProcess:
    def __init__(self, cmd, name=None, output=None, condition=None):
        self.cmd, self.condition = cmd, condition


class LaunchDescription:
    def __init__(self, entities):
        self.entities = entities


def text(value, arguments):
    if isinstance(value, Substitution):
        return value.perform(arguments)
    if isinstance(value, (list, tuple)):
        return "".join(text(part, arguments) for part in value)
    return value


def stand_in(name, *contents):
    module = types.ModuleType(name)
    for content in contents:
        setattr(module, content.__name__, content)
    sys.modules[name] = module


def main():
    stand_in("launch", LaunchDescription)
    stand_in("launch.actions", DeclareLaunchArgument, ExecuteProcess)
    stand_in("launch.conditions", IfCondition)
    stand_in("launch.substitutions", LaunchConfiguration, PythonExpression)

    file, *given = sys.argv[1:]
    arguments = dict(argument.split(":=", 1) for argument in given)
    entities = runpy.run_path(file)["generate_launch_description"]().entities
    for entity in entities:
        if isinstance(entity, DeclareLaunchArgument) and entity.name not in arguments:
            if entity.default_value is None:
                sys.exit(f"launch argument {entity.name} is missing: {entity.description}")
            arguments[entity.name] = entity.default_value
    commands = [
        [text(part, arguments) for part in entity.cmd]
        for entity in entities
        if isinstance(entity, ExecuteProcess)
        and (entity.condition is None or entity.condition.holds(arguments))
    ]
    json.dump(commands, sys.stdout)


if __name__ == "__main__":
    main()
