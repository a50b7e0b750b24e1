"""Subscribes to topics and publishes on them, over DDS."""

from __future__ import annotations

from typing import Any

from cyclonedds.core import DDSException, InstanceState, ReadCondition, SampleState, ViewState, WaitSet
from cyclonedds.pub import DataWriter
from cyclonedds.sub import DataReader
from cyclonedds.util import duration

from mosaic_ros2.bus.bus import Arrived, BusError, NotTaken
from mosaic_ros2.bus.dds.policies import policies_of
from mosaic_ros2.bus.dds.wire_types import WireSample, sample_of
from mosaic_ros2.bus.qos import QosProfile


class WaitingReader:
    """Reads the samples of a DDS topic, and waits for them without holding Python's lock."""

    def __init__(self, participant: Any, topic: Any, qos: QosProfile) -> None:
        try:
            self._reader = DataReader(participant, topic, policies_of(qos, is_writer=False))
            self._unread = ReadCondition(self._reader, ViewState.Any | InstanceState.Any | SampleState.NotRead)
            self._waiting = WaitSet(participant)
            self._waiting.attach(self._unread)
        except DDSException as error:
            raise BusError(f"can't subscribe: {error.msg}") from error
        self._depth = max(1, qos.depth)

    def take(self, timeout_s: float) -> list[WireSample]:
        """What waits, or comes within ``timeout_s``."""
        self._waiting.wait(duration(seconds=timeout_s))
        return [one for one in self._reader.take(self._depth) if isinstance(one, WireSample)]

    @property
    def writers(self) -> list[int]:
        """The instance handles of the writers that it hears."""
        return list(self._reader.get_matched_publications())

    def close(self) -> None:
        """Let Cyclone delete it, which is when nobody holds it any more."""
        self._waiting.detach(self._unread)
        del self._waiting, self._unread, self._reader


class DdsSubscription:
    """Receives the messages of one topic, the newest few of them."""

    def __init__(self, participant: Any, topic: Any, qos: QosProfile) -> None:
        self._reader = WaitingReader(participant, topic, qos)

    def take(self, timeout_s: float) -> list[Arrived]:
        return [Arrived(one.data, one.sample_info.source_timestamp) for one in self._reader.take(timeout_s)]

    @property
    def publishers(self) -> int:
        return len(self._reader.writers)

    def close(self) -> None:
        self._reader.close()


class DdsPublication:
    """Sends messages on one topic."""

    def __init__(self, participant: Any, topic: Any, qos: QosProfile) -> None:
        self._struct = topic.data_type
        self._name = topic.name
        try:
            self._writer: Any = DataWriter(participant, topic, policies_of(qos, is_writer=True))
        except DDSException as error:
            raise BusError(f"can't publish on {self._name}: {error.msg}") from error

    def write(self, data: bytes) -> None:
        try:
            self._writer.write(sample_of(self._struct, data))
        except DDSException as error:
            if error.code == DDSException.DDS_RETCODE_TIMEOUT:
                cure = "a reader that is reliable and too slow holds it up: look at who subscribes"
                raise NotTaken(f"{self._name} takes no message: {error.msg}", cure) from error
            raise self._lost(error) from error

    @property
    def readers(self) -> int:
        try:
            return len(self._writer.get_matched_subscriptions())
        except DDSException as error:
            raise self._lost(error) from error

    def _lost(self, error: Any) -> BusError:
        return BusError(f"{self._name} can't be used any more: {error.msg}")

    def close(self) -> None:
        self._writer = None
