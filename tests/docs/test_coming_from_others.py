"""The pages for those who come from something else: their connectors do what the page says they do."""

from __future__ import annotations

import re
from pathlib import Path
from types import ModuleType, SimpleNamespace
from typing import Any

import pytest
from typer.testing import CliRunner

from mosaic_core.cli.main import app
from mosaic_core.testing import Leaves, Silence, build, collect, feed, take_frames

HOWTO = Path(__file__).parents[2] / "docs" / "howto"
TWIST = {"linear": {"x": 0.2}, "angular": {"z": -0.1}}


def connector_file(page: str, name: str) -> Any:
    """The module that a page's file is."""
    found = re.search(rf'^```python title="connectors/{name}\.py"\n(.*?)^```', text_of(page), re.MULTILINE | re.DOTALL)
    assert found is not None
    module = ModuleType(name)
    exec(compile(found[1], f"{name}.py", "exec", dont_inherit=True), module.__dict__)  # noqa: S102 - our own documentation
    return module


def text_of(page: str) -> str:
    return (HOWTO / page).read_text()


def test_the_file_of_the_cpp_library_is_read_as_it_is_but_for_what_has_no_plugin(tmp_path: Path) -> None:
    (old,) = re.findall(r'^```yaml title="[^"]*, C\+\+"\n(.*?)^```', text_of("from-mosaic-cpp.md"), re.M | re.S)
    (tmp_path / "mosaic_config.yaml").write_text(old)
    done = CliRunner().invoke(app, ["validate", str(tmp_path / "mosaic_config.yaml")])
    assert done.exit_code == 2
    assert re.findall(r"^error: (.+)", done.output, re.M) == [
        "connectors[3].type: no connector type 'my-battery'",
    ]


def test_the_battery_that_was_cpp_tells_its_charge(tmp_path: Path) -> None:
    module = connector_file("from-mosaic-cpp.md", "battery")
    (tmp_path / "capacity").write_text("83\n")
    battery = build(module.BatteryConfigurer, params={"gauge": str(tmp_path / "capacity")})
    assert collect(battery, 1) == [module.Charge(percent=83)]


@pytest.mark.parametrize("end", [Silence(1.0), Leaves()])
def test_the_wheels_that_were_cpp_drive_and_stand_when_nobody_commands(end: Any) -> None:
    module = connector_file("from-mosaic-cpp.md", "wheels")
    driven: list[tuple[float, float]] = []
    module.drive = lambda *speeds: driven.append(speeds)
    feed(build(module.WheelsConfigurer), [TWIST, end])
    assert driven == [(0.2, -0.1), (0.0, 0.0)]


def test_a_battery_on_a_ros_topic_is_told_in_per_cent_and_its_node_is_closed(ros: Any) -> None:
    module = connector_file("from-rosbridge.md", "ros")
    module.SingleThreadedExecutor.said["/battery"] = SimpleNamespace(percentage=0.5, voltage=24.0)
    battery = build(module.RosBatteryConfigurer, params={"topic": "/battery"})
    (told,) = collect(battery, 1)
    assert (told.percent, told.voltage_v) == (50.0, 24.0)
    assert ros.open_nodes == 0


def test_wheels_on_a_ros_topic_drive_and_stand_when_the_operator_is_silent(ros: Any) -> None:
    module = connector_file("from-rosbridge.md", "ros")
    feed(build(module.RosWheelsConfigurer, params={"topic": "/cmd_vel"}), [TWIST, Silence(1.0)])
    assert [(topic, said.linear.x, said.angular.z) for topic, said in ros.published] == [
        ("/cmd_vel", 0.2, -0.1),
        ("/cmd_vel", 0.0, 0.0),
    ]


def test_the_lamp_that_was_aiortc_refuses_what_is_no_brightness() -> None:
    module = connector_file("from-aiortc.md", "lamp")
    shone: list[float] = []
    module.set_brightness = shone.append
    fed = feed(build(module.LampConfigurer), [{"percent": 40}, {"percent": 140}, Silence(6.0)])
    assert shone == [40, 0]
    assert [refused.code for refused in fed.refused] == ["channel.invalid"]


def test_pictures_that_were_aiortc_are_mirrored_and_the_camera_is_closed(monkeypatch: pytest.MonkeyPatch) -> None:
    import numpy as np

    module = connector_file("from-aiortc.md", "seen")
    image = np.zeros((2, 3, 3), np.uint8)
    image[:, 0] = 255
    closed: list[bool] = []
    camera = SimpleNamespace(read=lambda: (True, image), release=lambda: closed.append(True))
    monkeypatch.setattr(module.cv2, "VideoCapture", lambda index: camera)
    (picture,) = take_frames(build(module.SeenConfigurer), 1)
    assert picture[0, :, 0].tolist() == [0, 0, 255]
    assert closed == [True]
