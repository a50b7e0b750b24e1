"""The headless operator against a server and a robot in memory."""

from __future__ import annotations

import asyncio
import json
from typing import Any

import pytest

from mosaic_core.operator import (
    ConnectionCheckingStore,
    MediaStreamStore,
    MosaicOperator,
    ReceivableStore,
    RobotConnector,
    SendableStore,
    Shown,
    UnknownLabel,
)
from mosaic_core.operator.signaling.rest_api import log_in
from mosaic_core.testing import until
from mosaic_core.words import control, signaling
from mosaic_core.words.control import MOST_SHOWN_PX
from mosaic_core.words.data_type import MosaicDataType
from mosaic_core.words.errors import AuthError, ConnectionFailed, SignalingError
from mosaic_core.words.signaling import RobotStatus

WAIT_S = 30.0


def subscriptions(world: Any) -> int:
    return sum(isinstance(m, signaling.StatusSubscribe) for m in world.server.received)


def watched(world: Any) -> list[tuple[str, bool]]:
    return [(m.label, m.on) for m in world.robot.control if isinstance(m, control.MediaWatch)]


async def test_connecting_learns_the_catalogue_and_opens_stores_on_demand(world: Any) -> None:
    async with world.operator() as operator:
        connection = await operator.connect(world.robot_id, timeout_s=WAIT_S)
        assert connection.catalogue is not None
        assert {e.label: e for e in connection.catalogue.entries}["chat"].message_schema == {"type": "object"}
        assert not connection.is_original
        assert set(world.robot.channels) == {"_mosaic", "_stop"}
        battery = connection.receivable("battery")
        got: list[Any] = []
        battery.subscribe(lambda data: got.append(json.loads(data)))
        battery.subscribe(lambda data, info: got.append(info.seq))
        await battery.wait_open(WAIT_S)
        world.robot.channels["battery"].deliver(b'{"percent": 80}', seq=7, stamp_us=1)
        assert got == [{"percent": 80}, 7]
        assert battery.latest is not None
        assert battery.latest.json() == {"percent": 80}


async def test_a_robot_that_is_no_id_is_refused_and_the_next_one_is_connected_to(world: Any) -> None:
    async with world.operator() as operator:
        robot, *_ = await operator.robots()
        with pytest.raises(TypeError, match=r"such as robot\.id, not by RobotSummary"):
            await operator.connect(robot)
        assert (await operator.connect(world.robot_id, timeout_s=WAIT_S)).catalogue is not None


async def test_the_offer_has_a_line_per_camera_and_says_which_is_which(world: Any) -> None:
    async with world.operator() as operator:
        connection = await operator.connect(world.robot_id, timeout_s=WAIT_S)
        offer = next(m for m in world.server.received if isinstance(m, signaling.SdpOffer))
        assert offer.tracks == {"0": "front"}
        assert watched(world) == []
        front = connection.media("front")
        assert isinstance(front, MediaStreamStore)
        assert watched(world) == [("front", True)]
        waiting: asyncio.Task[Any] = asyncio.create_task(front.next_frame(WAIT_S))
        await asyncio.sleep(0)
        world.robot.videos["front"].queue.put_nowait("a frame")
        assert await waiting == "a frame"
        operator.stores.release_store(front.robot_connector)
        await until(lambda: watched(world)[-1] == ("front", False))


async def test_the_robot_is_told_how_large_a_picture_is_shown(world: Any) -> None:
    async with world.operator() as operator:
        connection = await operator.connect(world.robot_id, timeout_s=WAIT_S)
        front = connection.media("front")
        for shown in (Shown(640 * 480, leads=True), Shown(640 * 480, leads=True), Shown(0)):
            front.set_shown(shown)
        told = [(m.shown_px, m.leads) for m in world.robot.control if isinstance(m, control.MediaWatch)]
        assert told == [(None, None), (640 * 480, True), (0, False)], "what is the same is told once"
        operator.stores.release_store(front.robot_connector)
        await until(lambda: watched(world)[-1] == ("front", False))
        count = len(watched(world))
        front.set_shown(Shown(100))
        assert len(watched(world)) == count, "nobody watches it any more"


@pytest.mark.parametrize("size_px", [-1, MOST_SHOWN_PX + 1])
def test_a_size_that_no_screen_has_is_refused(size_px: int) -> None:
    with pytest.raises(ValueError, match=f"not {size_px}"):
        Shown(size_px)


async def test_commands_travel_unordered_and_newest_wins_while_the_link_is_full(world: Any) -> None:
    async with world.operator() as operator:
        connection = await operator.connect(world.robot_id, timeout_s=WAIT_S)
        commands = connection.sendable("cmd_vel")
        assert not commands.send_json({"early": 1})
        await commands.wait_open(WAIT_S)
        channel = world.robot.channels["cmd_vel"]
        assert (channel.ordered, channel.max_retransmits, channel.protocol) == (False, 0, "mosaic.1")
        assert commands.send_json({"v": 1})
        channel.buffered_bytes = 100_000
        assert commands.send_json({"v": 2})
        assert commands.send_json({"v": 3})
        channel.buffered_bytes = 0
        channel.on_drained()
        assert [(json.loads(f.payload), f.seq) for f in channel.frames()] == [({"v": 1}, 1), ({"v": 3}, 3)]
        with pytest.raises(ValueError, match="JSON"):
            commands.send_json({"v": float("nan")})


async def test_reliable_data_is_not_accepted_while_the_link_is_full(world: Any) -> None:
    async with world.operator() as operator:
        connection = await operator.connect(world.robot_id, timeout_s=WAIT_S)
        chat = connection.bidirectional("chat")
        await chat.wait_open(WAIT_S)
        world.robot.channels["chat"].buffered_bytes = 100_000
        assert not chat.send_json({"text": "hello"})


async def test_a_label_that_the_robot_does_not_have_names_the_nearest(world: Any) -> None:
    async with world.operator() as operator:
        connection = await operator.connect(world.robot_id, timeout_s=WAIT_S)
        with pytest.raises(UnknownLabel, match="did you mean 'battery'") as unknown:
            connection.receivable("batery")
        assert (unknown.value.code, unknown.value.nearest) == ("channel.unknown_label", "battery")
        with pytest.raises(ConnectionFailed, match="SendableStore"):
            connection.receivable("cmd_vel")


async def test_a_label_nobody_has_of_a_robot_that_is_offline_is_told_as_offline(world: Any) -> None:
    async with world.operator() as operator:
        world.server.robot_status = RobotStatus.DISCONNECTED
        with pytest.raises(SignalingError) as offline:
            await operator.connect(world.robot_id, connectors=[RobotConnector(world.robot_id, "batery")])
        assert offline.value.code == "signal.robot_offline"
        world.server.robot_status = RobotStatus.READY_TO_CONNECT
        with pytest.raises(UnknownLabel):
            await operator.connect(world.robot_id, connectors=[RobotConnector(world.robot_id, "batery")])


async def test_what_is_no_size_is_refused_with_what_a_size_is(world: Any) -> None:
    for wrong in ("big", 1.5, None, True):
        with pytest.raises(TypeError, match="size_px is a whole number"):
            Shown(wrong)  # type: ignore[arg-type]
    async with world.operator() as operator:
        connection = await operator.connect(world.robot_id, timeout_s=WAIT_S)
        for wrong in (640, None):
            with pytest.raises(TypeError, match="Shown"):
                connection.media("front").set_shown(wrong)  # type: ignore[arg-type]


async def test_a_store_from_before_the_connection_learns_of_a_mismatch(world: Any) -> None:
    async with world.operator() as operator:
        connector = RobotConnector(world.robot_id, "fronte", MosaicDataType.JSON_R2U)
        store = operator.stores.get_or_create_store(connector)
        moments: list[str] = []
        store.when("after_connection_failed", lambda: moments.append(store.state.code))
        await operator.connect(world.robot_id, timeout_s=WAIT_S)
        assert moments == ["channel.unknown_label"]
        assert (store.state.phase, store.state.nearest) == ("mismatch", "front")
        with pytest.raises(ConnectionFailed, match="fronte"):
            await store.wait_open(WAIT_S)


async def test_stores_survive_a_reconnection_and_tell_each_moment(world: Any) -> None:
    async with world.operator() as operator:
        connection = await operator.connect(world.robot_id, timeout_s=WAIT_S)
        battery = connection.receivable("battery")
        moments: list[str] = []
        for moment in ("before_connected", "after_connected", "after_disconnected"):
            battery.when(moment, lambda moment=moment: moments.append(moment))
        await battery.wait_open(WAIT_S)
        await connection.close()
        assert battery.state.phase == "closed"
        again = await operator.connect(world.robot_id, timeout_s=WAIT_S)
        assert again.receivable("battery") is battery
        await battery.wait_open(WAIT_S)
        assert moments == ["after_connected", "after_disconnected", "before_connected", "after_connected"]
        body = json.loads([r for r in world.server.requests if r.url.path.endswith("/connection")][-1].content)
        assert body == {"robotIds": [world.robot_id], "sessionId": "session-1"}


async def test_a_released_store_lingers_and_comes_back(world: Any) -> None:
    async with world.operator() as operator:
        connection = await operator.connect(world.robot_id, timeout_s=WAIT_S)
        store = connection.receivable("battery")
        await store.wait_open(WAIT_S)
        operator.stores.release_store(store.robot_connector)
        assert connection.receivable("battery") is store
        operator.stores.release_store(store.robot_connector)
        await until(lambda: not world.robot.channels["battery"].is_open)
        assert store.state.phase == "closed"
        assert connection.receivable("battery") is not store


async def test_refusals_reach_the_program(world: Any) -> None:
    async with world.operator() as operator:
        connection = await operator.connect(world.robot_id, timeout_s=WAIT_S)
        refusals: list[control.Refusal] = []
        end = connection.on_refusal(refusals.append)
        world.robot.say(control.Refusal(label="cmd_vel", seq=3, code="safety.stale"))
        end()
        world.robot.say(control.Refusal(label="cmd_vel", seq=4, code="safety.stale"))
        assert [(r.label, r.seq, r.code) for r in refusals] == [("cmd_vel", 3, "safety.stale")]


async def test_a_camera_that_fails_is_told_to_its_store(world: Any) -> None:
    async with world.operator() as operator:
        connection = await operator.connect(world.robot_id, timeout_s=WAIT_S)
        front = connection.media("front")
        world.robot.say(control.MediaUnavailable(label="front", code="media.no_line"))
        assert front.state.code == "media.no_line"


async def test_the_connection_check_measures_the_round_trip(world: Any) -> None:
    async with world.operator() as operator:
        connection = await operator.connect(world.robot_id, timeout_s=WAIT_S)
        store = operator.stores.get_or_create_store(RobotConnector(world.robot_id, "link"))
        assert isinstance(store, ConnectionCheckingStore)
        await store.wait_open(WAIT_S)
        out, back = world.robot.channels["link-receiver"], world.robot.channels["link-sender"]
        await until(out.frames)
        assert set(json.loads(out.frames()[0].payload)) == {"messageCreated"}
        back.deliver(out.frames()[0].payload)
        assert store.round_trip_ms is not None
        assert store.round_trip_ms < 1000
        assert connection.state == "connected"


async def test_pings_tell_the_round_trip_and_the_clock_offset(world: Any) -> None:
    async with world.operator() as operator:
        connection = await operator.connect(world.robot_id, timeout_s=WAIT_S)
        assert connection.round_trip_ms is not None
        assert connection.clock_offset_us is not None
        assert connection.round_trip_us_best is not None


async def test_a_robot_that_falls_silent_is_lost_within_two_and_a_half_seconds(world: Any) -> None:
    async with world.operator() as operator:
        connection = await operator.connect(world.robot_id, timeout_s=WAIT_S)
        battery = connection.receivable("battery")
        await battery.wait_open(WAIT_S)
        world.robot.answers_pings = False
        async with asyncio.timeout(3.0):
            error = await connection.wait_closed()
        assert error.code == "peer.lost"
        assert battery.state.phase == "closed"
        assert world.robot.is_closed


async def test_an_original_robot_behind_an_original_server_gets_bare_payloads(world: Any) -> None:
    world.server.extensions = None
    world.robot.is_ours = False
    pose = RobotConnector(world.robot_id, "pose", MosaicDataType.JSON_R2U)
    camera = RobotConnector(world.robot_id, "camera", MosaicDataType.MEDIA)
    twist = RobotConnector(world.robot_id, "twist", MosaicDataType.JSON_U2R)

    async with world.operator() as operator:
        connection = await operator.connect(world.robot_id, connectors=[pose, camera, twist], timeout_s=WAIT_S)
        assert connection.is_original
        offer = next(m for m in world.server.raw if m["type"] == "signaling.send_sdp_offer")
        assert set(offer["data"]) == {"rtcConnectionId", "sdpOffer"}
        posting = next(r for r in world.server.requests if r.url.path.endswith("/connection"))
        assert json.loads(posting.content) == {"robotIds": [world.robot_id]}
        store = operator.stores.get_or_create_store(pose)
        sender = operator.stores.get_or_create_store(twist)
        assert isinstance(store, ReceivableStore)
        assert isinstance(sender, SendableStore)
        await store.wait_open(WAIT_S)
        await sender.wait_open(WAIT_S)
        assert world.robot.channels["pose"].protocol == ""
        waiting = asyncio.create_task(store.next_message(WAIT_S))
        await asyncio.sleep(0)
        world.robot.channels["pose"].on_message('{"x": 1}')
        assert (await waiting).json() == {"x": 1}
        assert sender.send_json({"linear": {"x": 0.5}})
        assert world.robot.channels["twist"].from_operator == ['{"linear":{"x":0.5}}']
        with pytest.raises(ConnectionFailed, match="data type"):
            connection._store("nothing_known", None, ReceivableStore)
    closing = world.server.raw[-1]
    assert closing == {"type": "signaling.close_peer_connection", "data": {"rtcConnectionId": world.peer_id}}


async def test_a_refused_ticket_is_the_reason_of_the_failure(world: Any) -> None:
    world.server.answers = False

    async with world.operator() as operator:
        connecting = asyncio.create_task(operator.connect(world.robot_id, timeout_s=WAIT_S))
        await until(lambda: any(isinstance(m, signaling.SdpOffer) for m in world.server.received))
        world.server.push(
            signaling.ClosePeerConnection(rtc_connection_id=world.peer_id, code="auth.bad_ticket", message="No.")
        )
        with pytest.raises(ConnectionFailed, match=r"No\.") as failed:
            await connecting
        assert failed.value.code == "auth.bad_ticket"


async def test_a_robot_that_never_answers_times_out_with_a_code(world: Any) -> None:
    world.server.answers = False

    async with world.operator() as operator:
        with pytest.raises(ConnectionFailed) as failed:
            await operator.connect(world.robot_id, timeout_s=0.5)
        assert failed.value.code == "signal.no_answer"
        assert world.robot.is_closed


async def test_a_server_that_is_away_is_the_reason_too(world: Any) -> None:
    world.server.is_down = True

    async with world.operator() as operator:
        with pytest.raises(SignalingError, match="down") as failed:
            await operator.connect(world.robot_id, timeout_s=0.5)
        assert failed.value.code == "signal.unreachable"


async def test_status_and_catalogue_follow_the_server_across_its_restart(world: Any) -> None:
    async with world.operator() as operator:
        connection = await operator.connect(world.robot_id, timeout_s=WAIT_S)
        world.server.push(signaling.StatusUpdate(robot_id=world.robot_id, status=RobotStatus.READY_TO_CONNECT))
        await operator.wait_status(world.robot_id, RobotStatus.READY_TO_CONNECT, WAIT_S)
        world.server.sockets[-1].drop(1012)
        before = subscriptions(world)
        await until(lambda: subscriptions(world) > before)
        assert len(world.server.sockets) == 2
        world.server.push(signaling.StatusUpdate(robot_id=world.robot_id, status=RobotStatus.DISCONNECTED))
        await operator.wait_status(world.robot_id, RobotStatus.DISCONNECTED, WAIT_S)
        assert connection.state == "connected"  # a server restart leaves live peers alone


async def test_robots_are_listed_page_by_page(world: Any) -> None:
    async with world.operator() as operator:
        robots = await operator.robots()
        assert len(robots) == 130
        assert robots[0].is_online
        world.server.robot_status = RobotStatus.DISCONNECTED
        assert not (await operator.robots())[0].is_online


@pytest.mark.parametrize(
    ("status", "content", "kind", "code"),
    [
        (401, {"resultCode": "AUTHENTICATION_FAILED", "resultData": None}, AuthError, "auth.failed"),
        (400, {"resultCode": "ROBOT_NOT_READY_TO_CONNECT"}, SignalingError, "signal.robot_busy"),
        (400, {"resultCode": 10051}, SignalingError, "signal.robot_offline"),
        (403, {"resultCode": "X", "code": "auth.forbidden", "message": "Not you."}, AuthError, "auth.forbidden"),
        (500, {}, SignalingError, "signal.bad_message"),
        (200, {"resultCode": 20007, "resultData": None}, SignalingError, "signal.robot_busy"),
    ],
)
async def test_a_refusal_of_the_server_has_a_code(
    world: Any, status: int, content: dict[str, Any], kind: type[Exception], code: str
) -> None:
    world.server.refusal = (status, content)

    async with world.operator() as operator:
        with pytest.raises(kind) as refused:
            await operator.robots()
        assert getattr(refused.value, "code", "") == code


async def test_wrong_credentials_are_an_auth_error(world: Any) -> None:
    world.server.refusal = (400, {"resultCode": "INVALID_PASSWORD"})

    with pytest.raises(AuthError):
        await log_in("http://127.0.0.1", "/api/v1/account/login/access-token", {}, world.server.http())
    world.server.refusal = None
    assert await log_in("http://127.0.0.1", "/login/one-time", {"code": "x"}, world.server.http()) == "jwt"


async def test_a_server_that_is_not_there_is_said_so() -> None:
    with pytest.raises(SignalingError, match="can't be reached"):
        await MosaicOperator.login("http://127.0.0.1:1", "a@b", "c")


async def test_one_failing_subscriber_takes_nothing_from_the_others(world: Any) -> None:
    async with world.operator() as operator:
        connection = await operator.connect(world.robot_id, timeout_s=WAIT_S)
        battery = connection.receivable("battery")
        await battery.wait_open(WAIT_S)
        got: asyncio.Queue[bytes] = asyncio.Queue()

        async def slow(data: bytes) -> None:
            await asyncio.sleep(0)
            got.put_nowait(data)

        battery.subscribe(lambda data: 1 / 0)
        battery.subscribe(slow)
        stream = battery.messages()
        first = asyncio.ensure_future(anext(stream))
        await asyncio.sleep(0)
        world.robot.channels["battery"].deliver(b"1")
        assert await got.get() == b"1"
        assert (await first).data == b"1"
        await stream.aclose()


async def test_a_server_that_takes_nothing_is_left_before_the_queue_fills_the_memory(world: Any) -> None:
    async with world.operator() as operator:
        await operator.connect(world.robot_id, timeout_s=WAIT_S)
        (socket,) = world.server.sockets
        stuck = asyncio.Event()

        async def send(text: str) -> None:
            await stuck.wait()

        socket.send = send
        message = signaling.ClosePeerConnection(rtc_connection_id=world.peer_id)

        def flood() -> None:
            for _ in range(100_000):
                operator._signaling.send(message)

        with pytest.raises(SignalingError) as refused:
            flood()
        assert refused.value.code == "signal.too_slow"
        await until(lambda: len(world.server.sockets) == 2)
