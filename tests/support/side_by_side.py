"""Shares out the tests of real peers among processes; most of their time is waiting. The longest come first,
so that at the end no process waits alone."""

from __future__ import annotations

import pytest
from xdist.scheduler import LoadScopeScheduling

ONE_BY_ONE = "tests/webrtc/original/"
"""Every test there makes its own robot; elsewhere those of a module share one, and stay together."""
LONGEST_FIRST = (
    "test_vanished_operator",  # each waits for the end of consent: half a minute
    "test_a_refused_robot_goes_on",
    "test_an_operator_that_never_appears",
    "test_roaming",
    "test_turn",
    "test_black_hole",
    "test_sim_demo_whole",
    "test_whole_system",
    "test_who_may",
    "test_gstreamer",
    "test_codec_refusals",
    "test_aiortc_peers",
    "test_operator_command",
    "test_overload",
    "test_fuzzed_control",
    "test_shared_video",
)


class RealPeersScheduling(LoadScopeScheduling):
    """Hands out modules, and single tests of :data:`ONE_BY_ONE`."""

    def _split_scope(self, nodeid: str) -> str:
        return nodeid if nodeid.startswith(ONE_BY_ONE) else super()._split_scope(nodeid)


def longest_first(items: list[pytest.Item]) -> None:
    """In place."""

    def rank(item: pytest.Item) -> int:
        found = (number for number, name in enumerate(LONGEST_FIRST) if name in item.nodeid)
        return next(found, len(LONGEST_FIRST))

    items.sort(key=rank)
