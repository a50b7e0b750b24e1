"""The kit plays the limits of positions as the robot enforces them."""

from __future__ import annotations

import asyncio
import re
from typing import ClassVar

import pytest

from mosaic_core import DataChannelConfigurer, DataChannelReceivable, Message, NoParams
from mosaic_core.testing import Cleared, Silence, SlowedTo, Stopped, build, connector, feed, joined, until
from mosaic_core.words.errors import ConfigError

RATE = {"angle_deg": {"min": 5, "max": 90, "max_rate_per_s": 90}}


class Wish(Message):
    angle_deg: float = 0.0
    grip: float | None = None


class Arm(DataChannelReceivable[Wish]):
    """An arm that is at 60°, and wherever it was sent since."""

    timeout_s = 0.5
    requires_lease = True
    position_fields: ClassVar[tuple[str, ...]] = ("angle_deg",)

    def __init__(self, label: str) -> None:
        super().__init__(label)
        self.is_at: float | None = 60.0
        self.sent: list[float] = []
        self.causes: list[str] = []

    def reported_position(self, field: str) -> float | None:
        assert field == "angle_deg"
        return self.is_at

    def handle_data(self, data: Wish) -> None:
        self.is_at = data.angle_deg
        self.sent.append(data.angle_deg)

    def make_safe(self, cause: str) -> None:
        """It holds by itself."""
        self.causes.append(cause)


class ArmConfigurer(DataChannelConfigurer[NoParams]):
    connector_type = "arm"

    def configure(self) -> Arm:
        return Arm(self.label)


@pytest.mark.parametrize(
    ("safety", "told"),
    [
        ({"limits": {"angle_dg": {"max": 1}}}, "did you mean 'angle_deg'?"),
        ({"limits": {"angle_deg": {"min": 3, "max": 1}}}, "min 3 is above max 1"),
        ({"on_timeout": "zero"}, "0 is no standstill"),
    ],
)
def test_safety_that_validate_would_refuse_is_refused_where_a_test_builds(safety: dict[str, object], told: str) -> None:
    with pytest.raises(ConfigError, match=re.escape(told)):
        build(ArmConfigurer, safety=safety)


def arm(**safety: object) -> Arm:
    return build(ArmConfigurer, safety={"limits": RATE, **safety})


def test_an_arm_that_is_told_to_stay_stays_through_a_time_out_and_a_stop() -> None:
    one = arm()
    stay = {"angle_deg": 60}
    fed = feed(one, [stay, stay, Silence(5.0), stay, Stopped(), Cleared(), Silence(1.0), stay])
    assert [made.cause for made in fed.made_safe] == ["safety.timeout", "safety.stop"]
    assert one.sent == [60, 60, 60, 60]


def test_after_a_stop_only_a_pause_lets_go_of_a_position() -> None:
    fed = feed(arm(), [{"angle_deg": 60}, Stopped(), Cleared(), {"angle_deg": 0}, Silence(0.5), {"angle_deg": 61}])
    assert [refused.code for refused in fed.refused] == ["safety.release_first"]
    assert [wish.angle_deg for wish in fed.accepted] == [60, 61]


def test_a_message_that_leaves_the_position_out_means_the_default_and_gets_there_slowly() -> None:
    one = arm()
    feed(one, [{}, Silence(0.1), {}])
    assert one.sent == pytest.approx([51, 42])


def test_a_bad_link_slows_the_arm_and_moves_it_nowhere_else() -> None:
    one = arm()
    feed(one, [SlowedTo(0.5), {"angle_deg": 60}, Silence(0.1), {"angle_deg": 90}, SlowedTo(0.0), {"angle_deg": 90}])
    assert one.sent == pytest.approx([60, 64.5, 64.5])


def test_a_position_that_is_not_known_is_refused_until_it_is() -> None:
    one = arm()
    one.is_at = None
    fed = feed(one, [{"angle_deg": 60}])
    assert [refused.code for refused in fed.refused] == ["safety.position_unknown"]
    assert one.sent == []


async def test_an_arm_is_moved_from_where_it_is_by_an_operator_on_a_robot() -> None:
    arm = connector(ArmConfigurer, label="arm", safety={"limits": RATE, "slow_down": "off"})
    async with joined(arm, takes_leases=True) as link:
        (handler,) = link.configured.connectors[0].handlers
        assert isinstance(handler, Arm)
        store = link.connection.sendable("arm")
        await store.wait_open()
        assert store.send_json({"angle_deg": 60})
        await until(lambda: handler.causes == ["safety.timeout"])
        while handler.sent[-1] < 61:
            assert store.send_json({"angle_deg": 61})
            await asyncio.sleep(0.01)
        assert min(handler.sent) == 60
        assert max(handler.sent) == 61
