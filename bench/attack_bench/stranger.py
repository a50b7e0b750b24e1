"""A stranger without any account, alone at 127.0.0.2, who wears a server out. Runs as a process of its own.

python -m attack_bench.stranger ATTACK PORT
"""

from __future__ import annotations

import asyncio
import base64
import contextlib
import json
import random
import resource
import sys

ADDRESS = "127.0.0.2"
HELD = 1050
PINGS_BYTES_PER_S = 2_000_000
LOG_INS = 30


async def opened(port: int) -> tuple[asyncio.StreamReader, asyncio.StreamWriter]:
    return await asyncio.open_connection("127.0.0.1", port, local_addr=(ADDRESS, 0))


async def web_socket(port: int) -> tuple[asyncio.StreamReader, asyncio.StreamWriter]:
    reader, writer = await opened(port)
    key = base64.b64encode(random.randbytes(16)).decode()
    writer.write(
        f"GET /ws/user HTTP/1.1\r\nHost: 127.0.0.1\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"
        f"Sec-WebSocket-Key: {key}\r\nSec-WebSocket-Version: 13\r\n\r\n".encode()
    )
    await reader.readuntil(b"\r\n\r\n")
    return reader, writer


async def pings(port: int) -> None:
    """One socket that sends pings of ten bytes at 2 MB/s, and comes back whenever it is cut off."""
    ping = b"\x89\x84\0\0\0\0ping"
    chunk = ping * (PINGS_BYTES_PER_S // 100 // len(ping))
    while True:
        with contextlib.suppress(OSError, asyncio.IncompleteReadError):
            reader, writer = await web_socket(port)
            swallowing = asyncio.create_task(_swallow(reader))
            try:
                while not swallowing.done():
                    writer.write(chunk)
                    await writer.drain()
                    await asyncio.sleep(0.01)
            finally:
                swallowing.cancel()
                writer.close()
        await asyncio.sleep(0.01)


async def _swallow(reader: asyncio.StreamReader) -> None:
    with contextlib.suppress(OSError):
        while await reader.read(65536):
            pass


async def idle(port: int) -> None:
    """Connections that say nothing, opened again whenever they are closed."""
    await asyncio.gather(*(_held(port, b"") for _ in range(HELD)))


async def headers(port: int) -> None:
    """Requests whose headers never end: a byte every second."""
    await asyncio.gather(*(_held(port, b"GET / HTTP/1.1\r\nHost: 127.0.0.1\r\nX: ") for _ in range(HELD)))


async def _held(port: int, first: bytes) -> None:
    await asyncio.sleep(random.random())
    while True:
        with contextlib.suppress(OSError):
            reader, writer = await opened(port)
            writer.write(first)
            closed = asyncio.create_task(_swallow(reader))
            while not closed.done():
                if first:
                    writer.write(b"x")
                await asyncio.wait([closed], timeout=1.0)
            writer.close()
        await asyncio.sleep(1.0)


async def sockets(port: int) -> None:
    """WebSockets that never log in, opened again whenever they are closed."""

    async def one() -> None:
        await asyncio.sleep(random.random())
        while True:
            with contextlib.suppress(OSError, asyncio.IncompleteReadError):
                reader, writer = await web_socket(port)
                await _swallow(reader)
                writer.close()
            await asyncio.sleep(1.0)

    await asyncio.gather(*(one() for _ in range(HELD)))


async def log_ins(port: int) -> None:
    """Thirty log-ins at once, with e-mails that nobody has, again and again."""

    async def one() -> None:
        while True:
            body = json.dumps({"username": f"{random.random()}@example.org", "password": "wrong password"}).encode()
            with contextlib.suppress(OSError):
                reader, writer = await opened(port)
                head = "POST /api/v1/account/login/access-token HTTP/1.1\r\nHost: 127.0.0.1\r\nConnection: close\r\n"
                head += f"Content-Type: application/json\r\nContent-Length: {len(body)}\r\n\r\n"
                writer.write(head.encode() + body)
                await _swallow(reader)
                writer.close()
            await asyncio.sleep(0.05)

    await asyncio.gather(*(one() for _ in range(LOG_INS)))


ATTACKS = {"pings": pings, "idle": idle, "headers": headers, "sockets": sockets, "log-ins": log_ins}

if __name__ == "__main__":
    _, most = resource.getrlimit(resource.RLIMIT_NOFILE)
    resource.setrlimit(resource.RLIMIT_NOFILE, (min(4096, most), most))
    with contextlib.suppress(KeyboardInterrupt, TimeoutError):
        asyncio.run(asyncio.wait_for(ATTACKS[sys.argv[1]](int(sys.argv[2])), 600))
