"""A bridge in the manner of rosbridge: every message of two topics as JSON over a WebSocket, its bytes as base64."""

from __future__ import annotations

import asyncio
import base64
import json
import os
import threading
from collections.abc import Callable
from contextlib import suppress
from multiprocessing.connection import Connection
from typing import Any

from websockets.asyncio.server import ServerConnection, serve
from websockets.exceptions import ConnectionClosed

from mosaic_ros2.bus.dds.dds_bus import DdsBus
from mosaic_ros2.cdr.decoding import Decoder
from mosaic_ros2.definitions.type_book import TypeBook
from ros2_bench.node import CLOUD, IMAGE, QOS

TOPICS = (("/image", IMAGE), ("/points", CLOUD))


def bridge(pipe: Connection, domain: int) -> None:
    """Serve one client; the pipe gets the port and the process' id, and ends it."""
    asyncio.run(_bridge(pipe, domain))


async def _bridge(pipe: Connection, domain: int) -> None:
    book = TypeBook()
    bus = DdsBus(domain, book, "lo")
    loop = asyncio.get_running_loop()

    async def client(socket: ServerConnection) -> None:
        waiting: asyncio.Queue[str] = asyncio.Queue(4)  # what is more is lost, as where a subscriber is too slow
        is_over = threading.Event()

        def offer(text: str) -> None:
            if not waiting.full():
                waiting.put_nowait(text)

        readers = [
            threading.Thread(target=_read, args=(bus, book, topic, kind, is_over, loop, offer))
            for topic, kind in TOPICS
        ]
        for reader in readers:
            reader.start()
        try:
            with suppress(ConnectionClosed):
                while True:
                    await socket.send(await waiting.get())
        finally:
            is_over.set()
            for reader in readers:
                await asyncio.to_thread(reader.join)

    async with serve(client, "127.0.0.1", 0, max_size=None, compression=None) as server:
        pipe.send((server.sockets[0].getsockname()[1], os.getpid()))
        await asyncio.to_thread(_until_closed, pipe)


def _until_closed(pipe: Connection) -> None:
    try:
        pipe.recv()
    except (EOFError, ConnectionResetError):
        return


def _read(
    bus: DdsBus,
    book: TypeBook,
    topic: str,
    kind: str,
    is_over: threading.Event,
    loop: asyncio.AbstractEventLoop,
    offer: Callable[[str], None],
) -> None:
    decoder, subscription = Decoder(book, kind), bus.subscribe(topic, kind, QOS)
    while not is_over.is_set():
        for arrived in subscription.take(0.2)[-1:]:
            message = decoder.decode(arrived.data)
            message["data"] = base64.b64encode(message["data"]).decode()
            text = json.dumps({"op": "publish", "topic": topic, "msg": message})
            loop.call_soon_threadsafe(offer, text)
    subscription.close()


def read_message(text: str) -> tuple[str, float, Any]:
    """What a client does with it: the topic, the time in its header, its bytes."""
    found = json.loads(text)
    stamp = found["msg"]["header"]["stamp"]
    return found["topic"], stamp["sec"] + stamp["nanosec"] / 1e9, base64.b64decode(found["msg"]["data"])
