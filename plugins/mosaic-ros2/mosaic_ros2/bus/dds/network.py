"""Writes Cyclone DDS' configuration: for nodes of Fast DDS, for a network interface, and for peers that multicast does
not reach. Pure."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from xml.sax.saxutils import quoteattr

from mosaic_core.words.errors import hint_at

LOOPBACK = ("lo", "127.0.0.1", "localhost")
MATCHES_FAST_DDS = "<Compatibility><IgnoreTypeInformation>1.15</IgnoreTypeInformation></Compatibility>"
"""What Fast DDS (vendor 1.15) tells of a type with a sequence or an array Cyclone takes for invalid, and then never
matches it. So the types of Fast DDS' nodes are compared by their names, like those of nodes that tell nothing."""


def configuration(interface: str, peers: Sequence[str], environment: Mapping[str, str]) -> str:
    """The text for the domain, on top of ``CYCLONEDDS_URI``.

    Without an interface ``ROS_LOCALHOST_ONLY=1`` and ``ROS_AUTOMATIC_DISCOVERY_RANGE=LOCALHOST`` mean loopback, and
    ``ROS_STATIC_PEERS`` adds peers, as in ROS.
    """
    stays_here = environment.get("ROS_LOCALHOST_ONLY") == "1"
    stays_here |= environment.get("ROS_AUTOMATIC_DISCOVERY_RANGE", "").upper() == "LOCALHOST"
    interface = interface or (LOOPBACK[0] if stays_here else "")
    more = [one for one in environment.get("ROS_STATIC_PEERS", "").split(";") if one]
    addresses = [*peers, *more, *(["127.0.0.1"] if interface in LOOPBACK else [])]
    own = MATCHES_FAST_DDS + (_network(interface, addresses) if interface or addresses else "")
    before = f"{environment['CYCLONEDDS_URI']}," if environment.get("CYCLONEDDS_URI") else ""
    return f"{before}<CycloneDDS><Domain>{own}</Domain></CycloneDDS>"


def _network(interface: str, addresses: Sequence[str]) -> str:
    general = f"<Interfaces><NetworkInterface {_which(interface)}/></Interfaces>" if interface else ""
    if interface in LOOPBACK:
        general += "<AllowMulticast>false</AllowMulticast>"
    found = "".join(f"<Peer Address={quoteattr(one)}/>" for one in dict.fromkeys(addresses))
    # Peers are looked for at the ports of the first participants: this one must have one of those.
    index = "<ParticipantIndex>auto</ParticipantIndex><MaxAutoParticipantIndex>120</MaxAutoParticipantIndex>"
    return f"<General>{general}</General><Discovery>{index}<Peers>{found}</Peers></Discovery>"


def why_not_joined(interface: str, there: Sequence[str], said: str) -> tuple[str, str]:
    """What to tell, and the cure, where Cyclone DDS could not begin, which ``said`` no more than that.

    :param there: the names of this machine's interfaces
    """
    if interface and not _is_address(interface) and interface not in (*LOOPBACK, *there):
        return f"no network interface {interface!r}{hint_at(interface, there)}", f"there are: {', '.join(there)}"
    return said, "look at `interface`, at CYCLONEDDS_URI, and whether the network is up"


def _is_address(interface: str) -> bool:
    return interface.replace(".", "").isdigit() or ":" in interface


def _which(interface: str) -> str:
    return f"{'address' if _is_address(interface) else 'name'}={quoteattr(interface)}"
