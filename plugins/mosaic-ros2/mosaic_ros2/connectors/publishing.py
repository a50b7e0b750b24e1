"""Publishes what operators send, and what makes the robot safe: a standstill of a Twist, or a message that is named."""

from __future__ import annotations

import types
from collections.abc import Mapping
from typing import Any, ClassVar, Generic, TypeVar

from mosaic_core.contract.handler import DataChannelReceivable, Refused
from mosaic_core.messages import STANDSTILL, Twist
from mosaic_core.words.data_type import Delivery
from mosaic_ros2.bus.kept_publication import KeptPublication
from mosaic_ros2.cdr.cursor import CdrError
from mosaic_ros2.cdr.encoding import CdrEncoder
from mosaic_ros2.connectors.safety import BASE_TIMEOUT_S
from mosaic_ros2.conversion.conversions import Conversion, ToRos
from mosaic_ros2.conversion.json_form import fields_of
from mosaic_ros2.conversion.parts import Origin, ros_twist
from mosaic_ros2.conversion.places import twist_stamped

T = TypeVar("T")


class RosPublisher(DataChannelReceivable[T], Generic[T]):
    """Publishes what operators send, and what makes the robot safe."""

    delivery: ClassVar[Delivery] = Delivery.LATEST

    def __init__(self, label: str, publication: KeptPublication, encoder: CdrEncoder) -> None:
        super().__init__(label)
        self.publication, self.keeper = publication, publication.keeper
        self._encoder = encoder
        publication.end_with(self._safe_message)

    def fields(self, data: T) -> Mapping[str, Any]:
        """The message of ROS."""
        raise NotImplementedError

    def safe_fields(self) -> Mapping[str, Any] | None:
        """The message that makes the robot safe; ``None``: there is none."""
        return None

    def handle_data(self, data: T) -> None:
        """Receiver's thread."""
        try:
            encoded = self._encoder.encode(self.fields(data))
        except CdrError as error:
            raise Refused("channel.invalid", str(error)) from error
        self.publication.send(encoded)

    def make_safe(self, cause: str) -> None:
        """Safety thread."""
        safe = self._safe_message()
        if safe is not None:
            self.publication.send_whatever(safe)

    def _safe_message(self) -> bytes | None:
        safe = self.safe_fields()
        return None if safe is None else self._encoder.encode(safe)


class TwistPublisher(RosPublisher[Twist]):
    """Publishes velocities; a standstill when nobody commands."""

    widget: ClassVar[str | None] = "drive-pad"
    requires_lease = True
    timeout_s = BASE_TIMEOUT_S

    def __init__(
        self, label: str, publication: KeptPublication, encoder: CdrEncoder, frame_id: str | None = None
    ) -> None:
        """``frame_id``: of a stamped twist; ``None``: it has no header."""
        super().__init__(label, publication, encoder)
        self._frame_id = frame_id

    def fields(self, data: Twist) -> Mapping[str, Any]:
        if self._frame_id is None:
            return ros_twist(data)
        return twist_stamped(data, Origin.now(self._frame_id))

    def safe_fields(self) -> Mapping[str, Any]:
        return self.fields(STANDSTILL)


class JsonPublisher(RosPublisher[T], Generic[T]):
    """Publishes any type by its JSON."""

    delivery: ClassVar[Delivery] = Delivery.RELIABLE

    def __init__(
        self, label: str, publication: KeptPublication, encoder: CdrEncoder, safe: Mapping[str, Any] | None
    ) -> None:
        super().__init__(label, publication, encoder)
        self._safe = safe

    def fields(self, data: T) -> Mapping[str, Any]:
        return fields_of(data)  # type: ignore[arg-type]

    def safe_fields(self) -> Mapping[str, Any] | None:
        return self._safe


class StandardPublisher(JsonPublisher[T], Generic[T]):
    """Publishes standard messages as the type of ROS that holds the same."""

    to_ros: ClassVar[ToRos]
    frame_id: ClassVar[str]

    def fields(self, data: T) -> Mapping[str, Any]:
        return type(self).to_ros(data, Origin.now(self.frame_id))


def json_publisher(message: Any, motion_fields: tuple[str, ...]) -> type[JsonPublisher[Any]]:
    """A handler class of this message; one that moves something needs the lease."""
    content: dict[str, Any] = {"motion_fields": motion_fields}
    if motion_fields:
        content |= {"requires_lease": True, "timeout_s": BASE_TIMEOUT_S, "delivery": Delivery.LATEST}
    return _class_of(JsonPublisher[message], content)


def standard_publisher(kind: Conversion, to_ros: ToRos, frame_id: str) -> type[JsonPublisher[Any]]:
    """A handler class of this standard message, which says itself what moves. ``frame_id``: of a message that names
    none; empty: the one that it means."""
    moves = bool(kind.message.motion_kinds)
    content = {"to_ros": staticmethod(to_ros), "frame_id": frame_id or kind.frame_id, "requires_lease": moves}
    base: Any = StandardPublisher
    return _class_of(base[kind.message], content)


def _class_of(base: Any, content: Mapping[str, Any]) -> type[JsonPublisher[Any]]:
    every = {"__module__": __name__, **content}
    made: type[JsonPublisher[Any]] = types.new_class("PublisherOfType", (base,), {}, lambda own: own.update(every))
    return made
