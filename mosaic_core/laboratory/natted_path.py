"""Robot and operator behind a NAT each, in user space: a public network that exists in this process alone, with a STUN
and TURN server on it.

Whoever is behind a NAT reaches somebody outside through a local socket that stands for that one, its *door*; the NATs
decide which public endpoint the packet leaves from and who is let in. The bad link is the robot's.
"""

from __future__ import annotations

import socket
import time
from random import Random

from mosaic_core.laboratory.impaired_path import ImpairedPath, bound_socket, received
from mosaic_core.machines.laboratory.impaired_link import PROFILES, ImpairedLink, LinkProfile
from mosaic_core.machines.laboratory.nat import Endpoint, Nat, NatKind
from mosaic_core.machines.laboratory.turn_relay import Packet, TurnRelay

ROBOT_WAN, OPERATOR_WAN, SERVER = "198.51.100.1", "203.0.113.1", "192.0.2.1"
"""Of RFC 5737's documentation networks: nobody has them."""
DOOR_HOST = "127.0.0.1"


class NattedPath(ImpairedPath):
    """A path through two NATs, each before one peer. ``with`` runs it. ``with_relay``: whether peers are told of the
    TURN server, or of STUN alone.
    """

    def __init__(
        self,
        profile: LinkProfile | str = "pristine",
        *,
        robot: NatKind = "port-restricted",
        operator: NatKind = "port-restricted",
        with_relay: bool = True,
        seed: int = 1,
    ) -> None:
        super().__init__(profile, seed=seed)
        choose = Random(seed + 1).randrange
        clear = PROFILES["pristine"]
        self.robot = Household(self, Nat(robot, ROBOT_WAN, choose), self.down, self.up)
        self.operator = Household(self, Nat(operator, OPERATOR_WAN, choose), ImpairedLink(clear), ImpairedLink(clear))
        self._homes = {ROBOT_WAN: self.robot, OPERATOR_WAN: self.operator}
        self._names: dict[Endpoint, Endpoint] = {}
        self._server = TurnRelay(SERVER, lambda door: self._names.get(door, door), self._name_for)
        self._with_relay = with_relay

    def ice_url(self, home: Household) -> str:
        """What a peer in this household is told to ask."""
        host, port = home.door(self._server.endpoint)
        return f"{'turn' if self._with_relay else 'stun'}:{host}:{port}"

    def is_public(self, host: str) -> bool:
        """Whether this is an address of the public network in here."""
        return host in self._homes or host == SERVER

    def named(self, door: Endpoint, remote: Endpoint) -> None:
        """``door`` stands for ``remote``: somebody who knows doors only may speak of it to the server."""
        self._names[door] = remote

    def deliver(self, packet: Packet) -> None:
        """One datagram on the public network. Relay thread."""
        home = self._homes.get(packet.destination[0])
        if home is not None:
            home.arrived(packet)
        elif packet.destination[0] == SERVER:
            for answer in self._server.handle(packet, time.monotonic()):
                self.deliver(answer)

    def _name_for(self, client: Endpoint, endpoint: Endpoint) -> Endpoint:
        home = self._homes.get(client[0])
        return endpoint if home is None else home.door(endpoint)


class Household:
    """A NAT of one side, with the doors to everybody outside."""

    def __init__(self, path: NattedPath, nat: Nat, outward: ImpairedLink, inward: ImpairedLink) -> None:
        self.nat = nat
        self._path = path
        self._outward = outward
        self._inward = inward
        self._doors: dict[Endpoint, tuple[socket.socket, Endpoint]] = {}

    def door(self, remote: Endpoint) -> Endpoint:
        """The local address that stands for ``remote`` in here. Any thread; raises :class:`OSError`."""
        return self._opened(remote)[1]

    def arrived(self, packet: Packet) -> None:
        """Somebody outside sent this to our NAT. Relay thread."""
        inside = self.nat.inbound(packet.destination, packet.source, time.monotonic())
        if inside is not None:
            door, _ = self._opened(packet.source)
            self._path.carry(self._inward, packet.data, lambda data: door.sendto(data, inside))

    def _opened(self, remote: Endpoint) -> tuple[socket.socket, Endpoint]:
        with self._path.lock:
            found = self._doors.get(remote)
            if found is not None:
                return found
            sock = bound_socket(socket.AF_INET, DOOR_HOST)
            opened = self._doors[remote] = sock, (DOOR_HOST, int(sock.getsockname()[1]))
            self._path.named(opened[1], remote)
        self._path.open(sock, lambda: self._read(sock, remote))
        return opened

    def _read(self, sock: socket.socket, remote: Endpoint) -> None:
        for data, (host, port) in received(sock):
            public = self.nat.outbound((host, port), remote, time.monotonic())
            if public is not None:
                packet = Packet(data, public, remote)
                self._path.carry(self._outward, data, lambda _, packet=packet: self._path.deliver(packet))  # type: ignore[misc]
