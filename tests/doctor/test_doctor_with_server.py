"""`mosaic doctor` against a real server: the token is checked, and a robot that runs is not put off."""

from __future__ import annotations

import json
import socket
import threading
import time
from http.server import BaseHTTPRequestHandler, HTTPServer
from pathlib import Path
from typing import Any

import pytest
from typer.testing import CliRunner
from websockets.http11 import Request, Response
from websockets.sync.server import ServerConnection, serve

from mosaic_core.cli.main import app
from mosaic_core.words.signaling import AuthorizeRequest

pytestmark = pytest.mark.timeout(90)

NOBODY = "00000000-0000-4000-8000-000000000000"
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
    said[part] = {"token": "mrt_wrong", "robot_id": NOBODY}[part]
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


@pytest.mark.parametrize(
    ("robot_id", "token", "url"),
    [(None, "mrt_wrong", None), (NOBODY, None, None), (None, None, "ws://nix.invalid"), (None, None, "wss://{host}")],
)
def test_a_server_that_told_nothing_is_not_said_to_have_no_ice_servers(
    server: Any, seed: Any, tmp_path: Path, robot_id: str | None, token: str | None, url: str | None
) -> None:
    reached = (url or server.url).format(host=server.url.partition("://")[2])
    path = robot_file(tmp_path, reached, robot_id or seed.robot_id, token or seed.robot_token)
    _, found = examined(path, "--only", "server", "--only", "ice", "--only", "relay")
    [servers] = found["ice.servers"]
    assert servers["status"] == "skipped"
    assert "it could not be asked" in servers["sentence"]
    assert "ice.relay" not in found


def test_a_server_that_has_no_ice_servers_is_said_to_have_none(server: Any, seed: Any, tmp_path: Path) -> None:
    _, found = examined(robot_file(tmp_path, server.url, seed.robot_id, seed.robot_token), "--only", "ice")
    assert [one["code"] for one in found["ice.servers"]] == ["ice.no_servers"]


def test_without_a_robots_file_the_servers_ice_servers_are_unknown(server: Any) -> None:
    _, found = examined("--server", server.url, "--only", "ice")
    assert "its robots only" in found["ice.servers"][0]["sentence"]


class Stranger(BaseHTTPRequestHandler):
    """Somebody's web server: it knows none of our addresses."""

    def do_GET(self) -> None:
        self.send_error(404)

    def log_message(self, *_: Any) -> None:
        pass


def test_a_host_that_is_no_server_of_ours_is_not_taken_for_an_original_one() -> None:
    with HTTPServer(("127.0.0.1", 0), Stranger) as stranger:
        threading.Thread(target=stranger.serve_forever, daemon=True).start()
        code, found = examined("--server", f"ws://127.0.0.1:{stranger.server_port}", "--only", "server")
        stranger.shutdown()
    assert code == 1
    assert [one["code"] for one in found["server.http"]] == ["signal.not_mosaic"]
    assert "server.websocket" not in found, "whether a stranger speaks WebSocket is of no interest"


def test_an_original_server_greets_and_is_known_by_that() -> None:
    def greet(socket: ServerConnection) -> None:
        socket.send(AuthorizeRequest().to_text())
        for _ in socket:
            pass

    def respond(socket: ServerConnection, request: Request) -> Response | None:
        return None if request.path == "/ws/robot" else socket.respond(404, "nothing here")

    with serve(greet, "127.0.0.1", 0, process_request=respond) as original:
        threading.Thread(target=original.serve_forever, daemon=True).start()
        url = f"ws://127.0.0.1:{original.socket.getsockname()[1]}"
        code, found = examined("--server", url, "--only", "server")
        original.shutdown()
    assert code == 0
    assert [one["code"] for one in found["server.http"]] == ["signal.original_server"]
    assert found["server.websocket"][0]["status"] == "ok"


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
    speed = found["whole.throughput"][0]
    assert "The whole path, there and back: " in speed["sentence"]
    assert speed["facts"]["bps"] > 100_000
    assert 0 < speed["facts"]["roundTripMs"] < 1000


def test_the_path_to_a_running_robot_is_measured_without_a_connector_that_echoes(
    server: Any, seed: Any, start_robot: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    start_robot("  - { type: host-load, label: load }\n")
    monkeypatch.setenv("MOSAIC_PASSWORD", seed.password)
    path = robot_file(tmp_path, server.url, seed.robot_id, seed.robot_token)
    code, found = examined(path, "--with-server", "--email", seed.email, "--only", "whole")
    assert code == 0, found
    speed = found["whole.throughput"][0]
    assert "The whole path, operator to robot: " in speed["sentence"]
    assert speed["facts"]["bps"] > 100_000
    assert 0 < speed["facts"]["roundTripMs"] < 1000


def test_an_account_that_may_not_sign_in_is_a_finding(
    server: Any, seed: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("MOSAIC_PASSWORD", "wrong")
    path = robot_file(tmp_path, server.url, seed.robot_id, seed.robot_token)
    code, found = examined(path, "--with-server", "--email", seed.email, "--only", "whole")
    assert code == 1
    assert found["whole.sign_in"][0]["code"] == "auth.failed"
    assert "password" in found["whole.sign_in"][0]["cure"]
    assert "token" not in found["whole.sign_in"][0]["cure"]
