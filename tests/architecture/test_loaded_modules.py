"""What is loaded, held as sets: whoever makes a command or a robot load one more library says so here.

Times depend on the machine, these sets do not. `bench/startup.py` has the times, and the memory.
"""

from __future__ import annotations

import json
import subprocess
import sys
from functools import cache
from pathlib import Path

import pytest

import mosaic_core

TYPER = {"annotated_doc", "shellingham", "typer"}
PYDANTIC = {"annotated_types", "pydantic", "pydantic_core", "typing_extensions", "typing_inspection"}
WEBRTC = {"aioice", "aiortc", "av", "OpenSSL", "pylibsrtp"}
PICTURES = {"cv2", "numpy"}

RUN = """
from mosaic_core.cli.main import main
try:
    main(sys.argv[1:])
except SystemExit as end:
    assert not end.code
"""
ROBOT = """
import asyncio
from mosaic_core.adapters.machine.event_loop import run_event_loop
from mosaic_core.cli.robot.run_command import make_robot
from mosaic_core.runtime.configuration.auto_configurer import AutoConfigurer
from mosaic_core.words.config import RobotConfig

async def offline():
    robot = make_robot(AutoConfigurer().from_config(RobotConfig.model_validate({config})))
    running = asyncio.create_task(robot.run())
    while robot.state == "connecting":
        await asyncio.sleep(0)
    robot.stop()
    await running

run_event_loop(offline())
"""
SERVER = {
    "ws_url": "ws://127.0.0.1:9",
    "auth": {"type": "no-authorization", "robot_id": "7d1c2f6e-0b52-4c1e-9a53-2f6f1f0c9b11"},
}


def loaded_by(code: str, *words: str) -> set[str]:
    """The packages that a fresh interpreter has after running `code`; without Python's own, and without those that an
    installation loads into every interpreter."""
    found = _packages_after(code, *words) - _packages_after("pass") - sys.stdlib_module_names
    return {name for name in found if not name.startswith("_sysconfigdata_")}  # Python's own, named by the machine


@cache
def _packages_after(code: str, *words: str) -> set[str]:
    return {name.partition(".")[0] for name in modules_after(code, *words)}


def modules_after(code: str, *words: str) -> set[str]:
    """In a fresh interpreter."""
    script = f"import sys\n{code}\nprint('\\n', *sys.modules)"
    done = subprocess.run([sys.executable, "-c", script, *words], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    return set(done.stdout.splitlines()[-1].split())


def robot_with(*connectors: dict[str, object]) -> str:
    return ROBOT.format(config={"server": SERVER, "connectors": list(connectors)})


@pytest.mark.parametrize("words", [["--help"], ["--version"], ["--nonsense"]])
def test_the_list_of_commands_loads_what_prints_it_alone(words: list[str]) -> None:
    code = RUN.replace("assert not end.code", "pass")
    assert loaded_by(code, *words) <= {*TYPER, "mosaic_core"}


def test_the_list_of_commands_loads_none_of_them() -> None:
    ours = {name for name in modules_after(RUN, "--help") if name.startswith("mosaic_core.")}
    assert ours == {
        "mosaic_core.cli",
        "mosaic_core.cli.main",
        "mosaic_core.cli.later_command",
        "mosaic_core.cli.terminal",
        "mosaic_core.cli.terminal.error_report",
        "mosaic_core.cli.terminal.threads_left",
        "mosaic_core.words",
        "mosaic_core.words.codes",
        "mosaic_core.words.errors",
    }


@pytest.mark.parametrize("words", [["connectors", "list"], ["connectors", "list", "--json"]])
def test_the_list_of_connectors_loads_no_plugin_and_no_table_maker(words: list[str]) -> None:
    """Nor pydantic, with which typer checks words: flags need none."""
    assert loaded_by(RUN, *words) <= {*TYPER, "mosaic_core"}


@pytest.mark.parametrize(
    ("words", "package"),
    [
        (["server", "--help"], "mosaic_server"),
        (["server", "run", "--help"], "mosaic_server"),
        (["server", "user", "add", "--help"], "mosaic_server"),
        (["server", "robot", "grant", "--help"], "mosaic_server"),
        (["server", "ice", "add", "--help"], "mosaic_server"),
        (["server", "audit", "--help"], "mosaic_server"),
        (["lan", "pair", "--help"], "mosaic_server"),
        (["lan", "devices", "role", "--help"], "mosaic_server"),
        (["demo", "--help"], "mosaic_sim"),
    ],
)
def test_the_help_of_a_plugins_command_loads_its_words_alone(words: list[str], package: str) -> None:
    """No web server, database, HTTP client or table maker."""
    assert loaded_by(RUN, *words) <= {*TYPER, "mosaic_core", package}


@pytest.mark.parametrize("words", [["run", "--help"], ["doctor", "--help"], ["bench", "--help"]])
def test_the_help_of_our_own_commands_loads_its_words_alone(words: list[str]) -> None:
    assert loaded_by(RUN, *words) <= {*TYPER, "mosaic_core"}


def test_the_help_of_operator_needs_the_original_types_and_no_more() -> None:
    assert loaded_by(RUN, "operator", "--help") <= {*TYPER, *PYDANTIC, "mosaic_core"}


def test_validation_loads_neither_webrtc_nor_pictures(tmp_path: Path) -> None:
    config = tmp_path / "mosaic_config.yaml"
    config.write_text(json.dumps({"server": SERVER, "connectors": [{"type": "connection-check", "label": "link"}]}))
    loaded = loaded_by(RUN, "validate", str(config))
    assert not loaded & (WEBRTC | PICTURES | {"fastapi", "httpx", "rich", "sqlalchemy"})


def test_a_robot_without_cameras_loads_no_webrtc_until_an_operator_comes() -> None:
    loaded = loaded_by(robot_with({"type": "connection-check", "label": "link"}))
    assert not loaded & (WEBRTC | PICTURES | {"httpx", "rich", "prometheus_client"})
    assert "websockets" in loaded


def test_a_robot_with_a_camera_has_all_it_needs_before_an_operator_comes() -> None:
    loaded = loaded_by(robot_with({"type": "test-pattern", "label": "front"}))
    assert loaded >= WEBRTC | PICTURES
    assert not loaded & {"httpx", "rich", "prometheus_client"}


def test_an_answer_without_media_needs_no_picture_library() -> None:
    assert not loaded_by("import mosaic_core.adapters.peers.aiortc_answerer") & PICTURES


def test_every_public_name_is_there_although_none_is_imported_before() -> None:
    assert loaded_by("import mosaic_core") == {"mosaic_core"}
    everything = "import mosaic_core\nfor name in mosaic_core.__all__: getattr(mosaic_core, name)"
    assert loaded_by(everything) >= PYDANTIC
    with pytest.raises(AttributeError, match="no attribute 'Handlr'"):
        mosaic_core.Handlr  # type: ignore[attr-defined]  # noqa: B018
