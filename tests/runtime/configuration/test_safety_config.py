"""What ``safety:`` and ``control:`` may say, and which nonsense is told before anything starts."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, ClassVar

import pytest
from pydantic import AliasChoices, ConfigDict, Field, ValidationError
from support.refused_start import problems_at_start

from mosaic_core import DataChannelReceivable, DataChannelStringReceivable, Message
from mosaic_core.contract.configurer import DataChannelConfigurer
from mosaic_core.contract.message_fields import message_fields
from mosaic_core.contract.params import NoParams
from mosaic_core.runtime.configuration.checked_config import Validation
from mosaic_core.runtime.configuration.receiver_safety import ReceiverSafety
from mosaic_core.testing import connector, joined
from mosaic_core.words.config import ControlConfig, SafetyConfig
from mosaic_core.words.limits import NO_SLOW_DOWN, FieldLimit, SlowDownCurves


class Velocity(Message):
    x: float = 0.0
    y: float | None = None


class Twist(Message):
    linear: Velocity
    gear: int = 1
    name: str = ""


class Base(DataChannelReceivable[Twist]):
    timeout_s = 0.4
    requires_lease = True
    motion_fields: ClassVar[tuple[str, ...]] = ("linear.x", "linear.y")

    def handle_data(self, data: Twist) -> None:
        """Takes everything."""

    def make_safe(self, cause: str) -> None:
        """Stands."""


class Door(DataChannelStringReceivable):
    def handle_data(self, data: str) -> None:
        """Takes everything."""


class BaseConfigurer(DataChannelConfigurer[NoParams]):
    connector_type = "base"

    def configure(self) -> Base:
        return Base(self.label)


class DoorConfigurer(DataChannelConfigurer[NoParams]):
    connector_type = "door"

    def configure(self) -> Door:
        return Door(self.label)


def effective(handler: Any, safety: dict[str, Any] | None = None) -> ReceiverSafety:
    return ReceiverSafety.of(SafetyConfig.model_validate(safety or {}), handler)


def test_a_receiver_that_says_nothing_is_left_alone() -> None:
    it = effective(Door("door"))
    assert it == ReceiverSafety()
    assert not it.is_motion
    assert not it.is_slowed


def test_what_the_file_does_not_say_the_handler_says() -> None:
    it = effective(Base("base"))
    assert (it.timeout_s, it.resource, it.curves) == (0.4, "motion", SlowDownCurves())
    assert it.is_motion
    assert it.is_slowed


def test_the_file_overrides_the_handler() -> None:
    it = effective(Base("base"), {"timeout_s": 1, "requires_lease": False, "on_timeout": "zero", "slow_down": "off"})
    assert (it.timeout_s, it.resource, it.curves) == (1.0, None, NO_SLOW_DOWN)
    assert (it.on_timeout, it.on_loss) == ("zero", "zero")


def test_a_timeout_alone_makes_a_motion_receiver() -> None:
    assert effective(Door("door"), {"timeout_s": 1}).is_motion


@pytest.mark.parametrize("off", ["off", None, False])
def test_off_switches_a_curve_off_however_yaml_reads_it(off: Any) -> None:
    curves = effective(Base("base"), {"slow_down": {"rtt_ms": off}}).curves
    assert curves == SlowDownCurves(rtt_ms=None)
    assert effective(Base("base"), {"slow_down": off if off is not None else "off"}).curves == NO_SLOW_DOWN


def test_limits_become_those_of_fields() -> None:
    it = effective(Base("base"), {"limits": {"linear.x": {"min": -0.5, "max": 0.8, "max_rise_per_s": 1}}})
    assert it.limits == (FieldLimit(("linear.x",), -0.5, 0.8, None, 1.0, None),)


@pytest.mark.parametrize(
    "wrong",
    [
        {"timeout_s": 0},
        {"timeout_s": float("nan")},
        {"on_timeout": "panic"},
        {"resource": "Left Arm"},
        {"max_rate_hz": -1},
        {"limits": {"linear..x": {"max": 1}}},
        {"limits": {"linear.x": {"kind": "effort"}}},
        {"limits": {"linear.x": {"max_rise_per_s": 0}}},
        {"limits": {"linear.x": {"maximum": 1}}},
        {"slow_down": {"rtt_ms": [[300, 1], [150, 0.5]]}},
        {"slow_down": {"rtt_ms": [[150, 0.5], [300, 1]]}},
        {"slow_down": {"loss": [[0.1, 1.5]]}},
        {"slow_down": {"picture": "required", "picture_ms": "off"}},
        {"slow_down": {"rtt": [[1, 1]]}},
        {"slow_down": "sometimes"},
    ],
)
def test_nonsense_is_refused(wrong: dict[str, Any]) -> None:
    with pytest.raises(ValidationError):
        SafetyConfig.model_validate(wrong)


@pytest.mark.parametrize("wrong", [{"legacy_peers": "maybe"}, {"lease_expiry_s": 0.1}, {"lease": 1}])
def test_nonsense_about_control_is_refused(wrong: dict[str, Any]) -> None:
    with pytest.raises(ValidationError):
        ControlConfig.model_validate(wrong)


async def test_the_numbers_of_a_message_are_known_by_their_paths() -> None:
    assert message_fields(Twist).numbers == {"linear.x", "linear.y", "gear"}
    assert message_fields(None).numbers == frozenset()


def problems_of(configurer: Any, safety: dict[str, Any]) -> list[str]:
    found = problems_at_start(configurer, label="a", safety=safety)
    return [f"{problem.message}; {problem.cure}" for problem in found]


def test_a_misspelt_field_is_told_with_the_nearest_name() -> None:
    (told,) = problems_of(BaseConfigurer, {"limits": {"linear.z": {"max": 1}}})
    assert "no number 'linear.z'" in told
    assert "linear.x" in told or "linear.y" in told


@pytest.mark.parametrize(
    ("safety", "words"),
    [
        ({"limits": {"x": {"max": 1}}}, "takes no JSON messages"),
        ({"timeout_s": 1, "on_timeout": "zero"}, "no motion fields"),
        ({"on_loss": "zero"}, "no motion fields"),
        ({"resource": "arm"}, "needs no lease"),
    ],
)
def test_limits_that_nothing_can_follow_are_told(safety: dict[str, Any], words: str) -> None:
    (told,) = problems_of(DoorConfigurer, safety)
    assert words in told


async def test_the_catalogue_announces_what_holds() -> None:
    async with joined(connector(BaseConfigurer, label="base", safety={"resource": "arm"})) as link:
        safety: Any = link.robot.catalogue.entries[0].safety
    assert (safety["timeout_s"], safety["requires_lease"], safety["resource"]) == (0.4, True, "arm")
    assert safety["slow_down"]["picture"] == "if_watching"


def test_a_leased_connector_without_a_timeout_is_worth_a_hint(
    check: Callable[..., Validation], robot_yaml: Callable[..., str]
) -> None:
    def hints(control: str) -> list[str]:
        entry = "[{type: motor, label: a, params: {pin: 1}, safety: {requires_lease: true}}]"
        return [hint.message for hint in check(robot_yaml(entry) + control).hints]

    assert any("original dashboard" in hint for hint in hints(""))
    assert not any("original dashboard" in hint for hint in hints("control: {legacy_peers: observe}\n"))


@pytest.mark.parametrize(
    ("safety", "words"),
    [
        ("{timeout_s: 0.3, on_timeout: hold}", ["until its lease ends"]),
        (
            "{timeout_s: 0.3, on_timeout: hold, requires_lease: false}",
            ["until somebody says stop", "several at a time"],
        ),
        ("{timeout_s: 0.3, requires_lease: true}", []),
    ],
)
def test_guards_that_are_taken_away_are_worth_a_hint(
    check: Callable[..., Validation], robot_yaml: Callable[..., str], safety: str, words: list[str]
) -> None:
    hints = check(robot_yaml(f"[{{type: motor, label: a, params: {{pin: 1}}, safety: {safety}}}]")).hints
    told = [hint.message for hint in hints if "original dashboards" not in hint.message]
    assert len(told) == len(words)
    assert all(word in one for word, one in zip(words, told, strict=True))


class Aliased(Message):
    speed: float = Field(default=0.0, alias="v")


class Misnaming(SafetyConfig):
    def field_limits(self) -> tuple[FieldLimit, ...]:
        return (FieldLimit(("speed",), max=1.0),)


class Unnamed(DataChannelReceivable[Aliased]):
    def handle_data(self, data: Aliased) -> None:
        """Takes everything."""


class MisnamingConfigurer(DataChannelConfigurer[NoParams]):
    connector_type = "misnaming"
    safety_model = Misnaming

    def configure(self) -> Unnamed:
        return Unnamed(self.label)


def test_a_limit_of_a_connectors_own_that_its_messages_do_not_have_is_a_mistake_of_the_plugin() -> None:
    (told,) = problems_of(MisnamingConfigurer, {})
    assert "moves by 'speed', a number that its messages don't have" in told
    assert "they have: v" in told


class TwoNames(Message):
    v: float = Field(default=0.0, validation_alias=AliasChoices("v", "speed"))


class ByName(Message):
    model_config = ConfigDict(populate_by_name=True)
    v: float = Field(default=0.0, alias="speed")


class Inside(Message):
    wheel: TwoNames | None = None


class OneAlias(Message):
    v: float = Field(default=0.0, alias="speed")


@pytest.mark.parametrize(
    ("model", "field", "is_told"),
    [(TwoNames, "v", True), (ByName, "speed", True), (Inside, "wheel.v", True), (OneAlias, "speed", False)],
)
async def test_a_field_that_a_message_may_say_by_a_second_name_is_told(model: Any, field: str, is_told: bool) -> None:
    """Else the second name would pass by every limit."""

    class Motor(DataChannelReceivable[model]):
        motion_fields: ClassVar[tuple[str, ...]] = (field,)

        def handle_data(self, data: Any) -> None:
            """Takes everything."""

    class MotorConfigurer(DataChannelConfigurer[NoParams]):
        connector_type = "motor"

        def configure(self) -> Motor:
            return Motor(self.label)

    if not is_told:
        async with joined(connector(MotorConfigurer, label="a")):
            return
    (told,) = problems_of(MotorConfigurer, {})
    assert "two names" in told
