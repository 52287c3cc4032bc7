"""A stand-in for ROS 2's `launch`, `launch_ros` and `ament_index_python`, as far as our launch files use them.

No package index has the first two. Names, signatures and what a node's command line is made of are those of ROS 2
Jazzy, so that an argument or a value that the real ones would refuse is an error here too.
"""

import json
import os
import sys
import types
from pathlib import Path


class LaunchContext:
    """What is known while a launch file runs."""

    def __init__(self, launch_configurations, files):
        self.launch_configurations = launch_configurations
        self.files = files
        self.is_shutdown = False

    def parameter_file(self, parameters):
        """A parameter file for every node, as launch_ros makes it of a dictionary; JSON is YAML."""
        path = self.files / f"launch_params_{len(list(self.files.iterdir()))}"
        path.write_text(json.dumps({"/**": {"ros__parameters": parameters}}))
        return str(path)


class Substitution:
    """Something that becomes text when the launch arguments are known."""


class LaunchConfiguration(Substitution):
    def __init__(self, variable_name, *, default=None):
        self.variable_name, self.default = variable_name, default

    def perform(self, context):
        given = context.launch_configurations
        if self.variable_name not in given and self.default is None:
            raise LookupError(f"launch configuration '{self.variable_name}' does not exist")
        return given.get(self.variable_name, self.default)


class Action:
    def __init__(self, *, condition=None):
        self.condition = condition


class DeclareLaunchArgument(Action):
    def __init__(self, name, *, default_value=None, description=None, choices=None, **kwargs):
        super().__init__(**kwargs)
        if choices is not None and default_value is not None and default_value not in choices:
            raise RuntimeError(f"default_value {default_value!r} is not in choices {choices}")
        self.name, self.default_value = name, default_value
        self.description, self.choices = description, choices

    def execute(self, context):
        given = context.launch_configurations
        if self.name not in given:
            if self.default_value is None:
                raise RuntimeError(f'Required launch argument "{self.name}" was not provided.')
            given[self.name] = self.default_value
        if self.choices is not None and given[self.name] not in self.choices:
            raise RuntimeError(
                f'Argument "{self.name}" provided value "{given[self.name]}" is not valid.'
                f" Valid options are: {self.choices}"
            )
        return []


class OpaqueFunction(Action):
    def __init__(self, *, function, args=(), kwargs=None, **rest):
        super().__init__(**rest)
        self.function, self.args, self.kwargs = function, args, kwargs or {}

    def execute(self, context):
        return self.function(context, *self.args, **self.kwargs) or []


class Shutdown(Action):
    def __init__(self, *, reason="reason not given", **kwargs):
        super().__init__(**kwargs)
        self.reason = reason


class ExecuteProcess(Action):
    def __init__(
        self,
        *,
        cmd,
        prefix=None,
        name=None,
        cwd=None,
        env=None,
        additional_env=None,
        shell=False,
        sigterm_timeout="5",
        sigkill_timeout="5",
        emulate_tty=False,
        output="log",
        output_format=None,
        cached_output=False,
        log_cmd=False,
        on_exit=None,
        respawn=False,
        respawn_delay=None,
        respawn_max_retries=-1,
        **kwargs,
    ):
        super().__init__(**kwargs)
        if not isinstance(on_exit, (Action, list, type(None))) and not callable(on_exit):
            raise TypeError(f"on_exit is {on_exit!r}, expected actions or a function")
        if output not in ("screen", "log", "both", "own_log", "full"):
            raise ValueError(f"output is {output!r}")
        self.cmd, self.on_exit = cmd, on_exit

    def ended(self, context):
        """What is done when the process has ended."""
        actions = self.on_exit(None, context) if callable(self.on_exit) else self.on_exit
        if actions is None:
            return []
        return actions if isinstance(actions, list) else [actions]


class Node(ExecuteProcess):
    def __init__(
        self,
        *,
        executable,
        package=None,
        name=None,
        namespace=None,
        exec_name=None,
        parameters=None,
        remappings=None,
        ros_arguments=None,
        arguments=None,
        **kwargs,
    ):
        super().__init__(cmd=[executable], name=exec_name, **kwargs)
        if not isinstance(parameters, (list, type(None))):
            raise TypeError(f"parameters is {parameters!r}, expected a list")
        self.executable, self.package = executable, package
        self.name, self.namespace = name, namespace
        self.parameters, self.remappings = parameters or [], remappings or []
        self.ros_arguments, self.arguments = ros_arguments, arguments or []

    def command(self, context):
        """The command line that launch_ros composes."""
        program = self.executable
        if self.package is not None:
            program = str(Path(get_package_prefix(self.package), "lib", self.package, program))
        command = [program, *self.arguments]
        if self.ros_arguments is not None:
            command += ["--ros-args", *self.ros_arguments]
        command += ["--ros-args"]
        if self.name is not None:
            command += ["-r", f"__node:={self.name}"]
        if self.namespace is not None:
            command += ["-r", f"__ns:={absolute(self.namespace)}"]
        for source in self.parameters:
            if isinstance(source, dict):
                values = {name: evaluate(value, context) for name, value in source.items()}
                source = context.parameter_file(values)
            elif not Path(source).is_file():
                print(f"Parameter file path is not a file: {source}", file=sys.stderr)
                continue
            command += ["--params-file", str(source)]
        for old, new in self.remappings:
            command += ["-r", f"{old}:={new}"]
        return command


class LifecycleNode(Node):
    def __init__(self, *, name, namespace, **kwargs):
        super().__init__(name=name, namespace=namespace, **kwargs)


class LaunchDescription:
    def __init__(self, initial_entities=None, *, deprecated_reason=None):
        self.entities = list(initial_entities or [])
        for entity in self.entities:
            if not isinstance(entity, Action):
                raise TypeError(f"{entity!r} is no action")


class PackageNotFoundError(KeyError):
    """A package is in no prefix of AMENT_PREFIX_PATH."""


def get_package_prefix(package_name):
    for prefix in filter(None, os.environ.get("AMENT_PREFIX_PATH", "").split(os.pathsep)):
        marker = Path(prefix, "share/ament_index/resource_index/packages", package_name)
        if marker.is_file():
            return prefix
    raise PackageNotFoundError(f"package '{package_name}' not found")


def absolute(namespace):
    """A namespace as launch_ros normalises it."""
    namespace = namespace if namespace == "/" else namespace.rstrip("/")
    return namespace if namespace.startswith("/") else f"/{namespace}"


def evaluate(value, context):
    """A parameter's value: text stays text; what a substitution becomes is read as YAML."""
    if isinstance(value, Substitution):
        try:
            return json.loads(value.perform(context))
        except json.JSONDecodeError:
            return value.perform(context)
    if isinstance(value, list):
        if not value or {type(item) for item in value} not in ({bool}, {int}, {float}, {str}):
            raise TypeError(f"{value!r} is empty or of several types")
        return value
    if not isinstance(value, (bool, int, float, str)):
        raise TypeError(f"Unexpected type for parameter value {value!r}")
    return value


MODULES = {
    "launch": [LaunchDescription, LaunchContext],
    "launch.actions": [DeclareLaunchArgument, ExecuteProcess, OpaqueFunction, Shutdown],
    "launch.substitutions": [LaunchConfiguration],
    "launch_ros": [],
    "launch_ros.actions": [LifecycleNode, Node],
    "ament_index_python": [],
    "ament_index_python.packages": [PackageNotFoundError, get_package_prefix],
}


def install():
    """Lets launch files import the stand-in by the real names."""
    for name, contents in MODULES.items():
        module = types.ModuleType(name)
        for content in contents:
            setattr(module, content.__name__, content)
        sys.modules[name] = module
