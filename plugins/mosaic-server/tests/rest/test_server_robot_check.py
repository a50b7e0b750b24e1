"""A robot's token is checked without connecting it: nothing is registered, nobody is put off."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import pytest

from mosaic_server.security.login_limits import PER_ADDRESS
from mosaic_server.settings import Settings
from mosaic_server.storage.robots import RobotAuthType

PATH = "/api/v1/robots/auth/check"


@pytest.fixture
def settings(settings: Settings) -> Settings:
    """The guessers speak through a proxy, for addresses of their own."""
    return replace(settings, trusted_proxies=("127.0.0.1",))


def test_the_right_token_is_taken_and_a_connected_robot_stays(server: Any) -> None:
    robot_id, token = server.robot(server.account())
    body = {"robotId": robot_id.upper(), "token": token}
    told = server.http.post(PATH, json=body).json()["resultData"]
    assert told == {"robotId": robot_id, "name": "rover", "isOnline": False, "iceServers": []}
    robot = server.connect_robot(robot_id, token, {"catalogue": 1})
    assert server.http.post(PATH, json=body).json()["resultData"]["isOnline"] is True
    robot.status(1)
    robot.expect_silence()


def test_a_wrong_token_is_told_from_an_unknown_robot(server: Any) -> None:
    robot_id, _ = server.robot(server.account())
    wrong = server.http.post(PATH, json={"robotId": robot_id, "token": "mrt_wrong"})
    missing = server.http.post(PATH, json={"robotId": robot_id})
    unknown = server.http.post(PATH, json={"robotId": "00000000-0000-4000-8000-000000000000", "token": "x"})
    no_id = server.http.post(PATH, json={"robotId": "rover", "token": "x"})
    assert [(one.status_code, one.json()["code"]) for one in (wrong, missing, unknown, no_id)] == [
        (401, "auth.failed"), (401, "auth.failed"), (404, "auth.unknown_robot"), (404, "auth.unknown_robot"),
    ]  # fmt: skip


def test_a_robot_that_needs_no_token_needs_none_here(server: Any) -> None:
    robot_id, _ = server.robot(server.account(), auth=RobotAuthType.NO_AUTHORIZATION)
    assert server.http.post(PATH, json={"robotId": robot_id}).status_code == 200


def test_guessing_of_tokens_is_slowed_down(server: Any) -> None:
    robot_id, token = server.robot(server.account())
    headers = {"X-Forwarded-For": "192.0.2.1"}
    answers = [
        server.http.post(PATH, json={"robotId": robot_id, "token": f"mrt_{guess}"}, headers=headers).status_code
        for guess in range(PER_ADDRESS.failures + 1)
    ]
    assert answers == [401] * PER_ADDRESS.failures + [429]
    right = {"robotId": robot_id, "token": token}
    assert server.http.post(PATH, json=right, headers=headers).status_code == 429
    assert server.http.post(PATH, json=right, headers={"X-Forwarded-For": "192.0.2.2"}).status_code == 200
