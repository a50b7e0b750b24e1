"""Shares out the tests among processes. What takes longest comes first, so that at the end no process works alone."""

from __future__ import annotations

import pytest
from xdist.scheduler import LoadScopeScheduling

ONE_BY_ONE = "tests/webrtc/original/"
"""Every test there makes its own robot; elsewhere those of a module share one, and stay together."""
LONGEST_FIRST = (
    "test_original_page",
    "test_server_role_changes",
    "test_grant_properties",
    "test_recorder_robot",
    "test_control_walks",
    "test_original_dashboard",
    "test_server_guessing",
    "test_server_sockets",
    "test_server_postgresql",
    "test_sim_renderer",
    "test_drill",
    "test_loaded_modules",
    "test_video_on_a_shared_link",
    "test_docs",
    "test_sim_motion",
    "test_vanished_operator",
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
