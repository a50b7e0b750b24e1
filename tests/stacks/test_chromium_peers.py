"""Original robots and pages in a real Chromium without a line of ours (`independent/peers.js`) against ours."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from typing import Any

import numpy as np
import pytest

from mosaic_core.operator import (
    ConnectionCheckingStore,
    MediaStreamStore,
    MosaicOperator,
    ReceivableStore,
    RobotConnector,
    SendableStore,
)
from mosaic_core.words.data_type import MosaicDataType

pytestmark = [pytest.mark.e2e, pytest.mark.timeout(90)]
FORWARD = json.dumps({"linear": {"x": 0.3, "y": 0, "z": 0}, "angular": {"x": 0, "y": 0, "z": 0.1}})
PAGE, PLAIN = "original page in Chromium", ["pose", "cmd_vel", "link-sender", "link-receiver"]


@pytest.fixture(scope="module")
def host(browser: Any, server: Any, seed: Any, chromium_host: Any) -> Iterator[Any]:
    """One raw page for all tests of a module; each makes its own peers in it."""
    context = browser.new_context(permissions=["local-network-access"])
    yield chromium_host(context.new_page(), server.url)
    context.close()


@pytest.fixture
def tab(host: Any, server: Any, seed: Any) -> Iterator[Any]:
    page = host.make("Page", server.url)
    page("logIn", seed.email, seed.password)
    yield page
    page("close")


@contextmanager
def running(host: Any, url: str, identity: tuple[str, str], options: dict[str, Any]) -> Iterator[Any]:
    robot = host.make("Robot", url)
    robot.id = identity[0]
    robot("start", *identity, options)
    yield robot
    robot("close")


@pytest.fixture
def robot(host: Any, server: Any, new_robot: Any, request: pytest.FixtureRequest) -> Iterator[Callable[..., Any]]:
    """`robot(cameras=["front"], rsa=True)`: an original robot in the browser."""
    with ExitStack() as stack:
        yield lambda **options: stack.enter_context(
            running(host, server.url, new_robot(f"Chromium of {request.node.name}"), options)
        )


def test_an_original_page_in_chromium_sees_and_drives_our_robot(
    pair: Any, tab: Any, seed: Any, our_robot: Any, wait_for: Any
) -> None:
    pair("our robot", PAGE, "data, commands, connection check, a camera, hanging up")
    tab("waitReady", seed.robot_id)
    call = tab("call", seed.robot_id, PLAIN, {"videos": 1})
    assert tab("streams", call) == ["front"]
    assert tab("motion", call) > 0
    assert tab("check", call) < 500
    before = json.loads(tab("received", call, "pose")[-1])["position"]

    def moved() -> bool:
        tab("send", call, "cmd_vel", FORWARD)
        now = json.loads(tab("received", call, "pose")[-1])["position"]
        return bool(abs(now["x"] - before["x"]) + abs(now["y"] - before["y"]) > 0.05)

    wait_for(moved, "the base moves")
    tab("hangUp", call)
    tab("waitReady", seed.robot_id)


def test_an_original_page_with_an_rsa_certificate_connects_to_our_robot(
    pair: Any, tab: Any, seed: Any, our_robot: Any, wait_for: Any
) -> None:
    pair("our robot", f"{PAGE}, RSA certificate", "data and a camera")
    tab("waitReady", seed.robot_id)
    call = tab("call", seed.robot_id, ["pose"], {"videos": 1, "rsa": True})
    wait_for(lambda: tab("received", call, "pose"), "a pose")
    assert tab("motion", call) > 0


def test_an_original_page_that_knows_vp9_alone_is_told_and_gets_the_data(
    pair: Any, tab: Any, seed: Any, our_robot: Any, wait_for: Any
) -> None:
    pair("our robot", f"{PAGE}, VP9 alone", "data; the picture is refused in the answer")
    tab("waitReady", seed.robot_id)
    call = tab("call", seed.robot_id, ["pose"], {"videos": 1, "codec": "video/VP9"})
    wait_for(lambda: tab("received", call, "pose"), "a pose")
    assert "m=video 0 " in tab("answer", call)


def test_an_original_robot_in_chromium_and_an_original_page_meet_on_our_server(
    pair: Any, tab: Any, robot: Any, wait_for: Any
) -> None:
    pair("our server", "original robot and page in Chromium", "a whole session, simple token")
    there = robot(cameras=["front"])
    tab("waitReady", there.id)
    call = tab("call", there.id, PLAIN, {"videos": 1})
    assert tab("streams", call) == ["front"]
    assert tab("motion", call) > 0
    tab("check", call)
    tab("send", call, "cmd_vel", FORWARD)
    wait_for(lambda: there("look")["twists"] == [[0.3, 0.1]], "the twist")
    tab("hangUp", call)
    wait_for(lambda: there("look")["statuses"] == [0, 1, 2, 3, 0], "the robot is free")


@pytest.mark.parametrize("rsa", [False, True], ids=["ecdsa", "rsa"])
def test_our_python_operator_works_with_an_original_robot_in_chromium(
    pair: Any, server: Any, seed: Any, robot: Any, in_thread: Any, wait_for: Any, rsa: bool
) -> None:
    theirs = f"original robot in Chromium{', RSA certificate' if rsa else ''}"
    pair("our Python operator", theirs, "data, commands, connection check, a camera")
    there = robot(cameras=["front"], rsa=rsa)

    async def scene() -> None:
        async with await MosaicOperator.login(server.url, seed.email, seed.password) as operator:
            pose = RobotConnector(there.id, "pose", MosaicDataType.JSON_R2U)
            twist = RobotConnector(there.id, "cmd_vel", MosaicDataType.JSON_U2R)
            front = RobotConnector(there.id, "front", MosaicDataType.MEDIA)
            link = RobotConnector(there.id, "link", MosaicDataType.JSON_BI)
            check = operator.stores.get_or_create_store(link, ConnectionCheckingStore)
            connection = await operator.connect(there.id, connectors=[pose, twist, front], timeout_s=20)
            heard, said, seen = map(operator.stores.get_or_create_store, (pose, twist, front))
            assert isinstance(heard, ReceivableStore)
            assert isinstance(said, SendableStore)
            assert isinstance(seen, MediaStreamStore)
            assert json.loads((await heard.next_message(20)).data)["position"]["y"] == 1.5
            await said.wait_open(20)
            assert said.send_json(json.loads(FORWARD))
            first = (await seen.next_image(20)).astype(int)
            while not (np.abs((await seen.next_image(20)).astype(int) - first) > 60).any():
                pass
            while check.round_trip_ms is None:
                await heard.next_message(20)
            await connection.close()

    in_thread(scene())
    wait_for(lambda: there("look")["twists"] == [[0.3, 0.1]], "the twist")
    wait_for(lambda: there("look")["state"] == 0, "the robot is free")
