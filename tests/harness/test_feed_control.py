"""The kit plays leases, stops and limits as the robot enforces them."""

from __future__ import annotations

from dataclasses import replace
from typing import Any, ClassVar

import pytest

from mosaic_core import DataChannelJsonReceivable
from mosaic_core.contract.configurer import DataChannelConfigurer
from mosaic_core.contract.params import NoParams
from mosaic_core.testing import (
    ANOTHER_OPERATOR,
    OPERATOR,
    Cleared,
    From,
    Leaves,
    LosesLease,
    MadeSafe,
    Silence,
    SlowedTo,
    Stopped,
    build,
    feed,
)

OBSERVER = replace(OPERATOR, role="observer")


class Base(DataChannelJsonReceivable):
    timeout_s = 0.5
    requires_lease = True
    motion_fields: ClassVar[tuple[str, ...]] = ("v",)

    def __init__(self, label: str) -> None:
        super().__init__(label)
        self.speeds: list[float] = []

    def handle_data(self, data: dict[str, Any]) -> None:
        self.speeds.append(data["v"])

    def make_safe(self, cause: str) -> None:
        """Stands."""


class BaseConfigurer(DataChannelConfigurer[NoParams]):
    connector_type = "base"

    def configure(self) -> Base:
        return Base(self.label)


def base(**safety: Any) -> Base:
    return build(BaseConfigurer, safety=safety)


def test_a_stop_makes_safe_and_refuses_until_it_is_cleared() -> None:
    fed = feed(base(), [{"v": 1}, Stopped(ANOTHER_OPERATOR), {"v": 2}, Cleared(), {"v": 3}, {"v": 0}, {"v": 4}])
    assert fed.made_safe == [MadeSafe(0.0, "safety.stop")]
    assert [refused.code for refused in fed.refused] == ["safety.stopped", "safety.release_first"]
    assert fed.accepted == [{"v": 1.0}, {"v": 0.0}, {"v": 4.0}]


def test_after_a_stop_a_pause_lets_go_too_and_whoever_sent_nothing_holds_nothing() -> None:
    fed = feed(base(), [{"v": 1}, Stopped(), Cleared(), Silence(10.0), {"v": 2}, From(ANOTHER_OPERATOR, {"v": 3})])
    assert fed.refused == []
    assert fed.accepted == [{"v": 1.0}, {"v": 2.0}, {"v": 3.0}]


def test_whoever_loses_the_lease_is_stopped_and_refused() -> None:
    fed = feed(base(), [{"v": 1}, LosesLease(), {"v": 2}, From(ANOTHER_OPERATOR, {"v": 3})])
    assert fed.made_safe == [MadeSafe(0.0, "safety.lease_lost")]
    assert [refused.code for refused in fed.refused] == ["lease.required"]
    assert fed.accepted[-1] == {"v": 3.0}


def test_the_lease_of_somebody_who_moved_nothing_ends_without_a_stop() -> None:
    fed = feed(base(), [{"v": 1}, LosesLease(ANOTHER_OPERATOR)])
    assert fed.made_safe == []


def test_observers_are_refused() -> None:
    fed = feed(base(), [From(OBSERVER, {"v": 1})])
    assert [refused.code for refused in fed.refused] == ["lease.forbidden"]


def test_limits_and_a_slow_link_shape_what_the_handler_gets() -> None:
    receiver = base(limits={"v": {"max": 0.5}})
    feed(receiver, [{"v": 9}, SlowedTo(0.5), {"v": 0.4}, SlowedTo(0.0), {"v": 9}])
    assert receiver.speeds == [0.5, 0.2, 0.0]


def test_too_many_commands_are_refused() -> None:
    fed = feed(base(max_rate_hz=4), [{"v": 1}] * 4)
    assert [refused.code for refused in fed.refused] == ["safety.too_fast"] * 2


def test_zeros_after_a_second_reach_the_handler_no_more_and_no_timeout_strikes() -> None:
    receiver = base()
    fed = feed(receiver, [step for _ in range(30) for step in ({"v": 0}, Silence(0.1))] + [Silence(2.0)])
    assert len(receiver.speeds) == 10
    assert fed.idle == 20
    assert fed.made_safe == []


@pytest.mark.parametrize(("policy", "sent"), [("zero", [1.0, *[0.0] * 10]), ("callback", [1.0]), ("hold", [1.0])])
def test_silence_is_followed_by_what_the_policy_says(policy: str, sent: list[float]) -> None:
    receiver = base(on_timeout=policy)
    fed = feed(receiver, [{"v": 1}, Silence(3.0)])
    assert receiver.speeds == sent
    assert len(fed.made_safe) == (0 if policy == "hold" else 1)


def test_a_lost_link_has_a_policy_of_its_own() -> None:
    fed = feed(base(on_loss="hold"), [{"v": 1}, Leaves(OPERATOR), Silence(1.0)])
    assert fed.made_safe == [MadeSafe(0.5, "safety.timeout")]
