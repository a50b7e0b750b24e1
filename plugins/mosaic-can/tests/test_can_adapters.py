"""Real interfaces of python-can: an slcan adapter at the end of a pseudo terminal, and SocketCAN on a virtual one."""

from __future__ import annotations

import asyncio
import json
import os
import select
import subprocess
import threading
import tty
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import can
import pytest

from mosaic_can.frames import CanFramesConfigurer
from mosaic_can.send import CanSendConfigurer
from mosaic_core.testing import connector, joined, until

VCAN = "vcanmosaic"
CLOSED = b"C"
SAFE_FRAME = b"t1016000000000000"


class SlcanAdapter:
    """Speaks the Lawicel protocol at ``path``, as long as it is plugged in; ``lines`` is what it was told."""

    def __init__(self, path: Path) -> None:
        self._path = path
        self._ours, theirs = os.openpty()
        tty.setraw(theirs)
        path.symlink_to(os.ttyname(theirs))
        self._theirs = theirs
        self.lines: list[bytes] = []
        self._is_over = threading.Event()
        self._thread = threading.Thread(target=self._serve, daemon=True)
        self._thread.start()

    def _serve(self) -> None:
        rest = b""
        while not self._is_over.is_set():
            if select.select([self._ours], [], [], 0.02)[0]:
                *lines, rest = (rest + os.read(self._ours, 4096)).split(b"\r")
                self.lines += lines

    def says(self, frame: bytes) -> None:
        os.write(self._ours, frame + b"\r")

    async def is_set_up(self) -> None:
        """Somebody has opened it, at the right rate, and begun with the safe frame."""
        await until(lambda: SAFE_FRAME in self.lines, "the safe frame is sent")
        assert {b"S6", b"O"} <= set(self.lines)  # 500 kbit/s, opened

    def unplug(self) -> None:
        self._is_over.set()
        self._thread.join()
        self._path.unlink()
        os.close(self._ours)
        os.close(self._theirs)


@pytest.fixture
def port(tmp_path: Path) -> Path:
    return tmp_path / "ttyACM0"


async def test_an_slcan_adapter_is_pulled_out_and_plugged_in_again(port: Path) -> None:
    options = {"sleep_after_open": 0}
    bus = {"interface": "slcan", "channel": str(port), "bitrate": 500_000, "options": options, "dbc": "sample"}
    frames = connector(CanFramesConfigurer, label="bus", params={"bus": bus})
    drive = {
        "message": "DriveCommand",
        "kinds": {"left_mps": "velocity", "right_mps": "velocity"},
        "safe": {"enabled": False, "counter": 0},
    }
    sender = connector(CanSendConfigurer, label="drive", params={"bus": bus, **drive})
    adapter = SlcanAdapter(port)
    async with joined(frames, sender) as link:
        store = link.connection.receivable("bus")
        await adapter.is_set_up()
        adapter.says(b"t20120001")
        assert (await store.next_message()).json()["data"] == "0001"
        adapter.unplug()
        adapter = SlcanAdapter(port)
        await adapter.is_set_up()
        adapter.says(b"t20120002")
        assert (await store.next_message()).json()["data"] == "0002"
    await until(lambda: CLOSED in adapter.lines, "the bus is closed")
    adapter.unplug()


@pytest.mark.parametrize("said", [b"t12", b"t20x2", b"\xff\xfe", b"T0000020", b"d201Z", b"t2012zz"])
async def test_words_of_an_adapter_that_are_none_are_told_and_the_bus_goes_on(
    port: Path, caplog: pytest.LogCaptureFixture, said: bytes
) -> None:
    bus = {"interface": "slcan", "channel": str(port), "bitrate": 500_000, "options": {"sleep_after_open": 0}}
    adapter = SlcanAdapter(port)
    async with joined(connector(CanFramesConfigurer, label="bus", params={"bus": bus})) as link:
        heard: list[str] = []
        link.connection.receivable("bus").subscribe(lambda data: heard.append(json.loads(data)["data"]))
        await until(lambda: b"O" in adapter.lines, "the bus is opened")
        adapter.says(said)
        await until(lambda: "is lost: " in caplog.text, "it is told")

        def hears() -> bool:
            adapter.says(b"t20120001")
            return "0001" in heard

        await until(hears, "a frame is heard again")
    adapter.unplug()


async def test_options_that_a_driver_does_not_take_are_told_as_a_bus_that_cannot_be_opened(
    port: Path, caplog: pytest.LogCaptureFixture
) -> None:
    bus = {"interface": "slcan", "channel": str(port), "options": {"sleep_after_open": "long"}}
    adapter = SlcanAdapter(port)
    async with joined(connector(CanFramesConfigurer, label="bus", params={"bus": bus})):
        await until(lambda: "can't be opened: " in caplog.text, "it is told")
    adapter.unplug()


def set_link(name: str, state: str) -> None:
    subprocess.run(["ip", "link", "set", name, state], check=True, timeout=10)


@pytest.fixture
def vcan() -> Iterator[str]:
    """A virtual interface of the kernel; skipped where there is none."""
    made = subprocess.run(["ip", "link", "add", VCAN, "type", "vcan"], capture_output=True, text=True)
    if made.returncode:
        pytest.skip(f"no virtual CAN interface: {made.stderr.strip()}")
    set_link(VCAN, "up")
    yield VCAN
    subprocess.run(["ip", "link", "delete", VCAN], check=True)


async def test_socketcan_goes_down_and_comes_back(vcan: str) -> None:
    made = connector(CanFramesConfigurer, label="bus", params={"bus": {"channel": vcan}})

    def says(number: int) -> None:
        with can.Bus(interface="socketcan", channel=vcan) as node:
            node.send(can.Message(arbitration_id=0x201, data=[number], is_extended_id=False))

    async with joined(made) as link:
        store: Any = link.connection.receivable("bus")
        heard: list[str] = []
        store.subscribe(lambda data: heard.append(json.loads(data)["data"]))

        def hears(number: int) -> bool:
            says(number)
            return f"{number:02x}" in heard

        await until(lambda: hears(1), "a frame is heard")
        await asyncio.to_thread(set_link, vcan, "down")
        await asyncio.to_thread(set_link, vcan, "up")
        await until(lambda: hears(2), "a frame is heard again")
