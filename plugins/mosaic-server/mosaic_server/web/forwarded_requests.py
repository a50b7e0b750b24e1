"""Gives every request the address that named proxies say it comes from, before anything is counted by address."""

from __future__ import annotations

import logging

from starlette.types import ASGIApp, Receive, Scope, Send

from mosaic_server.entrance.forwarded import ProxyHeader, request_source
from mosaic_server.entrance.proxies import TrustedProxies
from mosaic_server.settings import Settings

_log = logging.getLogger(__name__)
_SOCKET_SCHEMES = {"http": "ws", "https": "wss"}


class ForwardedRequests:
    """Reads one header, the one that the settings name, and never the other: a proxy that writes one of them passes on
    what a stranger writes into the other. Plain ASGI."""

    def __init__(self, app: ASGIApp, settings: Settings) -> None:
        self._app = app
        self._header = settings.proxy_header
        self._proxies = TrustedProxies(settings.trusted_proxies)
        self._has_proxies = bool(settings.trusted_proxies)
        self._is_told = False

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        peer = str(scope["client"][0]) if scope.get("client") else ""
        if scope["type"] in ("http", "websocket") and peer in self._proxies:
            self._rewrite(scope, peer)
        elif scope["type"] in ("http", "websocket") and not self._has_proxies:
            self._note(scope, peer)
        await self._app(scope, receive, send)

    def _rewrite(self, scope: Scope, peer: str) -> None:
        said = _said(scope, self._header)
        if said is None:
            self._note(scope, peer)
        found = request_source(self._header, said or "", peer, self._proxies)
        scope["client"] = (found.address, 0)
        scheme = found.scheme
        if self._header is ProxyHeader.X_FORWARDED_FOR:
            scheme = (_said(scope, "x-forwarded-proto") or "").rpartition(",")[2].strip().lower()
        if scheme in _SOCKET_SCHEMES:
            scope["scheme"] = _SOCKET_SCHEMES[scheme] if scope["type"] == "websocket" else scheme

    def _note(self, scope: Scope, peer: str) -> None:
        """Once: where a proxy isn't named, or its header isn't, all behind it share its address and bounds."""
        header = next((one for one in ProxyHeader if _said(scope, one) is not None), None)
        if header is None or self._is_told:
            return
        self._is_told = True
        cure = [] if peer in self._proxies else [f"--trusted-proxy {peer}"]
        cure += [] if header is self._header else [f"--proxy-header {header}"]
        _log.warning(
            "a request from %s carries %s, which is ignored: if that is what your proxy writes, name it with %s, or "
            "all who come through it are counted as one",
            peer,
            _SHOWN[header],
            " ".join(cure),
        )


_SHOWN = {ProxyHeader.X_FORWARDED_FOR: "X-Forwarded-For", ProxyHeader.FORWARDED: "Forwarded"}


def _said(scope: Scope, header: str) -> str | None:
    """Lines of one header are one list (RFC 9110, section 5.3)."""
    name = header.encode()
    lines = [value.decode("latin-1") for key, value in scope["headers"] if key == name]
    return ",".join(lines) if lines else None
