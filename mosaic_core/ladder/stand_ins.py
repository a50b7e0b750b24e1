"""Stands in for the cameras and channels that params name: a recorder can't be configured on a robot without any."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from mosaic_core.contract.configurer import DataChannelConfigurer, MediaTrackConfigurer
from mosaic_core.contract.handler import DataChannelSendable, MediaTrackHandler
from mosaic_core.contract.params import NoParams
from mosaic_core.messages import Temperature

PERIOD_S = 0.1


class StandInCamera(MediaTrackHandler):
    """Shows a small gray picture, ten times a second."""

    def frames(self) -> Iterator[NDArray[np.uint8]]:
        for tick in self.every(PERIOD_S):
            yield np.full((48, 64, 3), tick % 256, np.uint8)


class StandInCameraConfigurer(MediaTrackConfigurer[NoParams]):
    """A camera that stands in for the one that a connector under examination names."""

    connector_type = "stand-in-camera"

    def configure(self) -> StandInCamera:
        return StandInCamera(self.label)


class StandInChannel(DataChannelSendable[Temperature]):
    """Tells a temperature, ten times a second."""

    def messages(self) -> Iterator[Temperature]:
        for _ in self.every(PERIOD_S):
            yield Temperature(temperature_c=20.0)


class StandInChannelConfigurer(DataChannelConfigurer[NoParams]):
    """A data channel that stands in for the one that a connector under examination names."""

    connector_type = "stand-in-channel"

    def configure(self) -> StandInChannel:
        return StandInChannel(self.label)
