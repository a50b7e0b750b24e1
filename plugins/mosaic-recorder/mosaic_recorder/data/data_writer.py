"""Turns tapped messages into the channels of an MCAP file: topics, schemas, times, and who commanded what."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

from mosaic_core import MosaicDataType
from mosaic_core.contract.data_tap import TappedChannel, TappedMessage
from mosaic_core.contract.sender import Sender
from mosaic_core.machines.delivery.framing import PayloadKind, kind_of
from mosaic_recorder.data.data_file import DataFile
from mosaic_recorder.data.movie_log import MovieStretch
from mosaic_recorder.messages import CommandNote, MovieNote
from mosaic_recorder.robot_clock import RobotClock

ENCODINGS = {
    PayloadKind.JSON: "json",
    PayloadKind.STRING: "text/plain",
    PayloadKind.BYTES: "application/octet-stream",
}
COMMANDS, MOVIES = "_commands", "_movies"
"""Topics of the recorder's own; labels of connectors do not begin with `_`."""
MAX_REFUSED_BYTES = 4096
"""Of what a refused command said: anybody may send anything."""
CLOCK_WORDS = (
    "log and publish times are the robot's monotonic clock, moved once to wall time: unix ns = monotonic ns + zero_ns. "
    "A message's log time is when it was sent or decided upon, its publish time when it was made or arrived. "
    f"A picture of a movie at t seconds was captured at captured_at_ns + (t - at_s) of the newest `{MOVIES}` note of "
    "its file with at_s <= t."
)


class DataWriter:
    """Writes the data of one recording into one file, on one thread; any may read its figures. Raises
    :class:`OSError`. ``claim`` gives the path of the file, ``release`` is told when it is finished."""

    def __init__(
        self, recorder: str, claim: Callable[[], Path], release: Callable[[Path], None], clock: RobotClock
    ) -> None:
        self._recorder = recorder
        self._claim = claim
        self._release = release
        self._clock = clock
        self._file: DataFile | None = None
        self._known: Mapping[str, TappedChannel] = {}
        self._channels: dict[tuple[str, PayloadKind], int] = {}
        self._schemas: dict[str, int] = {}
        self._sequences: dict[int, int] = {}
        self.names: list[str] = []
        self.messages = 0
        self.size_bytes = 0
        """At most what the file takes."""

    def open(self, channels: Sequence[TappedChannel]) -> None:
        """Begin the file, if it is not there yet, for these channels."""
        self._known = {channel.label: channel for channel in channels}
        if self._file is not None:
            return
        path = self._claim()
        try:
            self._file = DataFile(path)
        except BaseException:
            self._release(path)
            raise
        self.names.append(path.name)
        words = {"recorder": self._recorder, "zero_ns": str(self._clock.zero_ns), "clock": CLOCK_WORDS}
        self._file.describe("mosaic", words)
        for channel in channels:
            self._add_topics(channel)
        self._own_channel(COMMANDS, CommandNote)
        self._own_channel(MOVIES, MovieNote)
        self._measure()

    def size_bytes_with(self, message: TappedMessage) -> int:
        """What the file would take at most; a command has its note beside it."""
        assert self._file is not None, "opened before"
        note = 0 if message.sender is None else 1024 + min(2 * len(message.payload), 2 * MAX_REFUSED_BYTES)
        return self._file.size_bytes_with(message.payload) + note

    def add(self, message: TappedMessage) -> None:
        sequence = 0
        if not message.code:
            sequence = self._write(self._channel_of(message), message.payload, message)
        if message.sender is not None:
            note = _command_note(message, message.sender, sequence)
            text = note.model_dump_json(exclude_none=True).encode()
            self._write(self._own_channel(COMMANDS, CommandNote), text, message)
        self.messages += 1
        self._measure()

    def note(self, stretch: MovieStretch, now_s: float) -> None:
        """Where a movie's pictures belong."""
        at_ns = self._clock.wall_ns(stretch.captured_at_s)
        note = MovieNote(label=stretch.label, file=stretch.file, at_s=stretch.at_s, captured_at_ns=at_ns)
        text = note.model_dump_json().encode()
        self._put(self._own_channel(MOVIES, MovieNote), text, self._clock.wall_ns(now_s), at_ns)
        self._measure()

    def flush(self) -> None:
        """Let the disk have all that was written."""
        if self._file is not None:
            self._file.flush()
            self._measure()

    def close(self) -> None:
        """Finish the file, if there is one."""
        if self._file is None:
            return
        file, self._file = self._file, None
        try:
            file.close()
            self.size_bytes = file.path.stat().st_size
        finally:
            self._release(file.path)

    # -- inside --------------------------------------------------------------------------------------------------

    def _measure(self) -> None:
        if self._file is not None:
            self.size_bytes = self._file.size_bytes

    def _write(self, channel: int, payload: bytes, message: TappedMessage) -> int:
        log_ns, made_ns = self._clock.wall_ns(message.tapped_at_s), self._clock.wall_ns(message.stamped_at_s)
        return self._put(channel, payload, log_ns, made_ns)

    def _put(self, channel: int, payload: bytes, log_ns: int, publish_ns: int) -> int:
        assert self._file is not None, "opened before"
        sequence = self._sequences[channel] = (self._sequences.get(channel, 0) + 1) % (1 << 32)
        self._file.write(channel, payload, log_ns, publish_ns, sequence)
        return sequence

    def _add_topics(self, known: TappedChannel) -> None:
        """What goes both ways has a topic for each, and declares what it takes."""
        if known.data_type is MosaicDataType.JSON_BI:
            self._new_channel(f"{known.label}/commands", PayloadKind.JSON, known, known.message_schema)
            self._new_channel(known.label, PayloadKind.JSON, known, None)
        else:
            self._new_channel(known.label, kind_of(known.data_type), known, known.message_schema)

    def _channel_of(self, message: TappedMessage) -> int:
        known = self._known[message.label]
        is_command = known.data_type is MosaicDataType.JSON_BI and message.sender is not None
        topic = f"{message.label}/commands" if is_command else message.label
        made = self._channels.get((topic, message.kind))
        if made is None:  # of another kind than the data type says
            made = self._new_channel(topic, message.kind, known, None)
        return made

    def _new_channel(
        self, topic: str, kind: PayloadKind, known: TappedChannel, schema: Mapping[str, Any] | None
    ) -> int:
        assert self._file is not None, "opened before"
        number = 0
        if schema is not None and kind is PayloadKind.JSON:
            number = self._schema(known.schema_id or f"{known.connector_type}/{topic}", schema)
        about = {"label": known.label, "type": known.connector_type, "data_type": str(known.data_type)}
        made = self._channels[topic, kind] = self._file.add_channel(topic, ENCODINGS[kind], number, about)
        return made

    def _schema(self, name: str, schema: Mapping[str, Any]) -> int:
        """The same shape is written once; a message with fields of its own keeps the id and has its own schema."""
        assert self._file is not None, "opened before"
        key = json.dumps([name, schema])
        if key not in self._schemas:
            self._schemas[key] = self._file.add_schema(name, schema)
        return self._schemas[key]

    def _own_channel(self, topic: str, note: type[CommandNote] | type[MovieNote]) -> int:
        known = self._channels.get((topic, PayloadKind.JSON))
        if known is None:
            assert self._file is not None, "opened before"
            schema = self._schema(note.schema_id, note.model_json_schema(mode="serialization"))
            known = self._file.add_channel(topic, "json", schema, {"recorder": self._recorder})
            self._channels[topic, PayloadKind.JSON] = known
        return known


def _command_note(message: TappedMessage, sender: Sender, sequence: int) -> CommandNote:
    refused = message.payload[:MAX_REFUSED_BYTES].decode(errors="replace") if message.code else None
    return CommandNote(
        label=message.label,
        accepted=not message.code,
        sequence=sequence or None,
        code=message.code,
        gate=message.gate,
        refused=refused,
        operator=sender.name,
        operator_id=sender.operator_id,
        role=sender.role,
        session_id=sender.session_id,
    )
