"""Reads files of data with the library's own readers."""

from __future__ import annotations

import json
import struct
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from mcap.exceptions import McapError
from mcap.reader import make_reader
from mcap.records import Channel, Message, Schema
from mcap.stream_reader import StreamReader


@dataclass(frozen=True)
class Read:
    """One message with its channel and schema."""

    topic: str
    encoding: str
    schema: str
    payload: bytes
    log_ns: int
    publish_ns: int
    sequence: int


def messages_in(path: Path, topic: str | None = None) -> list[Read]:
    """By the index, as viewers read it; every checksum is verified."""
    with path.open("rb") as file:
        reader = make_reader(file, validate_crcs=True)
        topics = None if topic is None else [topic]
        found = reader.iter_messages(topics, log_time_order=False)
        return [_read(schema, channel, message) for schema, channel, message in found]


def schemas_in(path: Path) -> dict[str, bytes]:
    with path.open("rb") as file:
        summary = make_reader(file).get_summary()
        assert summary is not None
        return {schema.name: schema.data for schema in summary.schemas.values()}


def words_in(path: Path, name: str) -> dict[str, str]:
    """The metadata of that name."""
    with path.open("rb") as file:
        (found,) = [one.metadata for one in make_reader(file).iter_metadata() if one.name == name]
        return found


def whole_messages_in(path: Path) -> list[Read]:
    """What a reader without an index finds before a broken end."""
    with path.open("rb") as file:
        return list(_up_to_the_break(StreamReader(file, validate_crcs=True)))


def _up_to_the_break(reader: StreamReader) -> Iterator[Read]:
    schemas: dict[int, Schema] = {}
    channels: dict[int, Channel] = {}
    try:
        for record in reader.records:
            if isinstance(record, Schema):
                schemas[record.id] = record
            elif isinstance(record, Channel):
                channels[record.id] = record
            elif isinstance(record, Message):
                channel = channels[record.channel_id]
                yield _read(schemas.get(channel.schema_id), channel, record)
    except (McapError, struct.error):
        return  # the break, which the library tells in either way


def _read(schema: Schema | None, channel: Channel, message: Message) -> Read:
    name = "" if schema is None else schema.name
    return Read(
        channel.topic,
        channel.message_encoding,
        name,
        message.data,
        message.log_time,
        message.publish_time,
        message.sequence,
    )


def value_of(read: Read) -> Any:
    return json.loads(read.payload)
