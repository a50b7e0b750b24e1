"""Limits of guessing: they stop who guesses, from one machine or many, and not the owner."""

from __future__ import annotations

import ipaddress

import pytest
from hypothesis import given
from hypothesis import strategies as st

from mosaic_server.security.address_prefix import counted_address
from mosaic_server.security.login_limits import PER_ADDRESS, PER_EMAIL, PER_EMAIL_AND_ADDRESS, LoginLimits

ADA = "ada@example.org"
HOME, STRANGER = "192.0.2.1", "198.51.100.7"


def fails(
    limits: LoginLimits, times: int, *, email: str | None = ADA, address: str = STRANGER, now_s: float = 0
) -> int:
    """How many of the attempts were let through."""
    passed = 0
    for _ in range(times):
        if limits.wait_s(email, address, now_s) == 0:
            limits.failed(email, address, now_s)
            passed += 1
    return passed


def test_whoever_fails_waits_and_the_owner_does_not() -> None:
    limits = LoginLimits()
    assert fails(limits, 20) == PER_EMAIL_AND_ADDRESS.failures
    assert limits.wait_s(ADA, STRANGER, 1.0) == PER_EMAIL_AND_ADDRESS.window_s - 1
    assert limits.wait_s(ADA, HOME, 1.0) == 0
    assert limits.wait_s("bob@example.org", STRANGER, 1.0) == 0
    assert limits.wait_s(ADA, STRANGER, PER_EMAIL_AND_ADDRESS.window_s) == 0


def test_one_address_may_not_try_many_emails() -> None:
    limits = LoginLimits()
    for number in range(PER_ADDRESS.failures):
        limits.failed(str(number), STRANGER, 0.0)
    assert limits.wait_s("new", STRANGER, 1.0) > 0
    assert limits.wait_s(None, STRANGER, 1.0) > 0
    assert limits.wait_s("new", HOME, 1.0) == 0


def test_the_right_password_clears_this_address_only() -> None:
    limits = LoginLimits()
    for address in (HOME, STRANGER):
        fails(limits, 8, address=address)
    limits.succeeded(ADA, HOME, 1.0)
    assert limits.wait_s(ADA, HOME, 1.0) == 0
    assert limits.wait_s(ADA, STRANGER, 1.0) > 0


@given(st.lists(st.floats(0.5, 120), min_size=1, max_size=400))
def test_a_stranger_with_one_address_never_locks_the_owner_out(pauses_s: list[float]) -> None:
    limits, now_s = LoginLimits(), 0.0
    for pause_s in pauses_s:
        now_s += pause_s
        fails(limits, 3, now_s=now_s)
        assert limits.wait_s(ADA, HOME, now_s) == 0


def test_for_hours_without_a_pause_one_address_does_not_reach_the_limit_of_the_email() -> None:
    limits = LoginLimits()
    for second in range(3 * 3600):
        fails(limits, 1, now_s=float(second))
        assert limits.wait_s(ADA, HOME, float(second)) == 0


def test_many_addresses_together_are_limited_and_where_the_owner_was_stays_open() -> None:
    limits = LoginLimits()
    limits.succeeded(ADA, HOME, 0.0)
    passed = sum(fails(limits, 8, address=f"203.0.113.{number}", now_s=1.0) for number in range(250))
    assert passed == PER_EMAIL.failures
    assert limits.wait_s(ADA, "192.0.2.200", 2.0) > 0
    assert limits.wait_s(ADA, HOME, 2.0) == 0
    assert fails(limits, 20, address=HOME, now_s=2.0) == PER_EMAIL_AND_ADDRESS.failures, "not without its own limit"
    assert limits.wait_s(ADA, "192.0.2.200", 1.0 + PER_EMAIL.window_s + 1) == 0


@given(st.integers(0, 2**64 - 1), st.integers(0, 2**64 - 1))
def test_all_addresses_of_an_ipv6_network_count_as_one(first: int, second: int) -> None:
    network = 0x20010DB8_00000001 << 64
    one, other = (str(ipaddress.IPv6Address(network | host)) for host in (first, second))
    assert counted_address(one) == counted_address(other)
    neighbour = str(ipaddress.IPv6Address((0x20010DB8_00000002 << 64) | first))
    assert counted_address(neighbour) != counted_address(one)
    limits = LoginLimits()
    fails(limits, 8, address=one)
    assert limits.wait_s(ADA, other, 1.0) > 0
    assert limits.wait_s(ADA, neighbour, 1.0) == 0


@pytest.mark.parametrize(
    ("address", "counted"),
    [
        ("192.0.2.1", "192.0.2.1"),
        ("::ffff:192.0.2.1", "192.0.2.1"),
        ("fe80::1%eth0", "fe80::/64"),
        ("", ""),
        ("testclient", "testclient"),
    ],
)
def test_addresses_are_read_however_they_are_written(address: str, counted: str) -> None:
    assert counted_address(address) == counted


def test_what_is_remembered_is_bounded() -> None:
    limits = LoginLimits()
    for number in range(25_000):
        limits.failed(str(number), str(number), 0.0)
        limits.succeeded(str(number), str(number), 0.0)
    assert len(limits._failures) <= 20_003
    assert len(limits._familiar) <= 20_000
