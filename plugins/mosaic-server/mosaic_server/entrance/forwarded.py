"""Reads who a request comes from in what proxies say: X-Forwarded-For, or Forwarded (RFC 7239). Pure."""

from __future__ import annotations

import re
from collections.abc import Callable, Container, Iterator, Mapping
from dataclasses import dataclass
from enum import StrEnum
from ipaddress import IPv6Address, ip_address

_TOKEN = r"[!#$%&'*+.^_`|~0-9A-Za-z-]+"  # noqa: S105 - RFC 9110, section 5.6.2
_PAIR = re.compile(rf'(?P<name>{_TOKEN})=(?:(?P<token>{_TOKEN})|"(?P<quoted>(?:[^"\\]|\\.)*)")[ \t]*(?:;[ \t]*|$)')
_NODE = re.compile(r"(?:(?P<v4>[0-9.]+)|\[(?P<v6>[0-9A-Fa-f:.]+)\])(?::(?:[0-9]{1,5}|_[A-Za-z0-9._-]+))?")
_MOST_COMMAS = 10
"""Inside of one hop, in quotes. More were not written by a proxy, and would cost time."""


class ProxyHeader(StrEnum):
    """The one header that is read. Its name is that in the options; headers are compared in small letters."""

    X_FORWARDED_FOR = "x-forwarded-for"
    FORWARDED = "forwarded"


@dataclass(frozen=True, slots=True)
class RequestSource:
    """The address that a request comes from, and its scheme, as a proxy says."""

    address: str
    scheme: str | None = None


def request_source(header: ProxyHeader, said: str, peer: str, trusted: Container[str]) -> RequestSource:
    """The peer, if it is trusted, says who spoke to it; that one, if it is trusted, too; and so on from the right.

    Whoever hides who spoke to it (``unknown``, ``_name``), or says nothing that can be read, is the source itself.
    """
    found = RequestSource(peer)
    hops = _READERS[header](said)
    while found.address in trusted:
        hop = next(hops, None)
        if hop is None:
            break
        found = hop
    return found


def _x_forwarded_for(said: str) -> Iterator[RequestSource]:
    """From the right, until one can't be read. IPv6 stands in brackets only where a port follows."""
    for text in reversed(said.split(",")):
        address = _node(text.strip()) or _address(text.strip())
        if address is None:
            return
        yield RequestSource(address)


def _forwarded(said: str) -> Iterator[RequestSource]:
    """From the right, until one can't be read. What stands left of a hop may be a stranger's, with a quote that never
    ends: a hop is the shortest text at the end that is whole, and its own quotes may hold commas."""
    rest: str | None = said
    while rest is not None:
        rest, pairs = _last_hop(rest)
        address = _node(pairs.get("for", ""))
        if address is None:
            return
        yield RequestSource(address, pairs.get("proto", "").lower() or None)


def _last_hop(said: str) -> tuple[str | None, Mapping[str, str]]:
    """What stands before it (``None``: nothing), and its pairs; none, if they can't be read."""
    parts = said.rsplit(",", _MOST_COMMAS + 1)
    for start in range(len(parts) - 1, -1, -1):
        pairs = _pairs(",".join(parts[start:]).strip(" \t"))
        if pairs:
            return ",".join(parts[:start]) if start else None, pairs
    return None, {}


def _pairs(text: str) -> Mapping[str, str] | None:
    found: dict[str, str] = {}
    at = 0
    while at < len(text):
        pair = _PAIR.match(text, at)
        if pair is None or pair["name"].lower() in found:
            return None
        quoted = pair["quoted"]
        found[pair["name"].lower()] = pair["token"] if quoted is None else re.sub(r"\\(.)", r"\1", quoted)
        at = pair.end()
    return found


def _node(text: str) -> str | None:
    """The address of an IPv4 one, or an IPv6 one in brackets; with a port or without (RFC 7239, section 6)."""
    node = _NODE.fullmatch(text)
    return _address(node["v4"] or node["v6"]) if node else None


def _address(text: str) -> str | None:
    """As it is compared later. A zone (``fe80::1%eth0``) is one of the proxy's own and tells nothing here."""
    try:
        known = ip_address(text)
    except ValueError:
        return None
    if isinstance(known, IPv6Address):
        return None if known.scope_id else str(known.ipv4_mapped or known)
    return str(known)


_READERS: Mapping[ProxyHeader, Callable[[str], Iterator[RequestSource]]] = {
    ProxyHeader.X_FORWARDED_FOR: _x_forwarded_for,
    ProxyHeader.FORWARDED: _forwarded,
}
