"""The page of metrics: who may read it, and what anything else is told."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator, Awaitable, Callable
from contextlib import asynccontextmanager
from typing import Any

import pytest

from mosaic_core.cli.robot.metrics_option import MetricsAddress, metrics_address
from mosaic_core.runtime.observation.metrics_server import MetricsServer
from mosaic_core.words.errors import MosaicError

Ask = Callable[[bytes], Awaitable[tuple[str, str]]]


@asynccontextmanager
async def served(host: str = "127.0.0.1") -> AsyncIterator[Any]:
    server = MetricsServer(host, 0, lambda: "mosaic_robot_peers 1\n")
    await server.open()
    port = int(server.url.rpartition(":")[2].partition("/")[0])

    async def ask(request: bytes) -> tuple[str, str]:
        reader, writer = await asyncio.open_connection("127.0.0.1", port)
        writer.write(request)
        if not request.endswith(b"\r\n\r\n"):
            writer.write_eof()
        head, _, text = (await reader.read()).decode().partition("\r\n\r\n")
        writer.close()
        return head.splitlines()[0].partition(" ")[2], text

    try:
        yield ask
    finally:
        server.close()


async def test_the_page_is_served_and_nothing_else() -> None:
    async with served() as ask:
        assert await ask(b"GET /metrics HTTP/1.1\r\nHost: localhost:1\r\n\r\n") == ("200 OK", "mosaic_robot_peers 1\n")
        assert (await ask(b"GET /metrics?x=1 HTTP/1.0\r\n\r\n"))[0] == "200 OK"
        assert (await ask(b"GET / HTTP/1.1\r\nHost: [::1]:1\r\n\r\n"))[0] == "404 Not Found"
        assert (await ask(b"POST /metrics HTTP/1.1\r\n\r\n"))[0] == "405 Method Not Allowed"
        for nonsense in (b"\r\n\r\n", b"GET /metrics\r\n\r\n", b"\x16\x03\x01", b"x" * 100_000):
            assert (await ask(nonsense))[0] == "400 Bad Request"


async def test_a_web_site_whose_name_leads_here_reads_nothing() -> None:
    async with served() as ask:
        request = b"GET /metrics HTTP/1.1\r\nHost: evil.example:9464\r\n\r\n"
        assert await ask(request) == ("421 Misdirected Request", "")

    async with served("0.0.0.0") as ask:  # noqa: S104
        assert (await ask(b"GET /metrics HTTP/1.1\r\nHost: robot.example\r\n\r\n"))[0] == "200 OK"


async def test_a_port_that_is_taken_is_told_with_a_code() -> None:
    first = MetricsServer("127.0.0.1", 0, str)
    await first.open()
    with pytest.raises(MosaicError) as caught:
        await MetricsServer("127.0.0.1", int(first.url.split(":")[2].split("/")[0]), str).open()
    assert caught.value.code == "config.metrics"
    first.close()


@pytest.mark.parametrize(
    ("text", "host", "port"),
    [
        ("9464", "127.0.0.1", 9464),
        ("127.0.0.1:80", "127.0.0.1", 80),
        ("localhost", "localhost", 9464),
        ("[::1]:1", "::1", 1),
        ("[::1]", "::1", 9464),
    ],
)
def test_an_address_may_be_written_short(text: str, host: str, port: int) -> None:
    assert metrics_address(text, is_public=False) == MetricsAddress(host, port)


@pytest.mark.parametrize("text", ["localhost:x", "localhost:", "127.0.0.1:70000"])
def test_an_address_that_cannot_be_is_refused(text: str) -> None:
    with pytest.raises(MosaicError):
        metrics_address(text, is_public=True)


def test_a_word_without_a_port_is_told_as_that() -> None:
    with pytest.raises(MosaicError, match="expected HOST:PORT"):
        metrics_address("nonsense", is_public=False)
    assert metrics_address("rover", is_public=True) == MetricsAddress("rover", 9464)


def test_an_address_that_others_reach_has_to_be_insisted_on() -> None:
    for host in ("0.0.0.0:9464", "[::]:9464", "192.168.1.2:1", "robot.example:1"):
        with pytest.raises(MosaicError, match="could read") as caught:
            metrics_address(host, is_public=False)
        assert "--metrics-public" in caught.value.cure
        assert metrics_address(host, is_public=True).host == host.rpartition(":")[0].strip("[]")
