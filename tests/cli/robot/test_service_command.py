"""`mosaic service print`: a service file that systemd takes, for a robot's file that has no mistake."""

from __future__ import annotations

import os
import pwd
import shutil
import subprocess
from pathlib import Path

import pytest
from typer.testing import CliRunner, Result

from mosaic_core.cli.main import app
from mosaic_core.cli.robot.service_unit import ServiceUnit, unit_text
from mosaic_core.words.errors import ConfigError, MosaicError

ACCOUNT = pwd.getpwuid(1).pw_name
ROBOT = """\
server:
  ws_url: wss://mosaic.example.org
  auth:
    type: simple-token
    robot_id: ${MOSAIC_ROBOT_ID}
    params: { token: "${credential:token}" }
connectors:
  - { type: connection-check, label: link }
"""


@pytest.fixture
def robot_file(tmp_path: Path) -> Path:
    path = tmp_path / "my robot 100%" / "mosaic_config.yaml"
    path.parent.mkdir()
    path.write_text(ROBOT)
    return path


def printed(*words: str) -> Result:
    return CliRunner().invoke(app, ["service", "print", *words])


def verified(text: str, folder: Path, *words: str) -> str:
    """What systemd has to say against a service file; it warns of unknown settings and values, and goes on."""
    path = folder / "robot.service"
    path.write_text(text)
    environ = {**os.environ, "XDG_RUNTIME_DIR": str(folder)}
    done = subprocess.run(
        ["systemd-analyze", "verify", *words, str(path)], capture_output=True, text=True, timeout=20, env=environ
    )
    return done.stderr.strip()


needs_systemd = pytest.mark.skipif(shutil.which("systemd-analyze") is None, reason="needs systemd-analyze")


@needs_systemd
def test_systemd_has_nothing_against_the_service_of_an_account(robot_file: Path, tmp_path: Path) -> None:
    done = printed(str(robot_file), "--account", ACCOUNT, "--", "--serve", "--name", "Rover One")
    assert done.exit_code == 0, done.stderr
    assert verified(done.stdout, tmp_path) == ""


@needs_systemd
def test_systemd_has_nothing_against_the_service_of_a_users_own(robot_file: Path, tmp_path: Path) -> None:
    done = printed(str(robot_file), "--user")
    assert done.exit_code == 0, done.stderr
    assert verified(done.stdout, tmp_path, "--user") == ""
    assert "Nice=" not in done.stdout
    assert "\nUser=" not in done.stdout
    assert "WantedBy=default.target" in done.stdout


@needs_systemd
def test_a_wrong_setting_would_be_noticed(robot_file: Path, tmp_path: Path) -> None:
    text = printed(str(robot_file), "--account", ACCOUNT).stdout.replace("Nice=-10", "Nice=-50")
    assert "Nice" in verified(text, tmp_path)


def test_the_file_names_paths_account_words_and_secrets(robot_file: Path) -> None:
    lines = printed(str(robot_file), "--account", ACCOUNT, "--", "--serve=0.0.0.0:9002").stdout.splitlines()
    escaped = str(robot_file).replace("%", "%%")
    assert f"User={ACCOUNT}" in lines
    assert f"WorkingDirectory={escaped.removesuffix('/mosaic_config.yaml')}" in lines
    assert "LoadCredential=token:/etc/mosaic/token" in lines
    assert "EnvironmentFile=/etc/mosaic/mosaic.env" in lines
    [start] = [line for line in lines if line.startswith("ExecStart=")]
    assert start.endswith(f'mosaic run "{escaped}" --serve=0.0.0.0:9002')
    assert any("MOSAIC_ROBOT_ID" in line for line in lines if line.startswith("#"))


def test_no_secret_and_no_variable_need_no_line(robot_file: Path) -> None:
    robot_file.write_text(
        ROBOT.replace('"${credential:token}"', "abcd").replace(
            "${MOSAIC_ROBOT_ID}", "7d1c2f6e-0b52-4c1e-9a53-2f6f1f0c9b11"
        )
    )
    text = printed(str(robot_file), "--account", ACCOUNT).stdout
    assert "LoadCredential" not in text
    assert "EnvironmentFile" not in text
    assert "abcd" not in text


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["--account", "nobody-of-this-name"], "no account 'nobody-of-this-name'"),
        (["--account", ACCOUNT, "--user"], "leave out --account"),
        (["--account", ACCOUNT, "--name", "a/b"], "--name 'a/b'"),
        (["--account", ACCOUNT, "--", "--reload"], "--reload is for a terminal"),
        (["--account", ACCOUNT, "--", "--sevre"], "--sevre"),
    ],
)
def test_wrong_words_are_told_and_nothing_is_printed(words: list[str], said: str, robot_file: Path) -> None:
    done = printed(str(robot_file), *words)
    assert (done.exit_code, done.stdout) == (2, "")
    assert said in done.stderr


def test_options_of_run_without_a_file_are_told() -> None:
    done = printed("--", "--serve")
    assert (done.exit_code, done.stdout) == (2, "")
    assert "before `--`" in done.stderr


def test_root_is_never_taken_unasked(robot_file: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(os, "geteuid", lambda: 0)
    assert "needs no root" in printed(str(robot_file)).stderr


def test_the_account_is_by_default_who_asks(robot_file: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(os, "geteuid", lambda: 1)
    assert f"User={ACCOUNT}" in printed(str(robot_file)).stdout


def test_a_mistake_in_the_robots_file_is_told_instead(robot_file: Path) -> None:
    robot_file.write_text(ROBOT.replace("connection-check", "conection-check"))
    done = printed(str(robot_file), "--account", ACCOUNT)
    assert isinstance(done.exception, ConfigError)
    assert done.stdout == ""


@pytest.mark.parametrize("bad", ['a"b', "a$b", "a\\b", "a\nUser=root", "a'b"])
def test_a_path_that_systemd_would_read_otherwise_is_refused(bad: str) -> None:
    unit = ServiceUnit("mosaic", "rover", (), Path("/home") / bad, ("/bin/mosaic",), Path("/etc/mosaic"))
    with pytest.raises(MosaicError, match="would mean something else") as raised:
        unit_text(unit)
    assert raised.value.code == "config.service"


def test_a_folder_of_secrets_can_have_no_space_or_colon() -> None:
    for folder in ("/etc/my secrets", "/etc/a:b"):
        unit = ServiceUnit("mosaic", "rover", (), Path("/home/rover"), ("/bin/mosaic",), Path(folder), ("token",))
        with pytest.raises(MosaicError):
            unit_text(unit)


TWO_LEASES = """\
connectors:
  - { type: cmd-vel, label: left, params: { drive: { type: log } }, safety: { resource: arm } }
  - { type: cmd-vel, label: right, params: { drive: { type: log } }, safety: { resource: amr } }
"""


@pytest.mark.parametrize(("words", "is_told"), [([], True), (["--", "--serve", "9002"], False)])
def test_hints_are_told_as_validate_tells_them_but_for_what_the_words_answer(
    robot_file: Path, words: list[str], is_told: bool
) -> None:
    robot_file.write_text(TWO_LEASES)
    said = printed(str(robot_file), "--account", ACCOUNT, *words).stderr
    assert "are two leases, which two people may hold at once" in said
    assert ("no server is named" in said) is is_told
