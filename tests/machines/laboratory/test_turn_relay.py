"""The laboratory's STUN and TURN server, spoken to in bytes as any client does."""

from __future__ import annotations

import struct

import pytest
from hypothesis import given
from hypothesis import strategies as st

from mosaic_core.machines.laboratory import stun_message as stun
from mosaic_core.machines.laboratory.nat import Endpoint
from mosaic_core.machines.laboratory.stun_message import StunMessage, parse_stun, parse_xor_address, xor_address
from mosaic_core.machines.laboratory.turn_relay import LIFETIME_S, Packet, TurnRelay

HOST = "192.0.2.1"
ALICE: Endpoint = ("198.51.100.1", 40_000)
BOB: Endpoint = ("203.0.113.1", 50_000)
ENDPOINTS = st.tuples(st.ip_addresses(v=4).map(str), st.integers(0, 65535))


class Client:
    def __init__(self, relay: TurnRelay, endpoint: Endpoint) -> None:
        self.relay, self.endpoint = relay, endpoint

    def say(self, data: bytes, now_s: float = 0.0) -> list[Packet]:
        return self.relay.handle(Packet(data, self.endpoint, self.relay.endpoint), now_s)

    def ask(self, method: int, attributes: dict[int, bytes] | None = None, now_s: float = 0.0) -> StunMessage:
        request = StunMessage(method, "request", b"transaction!", attributes or {})
        (packet,) = self.say(request.encoded(), now_s)
        assert (packet.source, packet.destination) == (self.relay.endpoint, self.endpoint)
        answer = parse_stun(packet.data)
        assert answer is not None
        assert (answer.method, answer.transaction) == (method, b"transaction!")
        return answer

    def allocate(self) -> Endpoint:
        relayed = parse_xor_address(self.ask(stun.ALLOCATE).attributes[stun.XOR_RELAYED])
        assert relayed is not None
        return relayed

    def bind(self, channel: int, peer: Endpoint) -> StunMessage:
        number = struct.pack("!HH", channel, 0)
        return self.ask(stun.CHANNEL_BIND, {stun.CHANNEL_NUMBER: number, stun.XOR_PEER: xor_address(peer)})


def test_whoever_asks_is_told_by_which_address_it_is_seen() -> None:
    answer = Client(TurnRelay(HOST), ALICE).ask(stun.BINDING)
    assert answer.kind == "success"
    assert parse_xor_address(answer.attributes[stun.XOR_MAPPED]) == ALICE


def test_two_clients_talk_through_their_channels() -> None:
    relay = TurnRelay(HOST)
    alice, bob = Client(relay, ALICE), Client(relay, BOB)
    alices, bobs = alice.allocate(), bob.allocate()
    assert alices != bobs
    alice.bind(0x4000, bobs)
    bob.bind(0x4001, alices)
    (relayed,) = alice.say(struct.pack("!HH", 0x4000, 5) + b"hello")
    assert relayed == Packet(b"hello", alices, bobs)
    (arrived,) = relay.handle(relayed, 0.0)
    assert arrived == Packet(struct.pack("!HH", 0x4001, 5) + b"hello", relay.endpoint, BOB)


def test_a_permission_is_for_a_host_and_data_without_a_channel_comes_as_an_indication() -> None:
    relay = TurnRelay(HOST)
    alice = Client(relay, ALICE)
    relayed = alice.allocate()
    knock = Packet(b"hello", BOB, relayed)
    assert relay.handle(knock, 0.0) == []
    assert alice.ask(stun.CREATE_PERMISSION, {stun.XOR_PEER: xor_address((BOB[0], 0))}).kind == "success"
    (packet,) = relay.handle(knock, 0.0)
    told = parse_stun(packet.data)
    assert told is not None
    assert (told.method, told.kind, told.attributes[stun.PAYLOAD]) == (stun.DATA, "indication", b"hello")
    assert parse_xor_address(told.attributes[stun.XOR_PEER]) == BOB
    said = StunMessage(stun.SEND, "indication", bytes(12), {stun.XOR_PEER: xor_address(BOB), stun.PAYLOAD: b"hi"})
    assert alice.say(said.encoded()) == [Packet(b"hi", relayed, BOB)]


def test_nothing_is_relayed_for_who_allocated_nothing() -> None:
    bob = Client(TurnRelay(HOST), BOB)
    assert bob.bind(0x4000, ALICE).kind == "error"
    assert bob.say(struct.pack("!HH", 0x4000, 2) + b"hi") == []


@pytest.mark.parametrize("code", [300, 400, 437, 486, 508, 699])
def test_a_refusal_tells_class_and_number_of_its_code_and_why(code: int) -> None:
    """RFC 8489 §14.8."""
    request = StunMessage(stun.ALLOCATE, "request", b"transaction!")
    refused = request.refusal(code, "why")
    assert (refused.method, refused.kind, refused.transaction) == (stun.ALLOCATE, "error", b"transaction!")
    assert refused.attributes == {stun.ERROR_CODE: bytes((0, 0, code // 100, code % 100)) + b"why"}


def test_each_mistake_of_a_client_is_refused_with_its_code() -> None:
    alice = Client(TurnRelay(HOST), ALICE)
    asked = [alice.ask(stun.REFRESH), alice.bind(0x4000, BOB)]
    alice.allocate()
    asked += [alice.ask(stun.CREATE_PERMISSION), alice.bind(0x3FFF, BOB), alice.bind(0x8000, BOB)]
    asked += [alice.ask(stun.SEND, {stun.XOR_PEER: xor_address(BOB)})]
    assert [code_of(answer) for answer in asked] == [437, 437, 400, 400, 400, 400]


def code_of(answer: StunMessage) -> int:
    assert answer.kind == "error"
    _, hundreds, rest = struct.unpack_from("!HBB", answer.attributes[stun.ERROR_CODE])
    return int(hundreds * 100 + rest)


def test_a_channel_is_bound_to_one_peer_and_a_peer_to_one_channel() -> None:
    alice = Client(TurnRelay(HOST), ALICE)
    alice.allocate()
    assert alice.bind(0x4000, BOB).kind == alice.bind(0x4000, BOB).kind == "success"
    assert (
        alice.bind(0x4000, (BOB[0], 1)).kind == alice.bind(0x4001, BOB).kind == alice.bind(0x3FFF, BOB).kind == "error"
    )


def test_an_allocation_ends_when_it_is_given_back_or_not_refreshed() -> None:
    relay = TurnRelay(HOST)
    alice = Client(relay, ALICE)
    first = alice.allocate()
    assert alice.allocate() == first
    assert alice.ask(stun.REFRESH, now_s=LIFETIME_S - 1).kind == "success"
    assert alice.ask(stun.REFRESH, now_s=LIFETIME_S + 1).kind == "success"
    assert alice.ask(stun.REFRESH, {stun.LIFETIME: bytes(4)}, LIFETIME_S + 2).kind == "success"
    assert alice.ask(stun.REFRESH, now_s=LIFETIME_S + 3).kind == "error"
    alice.allocate()
    assert alice.ask(stun.REFRESH, now_s=2 * LIFETIME_S + 9).kind == "error"


def test_the_names_that_a_client_has_for_others_are_translated_both_ways() -> None:
    name: Endpoint = ("127.0.0.1", 777)
    relay = TurnRelay(HOST, lambda one: BOB if one == name else one, lambda _client, _endpoint: name)
    alice = Client(relay, ALICE)
    relayed = alice.allocate()
    alice.ask(stun.CREATE_PERMISSION, {stun.XOR_PEER: xor_address(name)})
    (packet,) = relay.handle(Packet(b"hello", BOB, relayed), 0.0)
    told = parse_stun(packet.data)
    assert told is not None
    assert parse_xor_address(told.attributes[stun.XOR_PEER]) == name


@given(endpoint=ENDPOINTS)
def test_an_address_survives_its_attribute(endpoint: Endpoint) -> None:
    assert parse_xor_address(xor_address(endpoint)) == endpoint


def test_an_address_is_written_as_the_example_of_the_rfc() -> None:
    """RFC 5769 §2.2."""
    assert xor_address(("192.0.2.1", 32853)) == bytes.fromhex("0001 a147 e112a643")
    assert parse_xor_address(bytes.fromhex("0002 a147 e112a643")) is None, "IPv6"
    assert parse_xor_address(bytes.fromhex("0001 a147 e112a6")) is None


ATTRIBUTE = bytes.fromhex("8022 0003") + b"abc\0"
HEAD = bytes.fromhex("0001 0008 2112a442") + b"transaction!"


def test_of_an_attribute_that_comes_twice_the_first_counts() -> None:
    twice = HEAD[:2] + b"\x00\x10" + HEAD[4:] + ATTRIBUTE + ATTRIBUTE.replace(b"abc", b"xyz")
    assert parse_stun(twice) == StunMessage(stun.BINDING, "request", b"transaction!", {0x8022: b"abc"})


@pytest.mark.parametrize(
    "data",
    [
        HEAD[:-1],
        b"\x40" + HEAD[1:] + ATTRIBUTE,
        b"\x80" + HEAD[1:] + ATTRIBUTE,
        HEAD.replace(b"\x42", b"\x43") + ATTRIBUTE,
        HEAD + ATTRIBUTE + b"\0",
        HEAD + ATTRIBUTE[:-1],
        HEAD[:3] + b"\x07" + HEAD[4:] + ATTRIBUTE[:-1],
        HEAD + bytes.fromhex("8022 0005") + b"abc\0",
    ],
)  # fmt: skip
def test_what_is_cut_short_or_too_long_or_no_stun_is_no_message(data: bytes) -> None:
    assert parse_stun(HEAD + ATTRIBUTE) is not None
    assert parse_stun(data) is None


@given(
    method=st.sampled_from([stun.BINDING, stun.ALLOCATE, stun.SEND, stun.DATA, stun.CHANNEL_BIND]),
    kind=st.sampled_from(["request", "indication", "success", "error"]),
    transaction=st.binary(min_size=12, max_size=12),
    attributes=st.dictionaries(st.integers(1, 0xFFFF), st.binary(max_size=40), max_size=5),
)
def test_a_message_survives_the_wire(method: int, kind: stun.Class, transaction: bytes, attributes: dict) -> None:  # type: ignore[type-arg]
    message = StunMessage(method, kind, transaction, attributes)
    assert parse_stun(message.encoded()) == message


@given(data=st.binary(max_size=80), is_peer=st.booleans())
def test_no_bytes_upset_it(data: bytes, is_peer: bool) -> None:
    relay = TurnRelay(HOST)
    relayed = Client(relay, ALICE).allocate()
    relay.handle(Packet(data, BOB if is_peer else ALICE, relayed if is_peer else relay.endpoint), 0.0)
    head = bytes((data[0] & 0x3F if data else 0,)) + b"\x01\x00\x00"
    Client(relay, ALICE).say(head + struct.pack("!I", stun.COOKIE) + data)
