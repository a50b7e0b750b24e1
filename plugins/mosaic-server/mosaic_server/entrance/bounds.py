"""The settings of the entrance: how many connections and requests one address gets, and how long each may dawdle."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Bounds:
    """Chosen so that two hundred browsers behind one NAT never meet them and one machine can't wear the server out."""

    connections_per_address: int = 1000
    """A browser keeps up to six for requests, and one WebSocket for each page."""
    requests_per_s: float = 200.0
    """Of one address; what goes beyond waits for its turn. A request costs about a millisecond of the event loop."""
    request_burst: float = 60.0
    """So many of one address are begun at once: a page with all its files."""
    header_s: float = 10.0
    """Within this a TLS handshake, and then the headers of a request, have to be complete."""
    silence_s: float = 30.0
    """A body that stops coming, and an answer of which nothing is taken, end the connection after this."""


DEFAULT_BOUNDS = Bounds()
