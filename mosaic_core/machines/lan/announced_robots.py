"""Reads what robots announce on their network, and picks the one that is meant.

Everybody on a network can announce anything: what is read here is bounded in number and size, and plain text.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from ipaddress import ip_address
from uuid import UUID

from mosaic_core.machines.lan.robot_url import url_of
from mosaic_core.machines.peers.home_address import leads_home
from mosaic_core.words.errors import SignalingError, hint_at
from mosaic_core.words.lan import SERVICE_TYPE
from mosaic_core.words.plain_text import plain

MOST_ROBOTS = 64
"""More are not looked at: whoever announces a thousand names is no fleet."""
MOST_ADDRESSES = 8
LONGEST_NAME = 100
_LONGEST_VERSION = 40
_LOCAL_NAME = re.compile(r"[a-z0-9](?:[a-z0-9-]{0,61}[a-z0-9])?\.local", re.IGNORECASE)
_FINGERPRINT = re.compile(r"[0-9A-F]{2}(?::[0-9A-F]{2}){31}")


@dataclass(frozen=True, slots=True)
class AnnouncedRobot:
    """A robot that announces itself; nothing proves that it is the one that it names.

    ``robot_id`` is a UUID; ``urls`` hold the addresses, then the name; ``fingerprint`` is the SHA-256 of its TLS
    certificate, empty over http.
    """

    name: str
    robot_id: str
    urls: tuple[str, ...]
    version: str = ""
    fingerprint: str = ""


def announced_robot(
    service: str, words: Mapping[str, str | None], hosts: Sequence[str], port: int | None
) -> AnnouncedRobot | None:
    """The robot of one DNS-SD service (RFC 6763): its name, TXT record, addresses and host name, and port.

    ``None`` for what is no robot: without a UUID, or without an address that leads to another machine.
    """
    robot_id = _uuid(words.get("id") or "")
    scheme = "https" if words.get("scheme") == "https" else "http"
    usable = [host for host in hosts[: 4 * MOST_ADDRESSES] if _leads_to_a_robot(host)][:MOST_ADDRESSES]
    if not robot_id or not usable or port is None or not 0 < port < 65536:
        return None
    fingerprint = words.get("fingerprint") or ""
    return AnnouncedRobot(
        _short(words.get("name") or service.removesuffix(f".{SERVICE_TYPE}"), LONGEST_NAME) or robot_id,
        robot_id,
        tuple(url_of(scheme, host, port) for host in usable),
        _short(words.get("version") or "", _LONGEST_VERSION),
        fingerprint if _FINGERPRINT.fullmatch(fingerprint) else "",
    )


def meant_robot(wanted: str, found: Iterable[AnnouncedRobot]) -> AnnouncedRobot:
    """The robot of this id or name; :class:`SignalingError` (``lan.not_found``, ``lan.several``) names those there
    are."""
    robots = list(found)
    matching = [one for one in robots if one.robot_id == wanted.lower()] or [
        one for one in robots if one.name == wanted
    ]
    if len(matching) == 1:
        return matching[0]
    if matching:
        which = ", ".join(f"{one.robot_id} at {one.urls[0]}" for one in matching[:8])
        message = f"{len(matching)} robots are announced as {wanted!r}: {which}"
        raise SignalingError(message, code="lan.several")
    message = f"no robot {wanted!r} announces itself on this network{hint_at(wanted, (one.name for one in robots))}"
    raise SignalingError(message, code="lan.not_found")


def _uuid(text: str) -> str:
    try:
        return str(UUID(text)) if len(text) <= 36 else ""
    except ValueError:
        return ""


def _leads_to_a_robot(host: str) -> bool:
    """Whether a host is an address of another machine, or a name of this network."""
    try:
        ip = ip_address(host)
    except ValueError:
        return _LOCAL_NAME.fullmatch(host) is not None
    return not (leads_home(host) or ip.is_multicast or (ip.version == 6 and ip.is_link_local))


def _short(text: str, most: int) -> str:
    return plain(text[:most]).strip()
