"""The server's REST routes that an operator uses, with errors in words instead of status codes."""

from __future__ import annotations

import asyncio
import ssl
from typing import Any
from urllib.parse import urlsplit

import httpx
from pydantic import ConfigDict, TypeAdapter, ValidationError

from mosaic_core.adapters.signaling.pinned_tls import pinned_tls
from mosaic_core.machines.peers.home_address import is_loopback_name
from mosaic_core.runtime.timing.background_tasks import BackgroundTasks
from mosaic_core.words.catalogue import Catalogue
from mosaic_core.words.codes import RESULT_REASONS, ResultCode, reason
from mosaic_core.words.described import DescribedConnector, read_connector_config
from mosaic_core.words.errors import AuthError, MosaicError, SignalingError
from mosaic_core.words.ice import IceServer
from mosaic_core.words.signaling import RobotStatus
from mosaic_core.words.wire_model import WireModel

TIMEOUT_S = 10.0
PAGE = 100


class RobotSummary(WireModel):
    """A robot as the server lists it."""

    model_config = ConfigDict(**{**WireModel.model_config, "extra": "ignore"})

    id: str
    name: str
    description: str | None = None
    status: RobotStatus = RobotStatus.DISCONNECTED

    @property
    def is_online(self) -> bool:
        """Whether the robot is connected to the server."""
        return self.status is not RobotStatus.DISCONNECTED


class NewConnection(WireModel):
    """The connection that the server made for one robot, with its ids. An original server knows no ``session_id``."""

    robot_id: str
    rtc_session_id: str
    session_id: str | None = None


_ICE_SERVERS = TypeAdapter(list[IceServer])


class RestApi:
    """Calls the server's REST API for one signed-in account. Raises :class:`AuthError` or :class:`SignalingError`;
    close it at the end. ``certificate``: the only one to trust, as PEM; empty: those that an authority vouches for."""

    def __init__(
        self,
        base_url: str,
        access_token: str,
        transport: httpx.AsyncBaseTransport | None = None,
        certificate: str = "",
    ) -> None:
        self._base_url = base_url
        self._certificate = certificate
        self._transport = transport
        self._headers = {"Authorization": f"Bearer {access_token}"}
        self._client = rest_client(base_url, transport, self._headers, certificate)
        self._leaving = BackgroundTasks()

    def renew(self) -> None:
        """The network is another one: connections that were kept may be dead without knowing it. Event loop."""
        if self._transport is not None:
            return
        self._leaving.start(self._client.aclose())
        self._client = rest_client(self._base_url, None, self._headers, self._certificate)

    async def robots(self) -> list[RobotSummary]:
        """All robots of this account's organization."""
        found: list[RobotSummary] = []
        while True:
            query = {"skip": len(found), "limit": PAGE}
            page = await _call(self._client, "GET", "/api/v1/robots", params=query)
            rows = page["data"]
            found += [RobotSummary.model_validate(row) for row in rows]
            if not rows or len(found) >= page["count"]:
                return found

    async def catalogue(self, robot_id: str) -> Catalogue | None:
        """The robot's short catalogue, or ``None`` where robot or server know no such thing."""
        try:
            data = await _call(self._client, "GET", f"/api/v1/robots/{robot_id}/catalogue")
        except SignalingError:
            return None
        return None if data is None else Catalogue.model_validate(data)

    async def described(self, robot_id: str) -> tuple[DescribedConnector, ...]:
        """What people wrote down of the robot's connectors (its ``connectorConfig``); nothing where the server keeps
        no such thing."""
        try:
            data = await _call(self._client, "GET", f"/api/v1/robots/{robot_id}")
        except MosaicError:  # who may not connect hears of it when they try
            return ()
        config = data.get("connectorConfig") if isinstance(data, dict) else None
        return read_connector_config(config if isinstance(config, str) else None)

    async def ice_servers(self) -> list[IceServer]:
        """What the server hands out; entries that we can't use are an error that names them."""
        data = await _call(self._client, "GET", "/api/v1/webrtc/ice-servers")
        try:
            return _ICE_SERVERS.validate_python(data or [])
        except ValidationError as error:
            message = f"The server's ICE servers can't be used: {error.errors()[0]['msg']}"
            raise SignalingError(message, code="signal.bad_message") from error

    async def create_connection(self, robot_id: str, session_id: str | None = None) -> NewConnection:
        """Ask for a connection to one robot; ``session_id`` continues a session of before."""
        body: dict[str, Any] = {"robotIds": [robot_id]}
        if session_id is not None:
            body["sessionId"] = session_id
        data = await _call(self._client, "POST", "/api/v1/webrtc/connection", json=body)
        return NewConnection.model_validate(data["sessions"][0])

    async def close(self) -> None:
        await asyncio.gather(self._client.aclose(), self._leaving.done(), return_exceptions=True)


async def log_in(
    base_url: str, route: str, body: dict[str, str], transport: httpx.AsyncBaseTransport | None = None
) -> str:
    """An access token for ``body``'s credentials; raises :class:`AuthError`."""
    async with rest_client(base_url, transport, {}) as client:
        try:
            data = await _call(client, "POST", route, json=body)
        except SignalingError as error:
            if error.code == "signal.unreachable":
                raise
            raise AuthError(error.message, code="auth.failed") from error
        return str(data["accessToken"])


def rest_client(
    base_url: str, transport: httpx.AsyncBaseTransport | None, headers: dict[str, str], certificate: str = ""
) -> httpx.AsyncClient:
    is_local = is_loopback_name(urlsplit(base_url).hostname or "")  # no proxy reaches our loopback
    return httpx.AsyncClient(
        base_url=base_url,
        headers=headers,
        timeout=TIMEOUT_S,
        transport=transport,
        trust_env=not is_local,
        verify=_trusted(base_url, certificate),
    )


def _trusted(base_url: str, certificate: str) -> ssl.SSLContext | bool:
    """Whom to trust. Without TLS nobody: to read all authorities takes the event loop 20 ms."""
    if certificate:
        return pinned_tls(certificate)
    return urlsplit(base_url).scheme == "https" or ssl.SSLContext(ssl.PROTOCOL_TLS_CLIENT)


async def _call(client: httpx.AsyncClient, method: str, path: str, **kwargs: Any) -> Any:
    """The result's data, out of the envelope where there is one."""
    try:
        response = await client.request(method, path, **kwargs)
    except (httpx.TransportError, httpx.InvalidURL) as error:
        why = str(error) or type(error).__name__
        raise SignalingError(
            f"The server {client.base_url} can't be reached: {why}", code="signal.unreachable", cure="Check the URL."
        ) from error
    try:
        content = response.json()
    except ValueError:
        content = None
    is_envelope = isinstance(content, dict) and "resultCode" in content
    if response.is_success and (not is_envelope or content["resultCode"] == ResultCode.SUCCESS):
        return content["resultData"] if is_envelope else content
    raise refused(path, response.status_code, content if isinstance(content, dict) else {})


def refused(path: str, status: int, content: dict[str, Any]) -> MosaicError:
    """The error that a refusing answer means: in the server's words, where it has any."""
    code = content.get("code") or _code_of(content.get("resultCode"), status)
    try:
        entry = reason(str(code))
    except KeyError:
        entry = reason("signal.bad_message")
    message = str(content.get("message") or f"{entry.sentence} ({path}: HTTP {status})")
    if entry.code.startswith("auth."):
        return AuthError(message, code=entry.code, cure=content.get("cure") or entry.cure)
    return SignalingError(message, code=entry.code, cure=content.get("cure") or entry.cure)


def _code_of(result: Any, status: int) -> str:
    """Original servers put the name of the code into errors and its number into successes."""
    known = ResultCode.__members__.get(str(result)) or next((code for code in ResultCode if code == result), None)
    if known in RESULT_REASONS:
        return RESULT_REASONS[known]
    return {401: "auth.failed", 403: "auth.forbidden", 404: "signal.unknown_connection"}.get(
        status, "signal.bad_message"
    )
