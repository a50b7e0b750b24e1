"""Mistakes in a cmd-vel's YAML are found before the robot starts, at their place."""

from __future__ import annotations

from importlib.metadata import EntryPoint
from typing import Any

import pytest
from pydantic import ValidationError

import mosaic_cmdvel.params
from mosaic_cmdvel.drives.log import LogParams
from mosaic_cmdvel.drives.unicycle import UnicycleParams
from mosaic_cmdvel.params import CmdVelParams, CmdVelSafety


def mistakes(drive: Any) -> dict[str, str]:
    with pytest.raises(ValidationError) as caught:
        CmdVelParams.model_validate({"drive": drive})
    return {".".join(map(str, problem["loc"])): problem["msg"] for problem in caught.value.errors()}


def test_the_drive_is_read_by_its_own_model() -> None:
    params = CmdVelParams.model_validate(
        {"drive": {"type": "unicycle", "wheel_radius_m": "0.1", "track_width_m": 0.5, "output": "log"}}
    )

    assert params.drive == UnicycleParams(type="unicycle", wheel_radius_m=0.1, track_width_m=0.5, output="log")


def test_params_that_are_already_a_model_are_taken_as_they_are() -> None:
    drive = LogParams(type="log")

    assert CmdVelParams(drive=drive).drive is drive


def test_every_mistake_in_the_drive_points_at_its_field() -> None:
    found = mistakes({"type": "unicycle", "wheel_radius_m": -1, "colour": "red", "output": "log"})

    assert set(found) == {"drive.wheel_radius_m", "drive.track_width_m", "drive.colour"}


def test_an_unknown_drive_type_points_at_the_type() -> None:
    assert "did you mean 'unicycle'?" in mistakes({"type": "unicicle"})["drive.type"]


@pytest.mark.parametrize("drive", [{}, {"port": "/dev/ttyACM0"}, {"type": 3}, "log", None, 7])
def test_a_drive_without_a_type_is_told_what_to_write(drive: Any) -> None:
    assert "a drive needs a type, for example {type: log}; installed: callback, log" in mistakes(drive)["drive"]


def test_a_serial_unicycle_without_a_port_is_told_what_to_write() -> None:
    found = mistakes({"type": "unicycle", "wheel_radius_m": 0.1, "track_width_m": 0.5})

    assert "needs a port, for example /dev/ttyACM0" in found["drive"]


def test_a_callback_that_does_not_exist_is_found_before_the_start() -> None:
    assert "no_such_module" in mistakes({"type": "callback", "function": "no_such_module:drive"})["drive.function"]


def test_the_schema_offers_the_params_of_every_installed_drive() -> None:
    choices = CmdVelParams.model_json_schema()["properties"]["drive"]["anyOf"]
    by_type = {choice["properties"]["type"]["const"]: choice for choice in choices}

    assert {"log", "unicycle", "callback"} <= by_type.keys()
    assert by_type["unicycle"]["properties"]["wheel_radius_m"]["description"]
    assert all("type" in choice["required"] for choice in choices)


def test_a_broken_drive_does_not_break_the_schema(monkeypatch: pytest.MonkeyPatch) -> None:
    broken = EntryPoint("broken", "no_such_module:Drive", "mosaic.drives")
    monkeypatch.setattr(mosaic_cmdvel.params, "installed_drives", lambda: (broken,))

    assert CmdVelParams.model_json_schema()["properties"]["drive"]


def test_the_limits_have_safe_defaults() -> None:
    safety = CmdVelSafety()

    assert (safety.timeout_s, safety.max_linear_mps, safety.max_angular_radps) == (0.3, 1.0, 1.5)


@pytest.mark.parametrize("field", ["timeout_s", "max_linear_mps", "max_angular_radps"])
@pytest.mark.parametrize("value", [0, -1, "inf", "nan", 1e6, "fast"])
def test_no_limit_can_be_switched_off(field: str, value: Any) -> None:
    with pytest.raises(ValidationError):
        CmdVelSafety.model_validate({field: value})


def test_an_empty_time_out_is_the_default_and_not_none() -> None:
    assert CmdVelSafety.model_validate({"timeout_s": None}).timeout_s == 0.3


@pytest.mark.parametrize("field", ["on_timeout", "on_loss"])
def test_a_base_never_holds_its_velocity(field: str) -> None:
    with pytest.raises(ValidationError, match="drives on for ever"):
        CmdVelSafety.model_validate({field: "hold"})
    assert CmdVelSafety.model_validate({field: "zero"})
