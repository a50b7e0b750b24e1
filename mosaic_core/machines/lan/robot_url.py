"""Writes and reads the addresses of robots' own servers."""

from __future__ import annotations

import re
from ipaddress import ip_address
from urllib.parse import urlsplit

from mosaic_core.words.errors import SignalingError
from mosaic_core.words.lan_wish import DEFAULT_PORT

_USUAL_PORTS = {"http": 80, "ws": 80, "https": 443, "wss": 443}
_HOST_AND_PORT = re.compile(r"(?P<host>\[[0-9A-Fa-f:.]+\]|[\w.-]+)(?::(?P<port>\d{1,5}))?")


def url_of(scheme: str, host: str, port: int) -> str:
    """A browser's address, without the port where it is the usual one."""
    literal = f"[{host}]" if ":" in host else host
    return f"{scheme}://{literal}" if port == _USUAL_PORTS[scheme] else f"{scheme}://{literal}:{port}"


def robot_url(text: str) -> str | None:
    """The address that ``text`` is, as :func:`url_of` writes it; ``None`` for a robot's name.

    Without a scheme it is http, without a port that of ``mosaic run --serve``. Raises :class:`SignalingError` for a URL
    that leads to no robot.
    """
    if "://" in text:
        return _checked(text)
    if text.count(":") > 1 and not text.startswith("["):
        return url_of("http", text, DEFAULT_PORT) if _is_ip(text) else None
    match = _HOST_AND_PORT.fullmatch(text)
    if match is None:
        return None
    host, port = match["host"].strip("[]"), match["port"]
    if port is None and not (_is_ip(host) or host.lower() == "localhost" or host.lower().endswith(".local")):
        return None
    return url_of("http", host, int(port or DEFAULT_PORT)) if int(port or DEFAULT_PORT) < 65536 else None


def _checked(url: str) -> str:
    try:
        parts = urlsplit(url)
        port = parts.port
    except ValueError:
        raise _no_robot(url) from None
    is_whole = parts.scheme in ("http", "https") and parts.hostname and "@" not in parts.netloc
    if not is_whole or parts.path not in ("", "/") or parts.query or parts.fragment:
        raise _no_robot(url)
    return url_of(parts.scheme, parts.hostname or "", port or _USUAL_PORTS[parts.scheme])


def _no_robot(url: str) -> SignalingError:
    """The URL is not repeated: a scanned one carries the code that pairs."""
    kind = url.partition("://")[0][:20]
    message = f"this {kind}:// URL is no robot's address"
    return SignalingError(
        message, code="lan.not_found", cure="Write http://HOST:PORT or https://HOST:PORT, and no more."
    )


def _is_ip(text: str) -> bool:
    try:
        ip_address(text)
    except ValueError:
        return False
    return True
