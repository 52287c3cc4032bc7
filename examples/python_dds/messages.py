"""The ROS 2 messages that detumble.py sends and receives, as Cyclone DDS takes them.

A ROS type `package/msg/Type` is called `package.msg.dds_.Type_` in DDS, and all of them are final. Fields, units and
frames are those of the .msg files: ../../msgs.
"""

from dataclasses import dataclass

from cyclonedds.idl import IdlStruct
from cyclonedds.idl.annotations import final
from cyclonedds.idl.types import array, float64, int32, sequence, uint32, uint64


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
class Invariants(IdlStruct, typename="lgvi_msgs.msg.dds_.Invariants_"):
    header: Header
    step: uint64
    energy: float64
    linear_momentum: array[float64, 3]
    angular_momentum: array[float64, 3]
    orthogonality_error: float64


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
