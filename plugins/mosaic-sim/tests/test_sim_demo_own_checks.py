"""What the demo's check sees of a connector that somebody brought, with all its handlers."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np
import pytest
import typer

from mosaic_core import (
    DataChannelJsonReceivable,
    DataChannelSendable,
    Handler,
    MediaTrackConfigurer,
    MediaTrackHandler,
    Message,
    NoParams,
)
from mosaic_core.testing import connector, joined
from mosaic_sim.demo import demo_command
from mosaic_sim.demo.checks import CheckFailed, Result
from mosaic_sim.demo.headless_check import cause_of, failures_in, with_cause
from mosaic_sim.demo.own_checks import own_works
from mosaic_sim.demo.supervisor import Interrupted


class Eye(MediaTrackHandler):
    def frames(self) -> Iterator[Any]:
        for _ in self.every(0.02):
            yield np.zeros((48, 64, 3), np.uint8)


class Light(DataChannelJsonReceivable):
    def handle_data(self, data: dict[str, Any]) -> None:
        """Shines."""


class Warmth(Message):
    celsius: float


class Thermometer(DataChannelSendable[Warmth]):
    def messages(self) -> Iterator[Warmth]:
        for _ in self.every(0.02):
            yield Warmth(celsius=20)


class ScopeConfigurer(MediaTrackConfigurer[NoParams]):
    def configure(self) -> Sequence[Handler]:
        label = self.label
        return [Eye(f"{label}_left"), Eye(f"{label}_right"), Light(f"{label}_light"), Thermometer(f"{label}_heat")]


async def test_every_handler_of_a_connector_is_looked_at() -> None:
    async with joined(connector(ScopeConfigurer, label="scope")) as link:
        seen = (await own_works(link.connection, "scope", "")).split(", ")
        assert seen[:2] == ["64×48", "takes messages"]
        assert len(seen) > 2, "and the thermometer"
        with pytest.raises(CheckFailed, match="does not announce"):
            await own_works(link.connection, "telescope", "")


class TapeConfigurer(MediaTrackConfigurer[NoParams]):
    def configure(self) -> Handler:
        return Light(f"{self.label}_head")


async def test_a_connector_whose_label_begins_like_another_is_not_counted_as_its_handler() -> None:
    three = [("scope", TapeConfigurer), ("scope_left", TapeConfigurer), ("scope_left_eye", ScopeConfigurer)]
    labels = [label for label, _ in three]
    async with joined(*(connector(kind, label=label) for label, kind in three)) as link:
        assert await own_works(link.connection, "scope", "", labels) == "takes messages"
        assert await own_works(link.connection, "scope_left", "", labels) == "takes messages"
        assert "64×48" in await own_works(link.connection, "scope_left_eye", "", labels)


def test_a_failure_is_told_of_the_connector_whose_handler_failed() -> None:
    log = "12:00:00 ERROR   connector 'lamp_post_light': no lamp; tries again in 1.0 s\n"
    assert failures_in(log, ["lamp", "lamp_post", "lam"]) == {"lamp_post": "no lamp"}
    assert failures_in(log, ["lamp", "lam"]) == {"lamp": "no lamp"}
    assert failures_in(log, ["lam"]) == {}


def test_a_device_that_is_missing_fails_what_nothing_was_seen_of() -> None:
    assert with_cause(Result("scope", True, "64×48, takes messages"), "no lamp") == Result("scope", False, "no lamp")
    assert with_cause(Result("scope", True, "64×48"), "it was away").is_ok


def test_a_body_that_blocks_the_event_loop_is_told_whatever_arrives() -> None:
    block = "by connector 'scope_left': /here/scope.py:12 in messages (plugin.blocks_loop). Use asyncio.sleep.\n"
    log = f"12:00:00 WARNING the event loop was blocked for 0.61 s, {block}"
    cause = "/here/scope.py:12 in messages: blocks the robot's event loop for 0.6 s (plugin.blocks_loop)"
    assert failures_in(log, ["scope"]) == {"scope": cause}
    assert failures_in(log.replace("was blocked for 0.61 s", "is blocked, for 2.1 s so far"), ["scope"]).keys() == {
        "scope"
    }
    assert failures_in(log.replace("0.61", "0.31"), ["scope"]) == {}
    assert with_cause(Result("scope", True, "64×48"), cause) == Result("scope", False, cause)


def test_who_blocks_the_event_loop_is_told_where_nobody_could_connect_for_it() -> None:
    blocked = {"lamp": "no lamp", "scope": "scope.py:12: blocks … (plugin.blocks_loop)"}
    assert cause_of(Result("connect", False, "did not open"), blocked) == blocked["scope"]
    assert cause_of(Result("connect", True, "12 ms"), blocked) == ""
    assert cause_of(Result("connect", False, "did not open"), {"lamp": "no lamp"}) == ""
    assert cause_of(Result("lamp", True, "takes messages"), blocked) == "no lamp"


@pytest.mark.parametrize(("is_check", "code"), [(True, 130), (False, 0)])
def test_a_check_that_is_interrupted_has_not_passed(is_check: bool, code: int, monkeypatch: pytest.MonkeyPatch) -> None:
    def interrupted(*_: Any, **__: Any) -> None:
        raise Interrupted

    monkeypatch.setattr(demo_command, "running_demo", interrupted)
    with pytest.raises(typer.Exit) as ended:
        demo_command.run_demo(None, opens=False, headless_check=is_check, as_json=True)
    assert ended.value.exit_code == code
