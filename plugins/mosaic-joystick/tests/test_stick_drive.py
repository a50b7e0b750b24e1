"""A stick drives a robot in memory: while its button is held, under the lease, and never without."""

from __future__ import annotations

import asyncio
import contextlib
import json
from collections.abc import AsyncIterator
from typing import TYPE_CHECKING, Any, ClassVar

import pytest
from hypothesis import given
from hypothesis import strategies as st

from mosaic_core import DataChannelConfigurer, DataChannelReceivable, NoParams
from mosaic_core.messages import STANDSTILL, Joy, Twist
from mosaic_core.operator import RobotConnection
from mosaic_core.testing import Joined, connector, joined, until
from mosaic_core.words.errors import MosaicError
from mosaic_joystick.commands import drive_session
from mosaic_joystick.commands.dead_man import DeadMan
from mosaic_joystick.commands.drive_session import StickDrive
from mosaic_joystick.commands.stick_mapping import StickMapping, Wishes
from mosaic_joystick.joystick import JoystickConfigurer
from mosaic_joystick.stick_state import StickReading
from mosaic_joystick.sticks import OpenStick, found_sticks

if TYPE_CHECKING:
    from conftest import FakeInput, FakeKernel

TRIGGER, Y = 0x120, 1


class Base(DataChannelReceivable[Twist]):
    """Remembers what it was told."""

    timeout_s = 5.0
    requires_lease = True
    told: ClassVar[list[float | str]] = []

    def handle_data(self, data: Twist) -> None:
        self.told.append(data.linear.x)

    def make_safe(self, cause: str) -> None:
        self.told.append(cause)


class BaseConfigurer(DataChannelConfigurer[NoParams]):
    """A base that remembers."""

    connector_type = "base"

    def configure(self) -> Base:
        return Base(self.label)


@pytest.fixture(autouse=True)
def quick_and_forgetful(monkeypatch: pytest.MonkeyPatch) -> None:
    Base.told = []
    monkeypatch.setattr(drive_session, "RETRY_S", 0.05)


@contextlib.asynccontextmanager
async def driving(
    link: Joined, monkeypatch: pytest.MonkeyPatch, *, role: str = "operator", force: str = ""
) -> AsyncIterator[RobotConnection]:
    """Carol's stick drives until the block ends."""
    carol = await link.another_operator("Carol", role=role)

    async def connected(*_: Any) -> RobotConnection:
        return carol

    monkeypatch.setattr(drive_session, "connected", connected)
    wishes = Wishes(linear_mps=0.5)
    task = asyncio.create_task(StickDrive("robot", "base", "any", 0.0, wishes, force, 0.0, True)(link.operator))
    try:
        yield carol
    finally:
        task.cancel()
        with contextlib.suppress(asyncio.CancelledError):
            await task


def robot(*, alice_drives: bool = False) -> Any:
    base = connector(BaseConfigurer, label="base", safety={"slow_down": "off"})
    return joined(base, takes_leases=alice_drives)


@pytest.fixture
def looks(monkeypatch: pytest.MonkeyPatch) -> list[bool]:
    """Whether the trigger was pressed, at each look at the stick."""
    seen: list[bool] = []
    read = OpenStick.read

    def remembered(stick: OpenStick, now_s: float) -> StickReading:
        reading = read(stick, now_s)
        seen.append(reading.buttons[0])
        return reading

    monkeypatch.setattr(OpenStick, "read", remembered)
    return seen


async def seen(looks: list[bool], pressed: bool) -> None:
    """Until the stick is looked at, and was so then."""
    before = len(looks)
    await until(lambda: pressed in looks[before:], "the stick is looked at")


def holder(link: Joined) -> str | None:
    held = link.connection.control.leases["motion"].holder
    return None if held is None else held.name


def states(capsys: pytest.CaptureFixture[str]) -> list[str]:
    return [json.loads(line)["state"] for line in capsys.readouterr().out.splitlines()]


async def test_held_it_drives_let_go_it_stands_and_is_free_for_others(
    joystick: FakeInput, looks: list[bool], monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    async with robot() as link, driving(link, monkeypatch):
        await seen(looks, pressed=False)
        joystick.push(Y, -512)
        joystick.press(TRIGGER)
        await until(lambda: 0.5 in Base.told, "it drives")
        assert holder(link) == "Carol"
        joystick.press(TRIGGER, down=False)
        await until(lambda: Base.told[-1] != 0.5, "it stands")
        await link.connection.control.wait_for(lambda: holder(link) is None)
    assert states(capsys)[:3] == ["ready", "driving", "stands"]


async def test_a_stick_that_lies_on_its_button_drives_nothing_until_it_was_let_go(
    joystick: FakeInput, looks: list[bool], monkeypatch: pytest.MonkeyPatch
) -> None:
    joystick.pressed.add(TRIGGER)
    joystick.axes[Y] = (-512, -512, 511, 16)
    async with robot() as link, driving(link, monkeypatch):
        await seen(looks, pressed=True)
        await seen(looks, pressed=True)
        assert (Base.told, holder(link)) == ([], None)
        joystick.press(TRIGGER, down=False)
        await seen(looks, pressed=False)
        joystick.press(TRIGGER)
        await until(lambda: 0.5 in Base.told, "it drives")


async def test_unplugged_it_stands_and_is_free_and_back_it_drives_again(
    kernel: FakeKernel, joystick: FakeInput, looks: list[bool], monkeypatch: pytest.MonkeyPatch
) -> None:
    async with robot() as link, driving(link, monkeypatch):
        await seen(looks, pressed=False)
        joystick.push(Y, -512)
        joystick.press(TRIGGER)
        await until(lambda: 0.5 in Base.told, "it drives")
        joystick.unplug()
        await link.connection.control.wait_for(lambda: holder(link) is None)
        await until(lambda: Base.told[-1] != 0.5, "it stands")
        driven = Base.told.count(0.5)
        joystick.plug()  # with something on its button
        await seen(looks, pressed=True)
        await seen(looks, pressed=True)
        assert (Base.told.count(0.5), holder(link)) == (driven, None)
        joystick.press(TRIGGER, down=False)
        await seen(looks, pressed=False)
        joystick.press(TRIGGER)
        await until(lambda: Base.told.count(0.5) > driven, "it drives again")


async def test_a_supervisors_stick_beats_who_drives_and_everybody_is_told_why(
    joystick: FakeInput, looks: list[bool], monkeypatch: pytest.MonkeyPatch
) -> None:
    async with robot() as link:
        lost = asyncio.get_running_loop().create_future()
        taken = await link.connection.control.take("motion")
        taken.on_lost(lost.set_result)
        async with driving(link, monkeypatch, role="supervisor", force="somebody stands beside it"):
            await seen(looks, pressed=False)
            joystick.press(TRIGGER)
            joystick.push(Y, -512)
            async with asyncio.timeout(30):
                assert (await lost).code == "lease.taken_over"
            assert "somebody stands beside it" in (await lost).message
            await until(lambda: 0.5 in Base.told, "it drives")


async def test_who_may_not_drive_is_told_and_must_let_go_first(
    joystick: FakeInput, looks: list[bool], monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    async with robot(alice_drives=True) as link, driving(link, monkeypatch):
        await seen(looks, pressed=False)
        joystick.press(TRIGGER)
        said: list[str] = []
        await until(lambda: "denied" in (said.extend(states(capsys)) or said), "it is denied")
        assert 0.5 not in Base.told
        assert holder(link) == "Alice"
    assert said == ["ready", "denied"]


async def test_what_takes_no_velocities_is_refused(joystick: FakeInput, monkeypatch: pytest.MonkeyPatch) -> None:
    async with joined(connector(JoystickConfigurer, label="base", params={"stick": "fake"})) as link:
        carol = await link.another_operator("Carol")
        session = StickDrive("robot", "base", "any", 0.0, Wishes(), "", 0.0, True)

        async def connected(*_: Any) -> RobotConnection:
            return carol

        monkeypatch.setattr(drive_session, "connected", connected)
        with pytest.raises(MosaicError, match="takes no velocities"):
            await session(link.operator)
        message = await carol.receivable("base").next_message()
        assert Joy.model_validate_json(message.data).frame_id == "a stick that is made up"


@given(st.lists(st.sampled_from(["held", "free", "lost"]), max_size=30))
def test_it_drives_only_while_held_since_it_was_last_let_go(steps: list[str]) -> None:
    dead_man, was_free = DeadMan(), False
    for step in steps:
        if step == "lost":
            dead_man.disarm()
            was_free = False
            continue
        was_free = was_free or step == "free"
        assert dead_man.may_drive(step == "held") is (step == "held" and was_free)


def test_axes_and_buttons_are_the_usual_ones_or_those_that_are_named(joystick: FakeInput) -> None:
    stick = next(found_sticks())
    reading = StickReading((0.5, 1.0, -1.0, 0.0), (True, False))
    usual = StickMapping.of(stick, Wishes(linear_mps=0.4, angular_radps=2.0))
    assert usual.twist(reading) == Twist.planar(0.4, 0.0, -2.0)
    assert usual.twist(StickReading(reading.axes, (False, True))) == STANDSTILL
    named = StickMapping.of(stick, Wishes(ahead="rz", turn="y", left="x", dead_man="thumb", linear_mps=1.0))
    assert named.twist(StickReading(reading.axes, (False, True))) == Twist.planar(-1.0, 0.5, 0.8)


@pytest.mark.parametrize(
    ("wishes", "says"),
    [
        (Wishes(ahead="rzz"), "has no axis 'rzz'; did you mean 'rz'"),
        (Wishes(dead_man="bumper"), "has no button 'bumper'.* It has: trigger, thumb"),
    ],
)
def test_what_a_stick_does_not_have_is_told_with_what_it_has(joystick: FakeInput, wishes: Wishes, says: str) -> None:
    with pytest.raises(MosaicError, match=says):
        StickMapping.of(next(found_sticks()), wishes)


def test_sticks_are_listed(kernel: FakeKernel, joystick: FakeInput) -> None:
    from typer.testing import CliRunner

    from mosaic_joystick.commands.joystick_commands import app

    ended = CliRunner().invoke(app, ["list", "--json"])
    assert json.loads(ended.stdout) == {
        "name": "Acme Stick", "path": str(joystick.path), "kind": "joystick",
        "axes": ["x", "y", "rz", "throttle"], "buttons": ["trigger", "thumb"],
    }  # fmt: skip
    assert CliRunner().invoke(app, ["list"]).stdout.splitlines() == [
        f"Acme Stick (joystick) {joystick.path}", "  axes: x y rz throttle", "  buttons: trigger thumb",
    ]  # fmt: skip
    joystick.unplug()
    assert "no stick is plugged in" in CliRunner().invoke(app, ["list"]).stdout
