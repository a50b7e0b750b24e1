"""Writes Cyclone DDS' configuration for a network interface and for peers that multicast does not reach. Pure."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from xml.sax.saxutils import quoteattr

LOOPBACK = ("lo", "127.0.0.1", "localhost")


def configuration(interface: str, peers: Sequence[str], environment: Mapping[str, str]) -> str | None:
    """The text for the domain, on top of ``CYCLONEDDS_URI``; ``None``: just that, or Cyclone's own choice.

    Without an interface ``ROS_LOCALHOST_ONLY=1`` and ``ROS_AUTOMATIC_DISCOVERY_RANGE=LOCALHOST`` mean loopback, and
    ``ROS_STATIC_PEERS`` adds peers, as in ROS.
    """
    stays_here = environment.get("ROS_LOCALHOST_ONLY") == "1"
    stays_here |= environment.get("ROS_AUTOMATIC_DISCOVERY_RANGE", "").upper() == "LOCALHOST"
    interface = interface or (LOOPBACK[0] if stays_here else "")
    more = [one for one in environment.get("ROS_STATIC_PEERS", "").split(";") if one]
    addresses = [*peers, *more, *(["127.0.0.1"] if interface in LOOPBACK else [])]
    if not interface and not addresses:
        return None
    general = f"<Interfaces><NetworkInterface {_which(interface)}/></Interfaces>" if interface else ""
    if interface in LOOPBACK:
        general += "<AllowMulticast>false</AllowMulticast>"
    found = "".join(f"<Peer Address={quoteattr(one)}/>" for one in dict.fromkeys(addresses))
    # Peers are looked for at the ports of the first participants: this one must have one of those.
    index = "<ParticipantIndex>auto</ParticipantIndex><MaxAutoParticipantIndex>120</MaxAutoParticipantIndex>"
    discovery = f"{index}<Peers>{found}</Peers>"
    own = f"<General>{general}</General><Discovery>{discovery}</Discovery>"
    before = f"{environment['CYCLONEDDS_URI']}," if environment.get("CYCLONEDDS_URI") else ""
    return f"{before}<CycloneDDS><Domain>{own}</Domain></CycloneDDS>"


def _which(interface: str) -> str:
    is_address = interface.replace(".", "").isdigit() or ":" in interface
    return f"{'address' if is_address else 'name'}={quoteattr(interface)}"
