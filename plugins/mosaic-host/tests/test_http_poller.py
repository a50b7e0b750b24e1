"""JSON of real servers on this machine: typed, bounded, gone and back."""

from __future__ import annotations

import asyncio
import json
from collections.abc import AsyncIterator, Awaitable, Callable
from contextlib import aclosing, asynccontextmanager
from typing import Any

import pytest
from support.devices.absence import thirty_seconds

from mosaic_core.testing import build, connector, fake_host, joined
from mosaic_core.words.errors import ConfigError, DeviceGone
from mosaic_host.web.http_poller import HttpPoller, HttpPollerConfigurer

Answer = Callable[[asyncio.StreamWriter], Awaitable[None]]


class Server:
    """Answers each question by the next of ``answers``, the last one again and again."""

    def __init__(self) -> None:
        self.answers: list[Answer] = []
        self.questions: list[str] = []
        self.port = 0

    async def meet(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        try:
            while True:
                self.questions.append((await reader.readuntil(b"\r\n\r\n")).decode())
                answer = self.answers.pop(0) if len(self.answers) > 1 else self.answers[0]
                await answer(writer)
        except (asyncio.IncompleteReadError, ConnectionError):
            pass
        finally:
            writer.close()

    @asynccontextmanager
    async def here(self) -> AsyncIterator[str]:
        server = await asyncio.start_server(self.meet, "127.0.0.1", self.port)
        self.port = server.sockets[0].getsockname()[1]
        try:
            yield f"http://127.0.0.1:{self.port}/status"
        finally:
            server.close()


def body(data: bytes, status: str = "200 OK", *headers: str) -> Answer:
    async def answer(writer: asyncio.StreamWriter) -> None:
        lines = [f"HTTP/1.1 {status}", f"content-length: {len(data)}", *headers, "", ""]
        writer.write("\r\n".join(lines).encode() + data)
        await writer.drain()

    return answer


def value(it: Any) -> Answer:
    return body(json.dumps(it).encode())


def poller(url: str, **params: Any) -> HttpPoller:
    return build(HttpPollerConfigurer, params={"url": url, **params})


@pytest.fixture
def server() -> Server:
    return Server()


async def test_each_answer_is_a_message_once_a_period(server: Server) -> None:
    server.answers = [value({"n": 1}), value({"n": 2})]
    async with server.here() as url:
        handler = poller(url, period_s=5)
        began_s = fake_host(handler).clock.now_s
        async with aclosing(handler.messages()) as messages:
            assert [await anext(messages), await anext(messages)] == [{"n": 1}, {"n": 2}]
        assert fake_host(handler).clock.now_s == began_s + 5


async def test_fields_are_found_by_their_pointers_and_have_types_and_units(server: Server) -> None:
    server.answers = [value({"robots": [{"battery": {"a/b": 81.5}, "is_docked": True}]})]
    fields = {"charge": {"unit": "%", "pointer": "/battery/a~1b"}, "is_docked": {"type": "boolean"}}
    async with server.here() as url, aclosing(poller(url, pointer="/robots/0", fields=fields).messages()) as messages:
        message = await anext(messages)
    assert message.model_dump() == {"charge": 81.5, "is_docked": True}
    assert type(message).model_json_schema()["properties"]["charge"]["unit"] == "%"


async def test_garbage_is_refused_and_counted_and_the_next_answer_arrives(server: Server) -> None:
    garbage = [b"", b"\xff\xfe", b"[1]", b"{", b'{"charge": NaN}', b'{"charge": "much"}', b"{}", b"[" * 5000]
    server.answers = [*map(body, garbage), body(b"x", "200 OK", "content-encoding: gzip"), value({"charge": 3})]
    async with server.here() as url:
        handler = poller(url, fields={"charge": {}})
        async with aclosing(handler.messages()) as messages:
            assert (await anext(messages)).charge == 3
    assert fake_host(handler).losses == {"refused": len(garbage) + 1}


async def test_a_body_that_is_too_large_is_not_read_to_its_end(server: Server) -> None:
    sent = 0

    async def flood(writer: asyncio.StreamWriter) -> None:
        nonlocal sent
        writer.write(b"HTTP/1.1 200 OK\r\n\r\n")
        while True:
            writer.write(b"x" * 65_536)
            sent += 65_536
            await writer.drain()

    server.answers = [flood, value({"n": 1})]
    async with server.here() as url:
        handler = poller(url, max_bytes=1000)
        async with aclosing(handler.messages()) as messages:
            assert await anext(messages) == {"n": 1}
    assert fake_host(handler).losses == {"refused": 1}
    assert sent < 100_000_000


@pytest.mark.parametrize("begin", [b"HTTP/1.1 200 OK\r\nx: ", b"HTTP/1.1 200 OK\r\n\r\n"], ids=["head", "body"])
async def test_a_server_that_drips_is_given_up_after_the_whole_time(server: Server, begin: bytes) -> None:
    async def drip(writer: asyncio.StreamWriter) -> None:
        writer.write(begin)
        while True:
            writer.write(b" ")
            await writer.drain()
            await asyncio.sleep(0.02)

    server.answers = [drip]
    async with server.here() as url:
        with pytest.raises(DeviceGone, match=r"no whole answer within 0\.3 s"):
            await anext(poller(url, timeout_s=0.3).messages())


@pytest.mark.parametrize(
    ("status", "said"),
    [
        ("503 Service Unavailable", "answered 503 Service Unavailable"),
        ("401 Unauthorized", "right `headers`"),
        ("302 Found", "redirects are not followed"),
        ("204 No Content", "answered 204"),
    ],
)
async def test_any_other_status_is_a_device_that_is_gone(server: Server, status: str, said: str) -> None:
    server.answers = [body(b"", status, "location: http://127.0.0.1:1/elsewhere")]
    async with server.here() as url:
        with pytest.raises(DeviceGone, match=said):
            await anext(poller(url).messages())
    assert len(server.questions) == 1


async def test_a_server_that_is_away_for_thirty_seconds_is_gone_and_its_return_is_noticed(server: Server) -> None:
    server.answers = [value({"n": 1})]
    async with server.here() as url:
        handler = poller(url)
        await anext(handler.messages())
    for _ in thirty_seconds(fake_host(handler).clock):
        with pytest.raises(DeviceGone, match="is the server running"):
            await anext(handler.messages())
    async with server.here():
        assert await anext(handler.messages()) == {"n": 1}


async def test_headers_are_sent_cookies_are_not_and_no_secret_is_told(
    server: Server, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("HTTP_PROXY", "http://127.0.0.1:1")
    server.answers = [body(b"{}", "200 OK", "set-cookie: a=b"), value({}), body(b"", "500 Oops")]
    async with server.here() as url:
        secret = url.replace("//", "//user:hidden@") + "?token=hidden"
        with pytest.raises(DeviceGone) as gone:
            async for _ in poller(secret, headers={"X-Key": "mine"}).messages():
                pass
    assert all("X-Key: mine" in one for one in server.questions)
    assert not any("ookie" in one for one in server.questions)
    assert "hidden" not in str(gone.value)


async def test_an_operator_of_a_whole_robot_sees_the_fake() -> None:
    params = {"url": "fake", "pointer": "/x", "fields": {"charge": {"pointer": "/battery/charge"}}}
    async with joined(connector(HttpPollerConfigurer, label="charger", params=params)) as link:
        assert "charge" in (await link.connection.receivable("charger").next_message()).json()


@pytest.mark.parametrize(
    ("params", "said"),
    [
        ({"url": "ftp://host/x"}, "no URL of a server"),
        ({"url": "http://"}, "no URL of a server"),
        ({"url": "http://host:port"}, "no URL"),
        ({"url": "fake", "pointer": "x"}, "no JSON Pointer"),
        ({"url": "fake", "fields": {"copy": {}}}, "meaning of its own"),
        ({"url": "fake", "fields": {"a": {"pointer": "/~2"}}}, "no JSON Pointer"),
        ({"url": "fake", "headers": {"A": "x\r\nB: y"}}, "headers"),
        ({"url": "fake", "max_bytes": 10**9}, "max_bytes"),
    ],
)
def test_what_cannot_be_meant_is_refused_at_once(params: dict[str, Any], said: str) -> None:
    with pytest.raises(ConfigError, match=said):
        build(HttpPollerConfigurer, params=params)
