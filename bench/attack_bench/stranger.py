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
from collections.abc import Callable

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

    def log_in() -> bytes:
        body = json.dumps({"username": f"{random.random()}@example.org", "password": "wrong password"}).encode()
        return posted("/api/v1/account/login/access-token", body)

    await asyncio.gather(*(_again_and_again(port, log_in, 0.05) for _ in range(LOG_INS)))


async def bodies(port: int) -> None:
    """Ten connections that send nested JSON of nearly a megabyte where only those who are signed in may ask."""
    request = posted("/api/v1/webrtc/connection", b'{"robotIds":[' + b"[]," * 300_000 + b"[]]}")
    await asyncio.gather(*(_again_and_again(port, lambda: request) for _ in range(10)))


async def many_headers(port: int) -> None:
    """Three hundred requests at once with 1 400 headers each."""
    many = b"".join(b"a%d: b\r\n" % number for number in range(1400))
    request = b"GET /healthz HTTP/1.1\r\nHost: 127.0.0.1\r\nConnection: close\r\n" + many + b"\r\n"
    await asyncio.gather(*(_again_and_again(port, lambda: request) for _ in range(300)))


def posted(path: str, body: bytes) -> bytes:
    head = f"POST {path} HTTP/1.1\r\nHost: 127.0.0.1\r\nConnection: close\r\nContent-Type: application/json\r\n"
    return f"{head}Content-Length: {len(body)}\r\n\r\n".encode() + body


async def _again_and_again(port: int, request: Callable[[], bytes], pause_s: float = 0.0) -> None:
    while True:
        with contextlib.suppress(OSError):
            reader, writer = await opened(port)
            writer.write(request())
            await _swallow(reader)
            writer.close()
        await asyncio.sleep(pause_s)


ATTACKS = {
    "pings": pings, "idle": idle, "headers": headers, "sockets": sockets, "log-ins": log_ins, "bodies": bodies,
    "many headers": many_headers,
}  # fmt: skip

if __name__ == "__main__":
    _, most = resource.getrlimit(resource.RLIMIT_NOFILE)
    resource.setrlimit(resource.RLIMIT_NOFILE, (min(4096, most), most))
    with contextlib.suppress(KeyboardInterrupt, TimeoutError):
        asyncio.run(asyncio.wait_for(ATTACKS[sys.argv[1]](int(sys.argv[2])), 600))
