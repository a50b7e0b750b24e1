"""Whether an address leads back to the machine that sends there: what listens on a loopback trusts everybody on it."""

from __future__ import annotations

from ipaddress import IPv4Address, IPv6Address, ip_address, ip_network

_THIS_NETWORK = ip_network("0.0.0.0/8")
"""RFC 1122 §3.2.1.3; Linux takes 0.0.0.0 for the loopback."""
_CARRIERS = tuple(map(ip_network, ("::/96", "::ffff:0:0/96", "::ffff:0:0:0/96", "64:ff9b::/96")))
"""IPv6 addresses whose last 32 bits are one of IPv4: compatible, mapped, translated (RFC 4291 §2.5.5, 7915, 6052)."""


def leads_home(address: str) -> bool:
    """Loopback and unspecified addresses, in whatever clothes; what is no address leads nowhere."""
    try:
        ip = ip_address(address.partition("%")[0])
    except ValueError:
        return False
    if ip.is_loopback or ip.is_unspecified:
        return True
    inner = _carried(ip) if isinstance(ip, IPv6Address) else ip
    return inner is not None and (inner.is_loopback or inner in _THIS_NETWORK)


def is_loopback(host: str) -> bool:
    """Whether only this machine reaches what listens at ``host``: unlike :func:`leads_home`, for an unspecified address
    leads others here too."""
    try:
        return host == "localhost" or ip_address(host).is_loopback
    except ValueError:
        return False


def is_loopback_name(host: str) -> bool:
    """Whether ``host`` of a URL is this machine."""
    return host.rstrip(".").lower() == "localhost" or leads_home(host)


def _carried(ip: IPv6Address) -> IPv4Address | None:
    if ip.sixtofour is not None:
        return ip.sixtofour
    return IPv4Address(int(ip) & 0xFFFFFFFF) if any(ip in carrier for carrier in _CARRIERS) else None
