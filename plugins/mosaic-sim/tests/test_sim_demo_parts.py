"""The parts of `mosaic demo`: children end surely, ports and missing parts are told, checks see what is wrong."""

import asyncio
import importlib.metadata
import io
import json
import socket
import sys
import time
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from rich.console import Console
from support.waiting import wait_for

from mosaic_core.runtime.configuration.config_loader import validate_file
from mosaic_core.runtime.lan.child_process import STOP_PATIENCE_S, end_all
from mosaic_sim.demo import browser, checks
from mosaic_sim.demo.child import Child
from mosaic_sim.demo.demo_robot import YARD
from mosaic_sim.demo.errors import DemoFailed
from mosaic_sim.demo.greeting import greet, report_failure
from mosaic_sim.demo.headless_check import print_results
from mosaic_sim.demo.robot_file import OwnConnector
from mosaic_sim.demo.server import HOST, Seed, check_server_is_installed, chosen_port, robot_environment

ROBOT_YAML = Path(checks.__file__).with_name("robot.yaml")
SEED = Seed("demo@localhost", "a-password", "7d1c2f6e-0b52-4c1e-9a53-2f6f1f0c9b11", "a-token")


def test_the_demos_robot_is_a_valid_configuration(monkeypatch: pytest.MonkeyPatch) -> None:
    for name, value in robot_environment("http://127.0.0.1:9001", SEED).items():
        monkeypatch.setenv(name, value)
    validation = validate_file(ROBOT_YAML)
    assert not validation.problems


def test_the_robots_token_is_in_its_environment_only() -> None:
    assert robot_environment("http://127.0.0.1:9001", SEED)["MOSAIC_WS_URL"] == "ws://127.0.0.1:9001"
    assert "a-token" not in ROBOT_YAML.read_text()


# -- children ----------------------------------------------------------------------------------------------------


def python(folder: Path, code: str) -> Child:
    return Child("thing", [sys.executable, "-c", code], folder / "thing.log")


def test_a_child_that_dies_is_named_with_its_last_words(tmp_path: Path) -> None:
    child = python(tmp_path, "print('one'); raise SystemExit('the disk is full')")
    wait_for(lambda: child.exit_code is not None, "the child ends")
    with pytest.raises(DemoFailed, match="the thing ended with exit code 1") as caught:
        child.check_alive()
    assert caught.value.details.splitlines() == ["one", "the disk is full"]


def test_a_living_child_passes_and_ends_when_asked(tmp_path: Path) -> None:
    child = python(tmp_path, "import time; time.sleep(60)")
    child.check_alive()
    end_all([child])
    assert child.exit_code == -15


def test_a_child_that_ignores_being_asked_is_killed_in_time(tmp_path: Path) -> None:
    deaf = "import signal, time; signal.signal(signal.SIGTERM, signal.SIG_IGN); "
    command = [sys.executable, "-c", deaf + "print('deaf', flush=True); time.sleep(60)"]
    children = [Child(name, command, tmp_path / f"{name}.log") for name in ("a", "b")]
    for child in children:
        wait_for(lambda child=child: "deaf" in child.last_lines(), "it is deaf")  # type: ignore[misc]
    began_s = time.monotonic()
    end_all(children)
    assert time.monotonic() - began_s < STOP_PATIENCE_S + 0.5, "at the same time, not one after the other"
    assert [child.exit_code for child in children] == [-9, -9]


def test_only_the_last_lines_of_a_long_log_are_told(tmp_path: Path) -> None:
    child = python(tmp_path, "print('\\n'.join(map(str, range(100))))")
    wait_for(lambda: child.exit_code is not None, "the child ends")
    assert child.last_lines(3) == "97\n98\n99"


# -- server ------------------------------------------------------------------------------------------------------


def test_a_taken_port_is_told_with_a_cure() -> None:
    with socket.create_server((HOST, 0)) as taken:
        port = taken.getsockname()[1]
        with pytest.raises(DemoFailed, match=f"port {port} .* can't be used") as caught:
            chosen_port(port)
    assert "--port" in caught.value.cure


def test_without_a_wish_a_taken_port_gives_way_to_a_free_one(monkeypatch: pytest.MonkeyPatch) -> None:
    with socket.create_server((HOST, 0)) as taken:
        monkeypatch.setattr("mosaic_sim.demo.server.USUAL_PORT", taken.getsockname()[1])
        assert chosen_port(None) == 0


def test_without_the_server_the_demo_says_what_to_install(monkeypatch: pytest.MonkeyPatch) -> None:
    def absent(name: str) -> None:
        raise importlib.metadata.PackageNotFoundError(name)

    monkeypatch.setattr(importlib.metadata, "distribution", absent)
    with pytest.raises(DemoFailed) as caught:
        check_server_is_installed()
    assert caught.value.cure == 'pip install "mosaic-sim[demo]"'


# -- terminal and browser ----------------------------------------------------------------------------------------


def test_without_a_desktop_no_browser_is_opened(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("sys.platform", "linux")
    for name in ("DISPLAY", "WAYLAND_DISPLAY"):
        monkeypatch.delenv(name, raising=False)
    assert not browser.opened("http://127.0.0.1/")


def test_with_a_desktop_the_page_is_opened(monkeypatch: pytest.MonkeyPatch) -> None:
    pages: list[str] = []
    monkeypatch.setenv("DISPLAY", ":0")
    monkeypatch.setattr("webbrowser.open", lambda page: bool(pages.append(page) or pages))  # type: ignore[func-returns-value]
    assert browser.opened("http://127.0.0.1/")
    assert pages == ["http://127.0.0.1/"]


def running(**brought: Any) -> Any:
    """As much of a running demo as its greeting tells."""
    return SimpleNamespace(**{"seed": SEED, "own": (), "notes": (), "shown": YARD, **brought})


def test_the_greeting_keeps_a_long_address_on_one_line() -> None:
    out = io.StringIO()
    page = "http://127.0.0.1:9001/robots/7d1c2f6e-0b52-4c1e-9a53-2f6f1f0c9b11#code=" + "x" * 40
    greet(Console(file=out, width=60), running(), page, is_opened=False)
    assert page in out.getvalue().splitlines()


def test_the_greeting_of_an_opened_browser_shows_no_code() -> None:
    out = io.StringIO()
    greet(Console(file=out), running(), "http://x/robots/1", is_opened=True)
    assert "code=" not in out.getvalue()
    assert "signed in" in out.getvalue()


def test_the_greeting_names_what_one_has_brought_and_what_was_changed_of_it() -> None:
    out = io.StringIO()
    demo = running(own=(OwnConnector("front_2", "lamp", "acme-lamp 0.1.0"),), notes=("'front' is taken",))
    greet(Console(file=out, width=200), demo, "http://x/robots/1", is_opened=True)
    assert "From acme-lamp 0.1.0: front_2 (lamp)" in out.getvalue()
    assert "Note: 'front' is taken." in out.getvalue()


def test_a_failure_shows_culprit_last_words_and_cure_as_they_are() -> None:
    out = io.StringIO()
    report_failure(Console(file=out, width=100), DemoFailed("the robot ended", 'pip install "x[demo]"', "[red]log[/]"))
    text = out.getvalue()
    assert "the robot ended" in text
    assert 'pip install "x[demo]"' in text
    assert "[red]log[/]" in text


def test_the_report_marks_what_failed() -> None:
    out = io.StringIO()
    print_results(Console(file=out), [checks.Result("drive", False, "it did not move"), checks.Result("gps", True, "")])
    assert "failed" in out.getvalue()
    assert "it did not move" in out.getvalue()


# -- checks ------------------------------------------------------------------------------------------------------


class FakeRobot:
    """Pose, wheels and camera with just enough physics: it moves while commanded, and stops if it is well-behaved."""

    def __init__(self, *, moves: bool = True, stops: bool = True, accepts: bool = True) -> None:
        self._moves, self._stops, self._accepts = moves, stops, accepts
        self._x_m, self._commanded_s = 0.0, float("-inf")

    def send_json(self, value: dict[str, Any]) -> bool:
        self._commanded_s = time.monotonic()
        return self._accepts

    async def next_message(self, timeout_s: float = 10.0) -> Any:
        await asyncio.sleep(0.01)
        is_commanded = time.monotonic() - self._commanded_s < 0.3 or not self._stops
        speed_mps = 0.6 if self._moves and is_commanded else 0.0
        self._x_m += speed_mps
        message = {"position": {"x": self._x_m, "y": 0.0}, "twist": {"linear": {"x": speed_mps}}}
        return SimpleNamespace(data=json.dumps(message).encode())


class FakeCamera:
    def __init__(self, image: np.ndarray) -> None:
        self._image = image

    async def next_image(self, timeout_s: float = 10.0) -> np.ndarray:
        await asyncio.sleep(0)
        return self._image


@pytest.fixture
def quick(monkeypatch: pytest.MonkeyPatch) -> None:
    for name, value in {"DRIVE_S": 0.1, "STOP_WITHIN_S": 0.6, "REST_S": 0.05}.items():
        monkeypatch.setattr(checks, name, value)


@pytest.mark.usefixtures("quick")
async def test_a_robot_that_drives_and_stops_passes() -> None:
    robot = FakeRobot()

    assert (await checks.told("drive", lambda: checks.driving_moves(robot, robot))).is_ok
    assert (await checks.told("silence", lambda: checks.silence_stops(robot))).is_ok


@pytest.mark.usefixtures("quick")
@pytest.mark.parametrize(
    ("robot", "complaint"), [(FakeRobot(moves=False), "it moved 0.00 m only"), (FakeRobot(accepts=False), "accepted")]
)
async def test_a_robot_that_does_not_move_fails(robot: FakeRobot, complaint: str) -> None:
    result = await checks.told("drive", lambda: checks.driving_moves(robot, robot))
    assert not result.is_ok
    assert complaint in result.detail


@pytest.mark.usefixtures("quick")
async def test_a_robot_that_drives_on_in_silence_fails() -> None:
    robot = FakeRobot(stops=False)
    result = await checks.told("silence", lambda: checks.silence_stops(robot))
    assert "still 0.60 m/s" in result.detail


async def test_a_gray_picture_fails_and_a_real_one_passes() -> None:
    real = np.random.default_rng(0).integers(0, 255, (48, 64, 3), dtype=np.uint8)
    for image, is_ok in ((np.full((48, 64, 3), 90, dtype=np.uint8), False), (real, True)):
        camera = FakeCamera(image)
        result = await checks.told("pictures", lambda camera=camera: checks.pictures_arrive(camera))  # type: ignore[misc]
        assert result.is_ok is is_ok


async def test_silence_of_a_sensor_is_a_failed_check_and_not_a_crash() -> None:
    class Silent:
        async def next_message(self, timeout_s: float = 10.0) -> Any:
            raise TimeoutError

    result = await checks.told("gps", lambda: checks.messages_arrive(Silent()))
    assert result == checks.Result("gps", False, "nothing arrived in time")


def test_results_survive_the_way_between_the_processes() -> None:
    result = checks.Result("drive", True, "moved 1 m")
    assert checks.Result.of_wire(json.loads(json.dumps(result.wire()))) == result
