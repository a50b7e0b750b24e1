"""Where a rate begins: what a connector says of where it is is taken only where it can be meant."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from typing import Any

import numpy as np
import pytest

from mosaic_core import DataChannelConfigurer, DataChannelReceivable, FieldBounds, Message, MosaicError, NoParams
from mosaic_core.messages import JointTarget
from mosaic_core.runtime.commands.reported_position import ReportedPosition
from mosaic_core.runtime.configuration.receiver_safety import ReceiverSafety
from mosaic_core.testing import Silence, build, feed
from mosaic_core.words.config import SafetyConfig


class Pan(DataChannelReceivable[JointTarget]):
    timeout_s = 0.5
    limits: Mapping[str, FieldBounds] = {"positions.*": FieldBounds(min=-1.5, max=1.5, max_rate_per_s=1.0)}

    def __init__(self, label: str) -> None:
        super().__init__(label)
        self.says: Any = 0.0
        self.told: list[float] = []

    def handle_data(self, data: JointTarget) -> None:
        self.told += data.positions

    def make_safe(self, cause: str) -> None:
        """It holds by itself."""

    def reported_position(self, field: str) -> float | None:
        return self.says  # type: ignore[no-any-return]


class PanConfigurer(DataChannelConfigurer[NoParams]):
    def configure(self) -> Pan:
        return Pan(self.label)


def report(**limits: FieldBounds) -> ReportedPosition:
    pan = Pan("pan")
    return ReportedPosition(pan, ReceiverSafety.of(SafetyConfig(limits=limits), pan))


@pytest.mark.parametrize(
    ("said", "place"),
    [(None, None), (math.nan, None), (math.inf, None), (1, 1.0), (np.float32(0.5), 0.5), (4.5, 4.5), (-4.5, -4.5)],
)
def test_a_number_near_the_range_is_where_it_is_and_what_is_none_is_unknown(said: Any, place: float | None) -> None:
    assert report().checked("positions.pan", said) == place


@pytest.mark.parametrize(
    ("said", "told"),
    [
        ("1", "says '1' of 'positions.pan'. Return a number, or None if unknown."),
        ([1.0], "says [1.0] of 'positions.pan'. Return a number"),
        (4.6, "says 4.6 of 'positions.pan', far outside of its range -1.5 … 1.5. Return it in the unit of the message"),
        (-80.0, "says -80 of 'positions.pan', far outside"),
    ],
)
def test_what_can_not_be_meant_is_told_with_class_and_line(said: Any, told: str) -> None:
    line = Pan.reported_position.__code__.co_firstlineno
    with pytest.raises(MosaicError, match=re.escape(told)) as caught:
        report().checked("positions.pan", said)
    assert caught.value.code == "plugin.wrong_message"
    assert caught.value.message.startswith(f"Pan.reported_position ({__file__}:{line}) says ")


def test_where_an_end_of_the_range_is_unknown_any_number_may_be_meant() -> None:
    class Winch(Message):
        length_m: float

    class Reel(DataChannelReceivable[Winch]):
        timeout_s = 0.5
        position_fields = ("length_m",)

        def make_safe(self, cause: str) -> None:
            """It brakes by itself."""

    reel = Reel("reel")
    safety = ReceiverSafety.of(SafetyConfig(limits={"length_m": FieldBounds(min=0, kind="position")}), reel)
    assert ReportedPosition(reel, safety).checked("length_m", 1e6) == 1e6


def test_an_arm_that_tells_degrees_for_radians_is_not_sent_there() -> None:
    pan = build(PanConfigurer)
    pan.says = 0.0
    feed(pan, [{"names": ["pan"], "positions": [0.05]}, Silence(2)])
    assert pan.told == [0.05]
    pan.says = 11.5
    with pytest.raises(MosaicError, match=r"says 11\.5 of 'positions\.pan', far outside"):
        feed(pan, [{"names": ["pan"], "positions": [0.2]}])
    assert pan.told == [0.05]
