"""The processes that `control.py` measures: a robot is met on the way that it was asked for."""

from __future__ import annotations

from contextlib import ExitStack
from pathlib import Path

import pytest
from control_bench.site import start_site

pytestmark = pytest.mark.webrtc


@pytest.mark.parametrize("network", [None, "pristine"])
async def test_a_robot_is_met_beside_its_operator_and_behind_a_network(network: str | None, tmp_path: Path) -> None:
    with ExitStack() as stack:
        site = start_site(tmp_path, stack, network)
        async with await site.sign_in() as operator:
            connection = await operator.connect(site.robot_id)
            async with await connection.control.take() as lease:
                assert lease.epoch > 0
