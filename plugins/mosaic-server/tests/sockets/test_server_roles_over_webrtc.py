"""A robot in a process of its own and an operator over real WebRTC: what was granted is what the robot goes by."""

from __future__ import annotations

import asyncio
import signal
import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from mosaic_core.operator import MosaicOperator
from mosaic_server.roles import Role
from mosaic_server.settings import Settings
from mosaic_server.sockets.keep_alive import KeepAlivePeriods
from mosaic_server.storage.grants import Actor, set_role

pytestmark = [pytest.mark.webrtc, pytest.mark.timeout(120)]
PASSWORD = "correct horse battery"  # noqa: S105 - of throw-away accounts


@contextmanager
def running_robot(folder: Path, url: str, robot_id: str, token: str) -> Iterator[None]:
    config = folder / "mosaic_config.yaml"
    auth = f"{{ type: simple-token, robot_id: {robot_id}, params: {{ token: {token} }} }}"
    connectors = "connectors:\n  - { type: connection-check, label: link }\n"
    config.write_text(f"server:\n  ws_url: {url}\n  auth: {auth}\n{connectors}", encoding="utf-8")
    with (folder / "robot.log").open("w") as log:
        robot = subprocess.Popen(
            [sys.executable, "-m", "mosaic_core.cli.main", "run", str(config)], stdout=log, stderr=log
        )
    try:
        yield
    finally:
        robot.send_signal(signal.SIGTERM)
        robot.wait(20)


def until_it_is_ready(server: Any, access_token: str, robot_id: str) -> None:
    party = server.connect_operator(access_token)
    party.send("status.subscribe", {"robotIds": [robot_id]})
    while party.expect("status.update", timeout_s=40)["status"] != 0:
        pass


async def role_at_the_robot(connection: Any) -> str:
    await connection.control.wait_for(lambda: connection.control.peers)
    return str(connection.control.peers[0].role)


def test_the_robot_goes_by_the_granted_role_and_lets_nobody_keep_an_older_one(
    settings: Settings, start_server: Callable[..., Any], tmp_path: Path
) -> None:
    calm = replace(settings, keep_alive=KeepAlivePeriods(), authorize_within_s=10.0)
    with start_server(calm) as server:
        ada = server.account()
        bob = server.member(ada, "bob@example.org")
        robot_id, token = server.robot(ada)
        url = f"http://127.0.0.1:{server.listening.port}"

        async def body() -> None:
            async with await MosaicOperator.login(url, "bob@example.org", PASSWORD) as operator:
                # A busy machine may keep either side silent for two seconds: that loss is no end.
                first = await operator.connect(robot_id, timeout_s=20, reconnect=True)
                assert await role_at_the_robot(first) == "operator"
                await asyncio.to_thread(server.work, set_role, robot_id, bob.id, Role.OBSERVER, Actor("test"))
                async with asyncio.timeout(15):
                    assert (await first.wait_closed()).code == "auth.role_changed"
                again = await operator.connect(robot_id, timeout_s=20)
                assert await role_at_the_robot(again) == "observer"

        with running_robot(tmp_path, server.ws_url, robot_id, token):
            until_it_is_ready(server, server.log_in(), robot_id)
            asyncio.run(body())
