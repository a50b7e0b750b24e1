"""What pages have a reader type is right: the command line takes every `mosaic …`, and what can be run here is run."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Iterator, Sequence
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from support.page_blocks import ROOT, Command, blocks, commands, named_in_prose
from support.robot_process import running_robot
from support.server_process import Seed, ServerProcess
from typer.core import TyperCommand
from typer.testing import CliRunner

from mosaic_core.cli.main import app

ALL = [one for block in blocks("bash", "console") for one in commands(block)]
OURS = [one for one in ALL if one.program == "mosaic"]

PROGRAMS = {
    "belongs to the reader's shell": ". cd cp export source",
    "reads files of the reader's": "cat echo less sha256sum gh python",
    "changes or asks the machine": "sudo timedatectl journalctl ls",
    "makes an environment": "python3 python3.11",
    "installs: `nox -s build` does, each distribution alone": "pip",
    "installs: tests/e2e/simulated_robot/test_own_page.py does": "npm",
    "sets up: tests/architecture/test_dev_script.py": "dev",
    "runs tests": "pytest",
    "needs the reader's server": "curl jq",
    "needs ROS 2": "ros2",
    "needs a broker: plugins/mosaic-mqtt/tests have one": "mosquitto_pub",
    "needs a board or a camera": "v4l2-ctl i2cdetect vcgencmd rpicam-vid gst-launch-1.0",
}
"""Why nobody runs them here, and which programs of other people's."""
KNOWN = {name for names in PROGRAMS.values() for name in names.split()}

NOT_RUN = {
    r"run\b|server run\b": "runs until Ctrl+C: server and robot of these tests are run by it",
    r"demo\b": "runs until Ctrl+C: plugins/mosaic-sim/tests",
    r"bench\b": "takes minutes: tests/bench",
    r"plugin check\b": "runs the tests of plugins: tests/ladder, and each plugin's test that it is gold",
    r"arm (calibrate|follow)\b": "needs an arm: plugins/mosaic-arm/tests have one of pseudo-terminals",
    r"safety drill\b": "holds times, which a busy machine stretches: tests/drill",
    r"operator drive\b": "reads keys: tests/cli/operator/test_drive_keys.py",
    r"operator send\b": "is late on a busy machine: tests/cli/operator/test_operator_command.py",
    r"operator call\b": "asks the connector of its page: tests/operator",
    r"joystick drive\b": "needs a stick: plugins/mosaic-joystick/tests have some that are made up",
    r"lan\b|operator (pair|unpair|robots --lan)\b": "needs a robot at hand: tests/e2e/test_lan_twin.py",
    r"ros2\b": "needs a robot that speaks ROS 2: plugins/mosaic-ros2/tests",
    r"mujoco\b": "needs the reader's model: plugins/mosaic-mujoco/tests",
    r"connectors show (thermometer|lamp)": "is of the reader: tests/cli/plugin/test_third_party_connector.py",
    r"service print\b": "is about accounts of this machine: tests/cli/robot/test_service_command.py",
    r"doctor$|doctor encoders|doctor mosaic_config.yaml$": "takes seconds of the processor: tests/doctor",
}
"""What of ours is not run here, and why or where it is."""

GONE_BEFORE = {
    r"server (?!init)": "server init",
    r"server robot grant ": "server robot add rover",
}
"""What a reader has done before, maybe on another page."""
CONFIG = "mosaic_config.yaml"
CONNECTORS = """\
  - { type: connection-check, label: link }
  - { type: cmd-vel, label: cmd_vel, params: { drive: { type: log } } }
"""
EMAIL = "ada@example.org\n"
"""What is asked where an account is made."""


def reasons_of(command: Command) -> list[str]:
    """Patterns of `NOT_RUN` that it is meant by."""
    return [pattern for pattern in NOT_RUN if re.match(pattern, " ".join(command.words[1:]))]


RUN = [one for one in OURS if not reasons_of(one)]
PAGES = sorted({one.block.page for one in RUN})


@pytest.fixture
def reads_only(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """Words are read by the command itself, which then does nothing."""
    monkeypatch.setattr(TyperCommand.__mro__[1], "invoke", lambda command, context: None)
    monkeypatch.chdir(tmp_path)


@pytest.fixture(scope="module")
def robot(server: ServerProcess, tmp_path_factory: pytest.TempPathFactory) -> Iterator[tuple[Seed, str]]:
    """The account of "My robot", which is ready, and its file."""
    seed, folder = server.seed("My robot"), tmp_path_factory.mktemp("robot")
    with running_robot(folder, server, seed, CONNECTORS):
        yield seed, (folder / CONFIG).read_text()


@pytest.fixture
def desk(tmp_path: Path, server: ServerProcess, robot: tuple[Seed, str], monkeypatch: pytest.MonkeyPatch) -> Path:
    """The reader's folder and shell."""
    seed, _ = robot
    (tmp_path / "turn-secret.txt").write_text("secret\n")
    monkeypatch.chdir(tmp_path)
    variables = {
        "HOME": str(tmp_path), "MOSAIC_DATA_DIR": str(tmp_path / "data"), "MOSAIC_SERVER": server.url,
        "MOSAIC_EMAIL": seed.email, "MOSAIC_PASSWORD": seed.password,
        "MOSAIC_ROBOT_ID": seed.robot_id, "MOSAIC_TOKEN": seed.robot_token,
    }  # fmt: skip
    for name, value in variables.items():
        monkeypatch.setenv(name, value)
    terminal = SimpleNamespace(stdin=SimpleNamespace(isatty=lambda: True))
    monkeypatch.setattr("mosaic_core.cli.operator.account_options.sys", terminal)  # a person types
    return tmp_path


@pytest.mark.parametrize("block", blocks("bash", "console"), ids=lambda block: block.place)
def test_every_program_is_ours_or_it_is_said_why_it_is_not_run(block: Any) -> None:
    for one in commands(block):
        assert one.program == "mosaic" or one.program in KNOWN, f"{one}: say in PROGRAMS why it isn't run"


def test_no_reason_is_left_of_what_no_page_has() -> None:
    assert KNOWN - {one.program for one in ALL} == set()
    assert NOT_RUN.keys() - {pattern for one in OURS for pattern in reasons_of(one)} == set()


def test_what_is_said_to_run_it_elsewhere_is_there() -> None:
    places = re.findall(r"(?:tests|plugins)/[\w./-]+", " ".join([*PROGRAMS, *NOT_RUN.values()]))
    assert [place for place in places if not (ROOT / place).exists()] == []


@pytest.mark.parametrize("command", OURS, ids=str)
def test_the_command_line_takes_it(command: Command, reads_only: None) -> None:
    for word in command.words:
        if re.fullmatch(r"[\w-]+\.\w+", word):
            Path(word).touch()
    done = CliRunner().invoke(app, command.words[1:], input=EMAIL)
    assert done.exit_code == 0, f"{command}\n{done.output}"


def test_commands_and_options_that_sentences_name_are_there(reads_only: None) -> None:
    for named, page in named_in_prose().items():
        words = [word for word in named.split()[1:] if not re.search("[…|]", word)]
        said = CliRunner().invoke(app, words, input=EMAIL).output
        assert "No such" not in said, f"{page}: `{named}`: {said}"


@pytest.mark.parametrize("words", ["rnu", "run --sevre", "operator lease", "run --log-level shout", "server user"])
def test_words_that_are_wrong_would_be_noticed(words: str, reads_only: None) -> None:
    assert CliRunner().invoke(app, words.split()).exit_code == 2


@pytest.mark.parametrize("command", [one for one in ALL if one.program == "pip"], ids=str)
def test_what_it_installs_of_ours_is_a_distribution_with_that_extra(command: Command) -> None:
    for found in filter(None, (re.fullmatch(r"(mosaic-\w+)(?:\[(\w+)\])?", word) for word in command.words)):
        name, extra = found.groups()
        folder = ROOT if name == "mosaic-core" else ROOT / "plugins" / name
        extras = tomllib.loads((folder / "pyproject.toml").read_text())["project"].get("optional-dependencies", {})
        assert not extra or extra in extras, f"{command}: {name} has no extra '{extra}'"


@pytest.mark.webrtc
@pytest.mark.timeout(300)
@pytest.mark.parametrize("page", PAGES)
def test_what_can_be_run_of_a_page_runs_in_its_order(page: str, desk: Path, robot: tuple[Seed, str]) -> None:
    typed: set[str] = set()
    for command in (one for one in RUN if one.block.page == page):
        words = ["My robot" if word == "ROBOT" else word for word in command.words[1:]]
        for pattern, before in GONE_BEFORE.items():
            if re.match(pattern, " ".join(words)) and not any(one.startswith(before) for one in typed):
                typed.add(before)
                run(before.split())
        typed.add(" ".join(words))
        if not (desk / CONFIG).exists() and (CONFIG in words or words[0] == "validate"):
            (desk / CONFIG).write_text(robot[1])
        run(words)


def run(words: Sequence[str]) -> None:
    """Run it; the doctor may find what it wants."""
    done = CliRunner().invoke(app, words, input=EMAIL)
    assert done.exit_code in ((0, 1) if words[0] == "doctor" else (0,)), f"mosaic {' '.join(words)}\n{done.output}"
