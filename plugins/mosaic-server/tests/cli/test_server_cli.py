"""`mosaic server …` as a person or a supervisor uses it."""

from __future__ import annotations

import json
import os
import re
import signal
import socket
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import httpx
import pytest
import yaml
from typer.testing import CliRunner

import mosaic_server
from mosaic_core.words.config import ServerConfig
from mosaic_server.cli import app

runner = CliRunner()


@pytest.fixture
def data_dir(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("MOSAIC_DATA_DIR", str(tmp_path / "data"))
    return tmp_path / "data"


def run(*words: str, text: str | None = None, code: int = 0) -> str:
    result = runner.invoke(app, list(words), input=text)
    assert result.exit_code == code, result.output
    return result.output


def as_json(*words: str) -> Any:
    return json.loads(run(*words, "--json"))


def test_init_makes_one_account_and_shows_its_password_once(data_dir: Path) -> None:
    made = as_json("init", "--email", "ada@example.org")
    assert len(made["password"]) >= 16
    run("init", "--email", "eve@example.org", code=2)
    assert (data_dir / "mosaic-server.sqlite3").stat().st_mode & 0o777 == 0o600
    assert data_dir.stat().st_mode & 0o777 == 0o700
    listed = as_json("user", "list")
    assert [user["email"] for user in listed] == ["ada@example.org"]
    assert made["password"] not in run("user", "list")


@pytest.mark.parametrize("email", ["notanemail", "@", "ada@", "a da@example.org"])
def test_what_is_no_e_mail_makes_no_account(data_dir: Path, email: str) -> None:
    assert "no e-mail" in run("init", "--email", email, code=2)
    run("init", "--email", "ada@example.org")
    assert "no e-mail" in run("user", "add", email, code=2)
    assert [one["email"] for one in as_json("user", "list")] == ["ada@example.org"]


@pytest.mark.usefixtures("data_dir")
def test_a_second_robot_of_the_same_name_is_hinted_at() -> None:
    run("init", "--email", "ada@example.org")
    assert "hint:" not in run("robot", "add", "Rover")
    assert "hint: another robot of this organization is called 'Rover'" in run("robot", "add", "Rover")
    run("user", "add", "bob@example.org")
    assert "hint:" not in run("robot", "add", "Rover", "--owner", "bob@example.org")


def test_a_password_may_come_from_standard_input(data_dir: Path) -> None:
    assert "password" not in run("init", "--email", "ada@example.org", "--password-stdin", text="long enough\n")
    run("user", "password", "ada@example.org", "--password-stdin", text="short\n", code=2)


@pytest.mark.usefixtures("data_dir")
def test_the_printed_snippet_is_a_valid_server_section() -> None:
    run("init", "--email", "ada@example.org")
    snippet = run("robot", "add", "rover", "--ws-url", "wss://mosaic.example.org")
    server = ServerConfig.model_validate(yaml.safe_load(snippet)["server"])
    assert server.auth.type == "simple-token"
    token = server.auth.params.token
    assert token is not None
    assert token.get_secret_value().startswith("mrt_")
    open_one = run("robot", "add", "toy", "--no-authorization")
    assert "token" not in open_one
    assert ServerConfig.model_validate(yaml.safe_load(open_one)["server"]).auth.type == "no-authorization"


@pytest.mark.usefixtures("data_dir")
def test_robots_are_listed_get_new_tokens_and_are_removed() -> None:
    run("init", "--email", "ada@example.org")
    first = as_json("robot", "add", "rover")
    assert as_json("robot", "token", "rover")["robotToken"] != first["robotToken"]
    assert as_json("robot", "list")[0]["id"] == first["robotId"]
    run("robot", "remove", first["robotId"])
    assert as_json("robot", "list") == []
    run("robot", "remove", "rover", code=1)


@pytest.mark.usefixtures("data_dir")
def test_with_several_accounts_a_robot_needs_an_owner() -> None:
    run("robot", "add", "rover", code=2)
    run("user", "add", "ada@example.org")
    run("user", "add", "bob@example.org")
    run("user", "add", "bob@example.org", code=1)
    run("robot", "add", "rover", code=2)
    run("robot", "add", "rover", "--owner", "bob@example.org")
    run("robot", "add", "rover", "--owner", "eve@example.org", code=1)
    run("user", "disable", "bob@example.org")
    assert [user["active"] for user in as_json("user", "list")] == [True, False]
    run("user", "disable", "bob@example.org", "--undo")
    run("user", "disable", "eve@example.org", code=1)


@pytest.mark.usefixtures("data_dir")
def test_ice_servers_are_checked_when_they_are_added() -> None:
    added = as_json("ice", "add", "turn:turn.example.org", "--username", "u", "--credential", "secret")
    assert "secret" not in run("ice", "list")
    run("ice", "add", "http://turn.example.org", code=2)
    run("ice", "remove", added["id"])
    run("ice", "remove", added["id"], code=1)


@pytest.mark.usefixtures("data_dir")
def test_seed_makes_a_database_only_once() -> None:
    seeded = as_json("seed", "--robot-name", "sim")
    assert seeded.keys() == {"email", "password", "robotId", "robotToken"}
    run("seed", code=2)


@pytest.mark.usefixtures("data_dir")
def test_a_public_address_without_tls_has_to_be_insisted_on() -> None:
    assert "--insecure-public" in run("run", "--host", "0.0.0.0", code=2)  # noqa: S104 - refused, never bound
    run("run", "--database", "nonsense://", code=2)


@pytest.fixture
def lab(data_dir: Path) -> None:
    run("init", "--email", "ada@example.org")
    run("user", "add", "bob@example.org", "--organization-of", "ada@example.org")
    run("robot", "add", "rover")


def roles(robot: str = "rover") -> dict[str, str]:
    return {one["email"]: one["role"] for one in as_json("robot", "grants", robot)}


@pytest.mark.usefixtures("lab")
def test_roles_are_granted_listed_and_revoked() -> None:
    assert roles() == {"ada@example.org": "supervisor", "bob@example.org": "operator"}
    granted = as_json("robot", "grant", "rover", "BOB@example.org", "observer")
    assert (granted["robot"], granted["role"], granted["granted"]) == ("rover", "observer", True)
    assert roles()["bob@example.org"] == "observer"
    table = run("robot", "grants", "rover").splitlines()
    assert table[0].split() == ["email", "role", "granted", "program", "admin", "active", "accountId"]
    assert table[2].split()[:4] == ["bob@example.org", "observer", "yes", "no"]
    said = run("robot", "revoke", "rover", "bob@example.org")
    assert said == "bob@example.org is operator on rover by default\n"


@pytest.mark.usefixtures("lab")
def test_wrong_names_are_answered_with_the_nearest() -> None:
    assert "did you mean 'rover'?" in run("robot", "grant", "rovr", "bob@example.org", "observer", code=1)
    assert "did you mean 'bob@example.org'?" in run("robot", "grant", "rover", "bop@example.org", "observer", code=1)
    assert "did you mean 'observer'?" in run("robot", "grant", "rover", "bob@example.org", "observr", code=2)
    assert "observer, operator, supervisor" in run("robot", "grant", "rover", "bob@example.org", "god", code=2)
    assert "see `mosaic server robot list`" in run("robot", "grants", "x", code=1)
    assert "see `mosaic server user list`" in run("robot", "revoke", "rover", "x", code=1)
    assert "did you mean 'role.granted'?" in run("audit", "--action", "role.grant", code=2)


@pytest.mark.usefixtures("lab")
def test_the_last_supervisor_and_strangers_are_refused() -> None:
    assert "without a supervisor" in run("robot", "grant", "rover", "ada@example.org", "observer", code=1)
    assert "without a supervisor" in run("user", "program", "ada@example.org", code=1)
    assert "without a supervisor" in run("user", "remove", "ada@example.org", code=1)
    run("robot", "remove", "rover")
    assert "without an administrator" in run("user", "admin", "ada@example.org", "--undo", code=1)
    run("user", "admin", "bob@example.org")
    run("user", "admin", "ada@example.org", "--undo")
    run("robot", "add", "rover")
    run("user", "add", "eve@example.org")
    assert "another organization" in run("robot", "grant", "rover", "eve@example.org", "observer", code=1)


@pytest.mark.usefixtures("lab")
def test_a_public_lab_makes_everyone_an_observer() -> None:
    assert as_json("organization")["defaultRole"] == "operator"
    assert as_json("organization", "--default-role", "observer")["defaultRole"] == "observer"
    assert roles() == {"ada@example.org": "supervisor", "bob@example.org": "observer"}
    run("user", "add", "eve@example.org")
    assert "--organization-of EMAIL" in run("organization", code=2)
    assert as_json("organization", "--organization-of", "eve@example.org")["defaultRole"] == "operator"


@pytest.mark.usefixtures("lab")
def test_accounts_of_programs_are_marked_and_accounts_removed() -> None:
    run("user", "add", "bot@example.org", "--program", "--organization-of", "ada@example.org")
    run("user", "add", "cleo@example.org", "--admin", "--organization-of", "ada@example.org")
    listed = {one["email"]: (one["admin"], one["program"]) for one in as_json("user", "list")}
    assert listed == {
        "ada@example.org": (True, False),
        "bob@example.org": (False, False),
        "bot@example.org": (False, True),
        "cleo@example.org": (True, False),
    }
    run("user", "program", "bot@example.org", "--undo")
    run("user", "remove", "cleo@example.org")
    assert roles() == {"ada@example.org": "supervisor", "bob@example.org": "operator", "bot@example.org": "operator"}
    run("user", "add", "eve@example.org")
    run("user", "remove", "eve@example.org")
    run("user", "add", "eve@example.org")


@pytest.mark.usefixtures("lab")
def test_the_audit_log_is_shown_newest_first() -> None:
    run("robot", "grant", "rover", "bob@example.org", "observer")
    run("robot", "grant", "rover", "bob@example.org", "observer")
    run("organization", "--default-role", "observer")
    lines = as_json("audit")
    assert [(one["action"], one["actor"]) for one in lines] == [
        ("default-role.changed", "command line"),
        ("role.granted", "command line"),
        ("account.added", "command line"),
    ]
    assert as_json("audit", "--limit", "1", "--before", str(lines[0]["id"])) == lines[1:2]
    assert as_json("audit", "--action", "role.granted", "--organization-of", "ada@example.org") == lines[1:2]
    table = run("audit").splitlines()
    assert table[0].split()[:4] == ["id", "at", "action", "actor"]
    assert "was operator" in table[2]


class Child:
    """The server as its own process, as a supervisor starts it."""

    def __init__(self, data_dir: Path, *words: str) -> None:
        self.ready = data_dir.parent / f"ready-{time.monotonic_ns()}.json"
        command = [sys.executable, "-m", "mosaic_server", "run", "--port", "0", "--ready-file", str(self.ready)]
        self.process = subprocess.Popen(
            [*command, "--data-dir", str(data_dir), *words], stderr=subprocess.PIPE, text=True
        )

    def listening(self) -> dict[str, Any]:
        deadline = time.monotonic() + 20
        while not self.ready.exists():
            assert self.process.poll() is None, self.process.communicate()[1]
            assert time.monotonic() < deadline
            time.sleep(0.05)
        return json.loads(self.ready.read_text())

    def ends(self, with_signal: int | None = None) -> tuple[int, str, float]:
        started = time.monotonic()
        if with_signal is not None:
            self.process.send_signal(with_signal)
        _, errors = self.process.communicate(timeout=20)
        return self.process.returncode, errors, time.monotonic() - started


@pytest.mark.parametrize(("number", "words"), [(signal.SIGTERM, []), (signal.SIGINT, ["--no-widgets"])])
def test_a_supervised_server_announces_its_port_and_ends_well(data_dir: Path, number: int, words: list[str]) -> None:
    seeded = as_json("seed")
    child = Child(data_dir, *words)
    url = child.listening()["url"]
    login = {"username": seeded["email"], "password": seeded["password"]}
    signed_in = httpx.post(f"{url}/api/v1/account/login/access-token", json=login).raise_for_status().json()
    headers = {"Authorization": f"Bearer {signed_in['resultData']['accessToken']}"}
    assert httpx.get(f"{url}/api/v1/widgets", headers=headers).json()["resultData"]["isOn"] is (words == [])
    if number == signal.SIGTERM:
        assert_no_second_one_starts(data_dir)
    code, errors, took_s = child.ends(number)
    assert code == 0
    assert took_s < 5
    assert seeded["password"] not in errors


def assert_no_second_one_starts(data_dir: Path) -> None:
    code, errors, _ = Child(data_dir).ends()
    assert code == 1
    assert "another MOSAIC server is running on" in errors
    assert "Traceback" not in errors


def test_a_port_that_is_taken_is_said_without_a_traceback(data_dir: Path) -> None:
    with socket.create_server(("127.0.0.1", 0)) as first:
        code, errors, _ = Child(data_dir, "--port", str(first.getsockname()[1])).ends()
    assert code != 0
    assert "address already in use" in errors.lower()
    assert "Traceback" not in errors


def test_a_file_descriptor_may_be_told_too(data_dir: Path) -> None:
    reading, writing = os.pipe()
    process = subprocess.Popen(
        [sys.executable, "-m", "mosaic_server", "run", "--port", "0", "--announce-fd", str(writing)],
        pass_fds=(writing,),
        stderr=subprocess.DEVNULL,
        env=os.environ | {"MOSAIC_DATA_DIR": str(data_dir)},
    )
    os.close(writing)
    with os.fdopen(reading) as pipe:
        assert json.loads(pipe.readline())["port"] > 0
    process.send_signal(signal.SIGTERM)
    assert process.wait(5) == 0


def test_importing_the_application_loads_no_webrtc() -> None:
    code = "import sys, mosaic_server.app; print(sorted({'aiortc', 'av', 'cv2', 'numpy'} & sys.modules.keys()))"
    command = [sys.executable, "-c", code]
    out = subprocess.run(command, capture_output=True, text=True, check=True)
    assert out.stdout.strip() == "[]"


def test_the_server_builds_on_the_two_lowest_layers_only() -> None:
    package = Path(mosaic_server.__file__).parent
    for module in package.rglob("*.py"):
        # the shelf finds widgets as robots do
        known = ("words", "machines", "runtime") if module.name == "widget_shelf.py" else ("words", "machines")
        for imported in re.findall(r"^\s*(?:from|import) mosaic_core\.?(\w*)", module.read_text(), re.MULTILINE):
            assert imported in known, f"{module} imports mosaic_core.{imported}"


def test_a_certificate_that_is_none_is_told_before_anything_starts(data_dir: Path, tmp_path: Path) -> None:
    file = tmp_path / "cert.pem"
    file.write_text("no PEM")
    said = run("run", "--port", "0", "--ssl-certfile", str(file), "--ssl-keyfile", str(file), code=2)
    assert f"{file} and {file} are no certificate and its key" in said
    assert not data_dir.exists()


def test_a_port_that_is_taken_is_no_robot_that_was_replaced(data_dir: Path) -> None:
    with socket.create_server(("127.0.0.1", 0)) as taken:
        run("run", "--port", str(taken.getsockname()[1]), code=1)


def test_a_data_directory_that_is_a_file_is_told_with_its_cure(tmp_path: Path) -> None:
    file = tmp_path / "file"
    file.touch()
    for words in (("user", "list"), ("run", "--port", "0")):
        assert "name a folder that you may write" in run(*words, "--data-dir", str(file), code=2)
