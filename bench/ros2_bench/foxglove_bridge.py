"""A bridge by Foxglove's own server (`pip install foxglove-sdk`): the bytes of two topics as they come, over its
WebSocket. What a client does not take in time is dropped, the oldest first."""

from __future__ import annotations

import os
import threading
from multiprocessing.connection import Connection
from typing import Any

from mosaic_ros2.bus.dds.dds_bus import DdsBus
from mosaic_ros2.definitions.type_book import TypeBook
from ros2_bench.json_bridge import TOPICS
from ros2_bench.node import QOS

BACKLOG = 8
"""Messages that wait for a client at most. The default of 1024 would be minutes of pictures."""


def foxglove_bridge(pipe: Connection, domain: int) -> None:
    """Serve whoever comes; the pipe gets the port and the process' id, and ends it."""
    import foxglove  # type: ignore[import-not-found, unused-ignore]  # of the bench alone

    bus = DdsBus(domain, TypeBook(), "lo")
    is_over = threading.Event()
    server = foxglove.start_server(host="127.0.0.1", port=0, message_backlog_size=BACKLOG)
    channels: dict[str, Any] = {
        topic: foxglove.Channel(topic, message_encoding="cdr", schema=foxglove.Schema(name=kind, encoding="", data=b""))
        for topic, kind in TOPICS
    }
    readers = [
        threading.Thread(target=_pass_on, args=(bus, topic, kind, channels[topic], is_over)) for topic, kind in TOPICS
    ]
    for reader in readers:
        reader.start()
    pipe.send((server.port, os.getpid()))
    try:
        pipe.recv()
    except (EOFError, ConnectionResetError):
        is_over.set()
    for reader in readers:
        reader.join()
    server.stop()


def _pass_on(bus: DdsBus, topic: str, kind: str, channel: Any, is_over: threading.Event) -> None:
    subscription = bus.subscribe(topic, kind, QOS)
    while not is_over.is_set():
        for arrived in subscription.take(0.2):
            if channel.has_sinks():
                channel.log(arrived.data)
    subscription.close()
