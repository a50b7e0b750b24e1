"""Motion ends also where its end goes wrong: zeros that break, messages that take no zero, links nobody measures."""

from __future__ import annotations

import time
from typing import Any, ClassVar

import pytest
from pydantic import Field

from mosaic_core import DataChannelReceivable, Message
from mosaic_core.machines.commands.safety_envelope import SafetyEnvelope
from mosaic_core.runtime.commands.fence import Fence
from mosaic_core.words.data_type import Delivery


class Speed(Message):
    v: float = Field(default=0.0)


class Forward(Message):
    v: float = Field(gt=0)


class Base(DataChannelReceivable[Speed]):
    timeout_s = 1.0
    motion_fields: ClassVar[tuple[str, ...]] = ("v",)

    def __init__(self) -> None:
        super().__init__("drive")
        self.log: list[Any] = []
        self.zero_breaks = False

    def handle_data(self, data: Speed) -> None:
        self.log.append(data.v)
        if data.v == 0 and self.zero_breaks:
            raise OSError("the wheels do not answer")

    def make_safe(self, cause: str) -> None:
        self.log.append(cause)


async def test_zeros_that_broke_are_no_standing_still(kit: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    """An operator that lets go and says zero for long must not be taken for one whose base stands."""
    monkeypatch.setitem(SafetyEnvelope.__init__.__kwdefaults__ or {}, "idle_after_s", 0.2)
    base = Base()
    base.zero_breaks = True

    async with kit.running(kit.connector_of(base, delivery=Delivery.LATEST)) as scene:
        ann = await scene.enters("ann")
        drive = ann.open("drive")
        drive.say({"v": 1})
        await kit.until(lambda: base.log)

        def zeros_end() -> bool:
            drive.say({"v": 0})
            return "safety.timeout" in base.log

        await kit.until(zeros_end)


async def test_a_message_that_takes_no_zero_costs_the_zeros_and_not_the_receiver(
    kit: Any, caplog: pytest.LogCaptureFixture
) -> None:
    class OnlyForward(DataChannelReceivable[Forward]):
        timeout_s = 0.1
        motion_fields: ClassVar[tuple[str, ...]] = ("v",)

        def __init__(self) -> None:
            super().__init__("drive")
            self.log: list[Any] = []

        def handle_data(self, data: Forward) -> None:
            self.log.append(data.v)

        def make_safe(self, cause: str) -> None:
            self.log.append(cause)

    base = OnlyForward()

    async with kit.running(kit.connector_of(base, safety={"on_timeout": "zero"})) as scene:
        ann = await scene.enters("ann")
        drive = ann.open("drive")
        drive.say({"v": 1})
        await kit.until(lambda: "takes no zeros" in caplog.text)
        [told] = [record for record in caplog.records if "takes no zeros" in record.message]
        assert told.message.startswith("'drive' takes no zeros: ")
        assert vars(told)["label"] == "drive"
        assert base.log == [1.0, "safety.timeout"]
        drive.say({"v": 2})
        await kit.until(lambda: base.log[2:3] == [2.0])


@pytest.mark.parametrize(("picture", "speed"), [("if_watching", 1.0), ("required", 0.0)])
async def test_who_cannot_show_a_picture_does_not_move_what_requires_one(kit: Any, picture: str, speed: float) -> None:
    base = Base()
    safety = {"slow_down": {"picture": picture}, "requires_lease": True}

    async with kit.running(kit.connector_of(base, safety=safety)) as scene:
        end = await scene.connects("an original dashboard")
        end.open("drive", protocol="").say({"v": 1})
        await kit.until(lambda: base.log)
        assert base.log[0] == speed


async def test_a_lease_cannot_end_between_the_check_of_a_command_and_its_beginning(
    kit: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    base = Base()
    is_late = False
    right = Fence.commanded

    def late(self: Fence, *arguments: Any) -> None:
        """The clock reaches the end of the lease here."""
        lease = self.desk._leases["motion"]
        lease.alive_s = time.monotonic() - lease.expiry_s - 1e-9 if is_late else lease.alive_s
        right(self, *arguments)

    monkeypatch.setattr(Fence, "commanded", late)

    async with kit.running(kit.connector_of(base, safety={"requires_lease": True})) as scene:
        ann = await scene.enters("ann")
        epoch = await ann.take()
        is_late = True
        ann.open("drive").say({"v": 1}, epoch=epoch)
        await kit.until(lambda: base.log)
        leases = [lease for lease in scene.hooks.of("lease") if lease["holder"] is None]
        assert not leases, "the command acts, so its sender still holds the lease"
