"""The receiver: clamps, stops on silence and when the commanding operator leaves."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

import pytest

from mosaic_cmdvel.cmd_vel import CmdVel, CmdVelConfigurer
from mosaic_cmdvel.kept_drive import KeptDrive
from mosaic_cmdvel.params import ANGULAR, LINEAR, CmdVelParams, CmdVelSafety
from mosaic_core.contract.devices.shared import Shared
from mosaic_core.contract.handler import message_type_of
from mosaic_core.contract.host import Sender
from mosaic_core.messages import STANDSTILL, Twist
from mosaic_core.runtime.configuration.receiver_safety import ReceiverSafety
from mosaic_core.testing import Leaves, Silence, build, fake_host, feed
from mosaic_core.words.data_type import Delivery, MosaicDataType
from mosaic_core.words.errors import ConfigError

if TYPE_CHECKING:
    from conftest import ScriptedDrive

IN_TIME_S = 5.0


def message(x: float = 0.0, yaw: float = 0.0) -> Twist:
    return Twist.model_validate({"linear": {"x": x}, "angular": {"z": yaw}})


@pytest.fixture
def base(drive: ScriptedDrive) -> Iterator[CmdVel]:
    with KeptDrive("cmd_vel", drive) as kept:
        assert kept.wait_until_open(IN_TIME_S)
        yield CmdVel("cmd_vel", kept, CmdVelSafety(max_linear_mps=0.8, max_angular_radps=1.0))


def test_it_is_announced_as_a_drive_pad_with_newest_only_delivery() -> None:
    assert CmdVel.data_type is MosaicDataType.JSON_U2R
    assert CmdVel.delivery is Delivery.LATEST
    assert CmdVel.widget == "drive-pad"
    assert message_type_of(CmdVel) is Twist


def test_a_command_moves_the_drive(base: CmdVel, drive: ScriptedDrive, alice: Sender) -> None:
    base.handle_data(message(0.5, -0.3), alice)

    assert drive.velocity == Twist.planar(x_mps=0.5, yaw_radps=-0.3)


def test_its_limits_are_vectors_that_the_framework_keeps_and_its_lease_is_required(base: CmdVel) -> None:
    linear, angular = CmdVelSafety(max_linear_mps=0.8, max_angular_radps=1.0).field_limits()

    assert (linear.fields, linear.max_norm, linear.max_rise_per_s) == (LINEAR, 0.8, None)
    assert (angular.fields, angular.max_norm, angular.max_fall_per_s) == (ANGULAR, 1.0, None)
    assert base.requires_lease


def test_what_is_faster_than_its_limits_arrives_clamped_and_no_faster_than_it_may_gain(
    base: CmdVel, drive: ScriptedDrive
) -> None:
    safety = CmdVelSafety(max_linear_mps=0.8, max_angular_radps=1.0, max_linear_accel_mps2=2.0)
    fake_host(base).safety = ReceiverSafety.of(safety, base)
    command = {"linear": {"x": 1e300}, "angular": {"z": -7.0}}
    feed(base, [command])
    assert drive.velocity == Twist.planar(x_mps=0.2, yaw_radps=-1.0)
    feed(base, [step for _ in range(5) for step in (command, Silence(0.1))])
    assert drive.velocity == Twist.planar(x_mps=0.8, yaw_radps=-1.0)


def test_silence_stops_and_a_newer_command_moves_again(base: CmdVel, drive: ScriptedDrive, alice: Sender) -> None:
    base.handle_data(message(0.5), alice)
    base.make_safe("safety.timeout")
    base.make_safe("safety.timeout")
    assert drive.velocity == STANDSTILL

    base.handle_data(message(0.2), alice)
    assert drive.velocity == Twist.planar(x_mps=0.2)


def test_the_base_stops_when_the_commanding_operator_leaves(base: CmdVel, drive: ScriptedDrive, alice: Sender) -> None:
    base.handle_data(message(0.5), alice)
    base.peer_left(alice)

    assert drive.velocity == STANDSTILL


def test_an_operator_who_only_watched_leaves_without_a_stop(
    base: CmdVel, drive: ScriptedDrive, alice: Sender, bob: Sender
) -> None:
    base.handle_data(message(0.5), alice)
    base.peer_left(bob)

    assert drive.velocity == Twist.planar(x_mps=0.5)


def test_an_operator_who_closed_the_pad_and_opened_it_again_drives_again(
    base: CmdVel, drive: ScriptedDrive, alice: Sender
) -> None:
    base.handle_data(message(0.5), alice)
    base.peer_left(alice)
    base.handle_data(message(0.2), alice)

    assert drive.velocity == Twist.planar(x_mps=0.2)


def configured(drive: dict[str, Any], shared: Shared, safety: CmdVelSafety | None = None) -> CmdVel:
    params = CmdVelParams.model_validate({"drive": drive})
    return CmdVelConfigurer("cmd_vel", params, safety=safety, shared=shared).configure()


def test_configuring_opens_nothing_and_the_robots_life_opens_and_closes_the_drive(alice: Sender) -> None:
    moves: list[Twist] = []
    shared = Shared()
    handler = configured({"type": "callback", "function": moves.append}, shared)
    assert moves == []

    with shared.entered():
        kept = shared.get("mosaic-cmdvel:cmd_vel", lambda: pytest.fail("the drive is not the robot's"))
        assert isinstance(kept, KeptDrive)
        assert handler.keeper is kept.keeper, "which says of it when the drive is away"
        assert kept.wait_until_open(IN_TIME_S)
        handler.handle_data(message(0.5), alice)

    assert moves == [STANDSTILL, Twist.planar(x_mps=0.5), STANDSTILL]


def test_the_time_out_comes_from_the_safety_section() -> None:
    assert configured({"type": "log"}, Shared()).timeout_s == 0.3
    assert configured({"type": "log"}, Shared(), CmdVelSafety(timeout_s=0.5)).timeout_s == 0.5


def test_the_example_to_paste_is_valid() -> None:
    assert CmdVelConfigurer.params_model is CmdVelParams
    assert CmdVelParams.model_validate(CmdVelConfigurer.example)


def test_a_script_of_commands_silence_and_leaving_moves_and_stops_the_base() -> None:
    moves: list[Twist] = []
    shared = Shared()
    base = build(
        CmdVelConfigurer,
        label="cmd_vel",
        params={"drive": {"type": "callback", "function": moves.append}},
        shared=shared,
    )
    forward = {"linear": {"x": 0.5}}
    with shared.entered():
        assert shared.get("mosaic-cmdvel:cmd_vel", KeptDrive).wait_until_open(IN_TIME_S)
        fed = feed(
            base, [forward, Silence(0.2), forward, Silence(1.0), forward, "{}", '{"linear":{"x":NaN}}', Leaves()]
        )

    assert [(safe.at_s, safe.cause) for safe in fed.made_safe] == [
        (0.5, "safety.timeout"),
        (1.2, "safety.peer_left"),
    ]
    assert len(fed.accepted) == 3
    assert len(fed.refused) == 2
    assert moves[-1] == STANDSTILL


def test_the_yaml_path_of_a_misspelt_drive_is_told() -> None:
    with pytest.raises(ConfigError, match=r"params\.drive\.type: no drive type 'unicicle'; did you mean 'unicycle'"):
        build(CmdVelConfigurer, params={"drive": {"type": "unicicle"}})
    with pytest.raises(ConfigError, match=r"safety\.timeout_s"):
        build(CmdVelConfigurer, params={"drive": {"type": "log"}}, safety={"timeout_s": 0})
