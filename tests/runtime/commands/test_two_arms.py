"""Two arms whose joints have equal names are limited and commanded each by itself."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from mosaic_core import DataChannelConfigurer, DataChannelReceivable, DataChannelSendable, FieldBounds, NoParams
from mosaic_core.messages import JointState, JointTarget
from mosaic_core.testing import connector, joined, until


class Arm(DataChannelReceivable[JointTarget]):
    requires_lease = True
    timeout_s = 5.0
    item_names = ("base", "lift")
    limits: Mapping[str, FieldBounds] = {"positions.base": FieldBounds(min=-1, max=1)}

    def __init__(self, label: str) -> None:
        super().__init__(label)
        self.targets: list[JointTarget] = []

    def reported_position(self, field: str) -> float | None:
        return 0.0

    def handle_data(self, data: JointTarget) -> None:
        self.targets.append(data)

    def make_safe(self, cause: str) -> None:
        """Holds."""


class ArmJoints(DataChannelSendable[JointState]):
    """Says nothing here."""


class ArmConfigurer(DataChannelConfigurer[NoParams]):
    connector_type = "arm"

    def configure(self) -> Any:
        return Arm(self.label), ArmJoints(f"{self.label}_joints")


async def test_joints_of_equal_names_are_those_of_their_own_connector() -> None:
    right_safety = {"resource": "right_arm", "limits": {"positions.base": {"max": 0.5}}}
    arms = connector(ArmConfigurer, label="left"), connector(ArmConfigurer, label="right", safety=right_safety)
    async with joined(*arms, takes_leases=True) as link:
        left, right = (one.handlers[0] for one in link.configured.connectors)
        assert isinstance(left, Arm)
        assert isinstance(right, Arm)
        for label in ("left", "right"):
            pad = link.connection.sendable(label)
            await pad.wait_open()
            assert pad.send_json({"names": ["base"], "positions": [9.0]})
        await until(lambda: left.targets and right.targets)
        assert [one.positions for one in left.targets] == [[1.0]]
        assert [one.positions for one in right.targets] == [[0.5]]
        told = {one.label: one.connector for one in link.connection.catalogue.entries}
        assert told == {"left": "left", "left_joints": "left", "right": "right", "right_joints": "right"}
