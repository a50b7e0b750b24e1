"""Serves the metrics over HTTP: one page, read only, a short answer to anything else."""

from __future__ import annotations

import asyncio
import contextlib
from collections.abc import Callable
from http import HTTPStatus

from mosaic_core.machines.peers.home_address import is_loopback
from mosaic_core.runtime.observation.metrics_text import CONTENT_TYPE
from mosaic_core.words.errors import MosaicError

_MAX_HEAD_BYTES = 8 * 1024
_PATIENCE_S = 5.0
_MAX_READERS = 16


class MetricsServer:
    """Serves the metrics over HTTP. ``page`` makes the text when somebody asks; it is called on the event loop."""

    def __init__(self, host: str, port: int, page: Callable[[], str]) -> None:
        self._host = host
        self._port = port
        self._page = page
        self._readers = 0
        self._server: asyncio.Server | None = None

    @property
    def url(self) -> str:
        """Where the page is; with port 0 known once it is open."""
        port = self._server.sockets[0].getsockname()[1] if self._server and self._server.sockets else self._port
        return f"http://{f'[{self._host}]' if ':' in self._host else self._host}:{port}/metrics"

    async def open(self) -> None:
        """Listen. Raises :class:`MosaicError` (``config.metrics``) where that is impossible."""
        try:
            self._server = await asyncio.start_server(self._serve, self._host, self._port, limit=_MAX_HEAD_BYTES)
        except OSError as error:
            message = f"the metrics can't be served on {self._host}, port {self._port}: {error.strerror or error}"
            raise MosaicError(message, code="config.metrics", cure="choose another address or port") from error

    def close(self) -> None:
        if self._server is not None:
            self._server.close()

    async def _serve(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        self._readers += 1
        try:
            async with asyncio.timeout(_PATIENCE_S):
                status, body = await self._answer(reader)
                writer.write(_response(status, body))
                await writer.drain()
        except (TimeoutError, OSError):
            pass  # whoever asked is gone, or never asked
        finally:
            self._readers -= 1
            with contextlib.suppress(OSError):
                writer.close()

    async def _answer(self, reader: asyncio.StreamReader) -> tuple[HTTPStatus, str]:
        if self._readers > _MAX_READERS:
            return HTTPStatus.SERVICE_UNAVAILABLE, ""
        try:
            head = (await reader.readuntil(b"\r\n\r\n")).decode("latin-1")
        except (asyncio.IncompleteReadError, asyncio.LimitOverrunError):
            return HTTPStatus.BAD_REQUEST, ""
        first, *fields = head.split("\r\n")
        words = first.split(" ")
        if len(words) != 3 or not words[2].startswith("HTTP/1."):
            return HTTPStatus.BAD_REQUEST, ""
        if not self._is_meant(fields):
            return HTTPStatus.MISDIRECTED_REQUEST, ""
        if words[0] != "GET":
            return HTTPStatus.METHOD_NOT_ALLOWED, ""
        if words[1].split("?")[0] != "/metrics":
            return HTTPStatus.NOT_FOUND, "the metrics are at /metrics\n"
        return HTTPStatus.OK, self._page()

    def _is_meant(self, fields: list[str]) -> bool:
        """A page of some web site, whose name was made to lead here, shall not read what only this machine may."""
        if not is_loopback(self._host):
            return True
        hosts = [
            value.strip() for name, _, value in (field.partition(":") for field in fields) if name.lower() == "host"
        ]
        return all(is_loopback(_without_port(host)) for host in hosts)


def _without_port(host: str) -> str:
    if host.startswith("["):
        return host[1:].partition("]")[0]
    return host.partition(":")[0]


def _response(status: HTTPStatus, body: str) -> bytes:
    content = body.encode()
    lines = (
        f"HTTP/1.1 {status.value} {status.phrase}",
        f"Content-Type: {CONTENT_TYPE}",
        f"Content-Length: {len(content)}",
        "Cache-Control: no-store",
        "X-Content-Type-Options: nosniff",
        "Connection: close",
    )
    return "\r\n".join((*lines, "", "")).encode() + content
