"""The drill passes on what is right, and fails on receivers that are broken in the ways that hurt."""

from __future__ import annotations

import contextlib
import math
import re
import threading
import time
from collections.abc import Sequence
from typing import Any, ClassVar

import pytest

from mosaic_cmdvel.cmd_vel import CmdVelConfigurer
from mosaic_core import DataChannelConfigurer, DataChannelReceivable, Keeper, MediaTrackConfigurer, MediaTrackHandler
from mosaic_core.contract.params import Message, NoParams
from mosaic_core.contract.request_handler import Request, RequestHandler
from mosaic_core.drill import findings as drill_findings
from mosaic_core.drill import position_reports
from mosaic_core.drill.command_stream import CommandStream
from mosaic_core.drill.drill import EXERCISES, drill
from mosaic_core.drill.findings import DrillFinding, ExerciseFailed, in_time
from mosaic_core.drill.positions import check_held, elsewhere, error_after, in_words
from mosaic_core.laboratory.joining import PATIENCE_S, ConnectorEntry, configured_with, connector, until
from mosaic_core.machines.commands.command_order import CommandOrder
from mosaic_core.machines.commands.position_slew import PositionSlew
from mosaic_core.machines.commands.watchdog import Watchdog
from mosaic_core.machines.control.lease_desk import LeaseDesk
from mosaic_core.messages import JointTarget
from mosaic_core.runtime.commands.fence import Fence
from mosaic_core.runtime.commands.safety_watch import SafetyWatch
from mosaic_core.runtime.configuration.auto_configurer import Configured
from mosaic_core.runtime.peers.peer_control import PeerControl
from mosaic_core.runtime.peers.stop_channel import StopChannel
from mosaic_core.words.control import ControlMessage, Stop
from mosaic_core.words.errors import ConfigError


@pytest.fixture(autouse=True)
def patient(monkeypatch: pytest.MonkeyPatch) -> None:
    """How late a busy machine is must not decide here; what is too late has a test of its own."""
    monkeypatch.setattr(drill_findings, "TOLERANCE_S", 10.0)


class Wish(Message):
    speed_mps: float


class Sled(DataChannelReceivable[Wish]):
    """Somebody else's receiver: one number, a time-out, a safe action."""

    timeout_s: float | None = 1.0
    requires_lease = True
    motion_fields: ClassVar[tuple[str, ...]] = ("speed_mps",)
    told: ClassVar[list[Any]] = []

    def handle_data(self, data: Wish) -> None:
        self.told.append(data)

    def make_safe(self, cause: str) -> None:
        self.told.append(cause)


class Careless(Sled):
    timeout_s = None
    make_safe = DataChannelReceivable.make_safe


class Hanging(Sled):
    released: ClassVar[threading.Event] = threading.Event()

    def handle_data(self, data: Wish) -> None:
        self.released.wait(20.0)


class SafeActionHangs(Sled):
    released: ClassVar[threading.Event] = threading.Event()

    def make_safe(self, cause: str) -> None:
        self.released.wait(20.0)


class SafeActionRaises(Sled):
    def make_safe(self, cause: str) -> None:
        raise OSError("the bus is gone")


class SafeActionWaits(Sled):
    """For a command that takes longer than anybody waits for a safe action."""

    lock: ClassVar[threading.Lock] = threading.Lock()

    def handle_data(self, data: Wish) -> None:
        with self.lock:
            threading.Event().wait(2.0)

    def make_safe(self, cause: str) -> None:
        with self.lock:
            pass


class Text(DataChannelReceivable[str]):
    def handle_data(self, data: str) -> None:
        raise AssertionError("a dry drill runs no code of a plugin")


class Still(MediaTrackHandler):
    def frames(self) -> Any:
        raise AssertionError("a dry drill opens no camera")


def made_by(handler: type[Any], base: type[Any] = DataChannelConfigurer) -> type[Any]:
    class Maker(base[NoParams]):  # type: ignore[misc]
        connector_type = handler.__name__.lower()

        def configure(self) -> Any:
            return handler(self.label)

    return Maker


def configured(*entries: ConnectorEntry) -> Configured:
    return configured_with(entries)


async def findings(*entries: ConnectorEntry, live: bool = False, only: tuple[str, ...] = ()) -> dict[str, DrillFinding]:
    found = [finding async for finding in drill(configured(*entries), live=live, only=only)]
    return {finding.exercise: finding for finding in found}


def sled(handler: type[Any], **safety: Any) -> ConnectorEntry:
    return connector(made_by(handler), label="sled", safety=safety or None)


async def test_a_velocity_receiver_and_its_camera_pass_every_exercise() -> None:
    camera = connector(made_by(Still, MediaTrackConfigurer), label="front")
    base = connector(
        CmdVelConfigurer, label="base", params={"drive": {"type": "log"}}, safety={"max_rate_hz": 40, "timeout_s": 1.0}
    )
    found = await findings(base, camera)
    expected = dict.fromkeys(EXERCISES, "passed") | {"holds-position": "skipped", "tells-position": "skipped"}
    assert {name: one.verdict for name, one in found.items()} == expected, found
    silence = found["silence"]
    assert (silence.limit, silence.why) == ("1000 ms", "safety.timeout")
    assert silence.measured_s is not None
    assert silence.measured_s > 0.9


async def test_a_dry_drill_runs_no_code_of_a_third_partys_receiver() -> None:
    Sled.told.clear()
    found = await findings(sled(Sled), only=("silence", "stop", "out-of-range"))
    assert (found["silence"].verdict, found["stop"].verdict) == ("passed", "passed")
    assert Sled.told == []
    assert found["out-of-range"].verdict == "skipped"
    assert "safety.limits" in found["out-of-range"].why


async def test_a_live_drill_really_drives_and_really_stops() -> None:
    Sled.told.clear()
    found = await findings(sled(Sled), live=True, only=("silence", "leaves"))
    assert (found["silence"].verdict, found["leaves"].verdict) == ("passed", "passed")
    assert any(isinstance(one, Wish) and one.speed_mps > 0 for one in Sled.told)
    assert {"safety.timeout", "safety.peer_left"} <= {one for one in Sled.told if isinstance(one, str)}


async def test_a_receiver_without_a_safe_action_fails() -> None:
    found = (await findings(sled(Careless, timeout_s=1.0), only=("safe-action",)))["safe-action"]
    assert found.verdict == "failed"
    assert "make_safe is not written" in found.why


class Unguarded(Careless):
    requires_lease = False


async def test_a_receiver_that_names_motion_alone_is_drilled_and_a_stop_concerns_it() -> None:
    found = await findings(sled(Unguarded), only=("safe-action", "stop"))
    assert found["safe-action"].verdict == "failed"
    assert found["stop"].verdict == "passed", found["stop"].why


async def test_a_receiver_whose_handle_data_hangs_fails_when_it_is_live() -> None:
    try:
        found = (await findings(sled(Hanging), live=True, only=("silence",)))["silence"]
    finally:
        Hanging.released.set()
    assert found.verdict == "failed"
    assert "handle_data does not return" in found.why


async def test_a_safe_action_that_hangs_fails_when_it_is_live() -> None:
    try:
        found = (await findings(sled(SafeActionHangs), live=True, only=("silence",)))["silence"]
    finally:
        SafeActionHangs.released.set()
    assert found.verdict == "failed"
    assert "did not return" in found.why


async def test_a_stop_is_said_while_a_command_is_carried_out_and_a_safe_action_that_waits_for_it_is_told() -> None:
    found = (await findings(sled(SafeActionWaits), live=True, only=("stop",)))["stop"]
    assert found.verdict == "failed"
    assert found.why.endswith("; handle_data ran meanwhile: make_safe must take no lock that it holds")


class Slow(Sled):
    def handle_data(self, data: Wish) -> None:
        threading.Event().wait(0.6)


@pytest.mark.parametrize(
    ("handler", "timeout_s", "verdict"),
    [(Slow, 1.0, "passed"), (Slow, 0.3, "passed"), (SafeActionWaits, 0.3, "failed")],
)
async def test_silence_begins_with_the_last_command_however_slow_that_is(
    monkeypatch: pytest.MonkeyPatch, handler: type[Any], timeout_s: float, verdict: str
) -> None:
    monkeypatch.setattr(drill_findings, "TOLERANCE_S", 0.4)
    found = (await findings(sled(handler, timeout_s=timeout_s), live=True, only=("silence",)))["silence"]
    assert found.verdict == verdict, found


async def test_a_safe_action_that_raises_fails_with_its_error_when_it_is_live() -> None:
    found = (await findings(sled(SafeActionRaises), live=True, only=("leaves",)))["leaves"]
    assert found.verdict == "failed"
    assert "OSError: the bus is gone" in found.why


@pytest.mark.parametrize(
    ("owner", "name", "always", "exercise"),
    [
        (LeaseDesk, "refusal", None, "stranger"),
        (LeaseDesk, "refusal", None, "old-epoch"),
        (CommandOrder, "arrived", (0.0, True), "replay"),
        (Watchdog, "expire", False, "silence"),
    ],
)
async def test_a_framework_without_one_of_its_guards_fails(
    monkeypatch: pytest.MonkeyPatch, owner: type[Any], name: str, always: Any, exercise: str
) -> None:
    monkeypatch.setattr(owner, name, lambda *arguments, **more: always)
    assert (await findings(sled(Sled), only=(exercise,)))[exercise].verdict == "failed"


def _deaf_stop_channel(channel: StopChannel, data: bytes | str) -> None:
    """Hears nothing."""


_hear = PeerControl.control_heard


def _deaf_control_channel(peer: PeerControl, message: ControlMessage, answer: Any = None) -> None:
    """``answer`` says that it came on the stop's own channel."""
    if answer is not None or not isinstance(message, Stop):
        _hear(peer, message, answer)


@pytest.mark.parametrize(
    ("owner", "name", "broken", "fails", "passes"),
    [
        (StopChannel, "_received", _deaf_stop_channel, "stop", "stop-on-control"),
        (PeerControl, "control_heard", _deaf_control_channel, "stop-on-control", "stop"),
    ],
)
async def test_each_channel_of_the_stop_is_exercised_alone(
    monkeypatch: pytest.MonkeyPatch, owner: type[Any], name: str, broken: Any, fails: str, passes: str
) -> None:
    monkeypatch.setattr(owner, name, broken)
    found = await findings(sled(Sled), only=(fails, passes, "silence"))
    assert {exercise: one.verdict for exercise, one in found.items()} == {
        fails: "failed", passes: "passed", "silence": "passed",
    }  # fmt: skip
    assert "safe action did not run" in found[fails].why


async def test_a_time_out_between_two_commands_is_no_stop(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(StopChannel, "_received", _deaf_stop_channel)
    monkeypatch.setattr(CommandStream, "period_s", 0.4)
    found = (await findings(sled(Sled, timeout_s=0.3), only=("stop",)))["stop"]
    assert found.verdict == "failed"
    assert "safe action did not run" in found.why


class Patient(Sled):
    """Waits for its commander for ever, as long as the link lives."""

    timeout_s = None


async def test_who_drills_after_a_link_died_waits_until_its_lease_has_ended() -> None:
    found = await findings(sled(Patient), only=("disconnect", "leaves"))
    assert {name: one.verdict for name, one in found.items()} == {"disconnect": "passed", "leaves": "passed"}


async def test_a_lease_that_ended_before_anything_moved_is_taken_anew(monkeypatch: pytest.MonkeyPatch) -> None:
    opened = CommandStream.open

    async def loses(stream: CommandStream) -> None:
        await opened(stream)
        stream.who.control.release(stream.subject.safety.resource or "")
        await until(lambda: stream.epoch == 0)

    monkeypatch.setattr(CommandStream, "open", loses)
    found = (await findings(sled(Sled), only=("reordered",)))["reordered"]
    assert found.verdict == "passed", found


async def test_a_stop_that_does_not_hold_fails(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(Fence, "refusal", lambda *asked: None)
    monkeypatch.setattr(Fence, "refusal_on_arrival", lambda *asked: None)
    monkeypatch.setattr(SafetyWatch, "must_release", lambda *asked: False)
    found = (await findings(sled(Sled), only=("stop",)))["stop"]
    assert (found.verdict, found.why) == ("failed", "it took commands while it was stopped")


@pytest.mark.parametrize(
    ("safety", "exercise", "why"),
    [
        ({"on_timeout": "hold"}, "silence", "hold"),
        ({"requires_lease": False}, "take-over", "without a lease"),
        ({"slow_down": "off"}, "frozen-picture", "off"),
        ({"timeout_s": 0.3}, "frozen-picture", "no camera"),
        ({"timeout_s": 0.3}, "too-fast", "max_rate_hz"),
    ],
)
async def test_what_cannot_be_exercised_is_said_with_its_reason(safety: Any, exercise: str, why: str) -> None:
    found = (await findings(sled(Sled, **safety), only=(exercise,)))[exercise]
    assert found.verdict == "skipped"
    assert why in found.why


class Angle(Message):
    angle_deg: float


class Arm(DataChannelReceivable[Angle]):
    """An arm that stands at 60° and says so."""

    timeout_s = 1.0
    requires_lease = True
    position_fields: ClassVar[tuple[str, ...]] = ("angle_deg",)

    def __init__(self, label: str) -> None:
        super().__init__(label)
        self.is_at = 60.0

    def reported_position(self, field: str) -> float | None:
        return self.is_at

    def handle_data(self, data: Angle) -> None:
        self.is_at = data.angle_deg

    def make_safe(self, cause: str) -> None:
        """It holds by itself."""


class SlewsFromZero(Arm):
    """Takes its place for a speed: after a safe action it begins at 0, whatever it is told."""

    ramp = 60.0

    def handle_data(self, data: Angle) -> None:
        self.ramp = self.is_at = min(data.angle_deg, self.ramp + 9)

    def make_safe(self, cause: str) -> None:
        self.ramp = 0.0


class Folds(Arm):
    def make_safe(self, cause: str) -> None:
        self.is_at = 20.0


class KnowsNothing(Arm):
    """Says that it reports where it is, and never does."""

    def reported_position(self, field: str) -> float | None:
        """Not yet."""
        return None


class DeafSensor(Arm):
    def __init__(self, label: str) -> None:
        super().__init__(label)
        self.sensed: float | None = None

    def reported_position(self, field: str) -> float | None:
        return self.sensed


class SwingsHome(Arm):
    """A safe action that sends it home, where it stands at first; it gets there by and by. A new command ends that."""

    speed_degps = 8.0

    def __init__(self, label: str) -> None:
        super().__init__(label)
        self.is_at = 20.0
        self.began_s: float | None = None

    def reported_position(self, field: str) -> float | None:
        if self.began_s is not None:
            gone = self.speed_degps * (time.monotonic() - self.began_s)
            self.began_s = time.monotonic()
            self.is_at += max(-gone, min(gone, 20.0 - self.is_at))
        return self.is_at

    def handle_data(self, data: Angle) -> None:
        self.began_s = None
        self.is_at = data.angle_deg

    def make_safe(self, cause: str) -> None:
        self.began_s = time.monotonic()


class ReportRaises(Arm):
    def reported_position(self, field: str) -> float | None:
        raise OSError("the bus is gone")


class Joints(DataChannelReceivable[JointTarget]):
    """An arm of two joints that is moved by lists, holds where it is, and says so."""

    timeout_s = 1.0
    requires_lease = True
    item_names: Sequence[str] = ("shoulder", "elbow")

    def __init__(self, label: str) -> None:
        super().__init__(label)
        self.is_at = {"shoulder": 60.0, "elbow": -30.0}

    def reported_position(self, field: str) -> float | None:
        return self.is_at[field.removeprefix("positions.")]

    def handle_data(self, data: JointTarget) -> None:
        self.is_at |= dict(zip(data.names, data.positions, strict=True))

    def make_safe(self, cause: str) -> None:
        """It holds by itself."""


class JointsSwing(Joints):
    """After a safe action its elbow begins at 0, whatever it is told."""

    ramp = -30.0

    def handle_data(self, data: JointTarget) -> None:
        super().handle_data(data)
        self.ramp = self.is_at["elbow"] = max(self.is_at["elbow"], self.ramp - 4)

    def make_safe(self, cause: str) -> None:
        self.ramp = 0.0


class JointsUnknown(Joints):
    item_names = ()


class Blind(Arm):
    reported_position = DataChannelReceivable.reported_position


LISTED = {"positions.*": {"min": 5, "max": 120, "max_rate_per_s": 90}, "positions.elbow": {"min": -50, "max": -10}}


def joints(handler: type[Any] = Joints) -> ConnectorEntry:
    return connector(made_by(handler), label="arm", safety={"limits": LISTED, "max_rate_hz": 40})


def arm(handler: type[Any] = Arm, **bounds: float) -> ConnectorEntry:
    return connector(
        made_by(handler), label="arm", safety={"limits": {"angle_deg": bounds} if bounds else {}, "max_rate_hz": 40}
    )


async def test_an_arm_passes_every_exercise_that_is_for_positions() -> None:
    found = await findings(arm(min=5, max=120, max_rate_per_s=90))
    skipped = {name for name, one in found.items() if one.verdict == "skipped"}
    assert skipped == {"frozen-picture", "tells-position"}
    assert [one for name, one in found.items() if one.verdict != "passed" and name not in skipped] == []
    assert found["holds-position"].limit == "angle_deg = 62.5"


class SevenJoints(Joints):
    item_names = tuple(f"joint_{number}" for number in range(7))

    def __init__(self, label: str) -> None:
        super().__init__(label)
        self.is_at = dict.fromkeys(self.item_names, 1.0)


async def test_of_an_arm_with_many_joints_a_line_is_told_and_all_are_exercised() -> None:
    entry = connector(
        made_by(SevenJoints), label="arm",
        safety={"limits": {"positions.*": {"min": -2, "max": 2}}, "max_rate_hz": 40},
    )  # fmt: skip
    found = await findings(entry, only=("holds-position", "silence", "stop", "not-a-number", "out-of-range"))
    assert {one.verdict for one in found.values()} == {"passed"}, found
    assert found["holds-position"].limit == "positions.joint_0 = -2 and 6 more"


async def test_one_of_many_joints_that_swings_is_named() -> None:
    class OneSwings(SevenJoints):
        has_been_safe = False

        def handle_data(self, data: JointTarget) -> None:
            super().handle_data(data)
            self.is_at["joint_5"] -= 0.5 if self.has_been_safe else 0.0

        def make_safe(self, cause: str) -> None:
            self.has_been_safe = True

    entry = connector(made_by(OneSwings), label="arm", safety={"max_rate_hz": 40})
    found = (await findings(entry, live=True, only=("holds-position",)))["holds-position"]
    assert (found.verdict, found.limit) == ("failed", "positions.joint_5 = 1")


@pytest.mark.parametrize(
    ("places", "words"),
    [
        ({"a": 1.0}, "a = 1"),
        ({"a": 1.0, "b": -0.5}, "a = 1 and b = -0.5"),
        ({"a": 1.0, "b": -0.5, "c": 0.0}, "a = 1 and 2 more"),
    ],
)
def test_positions_are_told_in_one_line(places: dict[str, float], words: str) -> None:
    assert in_words(places) == words


@pytest.mark.parametrize("exercise", ["leaves", "holds-position"])
async def test_whoever_leaves_after_the_time_out_of_a_last_command_leaves_it_safe(
    exercise: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """As where a busy machine keeps the drill waiting: nothing more is done then."""

    class Quick(Arm):
        timeout_s = 0.1

    drive = CommandStream.drive

    async def kept_waiting(stream: CommandStream, for_s: float) -> None:
        await drive(stream, for_s)
        time.sleep(0.3)  # noqa: ASYNC251 - it is the loop that waits

    monkeypatch.setattr(CommandStream, "drive", kept_waiting)
    found = (await findings(arm(Quick, min=5, max=120), only=(exercise,)))[exercise]
    assert found.verdict == "passed", found


async def test_a_live_drill_leaves_an_arm_where_it_is() -> None:
    found = await findings(arm(min=5, max=120, max_rate_per_s=90), live=True, only=("tells-position", "holds-position"))
    assert (found["tells-position"].verdict, found["tells-position"].measured) == ("passed", "angle_deg = 60")
    assert (found["holds-position"].verdict, found["holds-position"].limit) == ("passed", "angle_deg = 63.9")


async def test_a_safe_action_that_folds_an_arm_fails_though_nobody_swings_it_back() -> None:
    found = (await findings(arm(Folds), live=True, only=("holds-position",)))["holds-position"]
    assert (found.verdict, found.limit, found.measured) == ("failed", "angle_deg = 60", "20")
    assert found.why.startswith("its safe action moved it by 40 within 1 s: it must hold")


async def test_a_framework_that_begins_at_zero_after_a_safe_action_fails(monkeypatch: pytest.MonkeyPatch) -> None:
    began_at_zero = lambda slew, field, held, now_s: held[field].value if held[field].is_sure else 0.0  # noqa: E731
    start = PositionSlew._start
    monkeypatch.setattr(PositionSlew, "_start", lambda *its: began_at_zero(*its) if its[2] else start(*its))
    found = (await findings(arm(min=5, max=120, max_rate_per_s=90), only=("holds-position",)))["holds-position"]
    assert (found.verdict, found.limit) == ("failed", "angle_deg = 62.5")
    assert "told to stay after a safe action, it was sent elsewhere: a swing of " in found.why


async def test_an_arm_that_begins_at_zero_by_itself_fails_when_it_is_live() -> None:
    found = (await findings(arm(SlewsFromZero), live=True, only=("holds-position",)))["holds-position"]
    assert (found.verdict, found.limit) == ("failed", "angle_deg = 60")
    assert float(found.measured) < 50
    assert found.why.startswith("told to stay after a safe action, it was moved elsewhere: a swing of ")


@pytest.mark.parametrize(
    ("handler", "verdict", "why"),
    [
        (Blind, "skipped", "does not report its position"),
        (ReportRaises, "failed", "reported_position raised: OSError: the bus is gone"),
    ],
)
async def test_no_live_drill_moves_an_arm_of_which_nobody_knows_where_it_is(
    handler: type[Any], verdict: str, why: str
) -> None:
    found = (await findings(arm(handler), live=True, only=("holds-position",)))["holds-position"]
    assert found.verdict == verdict
    assert why in found.why


async def test_a_dry_drill_waits_for_no_device_that_is_kept(caplog: pytest.LogCaptureFixture) -> None:
    class KeptSled(Sled):
        def __init__(self, label: str) -> None:
            super().__init__(label)
            self.keeper = Keeper("sled", lambda: None)

    found = await findings(connector(made_by(KeptSled), label="sled"), only=("silence", "safe-action"))
    assert {one.verdict for one in found.values()} == {"passed"}
    assert not [one.message for one in caplog.records if one.levelname == "ERROR"]


async def test_a_report_that_is_never_given_is_told_in_a_dry_drill_and_what_a_dry_drill_does_not_ask() -> None:
    found = (await findings(arm(KnowsNothing, min=5, max=120), only=("holds-position",)))["holds-position"]
    assert (found.verdict, found.why) == (
        "skipped",
        "it does not report its position, where a command begins: write reported_position in KnowsNothing",
    )
    found = (await findings(arm(min=5, max=120), only=("holds-position",)))["holds-position"]
    assert (found.verdict, found.why) == (
        "passed",
        "its own reported_position is not asked in a dry drill: --live asks it",
    )


async def test_a_rate_of_what_never_reports_can_not_begin_anywhere() -> None:
    with pytest.raises(
        ConfigError, match=r"does not report where 'angle_deg' is.*let KnowsNothing implement reported_"
    ):
        configured(arm(KnowsNothing, max_rate_per_s=90))


async def test_no_live_drill_moves_an_arm_whose_sensor_says_nothing_and_says_so_once() -> None:
    (found,) = (await findings(arm(DeafSensor, min=5, max=120), live=True, only=("silence", "holds-position"))).values()
    assert (found.exercise, found.verdict) == ("silence", "failed")
    assert found.why.startswith("DeafSensor.reported_position says nothing of 'angle_deg', so a live drill")
    assert found.why.endswith("; nothing else of it is exercised")


@pytest.mark.parametrize("said", [math.nan, "60", [60.0]])
async def test_a_report_that_is_no_number_is_told_once_with_its_line_and_no_command_is_blamed(said: Any) -> None:
    class Babbles(Arm):
        def reported_position(self, field: str) -> Any:
            return said

    found = await findings(arm(Babbles, min=5, max=120), live=True)
    assert {name: one.verdict for name, one in found.items()} == {"safe-action": "passed", "tells-position": "failed"}
    told = found["tells-position"].why
    assert told.startswith(f"Babbles.reported_position says {said!r} of 'angle_deg' ({__file__}:")
    assert "a finite number is wanted, or None if unknown" in told


class InRadians(Arm):
    """Says where it is in another unit than that of the message."""

    def reported_position(self, field: str) -> float | None:
        return math.radians(self.is_at)


class ToldInRadians(Arm):
    """Takes degrees for radians, and says well where it is then."""

    def __init__(self, label: str) -> None:
        super().__init__(label)
        self.is_at = 6.0

    def handle_data(self, data: Angle) -> None:
        self.is_at = math.radians(data.angle_deg)


class InTurns(Arm):
    def reported_position(self, field: str) -> float | None:
        return self.is_at * 10


async def test_a_report_in_another_unit_is_told_and_moves_nothing() -> None:
    found = await findings(arm(InTurns, min=5, max=120), live=True)
    assert {name: one.verdict for name, one in found.items()} == {"safe-action": "passed", "tells-position": "failed"}
    told = found["tells-position"].why
    assert told.startswith(f"InTurns.reported_position ({__file__}:")
    assert "says 600 of 'angle_deg', far outside of its range 5 … 120. Return it in the unit of the message" in told


@pytest.mark.parametrize("kind", [InRadians, ToldInRadians])
async def test_an_arm_that_does_not_get_where_it_is_told_is_asked_for_its_unit(kind: type[Any]) -> None:
    found = (await findings(arm(kind, min=0, max=120), live=True, only=("holds-position",)))["holds-position"]
    assert re.search(r"told for 3 s to be at angle_deg = \d.*, it stood at .*: are what its device takes", found.why)


async def test_a_report_that_never_comes_ends_the_exercise_with_that_cause(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(position_reports, "ANSWER_S", 0.1)
    released = threading.Event()

    class Blocks(Arm):
        def reported_position(self, field: str) -> float | None:
            released.wait(PATIENCE_S)
            return self.is_at

    try:
        (found,) = (await findings(arm(Blocks), live=True, only=("silence", "stop"))).values()
    finally:
        released.set()
    assert (found.exercise, found.verdict) == ("silence", "failed")
    assert found.why.startswith(f"Blocks.reported_position did not return within 0.1 s ({__file__}:")


async def test_a_receiver_of_which_no_message_could_be_made_is_told_once() -> None:
    found = await findings(connector(made_by(JointsUnknown), label="arm"), only=("silence", "stop", "leaves"))
    assert list(found) == ["silence"]
    assert "nobody says which numbers" in found["silence"].why


@pytest.mark.parametrize("speed_degps", [8.0, 0.4])
async def test_a_safe_action_that_swings_an_arm_home_fails_though_it_stood_there_and_however_slowly(
    monkeypatch: pytest.MonkeyPatch, speed_degps: float
) -> None:
    monkeypatch.setattr(SwingsHome, "speed_degps", speed_degps)
    found = (await findings(arm(SwingsHome, min=5, max=120), live=True, only=("holds-position",)))["holds-position"]
    assert found.verdict == "failed", found
    assert found.why.startswith("its safe action moved it by ")


@pytest.mark.parametrize(
    ("stood", "said", "is_held"),
    [
        ([60.0] * 6, [60.2, 59.8], True),
        ([60.0] * 6, [60.1, 60.3], False),
        ([59.0, 60.0, 61.0, 60.0], [61.2], True),
        ([59.0, 60.0, 61.0, 60.0], [61.4], False),
        ([60.0, 60.1, 60.0], [], True),
        ([], [60.0], True),
    ],
)
def test_what_wavers_by_itself_may_waver_after_a_safe_action_and_no_more_than_a_sensor_errs(
    stood: list[float], said: list[float], is_held: bool
) -> None:
    with contextlib.nullcontext() if is_held else pytest.raises(ExerciseFailed, match="its safe action moved it"):
        check_held("angle_deg", stood, said, 1.3)


def test_in_a_small_range_a_sensor_errs_by_less_than_the_way_that_must_be_seen() -> None:
    assert error_after(0.04, 0.06) == pytest.approx(0.02 / 3)
    assert error_after(60.0, 63.9) == pytest.approx(3.9 / 3)
    assert error_after(60.0, 60.0) == pytest.approx(1.3)


@pytest.mark.parametrize(
    ("place", "low", "high", "there"),
    [
        (0.0, -1.0, 2.0, 0.3),
        (0.0, -2.0, 1.0, -0.3),
        (60.0, 5.0, 120.0, 63.9),
        (119.0, 5.0, 120.0, 119.0 - 7.44),
        (0.04, 0.0, 0.08, 0.06),
        (0.0, -math.inf, 1.0, 0.0),
        (5.0, 0.0, 1.0, 5.0),
    ],
)
def test_a_live_drill_brings_an_arm_a_little_away_within_its_range(
    place: float, low: float, high: float, there: float
) -> None:
    assert elsewhere(place, low, high) == pytest.approx(there)


async def test_an_arm_that_is_moved_by_lists_passes_the_exercises_of_its_numbers() -> None:
    found = await findings(joints(), only=("holds-position", "out-of-range", "not-a-number"))
    assert {one.verdict for one in found.values()} == {"passed"}, found
    assert found["holds-position"].limit == "positions.shoulder = 62.5 and positions.elbow = -50"
    assert found["out-of-range"].limit == "positions.shoulder ≤ 120"


async def test_a_live_drill_leaves_every_joint_where_it_is() -> None:
    found = (await findings(joints(), live=True, only=("holds-position",)))["holds-position"]
    assert (found.verdict, found.limit) == ("passed", "positions.shoulder = 63.9 and positions.elbow = -27.9")


async def test_one_joint_of_a_list_that_swings_by_itself_fails_when_it_is_live() -> None:
    found = (await findings(joints(JointsSwing), live=True, only=("holds-position",)))["holds-position"]
    assert (found.verdict, found.limit) == ("failed", "positions.elbow = -27.9")
    assert found.why.startswith("told to stay after a safe action, it was moved elsewhere: a swing of ")


async def test_a_framework_that_begins_at_zero_in_a_list_fails(monkeypatch: pytest.MonkeyPatch) -> None:
    began_at_zero = lambda slew, field, held, now_s: held[field].value if held[field].is_sure else 0.0  # noqa: E731
    start = PositionSlew._start
    monkeypatch.setattr(PositionSlew, "_start", lambda *its: began_at_zero(*its) if its[2] else start(*its))
    found = (await findings(joints(), only=("holds-position",)))["holds-position"]
    assert (found.verdict, found.limit) == ("failed", "positions.shoulder = 62.5")
    assert "told to stay after a safe action, it was sent elsewhere: a swing of " in found.why


async def test_a_list_of_which_nobody_names_a_number_is_not_drilled_and_the_cure_is_told() -> None:
    entry = connector(made_by(JointsUnknown), label="arm", safety={"max_rate_hz": 40})
    found = (await findings(entry, only=("holds-position",)))["holds-position"]
    assert found.verdict == "skipped", found
    assert "nobody says which numbers 'positions' may have: name them as `item_names` in JointsUnknown" in str(found)


async def test_no_live_drill_sends_an_arm_to_the_end_of_its_range() -> None:
    found = (await findings(arm(min=5, max=120), live=True, only=("out-of-range",)))["out-of-range"]
    assert (found.verdict, found.why) == ("skipped", "a live drill sends nothing to the end of its range")


async def test_a_receiver_that_moves_nothing_is_left_alone() -> None:
    (found,) = (await findings(connector(made_by(Text), label="display"))).values()
    assert (found.verdict, found.label) == ("skipped", "display")


class Arming(RequestHandler[Wish, Wish]):
    requires_lease = True

    def answer(self, question: Wish, request: Request) -> Wish:
        raise AssertionError("a drill asks no questions")


async def test_a_request_that_needs_the_lease_is_no_motion_and_asked_nothing() -> None:
    for live in (False, True):
        assert await findings(sled(Arming), live=live) == {}


async def test_limits_of_the_file_reach_a_third_partys_receiver() -> None:
    limits = {"speed_mps": {"min": -0.2, "max": 0.2, "max_fall_per_s": 1.0}}
    found = (await findings(sled(Sled, limits=limits), only=("out-of-range",)))["out-of-range"]
    assert found.verdict == "passed"
    assert float(found.measured) <= 0.2


def test_a_limit_is_kept_where_a_busy_machine_adds_a_tenth_of_a_second_and_no_more(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.undo()  # the real tolerance
    assert in_time(0.39, 0.3).measured == "390 ms"
    with pytest.raises(ExerciseFailed, match="too late") as failed:
        in_time(0.41, 0.3)
    assert (failed.value.limit, failed.value.measured) == ("300 ms", "410 ms")
