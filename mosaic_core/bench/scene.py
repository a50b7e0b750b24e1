"""The robot under measurement: a camera, a receiver of commands and a sender of values, without any device."""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mosaic_core.bench.time_stripe import burn
from mosaic_core.contract.configurer import DataChannelConfigurer, MediaTrackConfigurer
from mosaic_core.contract.handler import DataChannelReceivable, DataChannelSendable, MediaTrackHandler
from mosaic_core.contract.media import Captured
from mosaic_core.contract.params import Message, NoParams
from mosaic_core.laboratory.joining import ConnectorEntry, connector
from mosaic_core.words.data_type import Delivery

CAMERA, COMMANDS, VALUES = "front", "command", "pose"
WIDTH, HEIGHT, FPS = 640, 480, 30
VALUE_PERIOD_S = 0.02
MAX_OBEYED = 100_000


class Film(MediaTrackHandler):
    """A textured scene that moves, with the time of capture burnt in."""

    def frames(self) -> Iterator[Captured]:
        scene, shift = _texture(), 0
        for _ in self.every(1 / FPS):
            image = np.ascontiguousarray(scene[:, shift : shift + WIDTH])
            shift = (shift + 3) % WIDTH
            captured_at_s = time.monotonic()
            burn(image, captured_at_s)
            yield Captured(image, captured_at_s)


class FilmConfigurer(MediaTrackConfigurer[NoParams]):
    """Makes the camera that the benchmark watches."""

    connector_type = "bench-film"

    def configure(self) -> Film:
        return Film(self.label)


class BenchCommand(Message):
    """A command with the time when it was sent."""

    sent_s: float


Obeyed = deque[tuple[float, float]]
"""When a command was sent and when it reached ``handle_data``, by the clock that all processes of a machine share."""


class Obeying(DataChannelReceivable[BenchCommand]):
    """Notes when commands arrive."""

    delivery = Delivery.LATEST

    def __init__(self, label: str, obeyed: Obeyed) -> None:
        super().__init__(label)
        self._obeyed = obeyed

    def handle_data(self, data: BenchCommand) -> None:
        self._obeyed.append((data.sent_s, time.monotonic()))


class Value(Message):
    """A value with the time when it was sent."""

    sent_s: float


class Telling(DataChannelSendable[Value]):
    """Values as fast as a robot tells where it is."""

    delivery = Delivery.LATEST

    def messages(self) -> Iterator[Value]:
        for _ in self.every(VALUE_PERIOD_S):
            yield Value(sent_s=time.monotonic())


class TellingConfigurer(DataChannelConfigurer[NoParams]):
    """Makes the connector that sends the benchmark's values."""

    connector_type = "bench-values"

    def configure(self) -> Telling:
        return Telling(self.label)


def scene(obeyed: Obeyed) -> tuple[ConnectorEntry, ...]:
    """The connectors; what arrives is noted in ``obeyed``."""

    class ObeyingConfigurer(DataChannelConfigurer[NoParams]):
        """Makes the connector that takes the benchmark's commands."""

        connector_type = "bench-commands"

        def configure(self) -> Obeying:
            return Obeying(self.label, obeyed)

    return (
        connector(FilmConfigurer, label=CAMERA),
        connector(ObeyingConfigurer, label=COMMANDS),
        connector(TellingConfigurer, label=VALUES),
    )


def _texture() -> NDArray[Any]:
    """Twice as wide as the picture and periodic, with edges and grain as a room has."""
    noise = np.random.default_rng(7)
    coarse = noise.integers(40, 216, (HEIGHT // 24, WIDTH // 32, 3), np.uint8)
    once = np.kron(coarse, np.ones((24, 32, 1), np.uint8)).astype(np.int16)
    once += noise.integers(-12, 13, once.shape, np.int16)
    return np.tile(np.clip(once, 0, 255).astype(np.uint8), (1, 2, 1))
