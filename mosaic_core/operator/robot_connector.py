"""Which connector of which robot: the key of every store."""

from __future__ import annotations

from dataclasses import dataclass

from mosaic_core.words.data_type import MosaicDataType


@dataclass(frozen=True, slots=True)
class RobotConnector:
    """``connector_id`` is the label in the robot's YAML file. ``data_type`` is needed only for robots that announce
    no catalogue (original ones)."""

    robot_id: str
    connector_id: str
    data_type: MosaicDataType | None = None

    @property
    def key(self) -> tuple[str, str]:
        return (self.robot_id, self.connector_id)
