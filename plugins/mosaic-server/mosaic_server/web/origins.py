"""Which pages may open a socket: ours, those that were named, and everything that is no browser.

A browser always sends Origin with a WebSocket; robots and Python programs send none.
"""

from __future__ import annotations

import ipaddress
from collections.abc import Collection, Mapping
from urllib.parse import urlsplit


def origin_is_allowed(headers: Mapping[str, str], allowed: Collection[str]) -> bool:
    origin = headers.get("origin")
    if origin is None:
        return True
    if origin.rstrip("/") in allowed:
        return True
    try:
        return urlsplit(origin).netloc.lower() == headers.get("host", "").lower() != ""
    except ValueError:
        return False


def origin_in(text: str) -> str:
    """The origin of a page as browsers send it (``https://host:port``); raises ``ValueError`` for what is none."""
    parts = urlsplit(text.strip())
    if parts.scheme not in ("http", "https") or not parts.hostname or parts.username is not None:
        raise ValueError(f"{text!r} is no origin: write http://HOST:PORT or https://HOST")
    name = f"[{parts.hostname}]" if ":" in parts.hostname else parts.hostname
    default = {"http": 80, "https": 443}[parts.scheme]
    origin = f"{parts.scheme}://{name}" + (f":{parts.port}" if parts.port not in (None, default) else "")
    if parts.path not in ("", "/") or parts.query or parts.fragment:
        raise ValueError(f"{text!r} is a page, and an origin has no path: write {origin}")
    return origin


def host_name(host_header: str) -> str:
    """The name without port: ``[::1]:9001`` → ``::1``. Empty for nonsense."""
    try:
        return urlsplit(f"//{host_header}").hostname or ""
    except ValueError:
        return ""


def is_address(name: str) -> bool:
    """Whether a host name is an IP address written out."""
    try:
        ipaddress.ip_address(name)
    except ValueError:
        return False
    return True
