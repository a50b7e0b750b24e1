"""Whatever moves among all installed connectors and drives passes the whole drill, and really acts. A new one is
drilled as soon as it has an entry point.
"""

from __future__ import annotations

import os
from collections.abc import Mapping
from importlib.metadata import EntryPoint, entry_points
from typing import Any

import pytest
from support.live_drill import assert_safe, drilled, live_drill

from mosaic_cmdvel.cmd_vel import CmdVelConfigurer
from mosaic_core.contract.handler import DataChannelReceivable
from mosaic_core.contract.request_handler import RequestHandler
from mosaic_core.ladder.examinee import Examinee
from mosaic_core.ladder.shipment import Shipment
from mosaic_core.messages import Twist
from mosaic_core.runtime.configuration.auto_configurer import Configured
from mosaic_core.runtime.configuration.receiver_safety import ReceiverSafety
from mosaic_core.testing import connector

CONNECTORS = sorted(entry_points(group="mosaic.connectors"), key=lambda one: one.name)
MOVE_IN_COMPANY = {
    "mavlink-manual", "mavlink-velocity", "ros2-receiver-geometry-Twist", "ros2-receiver-geometry-TwistStamped",
}  # fmt: skip
"""They move nothing without an armed vehicle or a node that listens; tests of their own drill them beside one."""
RUN_WITH_THE_CLOCK = {"mujoco-gripper-target"}
"""Simulated in real time: how far it comes while it is drilled, a busy machine decides. It is drilled dry."""
ARE_KNOWN_TO_MOVE = {
    "arm-gripper", "arm-joints", "can-send", "cmd-vel", "gpio-output", "gpio-servo", "modbus-write", "mqtt-publish",
    "mujoco-gripper-target", "mujoco-joint-target", "serial-json", "serial-text", "sim-mast-target",
}  # fmt: skip
"""Were one of these taken for something that stands still, it would not be drilled."""


def moves(configured: Configured) -> bool:
    """Whether its connector, the first, has a receiver of motion."""
    one = configured.connectors[0]
    receivers = [part for part in one.handlers if isinstance(part, DataChannelReceivable)]
    motion = [part for part in receivers if not isinstance(part, RequestHandler)]
    return any(ReceiverSafety.of(one.safety, part).is_motion for part in motion)


@pytest.mark.parametrize("entry_point", CONNECTORS, ids=lambda one: one.name)
async def test_whatever_moves_passes_the_whole_drill(entry_point: EntryPoint) -> None:
    one = Examinee(Shipment(entry_point.name, "", (entry_point,), {}), entry_point)
    configured = one.configured(one.trial)
    assert moves(configured) or entry_point.name not in ARE_KNOWN_TO_MOVE
    if moves(configured) and entry_point.name not in MOVE_IN_COMPANY:
        assert_safe(await live_drill(configured, live=entry_point.name not in RUN_WITH_THE_CLOCK))


def test_those_that_are_drilled_elsewhere_are_there() -> None:
    assert {one.name for one in CONNECTORS} >= MOVE_IN_COMPANY | ARE_KNOWN_TO_MOVE


def ignore(twist: Twist) -> None:
    """The function of a drive that calls one."""


DRIVES: Mapping[str, Mapping[str, Any]] = {
    "callback": {"function": ignore},
    "log": {},
    "mujoco": {"model": "vehicle", "left": "left_wheel", "right": "right_wheel", "wheel_radius_m": 0.06,
               "track_width_m": 0.25},
    "sim": {},
    "unicycle": {"wheel_radius_m": 0.05, "track_width_m": 0.3},
}  # fmt: skip
"""What each needs; its connector's own trial drills the one that logs."""


@pytest.mark.parametrize("name", sorted(one.name for one in entry_points(group="mosaic.drives")))
async def test_a_base_with_any_drive_passes_the_whole_drill(name: str) -> None:
    controller, port = os.openpty()
    try:
        serial = {"port": os.ttyname(port)} if name == "unicycle" else {}
        drive = {"type": name, **DRIVES[name], **serial}
        assert_safe(await drilled(connector(CmdVelConfigurer, label="base", params={"drive": drive})))
    finally:
        os.close(controller)
        os.close(port)
