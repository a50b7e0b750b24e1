"""A running robot whose data is recorded beside its camera: what went over the wire is in the file, and lines up."""

from __future__ import annotations

import asyncio
import json
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from support.mcap_files import messages_in, value_of, whole_messages_in

from mosaic_camera.pattern import TestPatternConfigurer
from mosaic_core import (
    DataChannelConfigurer,
    DataChannelReceivable,
    DataChannelSendable,
    NoParams,
    Refused,
)
from mosaic_core.adapters.video.shared_video import SharedVideo
from mosaic_core.laboratory import joining, memory_network
from mosaic_core.messages import Pose, Twist
from mosaic_core.runtime.delivery import data_tap
from mosaic_core.testing import Joined, connector, joined
from mosaic_recorder.data.data_file import DataFile
from mosaic_recorder.recorder import RecorderConfigurer

FPS = 20


@pytest.fixture(autouse=True)
def _real_encoders(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(memory_network, "plain_streams", lambda prepare: SharedVideo)


class Walk(DataChannelSendable[Pose]):
    """Sends poses while somebody listens, and keeps what it sent."""

    runs = "watched"

    def messages(self) -> Iterator[Pose]:
        for number, _ in enumerate(self.every(0.02)):  # a tick that comes late is left out, no pose
            yield Pose.model_validate({"position": {"x": number / 10, "y": 0.0}})


class WalkConfigurer(DataChannelConfigurer[NoParams]):
    connector_type = "walk"

    def configure(self) -> Walk:
        return Walk(self.label)


class Wheels(DataChannelReceivable[Twist]):
    def handle_data(self, data: Twist) -> None:
        if data.linear.x > 1:
            raise Refused("safety.stopped", "too fast")


class WheelsConfigurer(DataChannelConfigurer[NoParams]):
    connector_type = "wheels"

    def configure(self) -> Wheels:
        return Wheels(self.label)


def robot(folder: Path, **params: Any) -> list[Any]:
    wanted = {"labels": ["front"], "data": "all", "directory": str(folder), "min_free_bytes": 0, **params}
    return [
        connector(TestPatternConfigurer, label="front", params={"width": 320, "height": 240, "fps": FPS}),
        connector(WalkConfigurer, label="pose"),
        connector(WheelsConfigurer, label="wheels"),
        connector(RecorderConfigurer, label="recorder", params=wanted),
    ]


async def rows(link: Joined, *words: Any, until: Any) -> dict[str, Any]:
    """The recordings by label, after these commands, once they are as wanted."""
    store = link.connection.bidirectional("recorder")
    await store.wait_open()
    for word in words:
        assert store.send_json(word)
    while True:
        news = json.loads((await store.next_message()).data)
        found = {row["label"]: row for row in news.get("recordings", ())}
        if news["type"] == "status" and until(found):
            return found


async def test_what_is_sent_and_commanded_is_in_the_file_and_lines_up_with_the_movie(
    studio: Any, tmp_path: Path
) -> None:
    async with joined(*robot(tmp_path)) as link:
        begun_ns = time.time_ns()
        await rows(link, {"command": "start"}, until=lambda found: found and found["data"]["state"] == "recording")
        wheels = link.connection.sendable("wheels")
        await wheels.wait_open()
        for speed in (0.5, 5.0):
            assert wheels.send_json({"linear": {"x": speed}})
        await rows(link, until=lambda found: found["front"]["pictures"] > FPS and found["data"]["messages"] > 50)
        ended = await rows(link, {"command": "stop"}, until=lambda found: found["data"]["state"] == "ended" == found["front"]["state"])  # noqa: E501  # fmt: skip
    (data_name,), (movie_name,) = ended["data"]["files"], ended["front"]["files"]
    assert data_name.endswith("_data.mcap")
    found = messages_in(tmp_path / data_name)
    poses = [one for one in found if one.topic == "pose"]
    assert poses[0].schema == Pose.schema_id
    numbers = [round(value_of(one)["position"]["x"] * 10) for one in poses]
    assert numbers == list(range(numbers[0], numbers[0] + len(numbers)))
    assert all(begun_ns <= one.publish_ns <= one.log_ns <= time.time_ns() for one in found)
    assert [value_of(one)["linear"]["x"] for one in found if one.topic == "wheels"] == [0.5]
    notes = [value_of(one) for one in found if one.topic == "_commands"]
    assert [(one["label"], one["accepted"], one["code"]) for one in notes] == [
        ("wheels", True, ""), ("wheels", False, "safety.stopped"),
    ]  # fmt: skip
    assert not [one for one in found if one.topic.startswith("recorder")]
    assert ended["data"]["messages"] == len(poses) + 2
    (stretch,) = [value_of(one) for one in found if one.topic == "_movies"]
    movie = studio.watched(tmp_path / movie_name)
    assert (stretch["file"], stretch["at_s"]) == (movie_name, 0.0)
    # the marks carry the robot's monotonic clock: where the note says that the first picture was captured, it was
    zero_s = stretch["captured_at_ns"] / 1e9 - movie.captured_s[0]
    assert zero_s == pytest.approx(time.time() - time.monotonic(), abs=0.05)


async def test_named_connectors_alone_are_recorded_and_a_sleeping_one_is_woken(tmp_path: Path) -> None:
    async with joined(*robot(tmp_path, labels=[], data=["pose"])) as link:
        (walk,) = link.configured.connectors[1].handlers
        assert not walk.is_heard
        ended = await rows(link, {"command": "start", "max_seconds": 0.5}, until=lambda found: found and found["data"]["code"])  # noqa: E501  # fmt: skip
        await joining.until(lambda: not walk.is_heard)
    assert ended["data"]["code"] == "recorder.max_seconds"
    found = messages_in(tmp_path / ended["data"]["files"][0])
    assert {one.topic for one in found} == {"pose"}


async def test_a_disk_that_hangs_holds_nobody_up_and_the_loss_is_counted(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    works, write = threading.Event(), DataFile.write

    def hanging(file: DataFile, *words: Any) -> None:
        assert works.wait(60)
        write(file, *words)

    monkeypatch.setattr(DataFile, "write", hanging)
    monkeypatch.setattr(data_tap, "MAX_WAITING_BYTES", 3000)
    async with joined(*robot(tmp_path, labels=[])) as link:
        await rows(link, {"command": "start"}, until=lambda found: found and found["data"]["state"] == "recording")
        pose = link.connection.receivable("pose")
        async with asyncio.timeout(20):
            for _ in range(20):  # operators get theirs meanwhile
                await pose.next_message()
        works.set()
        await rows(link, until=lambda found: found["data"]["dropped"] > 0 and found["data"]["messages"] > 10)
    (path,) = tmp_path.iterdir()
    numbers = [round(value_of(one)["position"]["x"] * 10) for one in messages_in(path) if one.topic == "pose"]
    assert numbers == sorted(set(numbers))
    assert len(numbers) < numbers[-1] - numbers[0] + 1


ROBOT = """
import asyncio, runpy, sys
from pathlib import Path
from mosaic_core.testing import joined
sys.path.insert(0, sys.argv[3])
tests = runpy.run_path(sys.argv[1])

async def main():
    async with joined(*tests["robot"](Path(sys.argv[2]), labels=[])) as link:
        start = {"command": "start"}
        row = await tests["rows"](link, start, until=lambda found: found and found["data"]["messages"] > 120)
        print(row["data"]["files"][0], row["data"]["messages"], flush=True)
        await asyncio.Event().wait()

asyncio.run(main())
"""


def test_a_robot_that_is_killed_leaves_a_file_that_can_be_read(tmp_path: Path) -> None:
    tests = str(Path(__file__).parents[3] / "tests")
    words = [sys.executable, "-c", ROBOT, __file__, str(tmp_path), tests]
    with subprocess.Popen(words, stdout=subprocess.PIPE, text=True) as killed:
        try:
            assert killed.stdout is not None
            name, messages = killed.stdout.readline().split()
        finally:
            killed.kill()
        assert killed.wait() == -signal.SIGKILL
    found = whole_messages_in(tmp_path / name)
    assert len(found) >= int(messages) - 60  # at 50 in a second, at most the last second is missing
