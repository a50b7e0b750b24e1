"""The way to the server, step by step, each with its own finding; what depends on a failed step is not tried.

The robot's token is checked by a request that registers nothing: on the socket the newest connection wins, and a
diagnosis must not put a running robot off.
"""

from __future__ import annotations

import asyncio
import time
from collections.abc import AsyncIterator
from dataclasses import dataclass
from email.utils import parsedate_to_datetime
from typing import Any
from urllib.parse import urlsplit
from urllib.request import getproxies, proxy_bypass

import httpx
from pydantic import TypeAdapter, ValidationError

from mosaic_core import __version__
from mosaic_core.adapters.diagnosis.server_probe import reached, resolved, secured
from mosaic_core.adapters.signaling.websocket import open_websocket
from mosaic_core.doctor.issued_ice_servers import NO_ROBOT, NOT_ASKED, Issued, IssuedIceServers
from mosaic_core.machines.timing.clock_skew import clock_skew
from mosaic_core.words.config import AuthConfig
from mosaic_core.words.errors import SignalingError, WireError
from mosaic_core.words.finding import Finding, failed, passed, skipped, warned
from mosaic_core.words.ice import IceServer
from mosaic_core.words.signaling import AuthorizeRequest, parse_signaling

HTTP_TIMEOUT_S = 4.0
SOCKET_TIMEOUT_S = 5.0
WARN_DAYS = 14.0
"""Public authorities renew 30 days before a certificate ends; two weeks later something is broken."""
_ICE_SERVERS = TypeAdapter(list[IceServer])


@dataclass(frozen=True, slots=True)
class ServerAddress:
    """The address of the server, by its WebSocket URL."""

    ws_url: str

    @property
    def host(self) -> str:
        return urlsplit(self.ws_url).hostname or ""

    @property
    def is_secure(self) -> bool:
        return self.ws_url.startswith("wss:")

    @property
    def port(self) -> int:
        return urlsplit(self.ws_url).port or (443 if self.is_secure else 80)

    @property
    def http_url(self) -> str:
        return self.ws_url.replace("ws", "http", 1).rstrip("/")

    @property
    def goes_through_proxy(self) -> bool:
        """The environment names one; then name, TCP and TLS are the proxy's business."""
        return bool(getproxies().get("https" if self.is_secure else "http")) and not proxy_bypass(self.host)


async def server_checks(
    address: ServerAddress, auth: AuthConfig | None, issued: IssuedIceServers
) -> AsyncIterator[Finding]:
    """All steps; ``issued`` is settled in any case."""
    try:
        can_go_on = True
        async for finding in _way(address):
            can_go_on = can_go_on and finding.status != "fail"
            yield finding
        if not can_go_on:
            return
        async for finding in _service(address, auth, issued):
            yield finding
    finally:
        issued.settle(NOT_ASKED)


async def _way(address: ServerAddress) -> AsyncIterator[Finding]:
    host, port = address.host, address.port
    if address.goes_through_proxy:
        yield skipped("server.tcp", "A proxy of this machine's environment stands between: its answers follow.")
        return
    try:
        found = await resolved(host)
        yield passed("server.dns", f"{host} is {found}." if found != host else f"{host} is an address.", address=found)
        took_ms = await reached(host, port)
        yield passed("server.tcp", f"{host}:{port} is reached in {took_ms:.0f} ms.", ms=round(took_ms, 1))
        if address.is_secure:
            certificate = await secured(host, port)
            yield _term((certificate.not_after_s - time.time()) / 86400, certificate.issuer)
    except SignalingError as error:
        step = {"signal.name_unknown": "dns", "signal.tls": "tls"}.get(error.code, "tcp")
        yield failed(f"server.{step}", error.code, error.message, error.cure)


def _term(days: float, issuer: str) -> Finding:
    text = f"The certificate (by {issuer}) is valid for {days:.0f} more days."
    facts = {"days": round(days, 1), "issuer": issuer}
    if days < WARN_DAYS:
        return warned("server.tls", "signal.certificate_ends", text, facts=facts)
    return passed("server.tls", text, **facts)


async def _service(address: ServerAddress, auth: AuthConfig | None, issued: IssuedIceServers) -> AsyncIterator[Finding]:
    trust_env = address.goes_through_proxy
    async with httpx.AsyncClient(base_url=address.http_url, timeout=HTTP_TIMEOUT_S, trust_env=trust_env) as client:
        introduced, socket = await _introduction(client), await _socket(address)
        kind = introduced[0] if introduced else _unversioned(client, socket)
        yield kind
        for finding in introduced[1:]:
            yield finding
        if not introduced and kind.status == "fail":
            return  # somebody else's server
        yield socket
        if auth is None:
            issued.settle(NO_ROBOT)
            yield skipped("server.token", "No robot's configuration was given.", "Name its YAML file.")
        elif "version" in kind.facts:
            async for finding in _token(client, auth, issued):
                yield finding
        elif kind.code == "signal.original_server":
            issued.settle(Issued())  # to robots it hands out none


async def _introduction(client: httpx.AsyncClient) -> list[Finding]:
    """What the server says of itself, and of the time; empty: something answers that says nothing of itself."""
    asked_at_s = time.time()
    try:
        response = await client.get("/api/v1/server")
    except httpx.HTTPError as error:
        why = str(error) or type(error).__name__
        return [failed("server.http", "signal.not_mosaic", f"{client.base_url} does not answer HTTP: {why}.")]
    answered_at_s = time.time()
    kind, skew = _version(client, response), _skew(response, asked_at_s, answered_at_s)
    return [] if kind is None else [kind, *([] if skew is None else [skew])]


def _unversioned(client: httpx.AsyncClient, socket: Finding) -> Finding:
    """Original servers do not introduce themselves, but greet."""
    if socket.status == "ok":
        return warned("server.http", "signal.original_server")
    text = f"What answers at {client.base_url} is no MOSAIC server: it has neither /api/v1/server nor /ws/robot."
    return failed("server.http", "signal.not_mosaic", text)


def _version(client: httpx.AsyncClient, response: httpx.Response) -> Finding | None:
    told = _data(response)
    if "version" not in told:
        if response.status_code == 404 or response.is_success:
            return None
        text = f"{client.base_url} answers with HTTP status {response.status_code}."
        return failed("server.http", "signal.not_mosaic", text)
    version, extensions = str(told["version"]), sorted(told.get("extensions") or {})
    facts = {"version": version, "extensions": extensions}
    shown = f"{told.get('name', 'server')} {version}"
    if version.split(".")[:2] != __version__.split(".")[:2]:
        text = f"The server is {shown}, this is mosaic-core {__version__}."
        return warned("server.http", "check.version_mismatch", text, "Update the older one.", facts)
    return passed("server.http", f"{shown} answers; extensions: {', '.join(extensions)}.", **facts)


def _content(response: httpx.Response) -> dict[str, Any]:
    """Empty where it is no JSON object."""
    try:
        content = response.json()
    except ValueError:
        return {}
    return content if isinstance(content, dict) else {}


def _data(response: httpx.Response) -> dict[str, Any]:
    content = _content(response)
    data = content.get("resultData", content)
    return data if isinstance(data, dict) else {}


def _skew(response: httpx.Response, asked_at_s: float, answered_at_s: float) -> Finding | None:
    try:
        date_s = parsedate_to_datetime(response.headers["Date"]).timestamp()
    except (KeyError, ValueError, TypeError):
        return None
    skew = clock_skew(asked_at_s, answered_at_s, date_s)
    facts = {"aheadS": round(skew.ahead_s, 1)}
    if skew.breaks_tickets:
        text = f"{skew.sentence} The operators' tickets look expired, or from the future: nobody can connect."
        return failed("server.clock", "signal.clock_skew", text, facts=facts)
    if skew.is_noticeable:
        return warned("server.clock", "signal.clock_skew", skew.sentence, facts=facts)
    return passed("server.clock", skew.sentence, **facts)


async def _socket(address: ServerAddress) -> Finding:
    """Up to the server's first word; leaving before one's own is no connection of any robot."""
    began_s = time.monotonic()
    try:
        async with asyncio.timeout(SOCKET_TIMEOUT_S):
            socket = await open_websocket(f"{address.ws_url.rstrip('/')}/ws/robot")
            try:
                async for text in socket:
                    if isinstance(parse_signaling(text), AuthorizeRequest):
                        took_ms = (time.monotonic() - began_s) * 1000
                        return passed("server.websocket", f"The WebSocket greets after {took_ms:.0f} ms.")
            finally:
                await socket.close()
    except SignalingError as error:
        return failed("server.websocket", "signal.no_websocket", error.message)
    except (TimeoutError, WireError):
        pass
    return failed("server.websocket", "signal.no_websocket", "What answers on /ws/robot does not greet as a server.")


async def _token(client: httpx.AsyncClient, auth: AuthConfig, issued: IssuedIceServers) -> AsyncIterator[Finding]:
    token = auth.params.token.get_secret_value() if auth.params.token else None
    body = {"robotId": str(auth.robot_id), **({} if token is None else {"token": token})}
    try:
        response = await client.post("/api/v1/robots/auth/check", json=body)
    except httpx.HTTPError as error:
        yield failed("server.token", "signal.unreachable", f"The token could not be checked: {error}.")
        return
    told = _data(response)
    if response.is_success and "name" in told:
        state = "connected at this moment" if told.get("isOnline") else "not connected at this moment"
        text = f"The server takes this robot: {told['name']}, {state}."
        yield passed("server.token", text, isOnline=bool(told.get("isOnline")))
        yield _ice_servers(told.get("iceServers"), issued)
    else:
        yield _refused(response, str(auth.robot_id))


def _refused(response: httpx.Response, robot_id: str) -> Finding:
    code = _content(response).get("code")
    if response.status_code == 429:
        return skipped("server.token", "The server takes no more attempts from this address for a while.")
    if code in ("auth.unknown_robot", "auth.failed", "auth.forbidden"):
        return failed("server.token", str(code), facts={"robotId": robot_id})
    return skipped("server.token", "This server can't check a token without registering the robot.")


def _ice_servers(told: object, issued: IssuedIceServers) -> Finding:
    try:
        servers = _ICE_SERVERS.validate_python(told or [])
    except ValidationError as error:
        return failed("server.ice_servers", "signal.bad_message", f"Its ICE servers: {error.errors()[0]['msg']}.")
    issued.settle(Issued(tuple(servers)))
    urls = [url for server in servers for url in server.urls]
    return passed("server.ice_servers", f"It hands out {len(urls)} STUN and TURN addresses.", urls=urls)
