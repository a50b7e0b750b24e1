"""Shares out the tests among processes. What takes longest comes first, so that at the end no process works alone."""

from __future__ import annotations

import pytest
from xdist.scheduler import LoadScopeScheduling

ONE_BY_ONE = ("tests/webrtc/original/", "tests/drill/")
"""Every test there makes its own robot; elsewhere those of a module share one, and stay together."""
LONGEST_FIRST = (
    "test_own_page",
    "test_accessibility",
    "test_site_in_chromium",
    "test_sim_demo_whole",
    "test_operator_command",
    "test_whole_system",
    "test_roaming",
    "test_aiortc_peers",
    "test_who_may",
    "test_black_hole",
    "test_everything_that_moves",
    "test_sim_demo_own",
    "test_plugin_new",
    "test_ladder_rules",
    "test_server_compatibility",
    "test_a_refused_robot_goes_on",
    "test_vanished_operator",
    "test_server_cli",
    "test_video_on_a_shared_link",
    "test_drill.py",
    "test_turn.py",
    "test_thirty_plugins",
    "test_shell_blocks",
    "test_reload.py",
    "test_ros2_over_dds",
    "test_command_line",
    "test_ros2_drill",
    "test_pairing_programs",
    "test_original_server",
    "test_recorder_robot",
    "test_viewers_come_and_go",
    "test_server_sockets",
    "test_original_dashboard",
    "test_ipv6",
    "test_overload",
    "test_an_operator_that_never_appears",
    "test_server_rest.py",
    "test_doctor_with_server",
    "test_entrance",
    "test_fuzzed_control",
    "test_video_over_bad_links",
    "test_lan_child",
    "test_a_camera_asked_for_later",
    "test_recorder_movie_file",
    "test_control_walks",
    "test_shared_video",
    "test_server_role_changes",
    "test_ice_probes",
    "test_gstreamer",
    "test_codec_refusals",
    "test_grant_properties",
    "test_server_grants",
    "test_recorder_clip",
    "test_mosaic_bench",
    "test_libdatachannel_peers",
    "test_control_with_robot",
    "test_quick_sctp",
    "test_forged_tickets",
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
