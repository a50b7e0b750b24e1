"""The page of names from MOSAIC's own bindings: whatever it names here is there."""

from __future__ import annotations

import asyncio
import re
import sys
import types
from collections.abc import Iterator
from importlib import import_module
from importlib.metadata import EntryPoint
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import mosaic_core
from mosaic_core.testing import build, take_frames
from mosaic_core.words.config import ConnectorConfig, RobotConfig

PAGE = Path(__file__).parents[2] / "docs" / "reference" / "names-from-mosaic.md"
NAMES = sorted(set(re.findall(r"`(mosaic_core(?:\.\w+)+)`", PAGE.read_text())))
FROM_THE_BINDINGS = [
    "AutoConfigurer", "ADCHandlerConfigurer", "AMTHandlerConfigurer", "IConfigurableConnectorFactory",
    "AMediaTrackHandler", "DataChannelSendable", "DataChannelJsonReceivable", "DataChannelStringReceivable",
    "DataChannelByteReceivable", "get_connector_type", "create_connector", "configure", "set_handler", "get_config",
    "handle_data", "send_json", "send_frame", "is_running", "set_running", "get_stop_flag", "set_stop_flag",
    "start", "stop",
]  # fmt: skip


def found(name: str) -> object:
    """The thing of this dotted name: a module's, or a class's attribute."""
    parts = name.split(".")
    for length in range(len(parts) - 1, 0, -1):
        try:
            thing: object = import_module(".".join(parts[:length]))
        except ModuleNotFoundError:
            continue
        for part in parts[length:]:
            thing = getattr(thing, part)
        return thing
    raise AssertionError(f"{name}: there is no such module")


@pytest.mark.parametrize("name", NAMES)
def test_every_name_on_the_right_is_there(name: str) -> None:
    assert found(name) is not None


@pytest.mark.parametrize("name", FROM_THE_BINDINGS)
def test_every_name_of_the_bindings_is_on_the_left(name: str) -> None:
    left = [line.split("|")[1] for line in PAGE.read_text().splitlines() if line.startswith("| ")]
    assert any(re.search(rf"`{name}[`(]", cell) for cell in left)


@pytest.mark.parametrize("name", mosaic_core.__all__)
def test_every_public_name_can_be_imported(name: str) -> None:
    assert getattr(mosaic_core, name) is not None


def test_a_name_that_is_not_there_is_an_attribute_error() -> None:
    with pytest.raises(AttributeError, match="AutoConfigurator"):
        mosaic_core.AutoConfigurator  # noqa: B018


@pytest.fixture
def example() -> Iterator[Any]:
    """The page's program, as the module that it says it is."""
    (text,) = re.findall(r"^```python\n(.*?)^```", PAGE.read_text(), re.MULTILINE | re.DOTALL)
    module = sys.modules["my_robot"] = types.ModuleType("my_robot")
    exec(compile(text, "my_robot.py", "exec", dont_inherit=True), module.__dict__)  # noqa: S102 - our own documentation
    yield module
    del sys.modules["my_robot"]


def test_the_camera_of_the_example_yields_pictures(example: Any) -> None:
    first, second = take_frames(build(example.RampConfigurer), 2)
    assert isinstance(first, np.ndarray)
    assert isinstance(second, np.ndarray)
    assert first.shape == (480, 640, 3)
    assert first.dtype == np.dtype(np.uint8)
    assert [int(picture[0, 0, 2]) for picture in (first, second)] == [0, 1]


async def test_the_program_of_the_example_runs_the_robot_until_it_is_cancelled(example: Any, tmp_path: Path) -> None:
    called = asyncio.Event()

    async def answer(_: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        called.set()
        writer.close()

    server = await asyncio.start_server(answer, "127.0.0.1")
    port = server.sockets[0].getsockname()[1]
    config = tmp_path / "mosaic_config.yaml"
    config.write_text(
        f"server: {{ws_url: 'ws://127.0.0.1:{port}', auth: {{type: no-authorization, robot_id: "
        "7d1c2f6e-0b52-4c1e-9a53-2f6f1f0c9b11}}\n"
        "connectors: [{type: ramp, label: front, params: {fps: 15}}]\n"
    )
    running = asyncio.create_task(example.main(str(config)))
    waiting = asyncio.create_task(called.wait())
    await asyncio.wait({running, waiting}, timeout=30, return_when=asyncio.FIRST_COMPLETED)
    assert called.is_set(), running
    running.cancel()
    with pytest.raises(asyncio.CancelledError):
        await running
    server.close()


def test_a_robot_without_a_server_is_not_run(example: Any) -> None:
    ramp = EntryPoint(name="ramp", value="my_robot:RampConfigurer", group="mosaic.connectors")
    configurer = mosaic_core.AutoConfigurer(resolver=mosaic_core.ConnectorResolver([ramp]))
    connectors = [ConnectorConfig(type="ramp", label="front")]
    configured = configurer.from_config(RobotConfig(server=None, connectors=connectors))
    with pytest.raises(mosaic_core.ConfigError, match="'server' is missing"):
        asyncio.run(mosaic_core.run_configured(configured))
