"""A host with a clock that stands still unless somebody waits: tests never sleep and never depend on the machine."""

from __future__ import annotations

import asyncio
import json
from collections import Counter
from collections.abc import Iterator, Sequence
from typing import Any, Generic, Protocol, Self, TypeVar

from mosaic_core.contract.data_tap import TappedChannel, TappedMessage
from mosaic_core.contract.handler import Handler
from mosaic_core.contract.host import Loss, Outgoing
from mosaic_core.contract.media import Picture
from mosaic_core.contract.media_tap import TapCodec, TappedImage, TappedPicture
from mosaic_core.contract.sound import Sound
from mosaic_core.harness.right_kind import check_handler
from mosaic_core.machines.delivery.framing import PayloadKind
from mosaic_core.runtime.configuration.receiver_safety import ReceiverSafety

Tapped = TypeVar("Tapped", TappedPicture, TappedImage, TappedMessage)


class Alarm(Protocol):
    """Something that happens at a point in time, like a time-out."""

    @property
    def due_at_s(self) -> float | None: ...
    def ring(self, now_s: float) -> None: ...


class FakeClock:
    """Seconds that pass only when told to. Not for several threads at once."""

    def __init__(self, now_s: float = 1000.0) -> None:
        self.now_s = now_s
        self._alarms: list[Alarm] = []

    def watch(self, alarm: Alarm) -> None:
        """Let ``alarm`` ring at its time, also in the middle of a longer wait."""
        self._alarms.append(alarm)

    def forget(self, alarm: Alarm) -> None:
        """Ring it no more."""
        self._alarms.remove(alarm)

    def advance(self, seconds: float) -> None:
        """Let ``seconds`` pass; what is due on the way happens at its exact time. Time does not go back:
        :class:`ValueError` for less than 0."""
        if not seconds >= 0:
            raise ValueError(f"a clock advances by 0 s or more, not {seconds}")
        end_s = self.now_s + seconds
        while due := [(alarm.due_at_s, alarm) for alarm in self._alarms if alarm.due_at_s is not None]:
            due_at_s, alarm = min(due, key=lambda one: one[0])
            if due_at_s > end_s:
                break
            self.now_s = max(self.now_s, due_at_s)
            alarm.ring(self.now_s)
        self.now_s = max(self.now_s, end_s)


class FakeHost:
    """Stands in for the runtime in tests of a handler.

    Waiting advances :attr:`clock`. What the handler sends is in :attr:`sent`, :attr:`pictures` and :attr:`sounds`;
    set :attr:`accepts` to ``False`` to play a link that takes nothing.
    """

    def __init__(self, clock: FakeClock | None = None) -> None:
        self.clock = clock or FakeClock()
        self.sent: list[Outgoing] = []
        self.pictures: list[Picture] = []
        self.sounds: list[Sound] = []
        self.losses: Counter[Loss] = Counter()
        """What the handler counted with ``count_loss``, by reason."""
        self.tapped: dict[str, list[TappedPicture]] = {}
        """What taps of other connectors give, by label; a label that isn't here is unknown."""
        self.tapped_images: dict[str, list[TappedImage]] = {}
        """The same for their pictures before encoding."""
        self.tapped_data: list[TappedMessage] | None = None
        """What a tap of data gives; ``None``: its labels are unknown."""
        self.tapped_channels: list[TappedChannel] = []
        """The data channels of the robot."""
        self.accepts = True
        self.heard: set[str] | None = None
        """The channels that somebody has open; ``None``: all."""
        self.safety: ReceiverSafety | None = None
        """The receiver's limits in force; ``build`` sets them."""
        self.stop_at_s = float("inf")
        self._is_stopping = False

    def arm(self) -> None:
        """A body begins, as after a restart."""
        self._is_stopping = False

    def stop(self) -> None:
        """End the body, as the runtime does when the robot stops or nobody watches any more."""
        self._is_stopping = True

    @property
    def is_stopping(self) -> bool:
        """Whether :meth:`stop` was called."""
        return self._is_stopping

    def monotonic_s(self) -> float:
        """The clock's time, in seconds."""
        return self.clock.now_s

    def wait(self, seconds: float) -> bool:
        """Advance the clock; ``True`` when the handler shall stop."""
        if not self._is_stopping:
            self.clock.advance(max(0.0, min(seconds, self.stop_at_s - self.clock.now_s)))
            self._is_stopping = self._is_stopping or self.clock.now_s >= self.stop_at_s
        return self._is_stopping

    async def wait_async(self, seconds: float) -> bool:
        """The same for ``async`` bodies."""
        await asyncio.sleep(0)
        return self.wait(seconds)

    def send(self, message: Outgoing) -> bool:
        """Keep the message, for :meth:`sent_values`."""
        if self.accepts:
            self.sent.append(message)
        return self.accepts

    def is_heard(self, channel: str) -> bool:
        """Whether the channel is among those that a test opened."""
        return self.heard is None or channel in self.heard

    def offer(self, label: str, item: Picture | Sound) -> bool:
        """Keep the picture or the sound."""
        if not self.accepts:
            return False
        if isinstance(item, Sound):
            self.sounds.append(item)
        else:
            self.pictures.append(item)
        return True

    def count_loss(self, reason: Loss, messages: int) -> None:
        """Add up the losses by their reason."""
        self.losses[reason] += messages

    def tap_media(self, label: str, codec: TapCodec) -> FakeTap:
        """The encoded pictures that the test has put there."""
        return FakeTap(self, self.tapped.get(label))

    def tap_pictures(self, label: str) -> FakePictureTap:
        """The pictures that the test has put there."""
        return FakePictureTap(self, self.tapped_images.get(label))

    def tap_data(self, labels: Sequence[str]) -> FakeDataTap:
        """The messages that the test has put there, of ``labels`` or of all channels."""
        wanted = [one for one in self.tapped_channels if not labels or one.label in labels]
        return FakeDataTap(self, wanted, self.tapped_data)

    def sent_values(self, channel: str | None = None) -> list[Any]:
        """What was sent (on one channel), as an operator would read it: JSON values, ``str`` or ``bytes``."""
        return [_value(one) for one in self.sent if channel in (None, one.channel)]


class _ScriptedTap(Generic[Tapped]):
    """Gives its pictures one after the other, then lets the time-outs pass."""

    def __init__(self, host: FakeHost, pictures: list[Tapped] | None) -> None:
        self._host = host
        self._pictures: Iterator[Tapped] = iter(pictures or [])
        self.failure = "" if pictures is not None else "channel.unknown_label"

    def next(self, timeout_s: float) -> Tapped | None:
        picture = next(self._pictures, None)
        if picture is None:
            self._host.wait(timeout_s)
        return picture

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *exception: object) -> None:
        """Nothing is held."""


class FakeTap(_ScriptedTap[TappedPicture]):
    """A tap that yields the packets of :attr:`FakeHost.tapped`."""

    def __init__(self, host: FakeHost, pictures: list[TappedPicture] | None) -> None:
        super().__init__(host, pictures)
        self.dropped = 0
        self.key_frames_asked = 0

    def ask_key_frame(self) -> None:
        self.key_frames_asked += 1


class FakeDataTap(_ScriptedTap[TappedMessage]):
    """A tap that yields the messages of :attr:`FakeHost.tapped_data`."""

    def __init__(self, host: FakeHost, channels: Sequence[TappedChannel], messages: list[TappedMessage] | None) -> None:
        super().__init__(host, messages)
        self.channels = tuple(channels)
        self.dropped = 0


class FakePictureTap(_ScriptedTap[TappedImage]):
    """A tap that yields the pictures of :attr:`FakeHost.tapped_images`."""


def _value(message: Outgoing) -> Any:
    if message.kind is PayloadKind.JSON:
        return json.loads(message.payload)
    return message.payload.decode() if message.kind is PayloadKind.STRING else message.payload


def fake_host(handler: Handler) -> FakeHost:
    """The fake host of ``handler``; binds one if it has none yet. Raises :class:`TypeError` for what is no handler."""
    check_handler(handler, "fake_host")
    if not isinstance(handler._host, FakeHost):
        handler.bind(FakeHost())
    host = handler._host
    assert isinstance(host, FakeHost)
    return host
