"""An operator's channels are matched by label; what comes over them is gated before it costs a place in an inbox, and
what goes out fills the channel that is open now."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from types import SimpleNamespace
from typing import Any

import pytest

from mosaic_core.contract.handler import DataChannelReceivable, DataChannelSendable
from mosaic_core.contract.host import Outgoing, Sender
from mosaic_core.machines.commands.admission import CommandChannel, refusal_on_arrival
from mosaic_core.machines.commands.command_order import ArrivalBaseline
from mosaic_core.machines.control.stop_latch import StopLatch
from mosaic_core.machines.delivery.delivery_terms import terms_of
from mosaic_core.machines.delivery.framing import Frame, FrameFlag, FrameReader, PayloadKind, encode_frame
from mosaic_core.machines.delivery.reassembly import MAX_PARTIAL
from mosaic_core.machines.delivery.send_scheduler import Offered
from mosaic_core.runtime.commands.inbox import Incoming
from mosaic_core.runtime.configuration.receiver_safety import ReceiverSafety
from mosaic_core.runtime.delivery.outbox import Outbox
from mosaic_core.runtime.handlers.routes import Route
from mosaic_core.runtime.observation.counters import ConnectorCounters
from mosaic_core.runtime.peers.peer_channels import PeerChannels
from mosaic_core.words.control import CHANNEL_PROTOCOL
from mosaic_core.words.data_type import Delivery
from mosaic_core.words.limits import SlowDownCurves

ORIGINAL = ""
"""The protocol of an original dashboard's channel."""


class Events(DataChannelSendable[dict[str, Any]]):
    """Sends to operators."""


class Orders(DataChannelReceivable[dict[str, Any]]):
    """Takes from operators."""


class Channel:
    """The robot's end of a data channel; ``sent``: what went out."""

    is_reliable, is_first = True, False
    buffered_bytes, window_bytes, under_way_bytes = 0, 1 << 20, 0

    def __init__(self, label: str, protocol: str = CHANNEL_PROTOCOL) -> None:
        self.label, self.protocol, self.is_open = label, protocol, True
        self.on_message: Any = None
        self.on_open: Any = None
        self.on_close: Any = None
        self.on_drained: Any = None
        self.sent: list[Any] = []

    def give_way(self, on: bool) -> None: ...

    def send(self, data: bytes | str) -> None:
        self.sent.append(data)

    def close(self) -> None:
        self.is_open = False
        if self.on_close is not None:
            self.on_close()

    def says(self, seq: int = 1, *, epoch: int = 0, kind: PayloadKind = PayloadKind.JSON) -> None:
        for piece in encode_frame(Frame(kind, b"{}", seq=seq, epoch=epoch)):
            self.on_message(piece)

    @property
    def frames(self) -> list[Frame | None]:
        reader = FrameReader()
        return [reader.read(data, 0.0) for data in self.sent]


class Receiver:
    """``log``: who opened, what was accepted, who closed."""

    def __init__(self, label: str) -> None:
        self.label = label
        self.watch = SimpleNamespace(generation=4)
        self.requests = None
        self.log: list[Any] = []

    def channel_opened(self, sender: Sender) -> int:
        self.log.append("opened")
        return 7

    def channel_closed(self, sender: Sender) -> None:
        self.log.append("closed")

    def accept(self, item: Incoming) -> None:
        self.log.append(item)


class Resume:
    """A session that numbers nothing, unless the test says so."""

    def __init__(self) -> None:
        self.held: list[Callable[[], None]] | None = None
        self.kept: set[str] = set()
        self.seen: set[int] = set()
        self.log: list[tuple[str, str]] = []

    def when_known(self, route: Route, is_framed: bool, proceed: Callable[[], None]) -> None:
        proceed() if self.held is None else self.held.append(proceed)

    def keeps(self, label: str) -> bool:
        return label in self.kept

    opens = keeps

    def attach(self, label: str, queue: Any, link: Any) -> None:
        self.log.append(("attached", label))

    def has_room(self, label: str) -> None: ...

    def arrived(self, route: Route, seq: int) -> bool:
        return seq not in self.seen

    def channel_closed(self, label: str) -> None:
        self.log.append(("closed", label))

    def removed(self, label: str) -> None:
        self.log.append(("removed", label))


class Scene:
    """One operator and a robot with five connectors. ``refused``: what the operator was told, ``told``: the robot's
    listener."""

    def __init__(self, role: Any = "operator", **safety: Any) -> None:
        self.operator: Any = SimpleNamespace(sender=Sender("p1", "s1", "ann", role=role), peer_id="p1")
        self.refused: list[tuple[str, int | None, str]] = []
        self.gates: list[str] = []
        self.operator.refuse = self._refuse
        self.receiver = Receiver("drive")
        drive = self.route("drive", Orders, Delivery.LATEST, ReceiverSafety(**safety), self.receiver)
        sending = [self.route(label, Events) for label in ("events", "state")]
        sending.append(self.route("map", Events, Delivery.BULK))
        self.routes = {one.label: one for one in (drive, *sending)}
        self.heard: list[tuple[str, bool]] = []
        self.outbox = Outbox(asyncio.get_running_loop(), lambda label, on: self.heard.append((label, on)))
        for route in self.routes.values():
            self.outbox.add_channel(route.label, route.terms, route.counters)
        self.leases = SimpleNamespace(asked=[], refusal=self._lease)
        self.latch = StopLatch()
        self.measured: list[tuple[Any, ...]] = []
        self.told: list[str] = []
        self.known = {"p1"}
        fence = SimpleNamespace(channel=self._gates_of, refusal_on_arrival=refusal_on_arrival)
        self.site: Any = SimpleNamespace(
            routes=self.routes,
            outbox=self.outbox,
            desk=SimpleNamespace(knows=self.known.__contains__, fence=fence),
            links={"p1": SimpleNamespace(command_seen=self._measured, channel_closed=self._measured)},
            listener=SimpleNamespace(command_refused=lambda label, sender, refusal: self.told.append(refusal.code)),
            legacy_peers="observe",
            unfinished=None,
        )
        self.resume: Any = Resume()
        self.channels = PeerChannels(self.operator, self.site, self.resume, ArrivalBaseline())

    @staticmethod
    def route(label: str, kind: Any, delivery: Delivery = Delivery.RELIABLE, *more: Any) -> Route:
        connector: Any = SimpleNamespace(terms_of=lambda handler: terms_of(delivery))
        return Route(label, connector, kind(label), ConnectorCounters(), *(more or (ReceiverSafety(),)))

    def _gates_of(self, safety: Any, legacy: Any, *more: Any) -> CommandChannel:
        return CommandChannel(safety, self.leases, self.latch, legacy, *more)

    def _lease(self, *asked: Any) -> str | None:
        self.leases.asked.append(asked[:3])
        return None

    def _refuse(self, label: str, seq: int | None, code: str, message: str = "", gate: str = "") -> None:
        self.refused.append((label, seq, code))
        self.gates.append(gate)

    def _measured(self, *seen: Any) -> None:
        self.measured.append(seen)

    def opens(self, label: str, protocol: str = CHANNEL_PROTOCOL, **more: Any) -> Channel:
        channel: Any = Channel(label, protocol)
        self.channels.channel_opened(channel, **more)
        return channel  # type: ignore[no-any-return]

    @property
    def accepted(self) -> list[Incoming]:
        return [one for one in self.receiver.log if isinstance(one, Incoming)]

    async def posts(self, label: str, text: str = "hi", to: str | None = None) -> None:
        self.outbox.post(Outgoing(label, PayloadKind.STRING, text.encode(), 0, to))
        for _ in range(5):
            await asyncio.sleep(0)


# -- opening


async def test_a_channel_with_a_label_that_nobody_knows_is_refused_an_originals_stays_open_unread() -> None:
    scene = Scene()
    ours, original = scene.opens("nothing"), scene.opens("nothing", ORIGINAL)
    assert (ours.is_open, original.is_open) == (False, True)
    assert scene.refused == [("nothing", None, "channel.unknown_label")]
    assert original.on_message is None
    assert scene.channels.labels() == ()


async def test_on_the_second_connection_there_is_nothing_but_bulk_of_our_own_operators() -> None:
    scene = Scene()
    queue = scene.channels.new_queue()
    for label, protocol in (("events", CHANNEL_PROTOCOL), ("map", ORIGINAL), ("nothing", CHANNEL_PROTOCOL)):
        channel: Any = Channel(label, protocol)
        scene.channels.bulk_channel_opened(channel, queue)
        assert not channel.is_open
    channel = Channel("map")
    scene.channels.bulk_channel_opened(channel, queue)
    assert [code for _, _, code in scene.refused] == ["channel.wrong_lane"] * 2 + ["channel.unknown_label"]
    assert scene.channels.labels() == ("map",)
    await scene.posts("map")
    assert len(channel.sent) == 1
    scene.channels.drop(scene.channels.queue)
    assert scene.channels.labels() == ("map",)
    scene.channels.drop(queue)
    assert scene.channels.labels() == ()


async def test_a_channel_that_is_not_open_yet_joins_when_it_is() -> None:
    scene = Scene()
    channel: Any = Channel("events")
    channel.is_open = False
    scene.channels.channel_opened(channel)
    assert not scene.outbox.is_heard("events")
    channel.on_open()
    assert scene.outbox.is_heard("events")


async def test_what_waits_for_the_session_joins_later_unless_another_channel_took_its_place() -> None:
    scene = Scene()
    scene.resume.held = []
    scene.opens("events")
    second = scene.opens("events")
    first_joins, second_joins = scene.resume.held
    first_joins()
    assert not scene.outbox.is_heard("events")
    second_joins()
    await scene.posts("events")
    assert len(second.sent) == 1


async def test_a_late_joiner_of_ours_gets_the_last_value_marked_as_old_an_original_does_not() -> None:
    scene = Scene()
    await scene.posts("state", "before")
    original = scene.opens("state", ORIGINAL)
    assert original.sent == []
    ours = scene.opens("state")
    [frame] = ours.frames
    assert frame is not None
    assert (frame.payload, frame.flags) == (b"before", FrameFlag.LATCHED)


async def test_what_belongs_to_a_session_is_left_to_it() -> None:
    scene = Scene()
    scene.resume.kept = {"events"}
    channel = scene.opens("events")
    assert scene.resume.log == [("attached", "events")]
    assert not scene.outbox.is_heard("events"), "the session's own stream listens"
    channel.close()
    assert scene.resume.log == [("attached", "events"), ("closed", "events")]
    scene.opens("events", ORIGINAL)
    assert scene.outbox.is_heard("events"), "an original's channel has no session"


# -- going out


async def test_what_is_sent_goes_over_the_channel_that_took_the_place_of_another() -> None:
    scene = Scene()
    first, second = scene.opens("events"), scene.opens("events")
    await scene.posts("events", "one")
    await scene.posts("events", "two", to="p1")
    assert first.sent == []
    assert [frame and (frame.payload, frame.seq) for frame in second.frames] == [(b"one", 1), (b"two", 2)]
    assert scene.channels.waiting("events") == (0, 0)


async def test_nothing_goes_over_a_channel_that_is_not_there() -> None:
    scene = Scene()
    assert scene.channels.deliver(Outgoing("events", PayloadKind.STRING, b"", 0)) is Offered.REFUSED
    assert scene.channels.waiting("events") == (0, 0)


# -- closing


async def test_a_closed_channel_leaves_the_outbox_its_receiver_and_the_measured_link() -> None:
    scene = Scene()
    drive, events = scene.opens("drive"), scene.opens("events")
    events.close()
    drive.close()
    assert scene.receiver.log == ["opened", "closed"]
    assert scene.heard == [("drive", True), ("events", True), ("events", False), ("drive", False)]
    assert scene.measured == [("events",), ("drive",)]
    assert scene.resume.log == [("closed", "events"), ("closed", "drive")]
    assert drive.on_message is None


async def test_a_channel_whose_place_was_taken_ends_nothing_when_it_closes() -> None:
    scene = Scene()
    first, _ = scene.opens("drive"), scene.opens("drive")
    first.close()
    assert scene.receiver.log == ["opened", "opened"]
    assert scene.channels.labels() == ("drive",)


async def test_a_channel_whose_connector_is_gone_closes_and_says_no_good_bye_to_a_receiver_that_has_ended() -> None:
    scene = Scene(max_rate_hz=1.0)
    drive = scene.opens("drive")
    drive.says()
    for label in ("drive", "events"):
        scene.channels.remove(label)
    assert not drive.is_open
    assert scene.channels.labels() == ()
    assert scene.measured == [("drive",)]
    assert scene.heard == [("drive", True), ("drive", False)]
    assert not [one for one in scene.receiver.log if one == "closed"]
    assert scene.resume.log == [("removed", "drive"), ("removed", "events")]
    scene.opens("drive").says()
    assert len(scene.accepted) == 2, "another connector, another rate"


async def test_a_peer_that_is_gone_leaves_all_its_receivers() -> None:
    scene = Scene()
    scene.opens("drive")
    scene.opens("events")
    scene.channels.close_all()
    assert scene.receiver.log == ["opened", "closed"]
    assert scene.channels.labels() == ()
    assert scene.resume.log == [], "a lost peer released nothing"


# -- coming in


async def test_a_command_of_ours_carries_its_number_its_epoch_and_when_it_arrived() -> None:
    scene = Scene(resource="motion")
    scene.opens("drive").says(3, epoch=12)
    [item] = scene.accepted
    assert (item.channel, item.payload, item.sender) == ("drive", b"{}", scene.operator.sender)
    assert (item.seq, item.epoch, item.opening, item.generation) == (3, 12, 7, 4)
    assert scene.leases.asked == [("p1", "motion", 12)]


async def test_a_bare_command_carries_neither_number_nor_epoch() -> None:
    scene = Scene()
    scene.opens("drive", ORIGINAL).on_message("{}")
    [item] = scene.accepted
    assert (item.payload, item.seq, item.epoch) == (b"{}", None, None)


async def test_what_a_gate_refuses_is_counted_and_told_to_both_sides_with_its_name() -> None:
    scene = Scene(timeout_s=0.3)
    scene.latch.stop("ann", "", "1", 0.0)
    scene.opens("drive").says(3)
    assert scene.accepted == []
    assert scene.refused == [("drive", 3, "safety.stopped")]
    assert (scene.told, scene.gates) == (["safety.stopped"], ["stop"])
    counters = scene.routes["drive"].counters
    assert (counters.refused, counters.refused_by) == (1, {"stop": 1})


async def test_an_observer_commands_nothing_that_does_not_take_observers() -> None:
    for takes_observers, codes in ((False, ["lease.forbidden"]), (True, [])):
        scene = Scene("observer", takes_observers=takes_observers)
        scene.opens("drive").says()
        assert [code for _, _, code in scene.refused] == codes
        assert len(scene.accepted) == takes_observers


@pytest.mark.parametrize(
    ("is_original", "is_known", "legacy_peers", "may"),
    [
        (False, True, "observe", True),
        (False, False, "observe", False),
        (False, False, "allow", True),
        (True, True, "observe", False),
        (True, True, "allow", True),
    ],
)
async def test_whoever_knows_no_leases_or_said_no_hello_yet_watches_unless_originals_may_command(
    is_original: bool, is_known: bool, legacy_peers: str, may: bool
) -> None:
    scene = Scene()
    scene.operator.sender = Sender("p1", "s1", "ann", is_original=is_original)
    scene.site.legacy_peers = legacy_peers
    if not is_known:
        scene.known.clear()
    scene.opens("drive").says()
    assert scene.refused == ([] if may else [("drive", 1, "lease.original_observes")])


async def test_more_commands_than_allowed_are_refused_also_on_a_channel_that_was_opened_anew() -> None:
    scene = Scene(max_rate_hz=1.0)
    codes = []
    for _ in range(3):
        channel = scene.opens("drive")
        channel.says()
        codes.append([code for _, _, code in scene.refused])
    assert codes[0] == []
    assert codes[2]
    assert set(codes[2]) == {"safety.too_fast"}


async def test_what_came_before_is_not_taken_again() -> None:
    scene = Scene()
    scene.resume.seen = {1}
    channel = scene.opens("drive")
    channel.says(1)
    channel.says(2)
    assert [item.seq for item in scene.accepted] == [2]
    assert scene.refused == []


async def test_a_connector_that_only_sends_takes_no_messages() -> None:
    scene = Scene()
    scene.opens("events").says(5)
    assert scene.refused == [("events", 5, "channel.wrong_direction")]


async def test_what_is_no_frame_is_refused_without_a_number() -> None:
    scene = Scene()
    channel = scene.opens("drive")
    channel.on_message("text")
    [(label, seq, _)] = scene.refused
    assert (label, seq, scene.accepted) == ("drive", None, [])
    channel.says()
    assert len(scene.accepted) == 1


async def test_what_came_in_part_and_is_not_waited_for_any_more_is_told_with_label_and_number() -> None:
    scene = Scene()
    channel = scene.opens("drive")
    for seq in range(1, MAX_PARTIAL + 2):
        channel.on_message(next(encode_frame(Frame(PayloadKind.JSON, b"{      }", seq=seq), 4)))
    assert scene.refused == [("drive", 1, "channel.incomplete")]
    assert scene.told == ["channel.incomplete"]
    assert scene.accepted == []


async def test_only_commands_that_a_bad_link_slows_down_measure_it() -> None:
    for safety, measured in (({}, []), ({"motion_fields": ("v",), "curves": SlowDownCurves()}, [("drive", 1)])):
        scene = Scene(**safety)
        scene.opens("drive").says()
        assert scene.measured == measured
        assert len(scene.accepted) == 1
        scene.site.links.clear()
        scene.opens("drive").says()
        assert len(scene.accepted) == 2, "nobody measures the link of this one"
