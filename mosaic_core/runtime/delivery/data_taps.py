"""The open taps of a running robot's data: they see what handlers send and are told, on its way past."""

from __future__ import annotations

import time
from collections.abc import Mapping
from typing import Protocol

from mosaic_core.contract.data_tap import TappedChannel, TappedMessage
from mosaic_core.contract.host import Outgoing
from mosaic_core.machines.commands.gates import GateRefusal
from mosaic_core.machines.delivery.framing import kind_of
from mosaic_core.runtime.commands.inbox import Incoming


class TapReader(Protocol):
    """Takes what passes; on the event loop, and never waits."""

    def put(self, message: TappedMessage) -> None: ...


class DataTaps:
    """Shows what passes to those who look. Event loop only, but for :meth:`is_open`."""

    def __init__(self) -> None:
        self.channels: Mapping[str, TappedChannel] = {}
        """The data channels of the robot, by label; others when its file is read anew."""
        self._readers: Mapping[str, tuple[TapReader, ...]] = {}

    def is_open(self, label: str) -> bool:
        """Whether anybody looks at this channel. Any thread."""
        return label in self._readers

    def add(self, label: str, reader: TapReader) -> None:
        self._readers = {**self._readers, label: (*self._readers.get(label, ()), reader)}

    def remove(self, label: str, reader: TapReader) -> None:
        left = tuple(one for one in self._readers.get(label, ()) if one is not reader)
        others = {key: readers for key, readers in self._readers.items() if key != label}
        self._readers = {**others, label: left} if left else others

    def sent(self, message: Outgoing) -> None:
        """A handler's message goes out to whoever listens."""
        for reader in self._readers.get(message.channel, ()):
            show(message, reader)

    def commanded(self, item: Incoming, refusal: GateRefusal | None) -> None:
        """It is known what became of an operator's message."""
        readers, channel = self._readers.get(item.channel), self.channels.get(item.channel)
        if readers is None or channel is None:
            return
        code, gate = ("", "") if refusal is None else (refusal.code, str(refusal.gate))
        kind, now_s = kind_of(channel.data_type), time.monotonic()
        told = TappedMessage(item.channel, kind, item.payload, item.arrived_at_s, now_s, item.sender, code, gate)
        for reader in readers:
            reader.put(told)


def show(message: Outgoing, reader: TapReader) -> None:
    """Show ``message`` and what travels right behind it."""
    now_s = time.monotonic()
    for payload in (message.payload, *message.followers):
        reader.put(TappedMessage(message.channel, message.kind, payload, message.stamp_us / 1e6, now_s))
