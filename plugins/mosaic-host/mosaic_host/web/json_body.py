"""Asks an HTTP server for JSON, within bounds of size and time. Runs on the event loop."""

from __future__ import annotations

import asyncio
from collections.abc import Mapping
from typing import Any

import httpx

from mosaic_core.words.errors import DeviceGone
from mosaic_core.words.wire_model import parsed_value


class JsonPage:
    """One URL of one server. ``max_bytes``: larger bodies are refused as soon as they are; ``timeout_s`` bounds the
    whole exchange, so that a server that drips a byte a second holds nobody."""

    def __init__(self, url: str, headers: Mapping[str, str], max_bytes: int, timeout_s: float) -> None:
        self._url = httpx.URL(url)
        self._headers = {"accept": "application/json", "accept-encoding": "identity", **headers}
        self._max_bytes = max_bytes
        self._timeout_s = timeout_s
        self.shown = shown_url(self._url)

    def client(self) -> httpx.AsyncClient:
        """A client that follows no redirect, and reads no proxy and no password from the environment."""
        limits = httpx.Limits(max_connections=1, max_keepalive_connections=1)
        return httpx.AsyncClient(follow_redirects=False, trust_env=False, timeout=self._timeout_s, limits=limits)

    async def ask(self, client: httpx.AsyncClient) -> Any:
        """The JSON value. Raises :class:`DeviceGone` when the server is away or answers with an error, and
        :class:`ValueError` for a body that can't be used."""
        try:
            async with asyncio.timeout(self._timeout_s):
                body = await self._body(client)
        except TimeoutError:
            raise DeviceGone(f"{self.shown}: no whole answer within {self._timeout_s:g} s") from None
        except httpx.HTTPError as error:
            why = str(error) or type(error).__name__
            raise DeviceGone(f"{self.shown}: {why}", "is the server running, and its port right?") from error
        return await asyncio.to_thread(parsed_value, body)

    async def _body(self, client: httpx.AsyncClient) -> bytes:
        client.cookies.clear()  # each question is the first one: what a server wants remembered is not
        async with client.stream("GET", self._url, headers=self._headers) as response:
            self._check(response)
            body = bytearray()
            async for piece in response.aiter_raw():
                body += piece
                if len(body) > self._max_bytes:
                    raise ValueError(f"larger than max_bytes ({self._max_bytes})")
        return bytes(body)

    def _check(self, response: httpx.Response) -> None:
        status = f"{self.shown}: answered {response.status_code} {response.reason_phrase[:64]}"
        if response.is_redirect:
            raise DeviceGone(status, "redirects are not followed; write the address where it is")
        if response.status_code != httpx.codes.OK:
            cure = "give it the right `headers`" if response.status_code in (401, 403) else ""
            raise DeviceGone(status, cure)
        if response.headers.get("content-encoding", "identity") != "identity":
            raise ValueError("the body is compressed, which was not asked for")


def shown_url(url: httpx.URL) -> str:
    """The address without what may be a secret: user, password and query."""
    return str(url.copy_with(userinfo=b"", query=None, fragment=None))
