"""A person behind a NAT, in Chromium, whose host candidates are names that nobody outside can resolve."""

from __future__ import annotations

from typing import Any

import pytest
from laboratory.browser import REAL_ADDRESSES, Visit, signed_in, visit
from laboratory.fleet import Fleet

pytestmark = [pytest.mark.e2e, pytest.mark.netlab, pytest.mark.timeout(120)]

SLOW_S = 8.0
"""Far more than it takes (bench/through_turn.py), and less than any time-out that it might have waited for."""


def seen_by_a_person(fleet: Fleet, chromium: str, *flags: str) -> Visit:
    def person() -> Visit:
        with signed_in(fleet, chromium, *flags) as page:
            return visit(fleet, page)

    found: Visit = fleet.lab.networks["operator"].run(person)
    return found


@pytest.mark.parametrize("flags", [(), (REAL_ADDRESSES,)], ids=["names", "addresses"])
def test_chromium_meets_the_robot_at_the_relay_whether_it_hides_its_address_or_not(
    fleet: Fleet, chromium: str, flags: tuple[str, ...]
) -> None:
    found = seen_by_a_person(fleet, chromium, *flags)
    hosts = [candidate for candidate in found.candidates if " typ host" in candidate]
    assert hosts
    assert all((".local " in candidate) != bool(flags) for candidate in hosts)
    assert "relay" in found.pair
    assert found.data_s < SLOW_S
    assert found.frame_s < SLOW_S


def test_chromium_and_the_robot_meet_directly_where_both_nats_keep_their_ports(
    cone_fleet: Fleet, chromium: str
) -> None:
    found = seen_by_a_person(cone_fleet, chromium)
    assert "relay" not in found.pair
    assert found.data_s < SLOW_S


def test_a_program_and_the_robot_meet_directly_where_both_nats_keep_their_ports(cone_fleet: Fleet) -> None:
    async def body() -> Any:
        async with await cone_fleet.signed_in() as operator:
            connection = await operator.connect(cone_fleet.account["robotId"], timeout_s=30)
            await connection.receivable("pose").next_message()
            return connection._peer.offerer.path()

    path = cone_fleet.lab.on_operators_side(body)
    assert path is not None
    assert "relay" not in (path.local_type, path.remote_type)
