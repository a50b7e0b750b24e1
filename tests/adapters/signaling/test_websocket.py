"""The signaling socket: what arrives, what is refused, and causes named in words."""

from __future__ import annotations

import asyncio
import socket
import ssl
from collections.abc import AsyncIterator, Awaitable, Callable, Iterator
from contextlib import ExitStack, asynccontextmanager, contextmanager
from typing import Any

import pytest
import uvloop
from support.processes import free_port
from websockets.asyncio.server import ServerConnection, serve
from websockets.datastructures import Headers
from websockets.exceptions import InvalidURI
from websockets.http11 import Request, Response

from mosaic_core.adapters.signaling import websocket
from mosaic_core.adapters.signaling.websocket import open_websocket
from mosaic_core.words.errors import SignalingError
from mosaic_core.words.signaling import SIZE_AFTER_AUTHORIZATION


@asynccontextmanager
async def against(handler: Callable[[ServerConnection], Awaitable[None]]) -> AsyncIterator[Any]:
    async with serve(handler, "127.0.0.1", 0, compression=None) as server:
        port = server.sockets[0].getsockname()[1]
        async with asyncio.timeout(30):
            yield f"ws://127.0.0.1:{port}/ws/robot"


@contextmanager
def deaf(host: str, port: int) -> Iterator[None]:
    """Whoever knocks there waits: the queue of connections is full, as on a path that swallows everything."""
    with ExitStack() as stack:
        listening = stack.enter_context(socket.socket())
        listening.bind((host, port))
        listening.listen(0)
        for _ in range(2):
            knocking = stack.enter_context(socket.socket())
            knocking.setblocking(False)
            knocking.connect_ex((host, port))
        yield


def failure(url: str) -> SignalingError:
    with pytest.raises(SignalingError) as failed:
        asyncio.run(open_websocket(url))
    assert failed.value.code == "signal.unreachable"
    return failed.value


async def test_text_goes_both_ways_binary_is_passed_over_and_the_close_code_is_known() -> None:
    async def handler(server: ServerConnection) -> None:
        await server.send(b"\x00")
        await server.send("hello " + str(await server.recv()))
        await server.close(4409, "replaced")

    async with against(handler) as url:
        opened = await open_websocket(url)
        assert opened.close_code is None
        await opened.send("robot")
        assert [frame async for frame in opened] == ["hello robot"]
        assert opened.close_code == 4409
        with pytest.raises(SignalingError):
            await opened.send("too late")


@pytest.mark.parametrize("loop_factory", [None, uvloop.new_event_loop], ids=["asyncio", "uvloop"])
def test_an_address_that_leads_nowhere_does_not_keep_it_from_the_next(
    monkeypatch: pytest.MonkeyPatch, loop_factory: Callable[[], asyncio.AbstractEventLoop] | None
) -> None:
    async def handler(server: ServerConnection) -> None:
        await server.send("here")

    async def addresses(host: str) -> list[str]:
        return ["127.0.0.2", "127.0.0.1"]

    async def run() -> None:
        async with serve(handler, "127.0.0.1", 0) as server:
            port = server.sockets[0].getsockname()[1]
            with deaf("127.0.0.2", port):
                async with asyncio.timeout(websocket.OPEN_TIMEOUT_S / 2):
                    opened = await open_websocket(f"ws://name.example:{port}/ws/robot")
                    assert [frame async for frame in opened] == ["here"]

    monkeypatch.setattr(websocket, "addresses_of", addresses)
    with asyncio.Runner(loop_factory=loop_factory) as runner:
        runner.run(run())


async def test_a_server_that_sends_on_to_another_address_is_named_with_it() -> None:
    async def moved(connection: ServerConnection, request: Request) -> Response:
        headers = Headers(Location="wss://elsewhere.example/ws/robot", Connection="close")
        return Response(301, "Moved Permanently", headers, b"")

    async with serve(lambda connection: connection.wait_closed(), "127.0.0.1", 0, process_request=moved) as server:
        with pytest.raises(SignalingError) as failed:
            await open_websocket(f"ws://127.0.0.1:{server.sockets[0].getsockname()[1]}/ws/robot")
    assert "wss://elsewhere.example/ws/robot" in str(failed.value)
    assert "server.ws_url" in (failed.value.cure or "")


async def test_nothing_is_compressed_and_a_frame_beyond_the_limit_closes_the_socket() -> None:
    async def handler(server: ServerConnection) -> None:
        assert "Sec-WebSocket-Extensions" not in (server.request.headers if server.request else {})
        await server.send("x" * (SIZE_AFTER_AUTHORIZATION + 1))
        await server.wait_closed()

    async with against(handler) as url:
        opened = await open_websocket(url)
        assert [frame async for frame in opened] == []


async def test_closing_tells_the_server_why() -> None:
    codes: list[int | None] = []

    async def handler(server: ServerConnection) -> None:
        await server.wait_closed()
        codes.append(server.close_code)

    async with against(handler) as url:
        await (await open_websocket(url)).close(4400, "bad message")
    assert codes == [4400]


async def test_who_has_no_patience_for_the_good_bye_leaves_nothing_open() -> None:
    async def deafened(connection: ServerConnection) -> None:
        connection.transport.pause_reading()
        await connection.wait_closed()

    async with serve(deafened, "127.0.0.1", 0, close_timeout=0) as server:
        mine = await open_websocket(f"ws://127.0.0.1:{server.sockets[0].getsockname()[1]}/ws/robot")
        with pytest.raises(TimeoutError):
            await asyncio.wait_for(mine.close(), 0.05)
        assert mine._connection.transport.is_closing()


def test_a_server_that_is_down_is_named_with_its_port() -> None:
    port = free_port()
    error = failure(f"ws://127.0.0.1:{port}/ws/robot")
    assert f"127.0.0.1:{port}" in error.message
    assert "running" in error.cure


def test_a_name_that_does_not_exist_is_told_apart(monkeypatch: pytest.MonkeyPatch) -> None:
    async def no_such_name(*_: object, **__: object) -> None:
        raise socket.gaierror(socket.EAI_NONAME, "Name or service not known")

    monkeypatch.setattr(websocket, "connect", no_such_name)
    assert "can't be resolved" in failure("ws://mosaic.invalid").message


async def test_an_http_status_is_told() -> None:
    async def refuse(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        await reader.readuntil(b"\r\n\r\n")
        writer.write(b"HTTP/1.1 404 Not Found\r\nContent-Length: 0\r\nConnection: close\r\n\r\n")
        await writer.drain()
        writer.close()

    server = await asyncio.start_server(refuse, "127.0.0.1", 0)
    async with server:
        with pytest.raises(SignalingError, match="HTTP status 404"):
            await open_websocket(f"ws://127.0.0.1:{server.sockets[0].getsockname()[1]}/")


async def test_a_plain_server_behind_wss_is_told_apart() -> None:
    async def handler(server: ServerConnection) -> None:
        await server.wait_closed()

    async with against(handler) as url:
        with pytest.raises(SignalingError, match=r"hung up|TLS") as failed:
            await open_websocket(url.replace("ws://", "wss://"))
        assert "ws://" in failed.value.cure


def test_an_untrusted_certificate_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    async def untrusted(*_: object, **__: object) -> None:
        error = ssl.SSLCertVerificationError(1, "certificate verify failed")
        error.verify_message = "self-signed certificate"
        raise error

    async def addresses(host: str) -> list[str]:
        return ["127.0.0.1"]

    monkeypatch.setattr(websocket, "connect", untrusted)
    monkeypatch.setattr(websocket, "addresses_of", addresses)
    with socket.create_server(("127.0.0.1", 0)) as server:
        url = f"wss://mosaic.example:{server.getsockname()[1]}"
        assert "self-signed certificate" in failure(url).message


@pytest.mark.parametrize("error", [TimeoutError(), InvalidURI("x", "bad"), OSError("no route to host")])
def test_every_other_cause_has_words_too(monkeypatch: pytest.MonkeyPatch, error: Exception) -> None:
    async def fail(*_: object, **__: object) -> None:
        raise error

    monkeypatch.setattr(websocket, "connect", fail)
    assert failure("wss://mosaic.example").message
