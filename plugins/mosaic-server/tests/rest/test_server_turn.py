"""A TURN server's shared secret stays with the server; robots and operators get fresh credentials of their own."""

from __future__ import annotations

import base64
import hashlib
import hmac
import json
import logging
import time
from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from typer.testing import CliRunner

from mosaic_core.words.ice import IceServer
from mosaic_server.cli import app
from mosaic_server.storage.database import Database
from mosaic_server.storage.ice_servers import add_ice_server, listed_ice_servers

SECRET = "north-of-the-wall"  # noqa: S105 - of nobody
TURN = ("turn:turn.example.org:3478?transport=udp", "turns:turn.example.org:5349?transport=tcp")
EXTENSIONS = {"multiPeer": 1, "tickets": 1, "iceServers": 1}
LIFETIME_S = 600
runner = CliRunner()


def checked(servers: Iterable[dict[str, Any]], party_id: str, lifetime_s: float = LIFETIME_S) -> str:
    """What coturn checks; returns the username. Sockets carry one entry, REST one for each address."""
    entries = list(servers)
    urls = [one["urls"] for one in entries]
    assert urls in ([list(TURN)], list(TURN))
    server = entries[0]
    assert all(one | {"urls": None} == server | {"urls": None} for one in entries)
    ends_s, _, whose = server["username"].partition(":")
    assert whose == party_id
    assert lifetime_s - 10 < int(ends_s) - time.time() <= lifetime_s
    digest = hmac.new(SECRET.encode(), server["username"].encode(), hashlib.sha1).digest()
    assert base64.b64decode(server["credential"]) == digest
    return str(server["username"])


def with_secret(server: Any) -> None:
    server.work(add_ice_server, IceServer(urls=TURN), SECRET)


def test_operators_and_robots_get_credentials_of_their_own(server: Any) -> None:
    with_secret(server)
    person = server.account()
    robot_id, robot_token = server.robot(person)
    token = server.log_in()
    robot, user = server.open("/ws/robot"), server.open("/ws/user")
    for party in (robot, user):
        party.expect("authorize.req")
    robot.send("authorize", {"robotId": robot_id, "data": robot_token, "extensions": EXTENSIONS})
    user.send("authorize", {"accessToken": token, "extensions": EXTENSIONS})
    for party, party_id in ((robot, robot_id), (user, person.id)):
        party.expect("authorize.res")
        checked(party.expect("session.welcome")["iceServers"], party_id)
    robot.status(0)
    for path in ("/api/v1/ice-servers", "/api/v1/webrtc/ice-servers"):
        answer = server.get(path, token)
        assert answer.headers["cache-control"] == "no-store"
        checked(answer.json(), person.id)
    answer = server.post("/api/v1/webrtc/connection", token, {"robotIds": [robot_id]})
    assert answer.status_code == 200, answer.text
    checked(robot.expect("signaling.prepare_connection")["iceServers"], robot_id)


def test_every_peer_connection_gets_fresh_ones(server: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    with_secret(server)
    person = server.account()
    robot_id, robot_token = server.robot(person)
    robot = server.connect_robot(robot_id, robot_token, EXTENSIONS)
    robot.status(0)
    token = server.log_in()
    server.connect_operator(token, EXTENSIONS)
    now_s, ends = time.time, []
    for later_s in (0, 300):
        monkeypatch.setattr("mosaic_server.sockets.authorizer.time.time", lambda later_s=later_s: now_s() + later_s)
        assert server.post("/api/v1/webrtc/connection", token, {"robotIds": [robot_id]}).status_code == 200
        asked = server.get("/api/v1/webrtc/ice-servers", token).json()
        prepared = robot.expect("signaling.prepare_connection")["iceServers"]
        ends.append([int(one[0]["username"].partition(":")[0]) for one in (asked, prepared)])
    monkeypatch.undo()
    for earlier, later in zip(*ends, strict=True):
        assert 299 <= later - earlier <= 310


def test_a_server_may_be_told_a_shorter_lifetime(settings: Any, start_server: Any) -> None:
    with start_server(replace(settings, turn_lifetime_s=60)) as server:
        with_secret(server)
        person = server.account()
        checked(server.get("/api/v1/ice-servers", server.log_in()).json(), person.id, 60)


def test_the_secret_is_neither_sent_nor_logged(server: Any, caplog: pytest.LogCaptureFixture) -> None:
    caplog.set_level(logging.DEBUG)
    with_secret(server)
    robot_id, robot_token = server.robot(server.account())
    robot = server.connect_robot(robot_id, robot_token, EXTENSIONS)
    robot.status(0)
    token = server.log_in()
    user = server.connect_operator(token, EXTENSIONS)
    asked = server.get("/api/v1/ice-servers", token)
    server.post("/api/v1/webrtc/connection", token, {"robotIds": [robot_id]})
    prepared = robot.expect("signaling.prepare_connection")
    user.send("status.subscribe", {"robotIds": [robot_id]})
    logged = "\n".join(record.getMessage() for record in caplog.records if not record.name.startswith("sqlalchemy"))
    assert robot_id in logged or "/api/v1/ice-servers" in logged
    for text in (logged, asked.text, str(asked.headers), json.dumps(prepared)):
        assert SECRET not in text


def test_turn_without_credentials_of_an_older_database_is_kept_back_and_that_is_said_once(
    server: Any, caplog: pytest.LogCaptureFixture
) -> None:
    server.work(add_ice_server, IceServer(urls=("stun:c.example.org", TURN[0])))
    server.work(add_ice_server, IceServer(urls=("turn:alone.example.org",), username="u"))
    server.account()
    token = server.log_in()
    for _ in range(2):
        assert server.get("/api/v1/ice-servers", token).json() == [
            {"urls": "stun:c.example.org:3478", "username": "", "credential": ""}
        ]
    said = [record.getMessage() for record in caplog.records if "handed to nobody" in record.getMessage()]
    assert sorted("alone.example.org" in one for one in said) == [False, True], "both may be of one millisecond"


def test_the_list_shows_which_entries_lack_credentials(data_dir: Path) -> None:
    database = Database(data_dir, None)
    try:
        database.migrate()
        database.work(add_ice_server, IceServer(urls=TURN))
    finally:
        database.close()
    assert json.loads(run("list", "--json"))[0]["credentials"] == "missing"


@pytest.fixture
def data_dir(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("MOSAIC_DATA_DIR", str(tmp_path / "data"))
    return tmp_path / "data"


def run(*words: str, code: int = 0) -> str:
    result = runner.invoke(app, ["ice", *words])
    assert result.exit_code == code, result.output
    assert SECRET not in result.output
    return result.output


def stored_secrets(data_dir: Path) -> list[str | None]:
    database = Database(data_dir, None)
    try:
        return [one.secret for one in database.work(listed_ice_servers)]
    finally:
        database.close()


def test_a_secret_comes_from_a_file_or_the_environment(
    data_dir: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    file = tmp_path / "turn-secret"
    file.write_text(f"{SECRET}\n")
    monkeypatch.setenv("TURN_SECRET", SECRET)
    run("add", *TURN, "--secret-file", str(file))
    run("add", TURN[0], "--secret-env", "TURN_SECRET", "--json")
    assert stored_secrets(data_dir) == [SECRET, SECRET]


def test_the_list_says_what_kind_of_credentials_and_shows_none(data_dir: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("TURN_SECRET", SECRET)
    run("add", TURN[0], "--secret-env", "TURN_SECRET")
    run("add", "turn:b.example.org", "--username", "u", "--credential", "hush-hush")
    run("add", "stun:c.example.org")
    rows = json.loads(run("list", "--json"))
    assert [row["credentials"] for row in rows] == ["time-limited", "fixed", "none"]
    listed = run("list")
    assert "time-limited" in listed
    assert "hush-hush" not in listed + json.dumps(rows)


@pytest.mark.usefixtures("data_dir")
@pytest.mark.parametrize(
    ("words", "content", "why"),
    [
        ([TURN[0], "--secret-env", "NO_SUCH"], "", "NO_SUCH holds no secret"),
        ([TURN[0], "--secret-file", "FILE"], "\n", "holds no secret"),
        ([TURN[0], "--secret-file", "FILE"], "one\ntwo\n", "more than one line"),
        ([TURN[0], "--secret-file", "FILE", "--secret-env", "HOME"], "one", "not both"),
        ([TURN[0], "--secret-file", "FILE", "--username", "u"], "one", "leave out --username"),
        (["stun:c.example.org", "--secret-file", "FILE"], "one", "is for TURN"),
        (["turn:c.example.org"], "", "give --secret-file"),
        (["stun:c.example.org", "turns:c.example.org"], "", "needs credentials"),
        (["turn:c.example.org", "--username", "u"], "", "both --username and --credential"),
        (["turn:c.example.org", "--username", "u", "--credential", ""], "", "both --username and --credential"),
        (["turns:c.example.org?transport=udp", "--secret-file", "FILE"], "one", "DTLS isn't supported"),
    ],
)
def test_what_makes_no_sense_is_refused_with_the_cure(words: list[str], content: str, why: str, tmp_path: Path) -> None:
    file = tmp_path / "turn-secret"
    file.write_text(content)
    assert why in " ".join(run("add", *(str(file) if word == "FILE" else word for word in words), code=2).split())
