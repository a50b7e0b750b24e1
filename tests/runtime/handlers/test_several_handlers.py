"""A connector with several handlers: a robot announces, delivers, guards, shows and counts each of them for itself, and
an operator finds each by its own label."""

from __future__ import annotations

import json
from collections.abc import Iterator, Sequence
from typing import Any, ClassVar

import numpy as np
import pytest

from mosaic_core import (
    AudioReceivable,
    AudioTrackHandler,
    DataChannelBidirectional,
    DataChannelConfigurer,
    DataChannelReceivable,
    DataChannelSendable,
    Delivery,
    FieldBounds,
    Handler,
    MediaTrackConfigurer,
    MediaTrackHandler,
    Message,
    MosaicError,
    NoParams,
    Sender,
    Sound,
)
from mosaic_core.laboratory.networks import WebRtcNetwork
from mosaic_core.messages import BatteryState, JointState, JointTarget
from mosaic_core.runtime.observation.delivery_reports import row_of
from mosaic_core.runtime.observation.metrics_text import metrics_text
from mosaic_core.testing import Joined, connector, joined, until
from mosaic_core.words.data_type import Direction, Kind, MosaicDataType
from mosaic_core.words.errors import ConfigError


class Grip(Message):
    is_closed: bool


class Force(Message):
    schema_id: ClassVar[str] = "acme/Force@1"
    force_n: float


class Arm(DataChannelReceivable[JointTarget]):
    delivery = Delivery.LATEST
    timeout_s = 5.0
    requires_lease = True
    resource = "arm"
    limits = {"positions.*": FieldBounds(min=-1.0, max=1.0)}  # noqa: RUF012 - as an author writes it

    def __init__(self, label: str) -> None:
        super().__init__(label)
        self.sent: list[list[float]] = []

    def handle_data(self, data: JointTarget) -> None:
        self.sent.append(data.positions)

    def make_safe(self, cause: str) -> None:
        """It holds by itself."""


class Joints(DataChannelSendable[JointState]):
    widget = "time-plot"
    delivery = Delivery.LATEST

    def messages(self) -> Iterator[JointState]:
        for _ in self.every(0.02):
            yield JointState(names=["elbow"], positions=[0.5])


class Gripper(DataChannelBidirectional[Grip]):
    sends = Force

    def handle_data(self, data: Grip, sender: Sender) -> None:
        self.send_json(Force(force_n=3.5 if data.is_closed else 0.0), to=sender)


class Power(DataChannelBidirectional[Grip]):
    sends = BatteryState

    def handle_data(self, data: Grip, sender: Sender) -> None:
        self.send_json(BatteryState(percent=81.0), to=sender)


class ArmConfigurer(DataChannelConfigurer[NoParams]):
    connector_type = "acme-arm"

    def configure(self) -> Sequence[Handler]:
        label = self.label
        return [Arm(label), Joints(f"{label}_joints"), Gripper(f"{label}_grip"), Power(f"{label}_power")]


def arm(*, is_driven: bool = False, **more: Any) -> Any:
    return joined(connector(ArmConfigurer, label="arm", **more), takes_leases=is_driven)


def handler_of(link: Joined, kind: type[Any]) -> Any:
    (made,) = link.configured.connectors
    return next(handler for handler in made.handlers if isinstance(handler, kind))


async def test_each_handler_is_announced_with_what_it_says() -> None:
    async with arm() as link:
        catalogue = link.connection.catalogue
        assert catalogue is not None
        apart = {entry.label: entry for entry in catalogue.entries}
        assert list(apart) == ["arm", "arm_joints", "arm_grip", "arm_power"]
        assert {entry.type for entry in catalogue.entries} == {"acme-arm"}
        assert apart["arm"].direction is Direction.TO_ROBOT
        assert apart["arm"].schema_id == "mosaic/JointTarget@1"
        assert apart["arm"].safety == {
            "timeout_s": 5.0, "requires_lease": True, "resource": "arm",
            "limits": {"positions.*": {"min": -1.0, "max": 1.0}}, "slow_down": apart["arm"].safety["slow_down"],
        }  # fmt: skip
        joints, grip = apart["arm_joints"], apart["arm_grip"]
        assert (joints.delivery, joints.widget, joints.safety) == (Delivery.LATEST, "time-plot", None)
        assert (grip.delivery, grip.data_type) == (Delivery.RELIABLE, MosaicDataType.JSON_BI)
        assert grip.message_schema is not None
        assert grip.sent_schema is not None
        assert [*grip.message_schema["properties"]] == ["is_closed"]
        assert (grip.schema_id, grip.sent_schema_id, [*grip.sent_schema["properties"]]) == (
            None,
            "acme/Force@1",
            ["force_n"],
        )
        assert all(entry.message_schema is None for entry in catalogue.short().entries)


async def test_an_operator_finds_each_by_its_label_and_reads_it_typed() -> None:
    async with arm() as link:
        connection = link.connection
        joints, grip = connection.receivable("arm_joints"), connection.bidirectional("arm_grip")
        power = connection.bidirectional("arm_power")
        for store in (joints, grip, power):
            await store.wait_open()
        await until(lambda: joints.latest is not None)
        assert joints.latest is not None
        assert joints.latest.message() == JointState(names=["elbow"], positions=[0.5])
        assert power.send_json({"is_closed": True})
        await until(lambda: power.latest is not None)
        assert power.latest is not None
        assert power.latest.message() == BatteryState(percent=81.0)
        assert grip.send_json({"is_closed": True})
        await until(lambda: grip.latest is not None)
        assert grip.latest is not None
        assert json.loads(grip.latest.data) == {"force_n": 3.5}


async def test_each_has_its_own_guards() -> None:
    """The lease and limits of the arm bind neither the gripper nor anybody else."""
    async with arm(is_driven=True) as link:
        assert link.connection.control.leases.keys() >= {"arm"}
        store = link.connection.sendable("arm")
        await store.wait_open()
        assert store.send_json({"names": ["elbow"], "positions": [9.0]})
        made = handler_of(link, Arm)
        await until(lambda: made.sent)
        assert made.sent[0] == [1.0]
        safety = {label: route.safety for label, route in link.robot._live.runs.routes.items()}
        assert (safety["arm"].resource, safety["arm"].timeout_s) == ("arm", 5.0)
        assert (safety["arm_grip"].resource, safety["arm_grip"].timeout_s, safety["arm_grip"].limits) == (
            None,
            None,
            (),
        )


async def test_each_counts_for_itself_in_the_table_the_report_and_the_metrics() -> None:
    async with arm() as link:
        grip = link.connection.bidirectional("arm_grip")
        await grip.wait_open()
        for _ in range(3):
            assert grip.send_json({"is_closed": False})
        assert grip.send_json({"is_closed": "perhaps"})
        rows = lambda: {row.label: row for row in link.robot.snapshot().connectors}  # noqa: E731
        await until(lambda: rows()["arm_grip"].refused == 1)
        assert list(rows()) == ["arm", "arm_joints", "arm_grip", "arm_power"]
        assert {row.type for row in rows().values()} == {"acme-arm"}
        assert (rows()["arm"].direction, rows()["arm"].delivery) == ("to-robot", "latest")
        assert (rows()["arm_grip"].direction, rows()["arm_grip"].delivery) == ("both", "reliable")
        assert rows()["arm"].messages == rows()["arm"].refused == 0
        assert row_of(rows()["arm_grip"]).label == "arm_grip"
        text = metrics_text(link.robot.snapshot(), "test")
        assert 'mosaic_connector_refused_total{connector="arm_grip",gate="shape"} 1.0' in text
        assert 'mosaic_connector_info{connector="arm_joints",delivery="latest"' in text


async def test_the_files_delivery_and_limits_reach_each_handler_that_has_them() -> None:
    async with arm(safety={"limits": {"positions.elbow": {"max": 0.5}}, "timeout_s": 2}, delivery="reliable") as link:
        catalogue = link.connection.catalogue
        assert catalogue is not None
        assert {entry.delivery for entry in catalogue.entries} == {Delivery.RELIABLE}
        routes = link.robot._live.runs.routes
        assert [limit.fields for limit in routes["arm"].safety.limits] == [("positions.*",), ("positions.elbow",)]
        assert routes["arm_grip"].safety.limits == ()
        assert {routes[label].safety.timeout_s for label in ("arm", "arm_grip")} == {2.0}


class Careless(Gripper):
    def handle_data(self, data: Grip, sender: Sender) -> None:
        self.send_json({"grams": 1})


def test_what_a_bidirectional_handler_sends_is_held_against_what_it_declares() -> None:
    with pytest.raises(MosaicError, match=r"Careless.*declares Force and sends keys grams") as refused:
        Careless("g").send_json({"grams": 1})
    assert refused.value.code == "plugin.wrong_message"
    with pytest.raises(MosaicError, match="declares Force and sends str"):
        Careless("g").send("closed")


def test_one_that_declares_nothing_sends_any_json() -> None:
    class Free(DataChannelBidirectional[Grip]):
        def handle_data(self, data: Grip) -> None:
            """Takes everything."""

    assert Free("f").send_json({"anything": 1}) is False, "nobody is there, and nobody objects"


class Eye(MediaTrackHandler):
    """Sees one shade of grey."""

    runs = "watched"

    def __init__(self, label: str, shade: int) -> None:
        super().__init__(label)
        self.shade = shade

    def frames(self) -> Iterator[Any]:
        for _ in self.every(0.02):
            yield np.full((64, 96, 3), self.shade, np.uint8)


class Ear(AudioTrackHandler):
    def sounds(self) -> Iterator[Any]:
        for _ in self.every(0.02):
            yield Sound(np.zeros((480, 1), np.int16), 48_000, self.monotonic_s())


class Mouth(AudioReceivable):
    def handle_sound(self, sound: Any, sender: Sender) -> None:
        """Plays nothing."""


class HeadConfigurer(MediaTrackConfigurer[NoParams]):
    def configure(self) -> Sequence[Handler]:
        label = self.label
        eyes = [Eye(f"{label}_left", 60), Eye(f"{label}_right", 200)]
        return [*eyes, Ear(f"{label}_ear"), Mouth(f"{label}_mouth"), Gripper(f"{label}_neck")]


def head(**more: Any) -> Any:
    return joined(connector(HeadConfigurer, label="head"), **more)


async def test_cameras_microphones_and_loudspeakers_are_announced_each_beside_what_takes_messages() -> None:
    async with head() as link:
        catalogue = link.connection.catalogue
        assert catalogue is not None
        assert [(one.label, one.kind, one.direction, len(one.channels)) for one in catalogue.entries] == [
            ("head_left", Kind.VIDEO, Direction.TO_OPERATOR, 0),
            ("head_right", Kind.VIDEO, Direction.TO_OPERATOR, 0),
            ("head_ear", Kind.AUDIO, Direction.TO_OPERATOR, 0),
            ("head_mouth", Kind.AUDIO, Direction.TO_ROBOT, 0),
            ("head_neck", Kind.DATA, Direction.BOTH, 1),
        ]


async def test_two_cameras_of_one_connector_are_each_watched_and_counted_alone() -> None:
    async with head() as link:
        rows = lambda: {row.label: row for row in link.robot.snapshot().connectors}  # noqa: E731
        right = link.connection.media("head_right")
        assert int((await right.next_image()).mean()) == 200
        await until(lambda: rows()["head_right"].messages)
        assert (rows()["head_right"].peers, rows()["head_left"].peers) == (1, 0)
        assert (rows()["head_right"].state, rows()["head_left"].state) == ("running", "waiting"), "nobody looks left"
        assert rows()["head_left"].messages == 0
        assert int((await link.connection.media("head_left").next_image()).mean()) == 60
        assert 'connector="head_left"' in metrics_text(link.robot.snapshot(), "test")


async def test_two_cameras_of_one_connector_over_real_webrtc() -> None:
    with WebRtcNetwork() as network:
        async with head(network=network) as link:
            stores = {shade: link.connection.media(label) for shade, label in ((60, "head_left"), (200, "head_right"))}
            for shade, store in stores.items():
                assert int((await store.next_image()).mean()) == pytest.approx(shade, abs=12)
            rows = {row.label: row for row in link.robot.snapshot().connectors}
            assert (rows["head_left"].peers, rows["head_right"].peers) == (1, 1)
            assert rows["head_left"].messages
            assert rows["head_right"].messages


async def test_the_files_delivery_is_of_the_data_channels_and_never_of_pictures() -> None:
    async with joined(connector(HeadConfigurer, label="head", delivery="bulk")) as link:
        catalogue = link.connection.catalogue
        assert catalogue is not None
        delivery = {one.label: one.delivery for one in catalogue.entries}
        assert (delivery["head_neck"], delivery["head_left"]) == (Delivery.BULK, Delivery.LATEST)


class TwinsConfigurer(MediaTrackConfigurer[NoParams]):
    def configure(self) -> Sequence[Handler]:
        return [Eye(self.label, 1), Eye(self.label, 2)]


async def test_two_handlers_of_one_label_are_refused() -> None:
    with pytest.raises(ConfigError, match="makes two handlers of one label 'eyes'"):
        async with joined(connector(TwinsConfigurer, label="eyes")):
            raise AssertionError("it started")
