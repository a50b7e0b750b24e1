"""Which addresses lead back to the machine that sends there, however they are written."""

from __future__ import annotations

from ipaddress import IPv4Address, IPv6Address

import pytest
from hypothesis import given
from hypothesis import strategies as st

from mosaic_core.machines.peers.home_address import is_loopback, is_loopback_name, leads_home

HOME = [
    "127.0.0.1",
    "127.9.8.7",
    "0.0.0.0",  # noqa: S104 (nothing is bound)
    "0.1.2.3",
    "::1",
    "::",
    "::1%lo",
    "::ffff:127.0.0.1",
    "::127.0.0.1",
    "::ffff:0:127.0.0.1",
    "64:ff9b::7f00:1",
    "2002:7f00:1::",
    "::ffff:0.0.0.0",
    "0:0:0:0:0:0:0:1",
]
AWAY = [
    "192.168.1.5",
    "10.0.0.1",
    "8.8.8.8",
    "fe80::1%eth0",
    "2001:db8::1",
    "::ffff:192.168.1.5",
    "fd00::7f00:1",
    "128.0.0.1",
]


@pytest.mark.parametrize("address", HOME)
def test_loopback_in_whatever_clothes_leads_home(address: str) -> None:
    assert leads_home(address)


@pytest.mark.parametrize("address", AWAY)
def test_all_others_lead_away(address: str) -> None:
    assert not leads_home(address)


@given(st.integers(0, 2**24 - 1))
def test_every_address_of_the_loopback_network_leads_home_mapped_too(host: int) -> None:
    address = IPv4Address((127 << 24) + host)
    assert leads_home(str(address))
    assert leads_home(str(IPv6Address((0xFFFF << 32) + int(address))))


@given(st.text(max_size=30))
def test_what_is_no_address_leads_nowhere_and_breaks_nothing(text: str) -> None:
    assert leads_home(text) in (True, False)
    assert not leads_home(f"x{text}.local")


def test_the_name_of_the_loopback_in_a_url() -> None:
    assert all(map(is_loopback_name, ("localhost", "LocalHost.", "127.0.0.1", "::1")))
    assert not any(map(is_loopback_name, ("", "robot.local", "localhost.example.org", "192.168.1.5")))


def test_only_this_machine_reaches_what_listens_on_its_loopback() -> None:
    hosts = ("localhost", "127.1.2.3", "::1", "192.168.1.2", "0.0.0.0", "::", "evil")  # noqa: S104 (nothing is bound)
    assert [host for host in hosts if is_loopback(host)] == ["localhost", "127.1.2.3", "::1"]
