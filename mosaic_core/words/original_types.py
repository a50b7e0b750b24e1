"""Lists the connector types of the original MOSAIC and what they carry: for robots that announce nothing themselves.

One table of the ``type`` words that people meet: those of a robot's YAML file, and those of an original dashboard's
``connectorConfig`` (its store classes, and the slugs before them). What drives also says how its command looks.
"""

from __future__ import annotations

import copy
from functools import partial
from typing import Any, Literal

from pydantic import Field

from mosaic_core.words.catalogue import ChannelEntry
from mosaic_core.words.data_type import Direction, Kind, MosaicDataType
from mosaic_core.words.wire_model import WireModel

CONNECTION_CHECK = "connection-check"


class DriveCommand(WireModel):
    """The JSON of one kind of velocity command. A path names a number in it, with dots: ``linear.x``."""

    name: str
    zero: dict[str, Any] = Field(description="The whole message that asks to stand.")
    ahead: str = Field(description="Path of the speed forward.")
    left: str = Field(description="Path of the turn.")
    left_sign: Literal[1, -1] = Field(default=1, description="What a turn to the left counts as.")
    sideways: str | None = Field(default=None, description="Path of the speed to the left, where there is one.")
    unit: Literal["si", "share"] = Field(description="`si`: m/s and rad/s; `share`: -1 to 1 of what the robot can.")

    def message(self, ahead: float, left: float) -> dict[str, Any]:
        """The command for these speeds, in :attr:`unit`; a share is bounded to what there is."""
        made = copy.deepcopy(self.zero)
        for path, value in ((self.ahead, ahead), (self.left, left * self.left_sign)):
            place, (*parents, last) = made, path.split(".")
            for parent in parents:
                place = place[parent]
            place[last] = (max(-1.0, min(1.0, value)) if self.unit == "share" else value) + 0.0  # no -0.0
        return made


class OriginalType(WireModel):
    """One connector type of the original MOSAIC."""

    type: str
    source: Literal["robot", "dashboard"] = Field(description="Whose word it is: the YAML file's or connectorConfig's.")
    title: str
    data_type: MosaicDataType
    direction: Direction
    kind: Kind = Kind.DATA
    widget: str | None = Field(default=None, description="The widget that shows it best.")
    drive: str | None = Field(default=None, description="Which of the drive commands it takes.")
    parallel_num: int = Field(default=0, description="Channels <label>-0 … where the file does not say; 0: the label.")
    channels: tuple[ChannelEntry, ...] = Field(default=(), description="Several channels, by what follows the label.")
    half: str | None = Field(default=None, description="It is this channel of a connector with several.")


ORIGINAL_DRIVES: dict[str, DriveCommand] = {
    drive.name: drive
    for drive in (
        DriveCommand(
            name="twist",
            zero={"linear": {"x": 0, "y": 0, "z": 0}, "angular": {"x": 0, "y": 0, "z": 0}},
            ahead="linear.x",
            left="angular.z",
            sideways="linear.y",
            unit="si",
        ),
        DriveCommand(
            name="teleop", zero={"linear_x": 0, "angular_z": 0}, ahead="linear_x", left="angular_z", unit="share"
        ),
        DriveCommand(
            name="h1-direction",
            zero={"lin_vel_x": 0, "ang_vel_yaw": 0},
            ahead="lin_vel_x",
            left="ang_vel_yaw",
            left_sign=-1,  # so does the original dashboard's pad, against REP-103
            unit="share",
        ),
    )
}
"""The velocity commands that original robots take, by name."""


_Source = Literal["robot", "dashboard"]


def _type(
    source: _Source, type_: str, title: str, data_type: MosaicDataType, widget: str | None = None, **more: Any
) -> OriginalType:
    kind = Kind.VIDEO if data_type is MosaicDataType.MEDIA else Kind.DATA
    direction = Direction.BOTH if more.get("channels") else data_type.direction
    return OriginalType(
        type=type_,
        source=source,
        title=title,
        data_type=data_type,
        direction=direction,
        kind=kind,
        widget=widget,
        **more,
    )


_robot = partial(_type, "robot")
_dashboard = partial(_type, "dashboard")
_FROM = MosaicDataType.JSON_R2U
_TO = MosaicDataType.JSON_U2R
_BYTES = MosaicDataType.BYTE_R2U
_MEDIA = MosaicDataType.MEDIA
_CHECK_RECEIVER = ChannelEntry(label="-receiver", data_type=MosaicDataType.STRING_U2R)
_CHECK_SENDER = ChannelEntry(label="-sender", data_type=MosaicDataType.STRING_R2U)


def _pad(source: _Source, type_: str, title: str, drive: str) -> OriginalType:
    return _type(source, type_, title, _TO, "drive-pad", drive=drive)


def _half(type_: str, title: str, channel: ChannelEntry) -> OriginalType:
    return _type("dashboard", type_, title, channel.data_type, half=channel.label)


ORIGINAL_TYPES: dict[str, OriginalType] = {
    entry.type: entry
    for entry in (
        # the YAML files of robots
        _robot("opencv-sender-camera", "Camera", _MEDIA, "video"),
        _robot("opencv-sender-v4l2-camera", "Camera (V4L2)", _MEDIA, "video"),
        _robot("opencv-webcam", "Camera (old name)", _MEDIA, "video"),
        _robot(
            CONNECTION_CHECK,
            "Check of the connection",
            MosaicDataType.STRING_U2R,
            CONNECTION_CHECK,
            channels=(_CHECK_RECEIVER, _CHECK_SENDER),
        ),
        _robot("ros2-sender-geometry-Pose", "Pose", _FROM, "pose-trail"),
        _robot("ros2-sender-geometry-PoseWithCovarianceStamped", "Pose with its covariance", _FROM, "pose-trail"),
        _pad("robot", "ros2-receiver-geometry-Twist", "Velocity commands", "twist"),
        _pad("robot", "ros2-receiver-geometry-TwistStamped", "Velocity commands, stamped", "twist"),
        _robot("ros2-sender-sensor-NavSatFix", "GPS position", _FROM, "gps"),
        _robot("ros2-sender-sensor-Image", "Pictures of a ROS topic", _MEDIA, "video"),
        _robot("ros2-sender-sensor-PointCloud2", "Point cloud", _BYTES, "point-cloud", parallel_num=1),
        _robot("turtlebot-sender-laser-scan", "Laser scan", _FROM, "laser-scan"),
        _pad("robot", "turtlebot-receiver-teleop", "Velocity commands of the TurtleBot 3", "teleop"),
        _pad("robot", "h1-direction", "Velocity commands of the H1", "h1-direction"),
        _robot("h1-imu-state", "IMU of the H1", _FROM, "imu"),
        _robot("h1-camera", "Camera of the H1", _MEDIA, "video"),
        _robot("ros2-clearpath-sender-clearpath_platform-Power-A200", "Power of the Husky A200", _FROM, "value-cards"),
        # the store classes of the original dashboard
        _dashboard("JsonReceivableStore", "JSON from the robot", _FROM),
        _dashboard("StringReceivableStore", "Text from the robot", MosaicDataType.STRING_R2U),
        _dashboard("MediaStreamStore", "Picture", _MEDIA, "video"),
        _dashboard("PointCloudStore", "Point cloud", _BYTES, "point-cloud"),
        _dashboard("ProgressivePointCloudStore", "Point cloud, part by part", _BYTES, "point-cloud"),
        _pad("dashboard", "Ros2WasdToTwistStore", "Velocity commands by keys", "twist"),
        _pad("dashboard", "ThumbstickToTwistStore", "Velocity commands by stick", "twist"),
        _pad("dashboard", "H1DirectionSenderStore", "Velocity commands of the H1", "h1-direction"),
        _half("ConnectionCheckSenderStore", "Check of the connection: question", _CHECK_RECEIVER),
        _half("ConnectionCheckReceiverStore", "Check of the connection: answer", _CHECK_SENDER),
        # the same in its first versions
        _pad("dashboard", "ros2-wasd-to-twist", "Velocity commands by keys", "twist"),
        _pad("dashboard", "ros2-thumbstick-to-twist", "Velocity commands by stick", "twist"),
        _pad("dashboard", "thumbstick-to-twist", "Velocity commands by stick", "twist"),
        _pad("dashboard", "h1_direction_sender", "Velocity commands of the H1", "h1-direction"),
        _half("connection-check-sender", "Check of the connection: question", _CHECK_RECEIVER),
        _half("connection-check-receiver", "Check of the connection: answer", _CHECK_SENDER),
    )
}
"""The connector types of the original MOSAIC, in the order in which people are offered them."""
