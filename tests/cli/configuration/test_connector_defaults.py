"""What `mosaic connectors show` says is in force when the file says nothing, of each channel of a type."""

from __future__ import annotations

import inspect
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import pytest
from pydantic import Field

from mosaic_core import (
    DataChannelConfigurer,
    DataChannelReceivable,
    DataChannelSendable,
    Delivery,
    FieldBounds,
    Handler,
    NoParams,
    Params,
)
from mosaic_core.cli.configuration.connector_defaults import ChannelDefaults, Unmade, defaults_of, lines_of
from mosaic_core.cli.configuration.connector_example import example_yaml, shown_example
from mosaic_core.messages import JointState, JointTarget, Twist
from mosaic_core.runtime.configuration.auto_configurer import AutoConfigurer
from mosaic_core.runtime.configuration.config_loader import validate_file
from mosaic_core.runtime.configuration.resolver import ConnectorResolver


class Arm(DataChannelReceivable[JointTarget]):
    delivery = Delivery.LATEST
    timeout_s = 0.5
    requires_lease = True
    resource = "arm"
    limits = {  # noqa: RUF012 - as an author writes it
        "positions.*": FieldBounds(max_rate_per_s=0.5),
        "positions.elbow": FieldBounds(min=-1.0, max=1.0),
    }

    def handle_data(self, data: JointTarget) -> None:
        """It moves nothing."""

    def reported_position(self, field: str) -> float | None:
        return 0.0

    def make_safe(self, cause: str) -> None:
        """It holds by itself."""


class Joints(DataChannelSendable[JointState]):
    widget = "time-plot"


class Base(DataChannelReceivable[Twist]):
    limits = {"linear.x": FieldBounds(min=-0.5, max=0.5)}  # noqa: RUF012 - as an author writes it

    def handle_data(self, data: Twist) -> None:
        """It moves nothing."""


class ArmConfigurer(DataChannelConfigurer[NoParams]):
    def configure(self) -> Sequence[Handler]:
        return [Arm(self.label), Joints(f"{self.label}_joints")]


class BaseConfigurer(DataChannelConfigurer[NoParams]):
    def configure(self) -> Base:
        return Base(self.label)


class PickyParams(Params):
    port: str = Field(pattern="^/dev/")


class PickyConfigurer(DataChannelConfigurer[PickyParams]):
    def configure(self) -> Base:
        return Base(self.label)


def lines(channel: ChannelDefaults) -> dict[str, str]:
    return dict(lines_of(channel))


def test_each_channel_has_its_own_lines() -> None:
    arm, joints = defaults_of("acme-arm", ArmConfigurer)
    assert lines(arm) == {
        "data type": "json-u2r, to-robot",
        "schema": "mosaic/JointTarget@1",
        "delivery": "latest",
        "lease": "of 'arm'",
        "time-out": "0.5 s",
        "safe action": "written (make_safe)",
        "position fields": "positions.*, positions.elbow",
        "position": "reported (reported_position)",
        "on a bad link": "slowed down",
        "limit of positions.*": "position: max_rate_per_s 0.5 rad/s",
        "limit of positions.elbow": "position: min -1 rad, max 1 rad, max_rate_per_s 0.5 rad/s",
    }
    assert lines(joints) == {
        "data type": "json-r2u, to-operator",
        "schema": "mosaic/JointState@1",
        "widget": "time-plot",
        "delivery": "reliable",
    }


def test_a_receiver_without_a_safe_action_says_so() -> None:
    (base,) = defaults_of("acme-base", BaseConfigurer)
    found = lines(base)
    assert (found["lease"], found["time-out"], found["safe action"]) == ("none is needed", "none", "none")
    assert found["limit of linear.x"] == "velocity: min -0.5 m/s, max 0.5 m/s"


def test_the_same_is_there_for_programs() -> None:
    arm, _ = defaults_of("acme-arm", ArmConfigurer)
    (safety,) = arm["safety"]
    assert (arm["label"], arm["data_type"], arm["delivery"]) == ("acme_arm", "json-u2r", "latest")
    assert safety["limits"][1] == {
        "fields": ["positions.elbow"], "kind": "position", "unit": "rad",
        "min": -1.0, "max": 1.0, "max_rate_per_s": 0.5,
    }  # fmt: skip
    assert (safety["safe_action"], safety["reports_position"], safety["timeout_s"]) == (True, True, 0.5)


def test_a_type_that_its_example_does_not_make_says_why() -> None:
    with pytest.raises(Unmade, match=r"params\.port: expected .* got '…'") as caught:
        defaults_of("picky", PickyConfigurer)
    assert not caught.value.is_broken


def fails(*_: Any) -> Base:
    raise OSError("no bus here")


def test_a_plugin_that_opens_its_device_too_early_is_told_as_validate_does() -> None:
    made = type("EarlyConfigurer", (BaseConfigurer,), {"configure": fails})
    line = inspect.getsourcelines(fails)[1] + 1
    with pytest.raises(Unmade, match=f"{__file__}:{line}: connector 'early' .* can't be made: OSError: no bus here"):
        defaults_of("early", made)


def test_the_example_of_what_moves_has_the_safety_that_is_in_force() -> None:
    assert shown_example("arm", ArmConfigurer)["safety"] == {
        "timeout_s": 0.5,
        "limits": {
            "positions.*": {"max_rate_per_s": 0.5},
            "positions.elbow": {"min": -1.0, "max": 1.0, "max_rate_per_s": 0.5},
        },
    }
    assert "safety" not in shown_example("base", BaseConfigurer)


@pytest.mark.parametrize("connector_type", ["cmd-vel", "mavlink-velocity", "sim-mast-target", "arm-joints"])
def test_the_example_of_each_of_our_movers_is_valid_as_it_is_shown(tmp_path: Path, connector_type: str) -> None:
    file = tmp_path / "robot.yaml"
    file.write_text(f"connectors:\n{example_yaml(connector_type, ConnectorResolver().resolve(connector_type))}")
    validation = validate_file(file)
    assert [*validation.problems, *AutoConfigurer().rehearse(validation).problems] == []
    assert "timeout_s" in file.read_text()
