"""Around every request: known Host names only, bodies of bounded size, security headers, one log line."""

from __future__ import annotations

import asyncio
import logging
import math
import re
import time
from urllib.parse import quote

from starlette.datastructures import Headers, MutableHeaders
from starlette.responses import JSONResponse
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from mosaic_core.words.codes import RESULT_REASONS, ResultCode, reason
from mosaic_server.entrance.request_pace import RequestPace
from mosaic_server.occupancy_map_files import MAX_PGM_BYTES, MAX_YAML_BYTES
from mosaic_server.rest.envelope import failure
from mosaic_server.security.access_tokens import AccessTokenRefused
from mosaic_server.security.address_prefix import counted_address
from mosaic_server.services import Services
from mosaic_server.settings import Settings
from mosaic_server.web.import_map import import_map_sources
from mosaic_server.web.origins import host_name, is_address

MAX_BODY_BYTES = 1024 * 1024
MAX_STRANGERS_BODY_BYTES = 8 * 1024
"""Of whoever isn't signed in: a body is read before its route asks who sends it, and a megabyte of JSON may cost the
event loop a quarter of a second. What belongs into one is a name, an e-mail, a password."""
STRANGERS_ROUTES = ("/api/v1/account/", "/api/v1/pairing", "/api/v1/robots/auth/")
"""Nobody need be signed in for them."""
MAX_MAP_BODY_BYTES = MAX_PGM_BYTES + MAX_YAML_BYTES + 64 * 1024
"""Of the one route that takes files; beside them it carries a name."""
MAP_ROUTE = "/api/v1/occupancy_map"
_access = logging.getLogger("mosaic_server.access")
MOST_WAIT_S = 10.0
"""Whoever would wait longer for a turn is refused: he would have gone meanwhile."""
_HOST = re.compile(r"[A-Za-z0-9.:\[\]_-]+")


class Guards:
    """Plain ASGI, so that sockets pass through untouched."""

    def __init__(self, app: ASGIApp, settings: Settings) -> None:
        self._app = app
        self._settings = settings
        self._import_map = import_map_sources(settings.dashboard_dir)
        self._pace = RequestPace(settings.bounds.requests_per_s, settings.bounds.request_burst)

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        if scope["type"] not in ("http", "websocket"):
            await self._app(scope, receive, send)
            return
        headers = Headers(scope=scope)
        wait_s = self._pace.wait_s(counted_address(_address(scope)), time.monotonic())
        if wait_s > MOST_WAIT_S:
            self._pace.left(counted_address(_address(scope)))
            await _refuse_hasty(scope, receive, send, wait_s)
            return
        if wait_s > 0:
            await asyncio.sleep(wait_s)
        if not self._knows(headers.get("host", "")):
            await self._refuse_host(scope, receive, send)
        elif scope["type"] == "websocket":
            await self._app(scope, receive, send)
        else:
            await self._http(scope, receive, send, headers)

    def _knows(self, host: str) -> bool:
        name, settings = host_name(host), self._settings
        is_literal = settings.pairs_with is not None and is_address(name)
        return not settings.allowed_hosts or name in settings.allowed_hosts or is_literal

    async def _refuse_host(self, scope: Scope, receive: Receive, send: Send) -> None:
        if scope["type"] == "websocket":
            await send({"type": "websocket.close", "code": 1008, "reason": ""})
            return
        message = "this server is not known under that name; add it with --allow-host"
        answer = JSONResponse(failure(ResultCode.ACCESS_DENIED.name, "auth.forbidden", message), status_code=421)
        await answer(scope, receive, send)

    async def _http(self, scope: Scope, receive: Receive, send: Send, headers: Headers) -> None:
        started_s = time.perf_counter()
        status = 500

        async def watched(message: Message) -> None:
            nonlocal status
            if message["type"] == "http.response.start":
                status = message["status"]
                self._secure(MutableHeaders(scope=message), scope["path"], headers.get("host", ""))
            await send(message)

        try:
            most_bytes, refused = _most_body_bytes(scope["path"]), None
            if most_bytes > MAX_STRANGERS_BODY_BYTES and (refused := _refused_token(scope, headers)) is not None:
                most_bytes = MAX_STRANGERS_BODY_BYTES
            if _announced_bytes(headers) <= most_bytes:
                await self._app(scope, _bounded(receive, most_bytes), watched)
            elif refused is not None:
                await _signed_out(scope, receive, watched, refused)
            else:
                await _too_large(scope, receive, watched, most_bytes)
        finally:
            took_ms = (time.perf_counter() - started_s) * 1000
            path = quote(scope["path"])  # never the query string; quoted, a line break can't forge a line of the log
            _access.info("%s %s %d %.1f ms", scope["method"], path, status, took_ms)

    def _secure(self, headers: MutableHeaders, path: str, host: str) -> None:
        headers["X-Content-Type-Options"] = "nosniff"
        headers["X-Frame-Options"] = "DENY"
        headers["Referrer-Policy"] = "no-referrer"
        headers["Cross-Origin-Opener-Policy"] = "same-origin"
        headers["Permissions-Policy"] = "camera=(self), microphone=(self), gamepad=(self), geolocation=(self)"
        headers["Content-Security-Policy"] = content_security_policy(host, self._import_map)
        if self._settings.uses_tls:
            headers["Strict-Transport-Security"] = "max-age=31536000"
        if path.startswith("/api/"):
            headers.setdefault("Cache-Control", "no-store")


def _address(scope: Scope) -> str:
    client = scope.get("client")
    return str(client[0]) if client else ""


def content_security_policy(host: str, import_map: str = "") -> str:
    """Only our own files, and the page's ``import_map``, which browsers read from inside it alone; sockets to this very
    host are named because older browsers don't count them as 'self'."""
    sockets = f" ws://{host} wss://{host}" if _HOST.fullmatch(host) else ""
    return (
        f"default-src 'self'; script-src 'self' 'wasm-unsafe-eval'{import_map}; style-src 'self' 'unsafe-inline'; "
        f"img-src 'self' data: blob:; media-src 'self' blob:; font-src 'self' data:; worker-src 'self' blob:; "
        f"connect-src 'self'{sockets}; object-src 'none'; base-uri 'none'; form-action 'self'; frame-ancestors 'none'"
    )


def _most_body_bytes(path: str) -> int:
    if path.startswith(STRANGERS_ROUTES):
        return MAX_STRANGERS_BODY_BYTES
    return MAX_MAP_BODY_BYTES if path == MAP_ROUTE else MAX_BODY_BYTES


def _refused_token(scope: Scope, headers: Headers) -> ResultCode | None:
    """Why whoever sends this is taken for a stranger; ``None``: there is a token that this server has signed, which is
    all that can be told without the database."""
    scheme, _, token = headers.get("authorization", "").partition(" ")
    services = scope["app"].state.services
    assert isinstance(services, Services)
    try:
        services.access_tokens.read(token if scheme.lower() == "bearer" else None)
    except AccessTokenRefused as error:
        return error.code
    return None


def _announced_bytes(headers: Headers) -> int:
    announced = headers.get("content-length", "")
    return int(announced) if announced.isdecimal() else 0


def _bounded(receive: Receive, most_bytes: int) -> Receive:
    """A body without Content-Length is counted as it comes."""
    seen_bytes = 0

    async def counted() -> Message:
        nonlocal seen_bytes
        message = await receive()
        seen_bytes += len(message.get("body", b""))
        if seen_bytes > most_bytes:
            return {"type": "http.disconnect"}
        return message

    return counted


async def _signed_out(scope: Scope, receive: Receive, send: Send, why: ResultCode) -> None:
    code = "auth.required" if why is ResultCode.AUTHENTICATION_FAILED else RESULT_REASONS[why]
    words = failure(why.name, code, reason(code).sentence)
    answer = JSONResponse(words, status_code=401, headers={"WWW-Authenticate": "Bearer"})
    await answer(scope, receive, send)


async def _too_large(scope: Scope, receive: Receive, send: Send, most_bytes: int) -> None:
    message = f"the body is larger than {most_bytes} bytes"
    answer = JSONResponse(failure(ResultCode.INVALID_FORMAT.name, "signal.too_large", message), status_code=413)
    await answer(scope, receive, send)


async def _refuse_hasty(scope: Scope, receive: Receive, send: Send, wait_s: float) -> None:
    """Too many of its address wait already. A socket is refused in the handshake."""
    message = f"too many requests from this address; try again in {math.ceil(wait_s)} s"
    words = failure(ResultCode.ACCESS_DENIED.name, "rest.bad_request", message, "Ask less often, or wait.")
    answer = JSONResponse(words, status_code=429, headers={"Retry-After": str(math.ceil(wait_s))})
    await answer(scope, receive, send)
