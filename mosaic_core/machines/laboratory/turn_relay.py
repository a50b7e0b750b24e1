"""The public server of a laboratory: tells who asks by which address it is seen (STUN), and relays for those whom no
direct path joins (TURN). It asks for no credentials, and never belongs on a real network.
"""

from __future__ import annotations

import struct
from collections.abc import Callable
from dataclasses import dataclass, field

from mosaic_core.machines.laboratory import stun_message as stun
from mosaic_core.machines.laboratory.nat import Endpoint
from mosaic_core.machines.laboratory.stun_message import StunMessage, parse_stun, parse_xor_address, xor_address

PORT = 3478
FIRST_RELAYED_PORT, LAST_RELAYED_PORT = 49152, 65535
LIFETIME_S = 600
_CHANNELS = range(0x4000, 0x5000)


@dataclass(frozen=True, slots=True)
class Packet:
    """One datagram on the public network."""

    data: bytes
    source: Endpoint
    destination: Endpoint


@dataclass(slots=True)
class _Allocation:
    client: Endpoint
    relayed: Endpoint
    ends_at_s: float
    permitted: set[str] = field(default_factory=set)
    peers: dict[int, Endpoint] = field(default_factory=dict)
    channels: dict[Endpoint, int] = field(default_factory=dict)


class TurnRelay:
    """Relays packets as a TURN server at ``host``. The names that clients have for others may differ from those on the
    public network: ``resolve(name)`` and ``name_for(client, endpoint)`` translate."""

    def __init__(
        self,
        host: str,
        resolve: Callable[[Endpoint], Endpoint] = lambda name: name,
        name_for: Callable[[Endpoint, Endpoint], Endpoint] = lambda _client, endpoint: endpoint,
    ) -> None:
        self.endpoint: Endpoint = (host, PORT)
        self._resolve = resolve
        self._name_for = name_for
        self._by_client: dict[Endpoint, _Allocation] = {}
        self._by_relayed: dict[Endpoint, _Allocation] = {}

    def handle(self, packet: Packet, now_s: float) -> list[Packet]:
        """What the server sends after a packet has reached it."""
        if packet.destination != self.endpoint:
            return self._from_peer(packet, now_s)
        allocation = self._alive(self._by_client.get(packet.source), now_s)
        if len(packet.data) >= 4 and packet.data[0] & 0xC0 == 0x40:
            return self._channel_data(packet.data, allocation)
        message = parse_stun(packet.data)
        if message is None:
            return []
        if message.kind == "indication":
            return self._sent(message, allocation)
        answer = self._answer(message, packet.source, allocation, now_s) if message.kind == "request" else None
        return [] if answer is None else [Packet(answer.encoded(), self.endpoint, packet.source)]

    # -- requests ------------------------------------------------------------------------------------------------

    def _answer(
        self, message: StunMessage, client: Endpoint, allocation: _Allocation | None, now_s: float
    ) -> StunMessage:
        if message.method == stun.BINDING:
            return message.answer({stun.XOR_MAPPED: xor_address(client)})
        if message.method == stun.ALLOCATE:
            return self._allocate(message, client, allocation, now_s)
        if allocation is None:
            return message.refusal(437, "Allocation Mismatch")
        if message.method == stun.REFRESH:
            return self._refresh(message, allocation, now_s)
        peer = self._peer(message)
        if peer is None:
            return message.refusal(400, "Bad Request")
        if message.method == stun.CHANNEL_BIND:
            return self._bind(message, allocation, peer)
        if message.method == stun.CREATE_PERMISSION:
            allocation.permitted.add(peer[0])
            return message.answer({})
        return message.refusal(400, "Bad Request")

    def _allocate(
        self, message: StunMessage, client: Endpoint, allocation: _Allocation | None, now_s: float
    ) -> StunMessage:
        if allocation is None:
            relayed = self._free_endpoint(now_s)
            if relayed is None:
                return message.refusal(508, "Insufficient Capacity")
            allocation = _Allocation(client, relayed, now_s + LIFETIME_S)
            self._by_client[client] = self._by_relayed[relayed] = allocation
        lifetime = struct.pack("!I", LIFETIME_S)
        seen = {stun.XOR_RELAYED: xor_address(allocation.relayed), stun.XOR_MAPPED: xor_address(client)}
        return message.answer({**seen, stun.LIFETIME: lifetime})

    def _refresh(self, message: StunMessage, allocation: _Allocation, now_s: float) -> StunMessage:
        wanted = message.attributes.get(stun.LIFETIME, struct.pack("!I", LIFETIME_S))
        lifetime_s = 0 if wanted == bytes(4) else LIFETIME_S
        allocation.ends_at_s = now_s + lifetime_s
        self._alive(allocation, now_s)
        return message.answer({stun.LIFETIME: struct.pack("!I", lifetime_s)})

    def _bind(self, message: StunMessage, allocation: _Allocation, peer: Endpoint) -> StunMessage:
        value = message.attributes.get(stun.CHANNEL_NUMBER, b"")
        channel = struct.unpack_from("!H", value)[0] if len(value) == 4 else 0
        taken = allocation.peers.get(channel, peer), allocation.channels.get(peer, channel)
        if channel not in _CHANNELS or taken != (peer, channel):
            return message.refusal(400, "Bad Request")
        allocation.peers[channel], allocation.channels[peer] = peer, channel
        allocation.permitted.add(peer[0])
        return message.answer({})

    # -- data ----------------------------------------------------------------------------------------------------

    def _channel_data(self, data: bytes, allocation: _Allocation | None) -> list[Packet]:
        channel, length = struct.unpack_from("!HH", data)
        peer = allocation.peers.get(channel) if allocation is not None else None
        if allocation is None or peer is None or len(data) < 4 + length:
            return []
        return [Packet(data[4 : 4 + length], allocation.relayed, peer)]

    def _sent(self, message: StunMessage, allocation: _Allocation | None) -> list[Packet]:
        peer = self._peer(message)
        if message.method != stun.SEND or allocation is None or peer is None or peer[0] not in allocation.permitted:
            return []
        return [Packet(message.attributes.get(stun.PAYLOAD, b""), allocation.relayed, peer)]

    def _from_peer(self, packet: Packet, now_s: float) -> list[Packet]:
        allocation = self._alive(self._by_relayed.get(packet.destination), now_s)
        if allocation is None or packet.source[0] not in allocation.permitted:
            return []
        channel = allocation.channels.get(packet.source)
        if channel is not None:
            data = struct.pack("!HH", channel, len(packet.data)) + packet.data
        else:
            name = self._name_for(allocation.client, packet.source)
            attributes = {stun.XOR_PEER: xor_address(name), stun.PAYLOAD: packet.data}
            data = StunMessage(stun.DATA, "indication", bytes(12), attributes).encoded()
        return [Packet(data, self.endpoint, allocation.client)]

    # -- allocations ---------------------------------------------------------------------------------------------

    def _peer(self, message: StunMessage) -> Endpoint | None:
        name = parse_xor_address(message.attributes.get(stun.XOR_PEER, b""))
        return None if name is None else self._resolve(name)

    def _alive(self, allocation: _Allocation | None, now_s: float) -> _Allocation | None:
        if allocation is None or allocation.ends_at_s > now_s:
            return allocation
        del self._by_client[allocation.client], self._by_relayed[allocation.relayed]
        return None

    def _free_endpoint(self, now_s: float) -> Endpoint | None:
        for allocation in list(self._by_relayed.values()):
            self._alive(allocation, now_s)
        ports = range(FIRST_RELAYED_PORT, LAST_RELAYED_PORT + 1)
        host = self.endpoint[0]
        return next(((host, port) for port in ports if (host, port) not in self._by_relayed), None)
