"""Which connector of which robot: the key of every store."""

from __future__ import annotations

from dataclasses import dataclass

from mosaic_core.words.data_type import MosaicDataType


@dataclass(frozen=True, slots=True, init=False)
class RobotConnector:
    """A connector of a robot, as an operator names it. ``connector_id`` is the label in the robot's YAML file.
    ``data_type``, also as text (``"json-r2u"``), is needed only for connectors that neither the robot nor the server's
    description of it names (of original robots).
    """

    robot_id: str
    connector_id: str
    data_type: MosaicDataType | None = None

    def __init__(self, robot_id: str, connector_id: str, data_type: MosaicDataType | str | None = None) -> None:
        """Raises :class:`ConnectionFailed` for a data type that does not exist, naming the nearest."""
        object.__setattr__(self, "robot_id", robot_id)
        object.__setattr__(self, "connector_id", connector_id)
        object.__setattr__(self, "data_type", None if data_type is None else MosaicDataType.named(data_type))

    @property
    def key(self) -> tuple[str, str]:
        """Robot and connector, by which stores are found again."""
        return (self.robot_id, self.connector_id)
