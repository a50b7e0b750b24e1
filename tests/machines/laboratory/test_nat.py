"""What RFC 4787 says of translators, for all orders of packets."""

from __future__ import annotations

import random

import pytest
from hypothesis import given
from hypothesis import strategies as st

from mosaic_core.machines.laboratory.nat import IDLE_S, NAT_KINDS, Endpoint, Nat, NatKind

WAN = "198.51.100.1"
INSIDE: Endpoint = ("192.168.1.2", 5000)
STUN: Endpoint = ("192.0.2.1", 3478)
PEER: Endpoint = ("203.0.113.1", 4000)
SAME_HOST: Endpoint = ("203.0.113.1", 4001)

KINDS = st.sampled_from(NAT_KINDS)
INSIDES = st.tuples(st.sampled_from(["192.168.1.2", "192.168.1.3"]), st.integers(5000, 5002))
REMOTES = st.tuples(st.sampled_from(["203.0.113.1", "203.0.113.2"]), st.integers(4000, 4002))
PACKETS = st.lists(st.tuples(INSIDES, REMOTES, st.floats(0, 20)), min_size=1, max_size=40)


def nat(kind: NatKind, seed: int = 1) -> Nat:
    return Nat(kind, WAN, random.Random(seed).randrange)


def sent(one: Nat, inside: Endpoint, remote: Endpoint, now_s: float = 0.0) -> Endpoint:
    public = one.outbound(inside, remote, now_s)
    assert public is not None
    return public


@pytest.mark.parametrize("kind", NAT_KINDS)
def test_whoever_is_spoken_to_may_answer(kind: NatKind) -> None:
    one = nat(kind)
    assert one.inbound(sent(one, INSIDE, PEER), PEER, 1.0) == INSIDE


@pytest.mark.parametrize(
    ("kind", "same_host", "anybody"),
    [
        ("full-cone", INSIDE, INSIDE),
        ("address-restricted", INSIDE, None),
        ("port-restricted", None, None),
        ("symmetric", None, None),
    ],
)
def test_who_else_gets_in_is_what_tells_the_kinds_apart(
    kind: NatKind, same_host: Endpoint | None, anybody: Endpoint | None
) -> None:
    one = nat(kind)
    public = sent(one, INSIDE, PEER)
    assert one.inbound(public, SAME_HOST, 1.0) == same_host
    assert one.inbound(public, STUN, 1.0) == anybody


@pytest.mark.parametrize("kind", NAT_KINDS)
def test_a_silent_mapping_ends_and_what_comes_in_does_not_keep_it(kind: NatKind) -> None:
    one = nat(kind)
    public = sent(one, INSIDE, PEER)
    assert one.inbound(public, PEER, IDLE_S - 1) == INSIDE
    assert one.inbound(public, PEER, IDLE_S) is None
    assert one.mapped(IDLE_S) == 0


def test_talking_to_one_keeps_the_mapping_but_not_the_permission_of_another() -> None:
    one = nat("port-restricted")
    public = sent(one, INSIDE, STUN)
    sent(one, INSIDE, PEER, IDLE_S - 1)
    assert one.inbound(public, PEER, IDLE_S + 1) == INSIDE
    assert one.inbound(public, STUN, IDLE_S + 1) is None


def test_a_port_that_nobody_mapped_leads_nowhere() -> None:
    assert nat("full-cone").inbound((WAN, 4000), PEER, 0.0) is None
    one = nat("full-cone")
    _, port = sent(one, INSIDE, PEER)
    assert one.inbound(("198.51.100.2", port), PEER, 0.0) is None


def test_without_a_free_port_a_packet_is_dropped_until_one_is_idle() -> None:
    one = Nat("symmetric", WAN, lambda _count: 3, ports=range(4000, 4005))
    for number in range(5):
        sent(one, INSIDE, ("203.0.113.2", number), number)
    assert one.outbound(INSIDE, PEER, 6.0) is None
    assert sent(one, INSIDE, PEER, IDLE_S) == (WAN, 4003)


@given(kind=KINDS, packets=PACKETS, seed=st.integers(0, 9))
def test_public_endpoints_are_shared_by_nobody_and_kept_while_used(
    kind: NatKind, packets: list[tuple[Endpoint, Endpoint, float]], seed: int
) -> None:
    one, owners = nat(kind, seed), {}
    for inside, remote, _ in packets:
        owner = (inside, remote) if kind == "symmetric" else inside
        assert owners.setdefault(sent(one, inside, remote), owner) == owner
    assert len(owners) == len(set(owners.values())) == one.mapped(0.0)


@given(kind=KINDS, packets=PACKETS, stranger=REMOTES, seed=st.integers(0, 9))
def test_nothing_gets_in_that_the_kind_does_not_allow(
    kind: NatKind, packets: list[tuple[Endpoint, Endpoint, float]], stranger: Endpoint, seed: int
) -> None:
    one, now_s = nat(kind, seed), 0.0
    spoken: dict[Endpoint, list[tuple[Endpoint, Endpoint, float]]] = {}
    for inside, remote, wait_s in packets:
        now_s += wait_s
        spoken.setdefault(sent(one, inside, remote, now_s), []).append((inside, remote, now_s))
    for public, said in spoken.items():
        fresh = [remote for _, remote, at_s in said if now_s - at_s < IDLE_S - 1e-6]
        hosts = [host for host, _ in fresh]
        found = one.inbound(public, stranger, now_s)
        if found is not None:
            assert fresh
            assert found in {inside for inside, _, _ in said}
            assert kind == "full-cone" or stranger[0] in hosts
            assert kind in ("full-cone", "address-restricted") or stranger in fresh
