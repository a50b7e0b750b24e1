"""A running robot is given other code and another file: only what changed begins anew, and operators stay."""

from __future__ import annotations

import asyncio
import contextlib
import logging
from collections.abc import AsyncIterator, Sequence
from pathlib import Path
from typing import Any

import pytest

from mosaic_core import Handler, hookimpl
from mosaic_core.laboratory.joining import ROBOT_ID, running_robot, signed_in, until
from mosaic_core.laboratory.memory_network import MemoryNetwork
from mosaic_core.laboratory.memory_server import MemoryServer
from mosaic_core.operator.robot_connection import RobotConnection
from mosaic_core.runtime.configuration.auto_configurer import AutoConfigurer
from mosaic_core.runtime.configuration.hook_calls import hook_plugins
from mosaic_core.runtime.configuration.local_connectors import connectors_beside
from mosaic_core.runtime.configuration.resolver import ConnectorResolver
from mosaic_core.runtime.reload import reloader as module
from mosaic_core.runtime.reload.reloader import Reloader
from mosaic_core.runtime.robot import Robot
from mosaic_core.words.errors import Problem

BEAT = """
from pathlib import Path
from mosaic_core import DataChannelConfigurer, DataChannelSendable, Message, Params
from pydantic import Field
from .words import WORD

class BeatParams(Params):
    period_s: float = Field(default=0.01, gt=0)

class Beat(Message):
    word: str
    period_s: float

class Heart(DataChannelSendable[Beat]):
    def __init__(self, label, params):
        super().__init__(label)
        self.params = params

    def messages(self):
        for _ in self.every(self.params.period_s):
            yield Beat(word=WORD, period_s=self.params.period_s)

class HeartConfigurer(DataChannelConfigurer[BeatParams]):
    connector_type = "heart"
    def configure(self):
        return Heart(self.label, self.params)
"""
WHEEL = """
from mosaic_core import DataChannelConfigurer, DataChannelReceivable, Delivery, Message, NoParams

def tell(line):
    with open(__file__ + ".told", "a") as story:
        story.write(line + "\\n")

class Turn(Message):
    speed_mps: float

class Wheel(DataChannelReceivable[Turn]):
    delivery = Delivery.LATEST
    timeout_s = 5.0
    motion_fields = ("speed_mps",)
    code = "old"

    def handle_data(self, data):
        tell(f"{self.code} turns {data.speed_mps}")

    def make_safe(self, cause):
        tell(f"{self.code} safe {cause}")

class WheelConfigurer(DataChannelConfigurer[NoParams]):
    connector_type = "wheel"
    def configure(self):
        return Wheel(self.label)
"""
HEAD = f"server: {{ ws_url: 'ws://127.0.0.1:9', auth: {{ type: no-authorization, robot_id: {ROBOT_ID} }} }}\n"


class Bench:
    """A robot on files that a test edits, and its operator."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.file = folder / "mosaic_config.yaml"
        self.problems: list[Problem] = []
        self.tellings = 0
        (folder / "connectors").mkdir()
        self.write("connectors/beats.py", BEAT)
        self.write("connectors/words.py", 'WORD = "tick"\n')
        self.write("connectors/wheels.py", WHEEL)
        self.connectors("{ type: heart, label: a }", "{ type: wheel, label: wheel }")
        auto = AutoConfigurer(resolver=self.resolver(), plugins=hook_plugins([]))
        self.reloader = Reloader(self.file, self.resolver, self._told, auto)

    def resolver(self) -> ConnectorResolver:
        return ConnectorResolver([], local=connectors_beside(self.file))

    def _told(self, problems: Sequence[Problem]) -> None:
        self.tellings += 1
        self.problems = list(problems)

    def write(self, name: str, text: str) -> None:
        (self.folder / name).write_text(text)

    def edit(self, name: str, old: str, new: str) -> None:
        text = (self.folder / name).read_text()
        assert old in text
        self.write(name, text.replace(old, new))

    def story(self) -> str:
        """What the wheel has told so far, line by line."""
        told = self.folder / "connectors" / "wheels.py.told"
        return told.read_text() if told.exists() else ""

    def connectors(self, *entries: str) -> None:
        self.write("mosaic_config.yaml", HEAD + "connectors:\n" + "".join(f"  - {entry}\n" for entry in entries))


class Live:
    """What runs."""

    def __init__(self, bench: Bench, robot: Robot, connection: RobotConnection) -> None:
        self.bench = bench
        self.robot = robot
        self.connection = connection

    def labels(self) -> list[str]:
        catalogue = self.connection.catalogue
        return [] if catalogue is None else [entry.label for entry in catalogue.entries]

    def threads(self) -> dict[str, object]:
        return {one.config.label: one.handlers[0] for one in self.bench.reloader.configured.connectors}


@pytest.fixture
def bench(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Bench:
    monkeypatch.setattr(module, "PERIOD_S", 0.02)
    return Bench(tmp_path)


@contextlib.asynccontextmanager
async def running(bench: Bench) -> AsyncIterator[Live]:
    server, network = MemoryServer(ROBOT_ID), MemoryNetwork()
    configured = bench.reloader.configured
    async with running_robot(configured, server, network, "test") as robot, contextlib.AsyncExitStack() as stack:
        _, connection = await signed_in(stack, server, network, "Alice")
        reloading = asyncio.create_task(bench.reloader.run(robot))
        yield Live(bench, robot, connection)
        reloading.cancel()
        await asyncio.gather(reloading, return_exceptions=True)


async def word(live: Live, label: str, wanted: str) -> None:
    """Wait for it on one store, which is never made anew."""
    store = live.connection.receivable(label)
    while (await store.next_message()).json()["word"] != wanted:
        pass


async def test_an_edit_of_code_begins_only_what_is_made_of_it_anew(bench: Bench) -> None:
    async with running(bench) as live:
        peer_id = live.connection.peer_id
        await word(live, "a", "tick")
        before = live.threads()
        bench.edit("connectors/words.py", "tick", "tock")
        await word(live, "a", "tock")
        after = live.threads()
        assert after["wheel"] is before["wheel"]
        assert after["a"] is not before["a"]
        assert (live.connection.state, live.connection.peer_id) == ("connected", peer_id)
        assert bench.problems == []


async def test_an_edit_of_the_file_begins_only_that_connector_anew(bench: Bench) -> None:
    bench.connectors("{ type: heart, label: a }", "{ type: heart, label: b }")
    bench.reloader = Reloader(bench.file, bench.resolver, bench._told, AutoConfigurer(resolver=bench.resolver()))
    async with running(bench) as live:
        before = live.threads()
        bench.connectors("{ type: heart, label: a, params: { period_s: 0.02 } }", "{ type: heart, label: b }")
        store = live.connection.receivable("a")
        while (await store.next_message()).json()["period_s"] != 0.02:
            pass
        after = live.threads()
        assert after["b"] is before["b"]
        assert after["a"] is not before["a"]


async def test_motion_is_made_safe_before_the_old_handler_goes(bench: Bench) -> None:
    async with running(bench) as live:
        pad = live.connection.sendable("wheel")
        await pad.wait_open()
        await until(lambda: pad.send_json({"speed_mps": 0.5}) and "old turns 0.5" in bench.story())
        bench.edit("connectors/wheels.py", '"old"', '"new"')
        await until(lambda: pad.send_json({"speed_mps": 0.7}) and "new turns 0.7" in bench.story())
        lines = bench.story().splitlines()
        # A command that the safe action overtakes may still come through; then it is made safe once more.
        safe = max(place for place, line in enumerate(lines) if line == "old safe safety.reload")
        assert safe < lines.index("new turns 0.7")
        assert not any(line.startswith("old turns") for line in lines[safe:])
        assert live.connection.state == "connected"


async def test_new_connectors_appear_and_removed_ones_go(bench: Bench) -> None:
    async with running(bench) as live:
        await word(live, "a", "tick")
        peer_id = live.connection.peer_id
        bench.connectors("{ type: wheel, label: wheel }", "{ type: heart, label: b }")
        await until(lambda: live.labels() == ["wheel", "b"])
        await word(live, "b", "tick")
        assert live.connection.receivable("a").state.phase == "mismatch"
        bench.connectors("{ type: heart, label: a }", "{ type: wheel, label: wheel }")
        await until(lambda: live.labels() == ["a", "wheel"])
        await word(live, "a", "tick")  # the store that had failed
        assert live.connection.peer_id == peer_id
        assert [one.label for one in live.robot.snapshot().connectors] == ["a", "wheel"]


async def test_another_delivery_opens_the_channel_anew(bench: Bench) -> None:
    async with running(bench) as live:
        await word(live, "a", "tick")
        bench.connectors("{ type: heart, label: a, delivery: latest }", "{ type: wheel, label: wheel }")
        await until(lambda: live.connection.catalogue and live.connection.catalogue.entries[0].delivery == "latest")
        bench.edit("connectors/words.py", "tick", "tock")
        await word(live, "a", "tock")


@pytest.mark.parametrize(
    ("file", "old", "new", "line", "told"),
    [
        ("mosaic_config.yaml", "type: heart", "type: hart", 3, "no connector type 'hart'"),
        ("connectors/beats.py", "class Beat(", "class Beat((", 10, "SyntaxError"),
        ("connectors/words.py", "WORD", "WORD (", 1, "SyntaxError"),
        ("connectors/words.py", "WORD", "WORT", None, "ImportError: cannot import name 'WORD'"),
    ],
)
async def test_a_mistake_is_told_with_its_line_and_what_ran_goes_on(
    bench: Bench, file: str, old: str, new: str, line: int | None, told: str
) -> None:
    async with running(bench) as live:
        before = live.threads()
        bench.edit(file, old, new)
        await until(lambda: bench.problems)
        (problem,) = bench.problems  # and none of its consequences
        assert told in problem.message
        if line is not None:
            assert any(problem.line == line and problem.file.endswith(file) for problem in bench.problems)
        assert live.threads() == before
        await word(live, "a", "tick")
        bench.edit(file, new, old)
        bench.edit("connectors/words.py", "tick", "tock")
        await word(live, "a", "tock")
        assert bench.tellings <= 2


async def test_a_mended_mistake_is_told_as_well_and_whose_code_runs_once(
    bench: Bench, caplog: pytest.LogCaptureFixture
) -> None:
    caplog.set_level(logging.INFO)
    async with running(bench):
        caplog.clear()
        bench.edit("mosaic_config.yaml", "label: a }", "label: a, parms: {} }")
        await until(lambda: bench.problems)
        bench.edit("mosaic_config.yaml", ", parms: {}", "")
        mended = "reloaded mosaic_config.yaml: no connector is another, what ran goes on"
        await until(lambda: mended in caplog.messages)
        bench.edit("connectors/words.py", "tick", "tock")
        await until(lambda: "reloaded mosaic_config.yaml: begun anew: a" in caplog.messages)
    assert not [line for line in caplog.messages if line.startswith("runs code of")]


async def test_what_a_running_robot_can_not_change_is_said(bench: Bench, caplog: pytest.LogCaptureFixture) -> None:
    caplog.set_level(logging.INFO, module.__name__)
    async with running(bench):
        bench.edit("mosaic_config.yaml", "127.0.0.1:9", "127.0.0.1:10")
        await until(lambda: "counts when the robot is started anew" in caplog.text)
        caplog.clear()
        bench.edit("mosaic_config.yaml", "127.0.0.1:10", "127.0.0.1:9")  # it is as it was begun
        await until(lambda: "reloaded mosaic_config.yaml" in caplog.text)
        assert "counts when the robot is started anew" not in caplog.text


CAMERA = """
import numpy as np
from mosaic_core import EncodingParams, MediaTrackConfigurer, MediaTrackHandler

class EyeParams(EncodingParams):
    shade: int = 100

class Eye(MediaTrackHandler):
    def __init__(self, label, params):
        super().__init__(label)
        self.params = self.encoding = params

    def frames(self):
        for _ in self.every(0.02):
            yield np.full((2, 2, 3), self.params.shade, np.uint8)

class EyeConfigurer(MediaTrackConfigurer[EyeParams]):
    connector_type = "eye"
    def configure(self):
        return Eye(self.label, self.params)
"""


async def shade(live: Live, label: str, wanted: int) -> None:
    store = live.connection.media(label)
    picture: Any = await store.next_frame()  # in memory as it was yielded
    while picture.image[0, 0, 0] != wanted:
        picture = await store.next_frame()


async def test_a_camera_goes_on_in_the_same_line_unless_it_is_encoded_otherwise(bench: Bench) -> None:
    bench.write("connectors/eyes.py", CAMERA)
    async with running(bench) as live:
        peer_id = live.connection.peer_id
        bench.connectors("{ type: wheel, label: wheel }", "{ type: eye, label: front }")
        await until(lambda: "front" in live.labels())
        await shade(live, "front", 100)
        bench.connectors("{ type: wheel, label: wheel }", "{ type: eye, label: front, params: { shade: 50 } }")
        await shade(live, "front", 50)
        assert live.connection.peer_id == peer_id
        bench.connectors(
            "{ type: wheel, label: wheel }", "{ type: eye, label: front, params: { shade: 30, rungs: 1 } }"
        )
        await until(lambda: live.robot.peers == ())
        await until(lambda: live.connection.state != "connected")  # a line that leads nowhere is closed


async def test_what_connectors_share_is_made_anew_with_its_last_user(bench: Bench) -> None:
    things = bench.reloader.configured.shared
    story: list[str] = []

    class Thing:
        def __enter__(self) -> None:
            story.append("open")

        def __exit__(self, *_: object) -> None:
            story.append("closed")

    things.of("a").get("own", Thing)
    kept = things.of("a").get("both", Thing)
    things.of("wheel").get("both", Thing)
    things.enter()
    after = things.without({"a"})
    assert after.get("both", Thing) is kept
    after.of("a").get("own", Thing)
    things.leave_to(after)
    assert story == ["open", "open", "closed"]
    after.enter()
    after.leave()
    assert story == ["open", "open", "closed", "open", "closed", "closed"]


async def test_only_what_changed_is_made_and_hooks_hear_of_it(bench: Bench) -> None:
    made: list[str] = []
    all_of_them: list[str] = []

    class Listener:
        @hookimpl
        def mosaic_before_configure(self, configurers: Sequence[Any]) -> None:
            made.extend(one.label for one in configurers)

        @hookimpl
        def mosaic_after_configure(self, handlers: Sequence[Handler]) -> None:
            all_of_them[:] = [one.label for one in handlers]

    bench.reloader.configured.plugins.register(Listener())
    async with running(bench) as live:
        bench.edit("connectors/words.py", "tick", "tock")
        await word(live, "a", "tock")
    assert (made, all_of_them) == (["a"], ["a", "wheel"])


async def test_motion_rests_while_the_new_object_is_made(bench: Bench) -> None:
    """Its maker waits for a file here, as one does that reads a slow disk."""
    slow = """    def configure(self):
        import pathlib, time
        tell("new begins to be made")
        while not (pathlib.Path(__file__).parents[1] / "go").exists():
            time.sleep(0.005)
        raise RuntimeError("no motor")
"""
    async with running(bench) as live:
        pad = live.connection.sendable("wheel")
        await pad.wait_open()
        await until(lambda: pad.send_json({"speed_mps": 0.5}) and "old turns 0.5" in bench.story())
        bench.edit("connectors/wheels.py", "    def configure(self):\n", slow)
        await until(lambda: "new begins to be made" in bench.story())
        assert "old safe safety.reload" in bench.story().partition("new begins")[0]
        for speed in (0.6, 0.7):
            pad.send_json({"speed_mps": speed})
        await word(live, "a", "tick")  # by then they have arrived
        assert "turns 0.6" not in bench.story()
        assert "turns 0.7" not in bench.story()
        bench.write("go", "")
        await until(lambda: bench.problems)
        assert "no motor" in bench.problems[0].message
        await until(lambda: pad.send_json({"speed_mps": 0.8}) and "old turns 0.8" in bench.story())  # what ran goes on


BREAKAGES = {
    "import": ("from .words import WORD", "from .words import WORD\nraise {error}"),
    "declaration": ("class Beat(Message):", "class Beat(Message):\n    raise {error}\n"),
    "params": (
        "class BeatParams(Params):",
        "from pydantic import field_validator\nclass BeatParams(Params):\n"
        "    @field_validator('period_s')\n    @classmethod\n    def odd(cls, value):\n        raise {error}\n",
    ),
    "configurer": (
        'connector_type = "heart"',
        'connector_type = "heart"\n    def __init__(self, *a, **k): raise {error}',
    ),
    "configure": ("        return Heart(self.label, self.params)", "        raise {error}"),
    "handler": ("        self.params = params", "        raise {error}"),
    "delivery": (
        "    def messages(self):",
        "    @property\n    def delivery(self): raise {error}\n    def messages(self):",
    ),
}
"""Where a plugin can raise before its body runs: what stands there, and what is written instead."""


@pytest.mark.parametrize(
    ("where", "error"),
    [
        *((where, "KeyError('x')") for where in BREAKAGES),
        ("import", "SystemExit(3)"),
        ("import", "KeyboardInterrupt()"),
        ("params", "SystemExit(3)"),
        ("configure", "StopIteration()"),
        ("delivery", "StopIteration()"),
    ],
)
async def test_nothing_that_a_plugin_raises_ends_the_watching(bench: Bench, where: str, error: str) -> None:
    old, new = BREAKAGES[where]
    whole = (bench.folder / "connectors/beats.py").read_text()
    broken = whole.replace(old, new.format(error=error))
    params = "{ type: heart, label: a, params: { period_s: 0.011 } }"
    line = next(number for number, text in enumerate(broken.splitlines(), 1) if f"raise {error}" in text)
    async with running(bench) as live:
        before = live.threads()
        bench.write("connectors/beats.py", broken)
        bench.connectors(params, "{ type: wheel, label: wheel }")
        await until(lambda: any(f"beats.py:{line}" in str(one) for one in bench.problems))
        assert live.threads() == before
        await word(live, "a", "tick")
        bench.write("connectors/beats.py", whole)
        bench.edit("connectors/words.py", "tick", "tock")
        await word(live, "a", "tock")


async def test_what_can_not_begin_is_told_and_the_next_save_begins_it(bench: Bench) -> None:
    """Too late to go on as before: the old one has ended."""
    whole = (bench.folder / "connectors/beats.py").read_text()
    broken = whole.replace(
        "    def messages(self):", "    def bind(self, host): raise KeyError('x')\n    def messages(self):"
    )
    async with running(bench) as live:
        await word(live, "a", "tick")
        before = live.threads()
        bench.write("connectors/beats.py", broken)
        await until(
            lambda: any("beats.py:19: a can't begin, and stands: KeyError" in str(one) for one in bench.problems)
        )
        assert live.threads()["wheel"] is before["wheel"]
        bench.write("connectors/beats.py", whole)
        bench.edit("connectors/words.py", "tick", "tock")
        await word(live, "a", "tock")


async def test_a_change_that_is_odd_is_hinted_at_once(bench: Bench, caplog: pytest.LogCaptureFixture) -> None:
    def hints() -> list[str]:
        return [one.getMessage() for one in caplog.records if one.getMessage().startswith("hint: ")]

    async with running(bench) as live:
        bench.connectors("{ type: heart, label: B-e }", "{ type: wheel, label: wheel }")
        await until(lambda: "B-e" in live.labels())
        (told,) = hints()
        assert told.startswith(f"hint: {bench.file}:3: connectors[0].label: the label 'B-e' is not snake_case")
        bench.write("mosaic_config.yaml", "# moved\n" + bench.file.read_text() + "  - { type: heart, label: c }\n")
        await until(lambda: "c" in live.labels())
        assert hints() == [told]
