"""The walks on the page of the architecture are what happens: what passes is written down, box by box, and compared."""

from __future__ import annotations

import re
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from types import FrameType
from typing import Any

from mosaic_core import DataChannelConfigurer, DataChannelReceivable, DataChannelSendable, NoParams
from mosaic_core.contract.params import Message
from mosaic_core.runtime.configuration.auto_configurer import AutoConfigurer
from mosaic_core.testing import connector, joined, until

ROOT = Path(__file__).parents[2]
PAGE = (ROOT / "docs" / "topics" / "architecture.md").read_text()
FILE = """\
server: { ws_url: "ws://127.0.0.1:9", auth: { type: no-authorization, robot_id: 7d1c2f6e-0b52-4c1e-9a53-2f6f1f0c9b11 } }
connectors:
  - { type: connection-check, label: link }
"""


class Level(Message):
    percent: float


class Gauge(DataChannelSendable[Level]):
    def messages(self) -> Iterator[Level]:
        for turn in self.every(0.05):
            yield Level(percent=float(turn is None))


class Winch(DataChannelReceivable[Level]):
    requires_lease = True
    timeout_s = 5.0
    motion_fields = ("percent",)
    told: Level | None = None

    def handle_data(self, data: Level) -> None:
        self.told = data

    def make_safe(self, cause: str) -> None:
        """It stands by itself."""


class GaugeConfigurer(DataChannelConfigurer[NoParams]):
    connector_type = "gauge"

    def configure(self) -> Gauge:
        return Gauge(self.label)


class WinchConfigurer(DataChannelConfigurer[NoParams]):
    connector_type = "winch"

    def configure(self) -> Winch:
        return Winch(self.label)


def drawn(title: str, first: str, last: str) -> list[tuple[str, str]]:
    """The boxes of a walk, in their order, from one function to the last one of that name."""
    walk = PAGE.split(f"### {title}")[1].split("```")[1]
    boxes = re.findall(r'\["([^"<]+)<br>(\w+)"\]', walk)
    names = [name for _, name in boxes]
    return boxes[names.index(first) : len(names) - names[::-1].index(last)]


@contextmanager
def passed(boxes: list[tuple[str, str]]) -> Iterator[list[tuple[str, str]]]:
    """Which of them were entered by any thread that began within the block, or by this one, as often as they were."""
    wanted = {(str(ROOT / file), name): (file, name) for file, name in boxes}
    entered: list[tuple[str, str]] = []

    def note(frame: FrameType, event: str, _argument: Any) -> None:
        if event == "call" and (box := wanted.get((frame.f_code.co_filename, frame.f_code.co_name))):
            entered.append(box)

    before: Callable[..., Any] | None = sys.getprofile()
    threading.setprofile(note)
    sys.setprofile(note)
    try:
        yield entered
    finally:
        sys.setprofile(before)
        threading.setprofile(None)  # type: ignore[arg-type]


def in_order(entered: list[tuple[str, str]]) -> list[tuple[str, str]]:
    """Each once, where it was entered first."""
    return list(dict.fromkeys(entered))


def test_a_robot_goes_from_its_yaml_file_through_the_drawn_functions(tmp_path: Path) -> None:
    boxes = drawn("A robot", "from_file", "hints_of")
    (tmp_path / "mosaic_config.yaml").write_text(FILE)
    with passed(boxes) as entered:
        AutoConfigurer().from_file(tmp_path / "mosaic_config.yaml")
    assert in_order(entered) == boxes


async def test_a_value_goes_through_the_drawn_functions() -> None:
    boxes = drawn("A value", "send_json", "offer")
    with passed(boxes) as entered:
        async with joined(connector(GaugeConfigurer, label="gauge")) as link:
            gauge = link.connection.receivable("gauge")
            await gauge.next_message()
            entered.clear()
            await gauge.next_message()
            await until(lambda: set(entered) == set(boxes))
    start = entered.index(boxes[0])
    assert in_order(entered[start:]) == boxes


async def test_a_command_goes_through_the_drawn_functions() -> None:
    boxes = drawn("A command", "_received", "refusal")
    with passed(boxes) as entered:
        async with joined(connector(WinchConfigurer, label="winch"), takes_leases=True) as link:
            winch: Any = link.configured.connectors[0].handlers[0]
            commands = link.connection.sendable("winch")
            await commands.wait_open()
            entered.clear()
            commands.send_json({"percent": 1.0})
            await until(lambda: winch.told is not None)
    assert in_order(entered)[: len(boxes)] == boxes
