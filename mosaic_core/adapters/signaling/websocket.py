"""The signaling socket over ``websockets``: verified TLS, no compression, any address of the server that answers, and
errors that say what is wrong.
"""

from __future__ import annotations

import asyncio
import socket
import ssl
from collections.abc import AsyncIterator
from pathlib import Path
from typing import Literal
from urllib.parse import urlsplit

from aiohappyeyeballs import start_connection
from websockets.asyncio.client import ClientConnection, connect
from websockets.exceptions import (
    ConnectionClosed,
    InvalidHandshake,
    InvalidProxy,
    InvalidStatus,
    InvalidURI,
    WebSocketException,
)
from websockets.proxy import get_proxy
from websockets.uri import parse_uri

from mosaic_core.adapters.signaling.name_lookup import addresses_of
from mosaic_core.adapters.signaling.pinned_tls import pinned_tls
from mosaic_core.machines.peers.home_address import is_loopback_name
from mosaic_core.words.errors import SignalingError
from mosaic_core.words.signaling import SIZE_AFTER_AUTHORIZATION

OPEN_TIMEOUT_S = 10.0
NEXT_ADDRESS_AFTER_S = 0.25
"""RFC 8305 §5: IPv6 may be there and lead nowhere."""
PING_PERIOD_S = 5.0
PING_TIMEOUT_S = 10.0
"""A dead connection is noticed within 15 s, the same as on the server's side."""


class WebSocket:
    """Wraps a WebSocket to a server; a ``TextSocket``."""

    def __init__(self, connection: ClientConnection) -> None:
        self._connection = connection

    async def __aiter__(self) -> AsyncIterator[str]:
        """Text frames until the socket closes; binary ones mean nothing here and are passed over."""
        try:
            async for frame in self._connection:
                if isinstance(frame, str):
                    yield frame
        except ConnectionClosed:
            return

    async def send(self, text: str) -> None:
        """Send one frame; raises :class:`SignalingError` when the socket is closed."""
        try:
            await self._connection.send(text)
        except ConnectionClosed as closed:
            raise SignalingError("The connection to the server is closed.", code="signal.unreachable") from closed

    async def close(self, code: int = 1000, reason: str = "") -> None:
        """The closing handshake; whoever has no more patience for it and cancels it leaves nothing open."""
        try:
            await self._connection.close(code, reason[:120])
        finally:
            self._connection.transport.abort()

    @property
    def close_code(self) -> int | None:
        return self._connection.close_code


async def open_websocket(url: str, *, certificate: Path | str | None = None) -> WebSocket:
    """A ``SocketConnector``; raises :class:`SignalingError` (``signal.unreachable``) naming the cause.

    With ``certificate`` (a PEM file, or PEM text) the server must present that very one, whatever name it is for.
    """
    sock: socket.socket | None = None
    try:
        async with asyncio.timeout(OPEN_TIMEOUT_S):
            sock = await _connected(url)
            return WebSocket(
                await connect(
                    url,
                    compression=None,
                    max_size=SIZE_AFTER_AUTHORIZATION,
                    open_timeout=None,
                    ping_interval=PING_PERIOD_S,
                    ping_timeout=PING_TIMEOUT_S,
                    close_timeout=1.0,
                    sock=sock,
                    ssl=_tls(url, certificate),
                )
            )
    except (OSError, WebSocketException, ValueError) as error:
        if sock is not None:
            sock.close()
        message, cure = _cause(url, error)
        raise SignalingError(message, code="signal.unreachable", cure=cure) from error


async def _connected(url: str) -> socket.socket | None:
    """A TCP connection to the first address of the server that answers; ``None`` where the way leads over a proxy."""
    uri = parse_uri(url)
    if not is_loopback_name(uri.host) and get_proxy(uri) is not None:
        return None
    tried = [
        (socket.AF_INET6, (address, uri.port, 0, 0)) if ":" in address else (socket.AF_INET, (address, uri.port))
        for address in await addresses_of(uri.host)
    ]
    infos = [(family, socket.SOCK_STREAM, socket.IPPROTO_TCP, "", address) for family, address in tried]
    return await start_connection(infos, happy_eyeballs_delay=NEXT_ADDRESS_AFTER_S)


def _tls(url: str, certificate: Path | str | None) -> ssl.SSLContext | Literal[True] | None:
    if not url.startswith("wss:"):
        return None
    return True if certificate is None else pinned_tls(certificate)


def _cause(url: str, error: Exception) -> tuple[str, str | None]:
    """The cause in words and its cure, most specific first."""
    host, port = urlsplit(url).hostname or url, _port(url)
    if isinstance(error, socket.gaierror):
        return f"The name {host!r} can't be resolved.", "Check `server.ws_url` and the DNS of this machine."
    if isinstance(error, ConnectionRefusedError):
        return f"Nothing answers at {host}:{port}.", "Is the server running, and is the port right?"
    if isinstance(error, ssl.SSLCertVerificationError):
        message = f"The certificate of {host} can't be verified: {error.verify_message}."
        return message, "Use a certificate for this name from an authority that this machine trusts."
    if isinstance(error, ssl.SSLError):
        return f"{host}:{port} does not speak TLS as expected ({error.reason or error}).", "Should the URL be ws://?"
    if isinstance(error, ConnectionError):
        cure = "Should the URL be ws:// (no TLS)?" if url.startswith("wss:") else None
        return f"{host}:{port} hung up before the connection was made.", cure
    if isinstance(error, InvalidStatus):
        status = error.response.status_code
        return f"{host}:{port} answered with HTTP status {status} instead of a WebSocket.", None
    if isinstance(error, TimeoutError):
        return f"{host}:{port} did not answer within {OPEN_TIMEOUT_S:.0f} s.", None
    if isinstance(error, ValueError) and "redirect" in str(error):
        return f"{host}:{port} sends on to another address: {error}.", "Name that address in `server.ws_url`."
    if isinstance(error, InvalidURI):
        return f"{url!r} is no WebSocket URL.", "Write ws://host:port or wss://host."
    if isinstance(error, InvalidProxy):
        return f"The proxy of this machine's environment can't be used: {error}.", "Check HTTPS_PROXY and NO_PROXY."
    if isinstance(error, InvalidHandshake):
        return f"What answers at {host}:{port} is no WebSocket server ({error}).", None
    return f"{host}:{port} can't be reached: {error or type(error).__name__}.", None


def _port(url: str) -> int:
    parts = urlsplit(url)
    try:
        return parts.port or (443 if parts.scheme == "wss" else 80)
    except ValueError:
        return 0
