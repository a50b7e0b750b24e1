"""Input that nobody sends by accident: it is refused in words and hurts nobody else."""

from __future__ import annotations

import json
from typing import Any

import pytest


def _announcing(safety_json: str) -> str:
    entry = {"label": "a", "type": "t", "dataType": "json-r2u", "direction": "to-operator", "safety": {"a": "HERE"}}
    message = {"type": "catalogue.announce", "data": {"catalogue": {"hash": "x", "entries": [entry]}}}
    return json.dumps(message).replace('"HERE"', safety_json)


@pytest.mark.parametrize("safety_json", ['"\\ud800"', "[" * 300 + "]" * 300], ids=["half a pair", "too deep"])
def test_a_catalogue_that_cannot_be_sent_on_is_refused_and_operators_never_meet_it(
    server: Any, safety_json: str
) -> None:
    person = server.account()
    access_token = server.log_in()
    robot_id, token = server.robot(person)
    robot = server.connect_robot(robot_id, token, {"catalogue": 1})
    robot.connection.send(_announcing(safety_json))
    assert robot.expect("catalogue.announce.res") == 10000
    operator = server.connect_operator(access_token, {"catalogue": 1})
    operator.send("status.subscribe", {"robotIds": [robot_id]})
    assert operator.expect("status.update")["status"] == 6
    operator.expect_silence()
    assert server.get(f"/api/v1/robots/{robot_id}/catalogue", access_token).json()["resultData"] is None


@pytest.mark.parametrize("path", ["/ws/robot", "/ws/user"])
def test_half_a_surrogate_pair_is_no_message_whatever_it_stands_for(server: Any, path: str) -> None:
    suffix = ".res" if path == "/ws/robot" else ""
    party = server.open(path)
    party.expect("authorize.req")
    party.connection.send('{"type":"\\ud800"}')
    assert party.expect(f"unknown{suffix}") == 10001
    party.connection.send('{"type":"authorize","data":{"robotId":"x","data":"\\ud800","accessToken":"\\ud800"}}')
    assert party.expect(f"authorize{suffix}") == 10000
