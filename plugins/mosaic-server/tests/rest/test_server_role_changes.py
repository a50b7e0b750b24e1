"""A changed role reaches connections that are alive: robot and operator are told, now or when the robot comes back."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import pytest
from typer.testing import CliRunner

from mosaic_server.cli import app
from mosaic_server.roles import Role
from mosaic_server.settings import Settings
from mosaic_server.storage.grants import Actor, set_role
from mosaic_server.storage.members import MemberChange, change_member

OURS = {"catalogue": 1, "multiPeer": 1, "tickets": 1, "iceServers": 1, "closeReasons": 1}
TEST = Actor("test")


class Connected:
    """Ada's robot, and Bob of her organization connected to it."""

    def __init__(self, server: Any) -> None:
        self.server = server
        self.ada = server.account()
        self.bob = server.member(self.ada, "bob@example.org")
        self.robot_id, self.robot_token = server.robot(self.ada)
        self.admin, self.token = server.log_in(), server.log_in("bob@example.org")
        self.robot = server.connect_robot(self.robot_id, self.robot_token, OURS)
        self.user = server.connect_operator(self.token, OURS)
        self.connection_id = self.connect()

    def connect(self) -> str:
        answer = self.server.post("/api/v1/webrtc/connection", self.token, {"robotIds": [self.robot_id]})
        assert answer.status_code == 200, answer.text
        connection_id = answer.json()["resultData"]["sessions"][0]["rtcSessionId"]
        self.robot.expect("signaling.prepare_connection")
        self.user.send("signaling.send_sdp_offer", {"rtcConnectionId": connection_id, "sdpOffer": "o"})
        self.robot.expect("signaling.send_sdp_offer")
        return str(connection_id)

    def grants(self, role: str) -> None:
        path = f"/api/v1/robots/{self.robot_id}/grants/{self.bob.id}"
        assert self.server.put(path, self.admin, {"role": role}).status_code == 200

    def robot_is_told(self, connection_id: str) -> None:
        told = self.robot.expect("signaling.close_peer_connection")
        assert (told["rtcConnectionId"], told["code"]) == (connection_id, "auth.role_changed")


@pytest.fixture
def connected(server: Any) -> Connected:
    return Connected(server)


def test_robot_and_operator_are_told_to_close_and_the_next_connection_is_fine(connected: Connected) -> None:
    connected.grants("observer")
    connected.robot_is_told(connected.connection_id)
    told = connected.user.expect("signaling.close_peer_connection")
    assert (told["rtcConnectionId"], told["code"]) == (connected.connection_id, "auth.role_changed")
    connected.connect()
    connected.robot.expect_silence(1.0)


def test_what_the_role_stays_is_not_closed(connected: Connected) -> None:
    connected.grants("operator")
    connected.server.put("/api/v1/organization", connected.admin, {"defaultRole": "observer"})
    connected.robot.expect_silence(1.0)


def test_connections_of_others_stay(connected: Connected) -> None:
    connected.server.connect_operator(connected.admin, OURS)
    body = {"robotIds": [connected.robot_id]}
    assert connected.server.post("/api/v1/webrtc/connection", connected.admin, body).status_code == 200
    connected.robot.expect("signaling.prepare_connection")
    connected.grants("observer")
    connected.robot_is_told(connected.connection_id)
    connected.robot.expect_silence(1.0)


@pytest.mark.parametrize("words", [("grant", "observer"), ("disable",), ("program",), ("remove",), ("default",)])
def test_a_change_on_the_command_line_reaches_the_running_server(connected: Connected, words: tuple[str, ...]) -> None:
    commands = {
        "grant": ["robot", "grant", "rover", "bob@example.org", "observer"],
        "disable": ["user", "disable", "bob@example.org"],
        "program": ["user", "program", "bob@example.org"],
        "remove": ["user", "remove", "bob@example.org"],
        "default": ["organization", "--default-role", "observer"],
    }
    command = [*commands[words[0]], "--data-dir", str(connected.server.settings.data_dir)]
    result = CliRunner().invoke(app, command)
    assert result.exit_code == 0, result.output
    connected.robot_is_told(connected.connection_id)


def test_a_robot_that_was_away_is_told_as_soon_as_it_comes_back(
    settings: Settings, start_server: Callable[..., Any]
) -> None:
    with start_server(replace(settings, revocation_check_s=60.0)) as server:
        connected = Connected(server)
        connected.robot.connection.close()
        connected.grants("observer")
        connected.user.expect("signaling.close_peer_connection")
        connected.robot = server.connect_robot(connected.robot_id, connected.robot_token, OURS)
        connected.robot_is_told(connected.connection_id)


def test_a_connection_made_before_a_restart_is_closed_after_it(
    settings: Settings, start_server: Callable[..., Any]
) -> None:
    """Peers outlive the server, and the command line works while it is stopped."""
    with start_server(settings) as server:
        before = Connected(server)
    with start_server(settings) as server:
        robot = server.connect_robot(before.robot_id, before.robot_token, OURS)
        robot.expect_silence(1.0)
        server.work(set_role, before.robot_id, before.bob.id, Role.OBSERVER, TEST)
        assert robot.expect("signaling.close_peer_connection")["rtcConnectionId"] == before.connection_id
    with start_server(settings) as server:
        robot = server.connect_robot(before.robot_id, before.robot_token, OURS)
        told = robot.expect("signaling.close_peer_connection")
        assert told["rtcConnectionId"] == before.connection_id, "until it certainly has heard it"


def test_the_operator_can_not_hide_a_connection_by_closing_it_while_the_robot_is_away(connected: Connected) -> None:
    connected.robot.connection.close()
    connected.user.send("signaling.close_peer_connection", {"rtcConnectionId": connected.connection_id})
    connected.user.expect("signaling.close_peer_connection")
    connected.grants("observer")
    connected.robot = connected.server.connect_robot(connected.robot_id, connected.robot_token, OURS)
    connected.robot_is_told(connected.connection_id)


def test_an_original_robot_gets_the_original_message(server: Any) -> None:
    ada = server.account()
    bob = server.member(ada, "bob@example.org")
    robot_id, robot_token = server.robot(ada)
    robot = server.connect_robot(robot_id, robot_token)
    robot.status(0)
    token = server.log_in("bob@example.org")
    user = server.connect_operator(token)
    user.send("status.subscribe", {"robotIds": [robot_id]})
    while user.expect("status.update")["status"] != 0:
        pass
    made = server.post("/api/v1/webrtc/connection", token, {"robotIds": [robot_id]}).json()["resultData"]
    connection_id = made["sessions"][0]["rtcSessionId"]
    robot.expect("signaling.prepare_connection")
    server.work(change_member, bob.id, MemberChange(is_active=False), TEST)
    assert robot.expect("signaling.close_peer_connection") == {"rtcConnectionId": connection_id}
    assert user.close_code() == 4401
