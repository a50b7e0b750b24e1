"""Finds the addresses and names by which this machine is reached on its networks."""

from __future__ import annotations

import ipaddress
import re
import socket
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

import ifaddr

ANY_IPV4, ANY_IPV6 = "0.0.0.0", "::"  # noqa: S104 - compared with, not bound to here
_INSIDE_THIS_MACHINE = re.compile(r"(docker|virbr|lxcbr|lxdbr|podman|cni|flannel)\S*|br-[0-9a-f]{12}|veth[0-9a-f]{7,}")
"""Networks of containers and virtual machines: nobody comes from there with a phone."""


@dataclass(frozen=True, slots=True)
class InterfaceAddress:
    """One address of one network interface."""

    interface: str
    address: str


def is_only_here(host: str) -> bool:
    """Whether nobody but this machine reaches a server bound to ``host``."""
    try:
        return ipaddress.ip_address(host.partition("%")[0]).is_loopback
    except ValueError:
        return host == "localhost" or host.endswith(".localhost")


def lan_addresses(host: str) -> list[str]:
    """The addresses under which a server bound to ``host`` is reached from outside, the most usual first."""
    if is_only_here(host):
        return []
    if host not in (ANY_IPV4, ANY_IPV6):
        return [host]
    wanted = 4 if host == ANY_IPV4 else 6
    return usable(places(), wanted)


def places() -> list[InterfaceAddress]:
    found = []
    for adapter in ifaddr.get_adapters():
        for ip in adapter.ips:
            address = ip.ip if isinstance(ip.ip, str) else ip.ip[0]
            found.append(InterfaceAddress(adapter.name, address))
    return found


def usable(found: Iterable[InterfaceAddress], version: int) -> list[str]:
    """Addresses of that IP version that other machines can use: private networks first, in the order of the system."""
    outside = []
    for place in found:
        ip = ipaddress.ip_address(place.address)
        is_inside = ip.is_loopback or ip.is_link_local or _INSIDE_THIS_MACHINE.fullmatch(place.interface) is not None
        if ip.version == version and not is_inside:
            outside.append(ip)
    return [str(ip) for ip in sorted(dict.fromkeys(outside), key=lambda ip: not ip.is_private)]


def own_names() -> list[str]:
    """What this machine calls itself: the host name, and the one that mDNS makes of it."""
    name = socket.gethostname().lower().removesuffix(".local")
    return list(dict.fromkeys([name, f"{name.partition('.')[0]}.local"]))


def mdns_label(name: str) -> str:
    """``Rover 7`` → ``rover-7``: a name that may stand before ``.local``; empty if nothing is left of it."""
    return re.sub(r"[^a-z0-9]+", "-", name.lower()).strip("-")[:63].strip("-")


def names_of_certificate(file: Path) -> list[str]:
    """The DNS names for which a PEM certificate is good, those with a wildcard left out."""
    from cryptography import x509

    certificate = x509.load_pem_x509_certificate(file.read_bytes())
    try:
        names = certificate.extensions.get_extension_for_class(x509.SubjectAlternativeName).value
    except x509.ExtensionNotFound:
        return []
    return [name.lower() for name in names.get_values_for_type(x509.DNSName) if "*" not in name]
