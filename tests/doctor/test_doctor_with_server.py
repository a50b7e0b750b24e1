"""`mosaic doctor` against a real server: the token is checked, and a robot that runs is not put off."""

from __future__ import annotations

import json
import socket
import time
from pathlib import Path
from typing import Any

import pytest
from typer.testing import CliRunner

from mosaic_core.cli.main import app

pytestmark = pytest.mark.timeout(90)

YAML = """\
version: 1
server:
  ws_url: {url}
  auth: {{ type: simple-token, robot_id: {robot_id}, params: {{ token: "{token}" }} }}
connectors:
  - {{ type: connection-check, label: link }}
"""


def examined(*words: str) -> tuple[int, dict[str, list[dict[str, Any]]]]:
    done = CliRunner().invoke(app, ["doctor", *words, "--json"])
    found: dict[str, list[dict[str, Any]]] = {}
    for finding in json.loads(done.output)["findings"]:
        found.setdefault(finding["check"], []).append(finding)
    return done.exit_code, found


def robot_file(folder: Path, url: str, robot_id: str, token: str) -> str:
    path = folder / "robot.yaml"
    path.write_text(YAML.format(url=url.replace("http", "ws", 1), robot_id=robot_id, token=token))
    return str(path)


def test_a_running_robot_stays_connected_while_its_token_is_checked(
    server: Any, seed: Any, start_robot: Any, tmp_path: Path
) -> None:
    robot = start_robot("  - { type: connection-check, label: link }\n")
    path = robot_file(tmp_path, server.url, seed.robot_id, seed.robot_token)
    code, found = examined(path, "--only", "server", "--only", "config")
    assert code == 0
    assert {check: rows[0]["status"] for check, rows in found.items()} == {
        "config.yaml": "ok", "server.dns": "ok", "server.tcp": "ok", "server.http": "ok", "server.clock": "ok",
        "server.websocket": "ok", "server.token": "ok", "server.ice_servers": "ok",
    }  # fmt: skip
    assert found["server.token"][0]["facts"]["isOnline"] is True
    assert robot.process.poll() is None
    assert not any("replaced" in line for line in robot.log)
    robot.wait_for(lambda snapshot: snapshot["state"] == "ready", "the robot is still ready")


@pytest.mark.parametrize(("part", "code"), [("token", "auth.failed"), ("robot_id", "auth.unknown_robot")])
def test_wrong_credentials_are_told_from_an_unknown_robot(
    server: Any, seed: Any, tmp_path: Path, part: str, code: str
) -> None:
    said = {"robot_id": seed.robot_id, "token": seed.robot_token}
    said[part] = {"token": "mrt_wrong", "robot_id": "00000000-0000-4000-8000-000000000000"}[part]
    exit_code, found = examined(robot_file(tmp_path, server.url, **said), "--only", "server")
    assert exit_code == 1
    assert found["server.token"][0]["code"] == code


def test_without_a_file_the_server_alone_is_looked_at(server: Any) -> None:
    code, found = examined("--server", f"{server.url}/robots", "--only", "server")
    assert code == 0
    assert found["server.token"][0]["status"] == "skipped"


@pytest.mark.parametrize(
    ("url", "check", "code"),
    [
        ("ws://nix.invalid", "server.dns", "signal.name_unknown"),
        ("ws://127.0.0.1:9", "server.tcp", "signal.unreachable"),
        ("wss://{host}", "server.tls", "signal.tls"),
    ],
)
def test_each_step_of_the_way_has_its_code(server: Any, url: str, check: str, code: str) -> None:
    host = server.url.partition("://")[2]
    exit_code, found = examined("--server", url.format(host=host), "--only", "server")
    assert exit_code == 1
    assert found[check][0]["code"] == code
    assert "server.websocket" not in found, "what depends on a failed step is not tried"


def test_everything_ends_within_twenty_seconds_with_a_server_that_says_nothing() -> None:
    with socket.create_server(("127.0.0.1", 0)) as mute:  # takes connections, and never a word
        began_s = time.monotonic()
        code, found = examined("--server", f"ws://127.0.0.1:{mute.getsockname()[1]}")
    assert time.monotonic() - began_s < 25, "20 s are promised; this machine may be busy"
    assert code == 1
    assert found["server.http"][0]["code"] == "signal.not_mosaic"
    assert found["webrtc.loopback"][0]["status"] == "ok"


def test_a_whole_connection_is_made_with_a_stand_in_where_the_robot_is_offline(
    server: Any, seed: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("MOSAIC_PASSWORD", seed.password)
    path = robot_file(tmp_path, server.url, seed.robot_id, seed.robot_token)
    code, found = examined(path, "--with-server", "--email", seed.email, "--only", "whole")
    assert code == 0, found
    assert "ms until it can be used" in found["whole.connection"][0]["sentence"]
    moments = [mark["moment"] for mark in found["whole.connection"][0]["facts"]["timeline"]["marks"]]
    assert {"asked", "granted", "offered", "answered", "ice", "dtls", "control", "hello", "catalogue"} <= set(moments)
    assert "whole.relay" not in found, "this server hands out no relay"


def test_an_account_that_may_not_sign_in_is_a_finding(
    server: Any, seed: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("MOSAIC_PASSWORD", "wrong")
    path = robot_file(tmp_path, server.url, seed.robot_id, seed.robot_token)
    code, found = examined(path, "--with-server", "--email", seed.email, "--only", "whole")
    assert code == 1
    assert found["whole.sign_in"][0]["code"] == "auth.failed"
