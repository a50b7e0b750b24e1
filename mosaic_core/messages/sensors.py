"""What sensors measure."""

from __future__ import annotations

from typing import ClassVar, Literal, Self

from pydantic import Field, model_validator

from mosaic_core.contract.params import unit
from mosaic_core.messages.geometry import AngularVelocity, LinearAcceleration, Quaternion
from mosaic_core.messages.standard import (
    Metres,
    Name,
    Radians,
    Seconds,
    StandardMessage,
    absent,
    check_lengths,
    frame,
    stamp,
)

MAX_RAYS = 65_535
MAX_AXES, MAX_BUTTONS = 64, 256


class Imu(StandardMessage):
    """Rotation rates and accelerations; at rest it feels gravity upwards."""

    schema_id: ClassVar[str] = "mosaic/Imu@1"
    given_in: ClassVar[str] = (
        "`frame_id`; absent: `base_link`. The orientation is that of this frame in the world (east, north, up)"
    )
    shape_from: ClassVar[str] = "sensor_msgs, without its covariances; REP-145"
    ros_type: ClassVar[str] = "sensor_msgs/msg/Imu"
    angular_velocity: AngularVelocity
    linear_acceleration: LinearAcceleration
    orientation: Quaternion | None = absent(description="Absent where it does not estimate it.")
    frame_id: str | None = frame()
    timestamp: int | None = stamp()


class GpsFix(StandardMessage):
    """A position on Earth. ``null``: unknown, for example without a fix."""

    schema_id: ClassVar[str] = "mosaic/GpsFix@1"
    given_in: ClassVar[str] = "WGS84"
    shape_from: ClassVar[str] = "sensor_msgs (first three keys); accuracy as the W3C's Geolocation has it"
    ros_type: ClassVar[str] = "sensor_msgs/msg/NavSatFix"
    latitude: float | None = Field(ge=-90, le=90, json_schema_extra=unit("deg"), description="North positive.")
    longitude: float | None = Field(ge=-180, le=180, json_schema_extra=unit("deg"), description="East positive.")
    altitude: float | None = Field(
        json_schema_extra=unit("m"),
        description="Above the ellipsoid; above mean sea level where a receiver says no more than that.",
    )
    timestamp: int | None = stamp()
    fix: str | None = absent(max_length=32, description="none, gps, dgps, rtk, float-rtk, …")
    satellites: int | None = absent(ge=0, description="In use.")
    accuracy_m: float | None = absent("m", ge=0, description="Horizontal, 95 % of the time.")
    hdop: float | None = absent(ge=0, description="Horizontal dilution of precision.")
    vdop: float | None = absent(ge=0, description="Vertical dilution of precision.")
    speed_mps: float | None = absent("m/s", ge=0, description="Over ground.")
    course_rad: float | None = absent("rad", description="Of the motion: clockwise from true north.")

    @model_validator(mode="after")
    def _is_a_place_or_none(self) -> Self:
        if (self.latitude is None) != (self.longitude is None):
            raise ValueError("latitude and longitude are both known, or neither")
        return self


class LaserScan(StandardMessage):
    """One turn of a planar scanner; angles count counter-clockwise from straight ahead."""

    schema_id: ClassVar[str] = "mosaic/LaserScan@1"
    given_in: ClassVar[str] = "`frame_id`; absent: the scanner's own, around its z"
    shape_from: ClassVar[str] = "sensor_msgs; `null` where it has infinity or NaN; REP-117"
    ros_type: ClassVar[str] = "sensor_msgs/msg/LaserScan"
    angle_min: Radians = Field(description="Of the first ray.")
    angle_max: Radians = Field(description="Of the last ray.")
    angle_increment: Radians = Field(description="From each ray to the next.")
    time_increment: Seconds = Field(default=0.0, description="From each ray to the next.")
    scan_time: Seconds = Field(default=0.0, description="From each scan to the next.")
    range_min: Metres = 0.0
    range_max: Metres
    ranges: list[float | None] = Field(max_length=MAX_RAYS, description="null: no return.", json_schema_extra=unit("m"))
    intensities: list[float] = Field(default=[], description="Empty, or one for each range.")
    frame_id: str | None = frame()
    timestamp: int | None = stamp()

    @model_validator(mode="after")
    def _lengths_match(self) -> Self:
        """Drivers round their last angle: one ray more or less is no mistake."""
        count, span_rad = len(self.ranges), self.angle_max - self.angle_min
        if (
            abs(abs(span_rad) - (count - 1) * abs(self.angle_increment)) > 1.5 * abs(self.angle_increment) + 1e-6
            and count
        ):
            raise ValueError(f"ranges has {count} values, which angle_min, angle_max and angle_increment do not make")
        check_lengths("ranges", count, intensities=self.intensities)
        return self


class Range(StandardMessage):
    """How far it is to what lies ahead, in one direction."""

    schema_id: ClassVar[str] = "mosaic/Range@1"
    given_in: ClassVar[str] = "`frame_id`: along its x; absent: the sensor's own"
    shape_from: ClassVar[str] = "sensor_msgs, its limits named as in LaserScan; REP-117"
    ros_type: ClassVar[str] = "sensor_msgs/msg/Range"
    range: float | None = Field(json_schema_extra=unit("m"), description="null: nothing within the limits.")
    range_min: Metres = 0.0
    range_max: Metres
    field_of_view: Radians | None = absent("rad", gt=0, description="Of the cone in which it sees.")
    radiation: Literal["ultrasound", "infrared", "laser", "radar"] | None = absent()
    frame_id: str | None = frame()
    timestamp: int | None = stamp()


class Joy(StandardMessage):
    """How a joystick, a gamepad or a 3D mouse stands. It is said twice a second at least: whoever moves something by it
    stops where it falls silent."""

    schema_id: ClassVar[str] = "mosaic/Joy@1"
    given_in: ClassVar[str] = (
        "the stick's own axes: pushed ahead, to the left or up, and turned to the left, is positive"
    )
    shape_from: ClassVar[str] = "sensor_msgs, the signs as its joy_node has them; with names for people"
    ros_type: ClassVar[str] = "sensor_msgs/msg/Joy"
    axes: list[float] = Field(
        max_length=MAX_AXES, description="-1 to 1, 0 let go; triggers and throttles 0 to 1. A dead zone is taken off."
    )
    buttons: list[int] = Field(max_length=MAX_BUTTONS, description="0 let go, 1 pressed.")
    axis_names: list[Name] = Field(default=[], max_length=MAX_AXES, description="Empty, or one for each axis.")
    button_names: list[Name] = Field(default=[], max_length=MAX_BUTTONS, description="Empty, or one for each button.")
    frame_id: str | None = frame("Which stick it is.")
    timestamp: int | None = stamp()

    @model_validator(mode="after")
    def _lengths_match(self) -> Self:
        check_lengths("axes", len(self.axes), axis_names=self.axis_names)
        check_lengths("buttons", len(self.buttons), button_names=self.button_names)
        return self


class Temperature(StandardMessage):
    """A temperature."""

    schema_id: ClassVar[str] = "mosaic/Temperature@1"
    given_in: ClassVar[str] = "–"
    shape_from: ClassVar[str] = "sensor_msgs, its unit in the name"
    ros_type: ClassVar[str] = "sensor_msgs/msg/Temperature"
    temperature_c: float = Field(ge=-273.15, json_schema_extra=unit("°C"))
    timestamp: int | None = stamp()


class BatteryState(StandardMessage):
    """The charge of a battery."""

    schema_id: ClassVar[str] = "mosaic/BatteryState@1"
    given_in: ClassVar[str] = "–"
    shape_from: ClassVar[str] = (
        "sensor_msgs, units in the names; percent is 100 times its percentage, the current has the other sign"
    )
    ros_type: ClassVar[str] = "sensor_msgs/msg/BatteryState"
    percent: float | None = Field(ge=0, le=100, json_schema_extra=unit("%"), description="null: unknown.")
    voltage_v: float | None = absent("V")
    current_a: float | None = absent("A", description="Out of the battery; negative while charging.")
    charging: bool | None = absent()
    temperature_c: float | None = absent("°C")
    timestamp: int | None = stamp()
