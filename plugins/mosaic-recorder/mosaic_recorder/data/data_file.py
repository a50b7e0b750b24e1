"""One MCAP file of a robot's data: messages go in byte for byte, and what is on the disk can be read at any time.

Chunks hold a second or a mebibyte and are complete by themselves: a crash or a power cut costs the last one at most.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from mcap.writer import CompressionType, Writer

from mosaic_recorder.disk_file import DiskFile

CHUNK_BYTES = 1024 * 1024
LIBRARY = "mosaic-recorder"
FILE_BYTES = 1024
MESSAGE_BYTES = 31 + 16
CHUNK_INDEX_BYTES = 256
CHANNEL_BYTES = 26
"""What MCAP adds at most to a file, a message (with its place in the index), a chunk and each of its channels; for
`max_bytes` before it is written."""


class DataFile:
    """Writes one file, from one thread. Raises :class:`OSError` when the disk does not take it; close it then, too."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self._disk = DiskFile(path)
        self._channels = 0
        self._waiting_bytes = 0
        self._indexes_bytes = FILE_BYTES
        self._writer = Writer(self._disk, chunk_size=CHUNK_BYTES, compression=CompressionType.ZSTD)  # type: ignore[arg-type]
        try:
            self._writer.start(profile="", library=LIBRARY)
        except BaseException:
            self._disk.close()
            raise

    @property
    def size_bytes(self) -> int:
        """At most what the file takes when it is closed now."""
        return self._disk.tell() + self._waiting_bytes + self._indexes_bytes

    def size_bytes_with(self, payload: bytes) -> int:
        """The same with one message more, even if it needs a channel that is not there yet."""
        return (
            self.size_bytes
            + len(payload)
            + MESSAGE_BYTES
            + 2 * FILE_BYTES
            + CHUNK_INDEX_BYTES
            + CHANNEL_BYTES * self._channels
        )

    def describe(self, name: str, text: Mapping[str, str]) -> None:
        """Add words about the whole file."""
        self._disk.mark_whole()
        self._writer.add_metadata(name, dict(text))
        self._indexes_bytes += FILE_BYTES

    def add_schema(self, name: str, schema: Mapping[str, Any]) -> int:
        """The number of a JSON Schema for :meth:`add_channel`."""
        text = json.dumps(schema, separators=(",", ":")).encode()
        self._indexes_bytes += 2 * (len(text) + len(name) + FILE_BYTES)
        number: int = self._writer.register_schema(name, "jsonschema", text)
        return number

    def add_channel(self, topic: str, encoding: str, schema: int, about: Mapping[str, str]) -> int:
        """The number of a channel for :meth:`write`; ``schema`` 0: it has none."""
        self._channels += 1
        self._indexes_bytes += 2 * (len(topic) + sum(map(len, (*about, *about.values()))) + FILE_BYTES)
        return self._writer.register_channel(topic, encoding, schema, dict(about))

    def write(self, channel: int, payload: bytes, log_ns: int, publish_ns: int, sequence: int) -> None:
        """Add one message; the disk may get it up to a second later, by :meth:`flush`."""
        before = self._disk.tell()
        self._disk.mark_whole()
        self._writer.add_message(channel, log_ns, payload, publish_ns, sequence)
        self._waiting_bytes += len(payload) + MESSAGE_BYTES
        if self._disk.tell() != before:
            self._written()

    def flush(self) -> None:
        """Let the disk have all that was written."""
        if self._waiting_bytes:
            self._disk.mark_whole()
            self._writer.flush()  # type: ignore[no-untyped-call]
            self._written()
        self._disk.sync_now_and_then()

    def _written(self) -> None:
        self._waiting_bytes = 0
        self._indexes_bytes += CHUNK_INDEX_BYTES + CHANNEL_BYTES * self._channels

    def close(self) -> None:
        """Finish the file, unless the disk has failed already. Raises :class:`OSError`; what was written whole stays
        readable."""
        try:
            if self._disk.failure is None:
                self._disk.mark_whole()
                self._writer.finish()  # type: ignore[no-untyped-call]
        finally:
            self._disk.close()
