"""Networks without IPv4, and with both: signaling and the peer connection take what there is."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from typing import Any

import pytest
from laboratory.ipv6 import V4, SixSite, run_six_site
from laboratory.nats import command

from mosaic_core.machines.peers.chosen_path import ChosenPath
from mosaic_core.operator import MosaicOperator

pytestmark = [pytest.mark.netlab, pytest.mark.timeout(120)]


@pytest.fixture(scope="module", params=[False, True], ids=["ipv6-only", "dual-stack"])
def six_site(
    request: pytest.FixtureRequest,
    lab: Any,
    tmp_path_factory: pytest.TempPathFactory,
    wait_for: Callable[..., float],
) -> Iterator[SixSite]:
    with ExitStack() as stack:
        yield run_six_site(tmp_path_factory.mktemp("six"), stack, wait_for, with_v4=request.param)


def path_of(site: SixSite) -> ChosenPath:
    async def body() -> ChosenPath:
        async with await MosaicOperator.login(site.url, site.account["email"], site.account["password"]) as operator:
            connection = await operator.connect(site.account["robotId"], timeout_s=20)
            await connection.receivable("pose").next_message()
            path = connection._peer.offerer.path()
            assert path is not None
            return path

    found: ChosenPath = site.networks["operator"].run(lambda: asyncio.run(body()))
    return found


def test_robot_and_operator_meet_over_what_they_have(six_site: SixSite) -> None:
    path = path_of(six_site)
    has_v4 = V4["operator"] in command(*six_site.networks["operator"].prefix, "ip", "addr")
    assert has_v4 or "2001:db8:1::2" in path.remote_address


def test_a_dual_stack_whose_ipv4_leads_nowhere_costs_nothing(six_site: SixSite) -> None:
    router = six_site.networks["router"].name
    for prefix in V4.values():
        command("ip", "-n", router, "route", "add", "blackhole", f"{prefix}.2/32")
    assert "2001:db8:1::2" in path_of(six_site).remote_address
