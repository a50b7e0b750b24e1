"""The stores of sound: what a robot's microphone hears, and one's own voice for its loudspeaker."""

from __future__ import annotations

import asyncio
from collections import deque
from collections.abc import AsyncIterator
from typing import TYPE_CHECKING

from mosaic_core.operator.stores.mosaic_store import MosaicStore
from mosaic_core.operator.stores.robot_connector import RobotConnector

if TYPE_CHECKING:
    from mosaic_core.contract.sound import Sound
    from mosaic_core.runtime.transport.operator_transport import OutgoingSound

QUEUED_SOUNDS = 50
"""One second of 20 ms pieces: an iteration that falls further behind loses the oldest."""


class SoundStore(MosaicStore):
    """Receives a microphone's sound. While this store exists the robot sends it; without any it captures nothing."""

    def __init__(self, robot_connector: RobotConnector) -> None:
        super().__init__(robot_connector)
        self.latest_sound: Sound | None = None
        self.received_sounds = 0
        self._queues: list[tuple[deque[Sound], asyncio.Event]] = []

    async def sounds(self) -> AsyncIterator[Sound]:
        """Every piece that arrives from now on: 48 kHz, ``int16`` (960, 2), ``captured_at_s`` = its arrival here by
        ``time.monotonic()``."""
        queue: deque[Sound] = deque(maxlen=QUEUED_SOUNDS)
        arrived = asyncio.Event()
        entry = (queue, arrived)
        self._queues.append(entry)
        try:
            while True:
                while not queue:
                    arrived.clear()
                    await arrived.wait()
                yield queue.popleft()
        finally:
            self._queues.remove(entry)

    def sound_arrived(self, sound: Sound) -> None:
        """Called by the connection with every piece."""
        self.latest_sound = sound
        self.received_sounds += 1
        for queue, arrived in self._queues:
            queue.append(sound)
            arrived.set()


class VoiceStore(MosaicStore):
    """Sends a voice to the robot: its loudspeaker says what is sent here, one operator at a time.

    Whom it refuses hears of it by :meth:`RobotConnection.on_refusal`: ``media.talk_busy`` while somebody else talks,
    ``lease.forbidden`` for observers.
    """

    def __init__(self, robot_connector: RobotConnector) -> None:
        super().__init__(robot_connector)
        self.talker: str | None = None
        """The name of who is heard now (oneself, too); ``None``: nobody."""
        self._line: OutgoingSound | None = None

    def connect_line(self, line: OutgoingSound | None) -> None:
        """Where to send to; the connection sets it."""
        self._line = line

    def send_sound(self, sound: Sound) -> bool:
        """Say this, of any rate and shape; send piece after piece at the pace of the sound. ``False`` if it was not
        accepted (not open, or the link does not take it). Raises :class:`TypeError` or :class:`ValueError` for what is
        no sound."""
        return self._line is not None and self._line.send(sound)

    def talking_changed(self, name: str | None) -> None:
        """Called by the connection."""
        self.talker = name

    def closed(self) -> None:
        self._line = self.talker = None
        super().closed()
