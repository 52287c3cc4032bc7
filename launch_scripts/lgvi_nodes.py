"""What the launch files share: arguments that all of them take, and how a node of lgvi is started.

An argument that is left out leaves its parameter to the parameter file, and to the node's default.
"""

from pathlib import Path

from ament_index_python.packages import PackageNotFoundError, get_package_prefix
from launch.actions import DeclareLaunchArgument, Shutdown
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import LifecycleNode, Node

PACKAGE = "lgvi"
FOLDER = Path(__file__).resolve().parent
SWITCH = ["", "true", "false"]


def common_arguments():
    """The arguments that every launch file takes."""
    return [
        DeclareLaunchArgument(
            "namespace", default_value="", description="Namespace of the nodes; empty: the root"
        ),
        DeclareLaunchArgument(
            "params_file",
            default_value="",
            description="Parameter file with a section for each node, as those in params/",
        ),
        DeclareLaunchArgument(
            "autostart",
            default_value="",
            choices=SWITCH,
            description="false: managed nodes stay unconfigured until `ros2 lifecycle set`",
        ),
        DeclareLaunchArgument(
            "use_sim_time",
            default_value="",
            choices=SWITCH,
            description="true: the time is that of /clock",
        ),
        DeclareLaunchArgument(
            "log_level", default_value="", description="debug, info, warn, error or fatal"
        ),
    ]


def rviz_argument():
    """The argument of `rviz`."""
    return DeclareLaunchArgument(
        "rviz",
        default_value="false",
        choices=["true", "false"],
        description="Start RViz with the layout lgvi.rviz",
    )


def value(context, name):
    """A launch argument's text, None where it is empty."""
    return LaunchConfiguration(name).perform(context) or None


def typed(context, name):
    """A launch argument as a parameter whose type is that of its YAML, None where it is empty."""
    return LaunchConfiguration(name) if value(context, name) else None


def managed_node(context, kind, parameters=None, remappings=(), name=None):
    """A node of lgvi under launch, at whose end everything is shut down.

    `parameters` override the parameter file; those that are None are left out.
    """
    level = value(context, "log_level")
    file = value(context, "params_file")
    if file and not Path(file).is_file():
        raise FileNotFoundError(f"params_file is {file}, expected a parameter file")
    given = {
        "autostart": typed(context, "autostart"),
        "use_sim_time": typed(context, "use_sim_time"),
        **(parameters or {}),
    }
    given = {key: content for key, content in given.items() if content is not None}
    name = name or f"lgvi_{kind}"
    return LifecycleNode(
        package=installed(),
        executable=f"lgvi_{kind}",
        name=name,
        namespace=value(context, "namespace") or "",
        parameters=[source for source in (file, given) if source],
        remappings=list(remappings),
        ros_arguments=["--log-level", level] if level else [],
        output="screen",
        on_exit=end_all(name),
    )


def end_all(name):
    """What `launch` does when the node of this name has ended: it ends all the others, unless it is doing so already."""

    def ended(_event, context):
        return None if context.is_shutdown else Shutdown(reason=f"{name} has ended")

    return ended


def rviz(context):
    """RViz with our layout, where it was asked for."""
    if value(context, "rviz") != "true":
        return []
    simulated = value(context, "use_sim_time") == "true"
    return [
        Node(
            package="rviz2",
            executable="rviz2",
            arguments=["-d", str(FOLDER / "lgvi.rviz")],
            parameters=[{"use_sim_time": simulated}],
            output="log",
        )
    ]


def installed():
    """The package of the programs, None where colcon has not installed it: they are taken from the PATH then."""
    try:
        get_package_prefix(PACKAGE)
    except PackageNotFoundError:
        return None
    return PACKAGE
