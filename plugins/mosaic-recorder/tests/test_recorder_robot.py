"""A running robot with real encoders, a test pattern and a recorder; no network, no camera."""

from __future__ import annotations

import asyncio
import json
import signal
import subprocess
import sys
import threading
from collections.abc import Iterator
from itertools import pairwise
from pathlib import Path
from typing import Any

import av
import numpy as np
import pytest

from mosaic_camera.marks import draw_marks
from mosaic_camera.pattern import TestPatternConfigurer
from mosaic_core import Captured, MediaTrackConfigurer, MediaTrackHandler, NoParams
from mosaic_core.adapters.video.shared_video import SharedVideo
from mosaic_core.laboratory import joining, memory_network
from mosaic_core.runtime.media import media_tap
from mosaic_core.testing import Joined, connector, joined
from mosaic_recorder.movie_file import MovieFile
from mosaic_recorder.recorder import RecorderConfigurer

PATIENCE_S = 60.0
FPS = 20


@pytest.fixture(autouse=True)
def _real_encoders(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(memory_network, "plain_streams", lambda prepare: SharedVideo)


def pattern(**params: Any) -> Any:
    return connector(TestPatternConfigurer, label="front", params={"width": 320, "height": 240, "fps": FPS, **params})


def recorder(folder: Path, **params: Any) -> Any:
    wanted = {"labels": ["front"], "directory": str(folder), "min_free_bytes": 0, **params}
    return connector(RecorderConfigurer, label="recorder", params=wanted)


class Pad:
    """The operator's side of the recorder."""

    def __init__(self, link: Joined) -> None:
        self._store = link.connection.bidirectional("recorder")

    async def say(self, command: str, **words: Any) -> None:
        await self._store.wait_open()
        assert self._store.send_json({"command": command, **words})

    async def hear(self, kind: str) -> Any:
        while True:
            news = json.loads((await self._store.next_message()).data)
            if news["type"] == kind:
                return news

    async def row(self, **wanted: Any) -> Any:
        """The camera's recording, once it is as wanted; ``pictures`` and ``files`` (a count) at least."""
        while True:
            for row in (await self.hear("status"))["recordings"]:
                counts = {"pictures": row["pictures"], "files": len(row["files"])}
                if all(
                    counts[name] >= value if name in counts else row[name] == value for name, value in wanted.items()
                ):
                    return row


def camera_pictures(link: Joined) -> int:
    """How many were encoded."""
    return link.robot.snapshot().connectors[0].messages


def assert_smooth(movie: Any) -> None:
    """Every picture readable, none twice, at its time of capture."""
    assert None not in movie.numbers
    assert all(later > earlier for earlier, later in pairwise(movie.numbers))
    assert all(later > earlier for earlier, later in pairwise(movie.times_s))


@pytest.mark.parametrize(("container", "codec"), [("mp4", "h264"), ("mkv", "vp8")])
async def test_what_the_camera_shows_is_in_the_file(studio: Any, tmp_path: Path, container: str, codec: str) -> None:
    rows: list[Any] = []

    async with joined(pattern(), recorder(tmp_path, container=container, codec=codec)) as link:
        pad = Pad(link)
        await pad.say("start")
        await pad.row(pictures=2 * FPS)
        await pad.say("stop")
        rows.append(await pad.row(state="ended"))
    (row,) = rows
    assert (row["code"], row["width"], row["height"], row["dropped"]) == ("", 320, 240, 0)
    (name,) = row["files"]  # though the encoder begins anew once it knows how many pictures come
    movie = studio.watched(tmp_path / name)
    assert movie.codec == codec
    assert len(movie.numbers) == row["pictures"]
    assert_smooth(movie)
    assert movie.duration_s == pytest.approx(row["seconds"], abs=1 / FPS)
    # The marks tell when each picture was captured, in tenths of a millisecond.
    assert np.diff(movie.times_s) == pytest.approx(np.diff(movie.captured_s), abs=0.0015)


async def test_a_pause_lets_the_camera_rest_and_the_file_goes_on_with_a_key_frame(studio: Any, tmp_path: Path) -> None:
    rows: list[Any] = []

    async with joined(pattern(), recorder(tmp_path)) as link:
        pad = Pad(link)
        await pad.say("start")
        await pad.row(pictures=FPS // 2)
        await pad.say("pause")
        paused = await pad.row(state="paused")
        await joining.until(lambda: link.robot.snapshot().connectors[0].peers == 0)
        await pad.say("resume")
        await pad.row(pictures=paused["pictures"] + FPS // 2)
        await pad.say("stop")
        rows.append(await pad.row(state="ended"))
    movie = studio.watched(tmp_path / rows[0]["files"][0])
    assert len(movie.numbers) == rows[0]["pictures"]
    assert movie.keys >= 2
    assert movie.duration_s == pytest.approx(rows[0]["seconds"], abs=1 / FPS)
    assert all(later > earlier for earlier, later in pairwise(movie.times_s))


async def test_key_frames_come_as_often_as_configured(studio: Any, tmp_path: Path) -> None:
    rows: list[Any] = []

    async with joined(pattern(), recorder(tmp_path, key_interval_s=0.5)) as link:
        pad = Pad(link)
        await pad.say("start", max_seconds=3)
        rows.append(await pad.row(state="ended"))
    assert rows[0]["code"] == "recorder.max_seconds"
    movie = studio.watched(tmp_path / rows[0]["files"][0])
    assert movie.duration_s <= 3.001
    assert movie.keys >= 3
    assert_smooth(movie)


class Growing(MediaTrackHandler):
    """A source that changes its size when it is told to."""

    def __init__(self, label: str) -> None:
        super().__init__(label)
        self.is_grown = threading.Event()

    def frames(self) -> Iterator[Captured]:
        for number in self.every(1 / FPS):
            width, height = (640, 480) if self.is_grown.is_set() else (320, 240)
            image = np.full((height, width, 3), 90, dtype=np.uint8)
            draw_marks(image, number, self.monotonic_s())
            yield Captured(image, self.monotonic_s())


class GrowingConfigurer(MediaTrackConfigurer[NoParams]):
    connector_type = "growing"

    def configure(self) -> Growing:
        return Growing(self.label)


async def test_a_source_that_changes_its_size_is_recorded_into_another_file(studio: Any, tmp_path: Path) -> None:
    rows: list[Any] = []

    async with joined(connector(GrowingConfigurer, label="front"), recorder(tmp_path)) as link:
        pad = Pad(link)
        (growing,) = link.configured.connectors[0].handlers
        assert isinstance(growing, Growing)
        await pad.say("start")
        await pad.row(pictures=FPS // 2)
        growing.is_grown.set()
        before = await pad.row(files=2)
        await pad.row(pictures=before["pictures"] + FPS // 2)
        await pad.say("stop")
        rows.append(await pad.row(state="ended"))
    first, second = (studio.watched(tmp_path / name) for name in rows[0]["files"])
    assert (rows[0]["width"], rows[0]["height"]) == (640, 480)
    assert len(first.numbers) + len(second.numbers) == rows[0]["pictures"]
    assert_smooth(first)
    assert_smooth(second)
    # While the new size's first picture is encoded, the old size goes on: the pictures in between may be in both files.
    assert first.numbers[0] < second.numbers[0]
    assert first.numbers[-1] < second.numbers[-1]


async def test_a_still_is_taken_and_sent_while_nobody_records(tmp_path: Path) -> None:
    async with joined(pattern(width=640, height=480), recorder(tmp_path)) as link:
        pad = Pad(link)
        await pad.say("snapshot", send=True, request_id="1")
        taken = await pad.hear("snapshot")
        assert (taken["width"], taken["height"], taken["code"]) == (640, 480, "")
        assert taken["png_base64"]
        assert (tmp_path / taken["file"]).stat().st_size == taken["bytes"]


class NoiseHandler(MediaTrackHandler):
    """One picture again and again, in one buffer: noise, of which an encoder leaves little."""

    def frames(self) -> Iterator[Any]:
        buffer = np.zeros((48, 64, 3), np.uint8)
        while not self.is_stopping:
            buffer[:] = noise()
            yield buffer
            buffer[:] = 0
            self.sleep(1 / FPS)


class NoiseConfigurer(MediaTrackConfigurer[NoParams]):
    connector_type = "noise-camera"

    def configure(self) -> NoiseHandler:
        return NoiseHandler(self.label)


def noise() -> Any:
    return np.random.default_rng(3).integers(0, 256, (48, 64, 3), dtype=np.uint8)


async def test_a_still_is_what_the_camera_saw_not_what_an_encoder_left_of_it(tmp_path: Path) -> None:
    async with joined(connector(NoiseConfigurer, label="front"), recorder(tmp_path)) as link:
        pad = Pad(link)
        await pad.say("snapshot")
        taken = await pad.hear("snapshot")
        with av.open(str(tmp_path / taken["file"])) as file:
            image = next(file.decode(video=0)).to_ndarray(format="bgr24")
        assert np.array_equal(image, noise())


async def test_an_observer_reads_the_news_but_may_not_record(tmp_path: Path) -> None:
    async with joined(pattern(), recorder(tmp_path)) as link:
        visitor = await link.another_operator("Eve", role="observer")
        refused: asyncio.Queue[str] = asyncio.Queue()
        visitor.on_refusal(lambda refusal: refused.put_nowait(refusal.code))
        store = visitor.bidirectional("recorder")
        news = json.loads((await store.next_message()).data)
        assert (news["type"], news["state"]) == ("status", "idle")
        store.send_json({"command": "start"})
        assert await refused.get() == "lease.forbidden"
    assert list(tmp_path.iterdir()) == []


async def test_a_disk_that_hangs_holds_nobody_up_and_the_recording_goes_on_with_a_key_frame(
    studio: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    works = threading.Event()
    works.set()
    write = MovieFile.write

    def hanging(file: MovieFile, *args: Any, **words: Any) -> None:
        assert works.wait(PATIENCE_S)
        write(file, *args, **words)

    monkeypatch.setattr(MovieFile, "write", hanging)
    monkeypatch.setattr(media_tap, "MAX_WAITING_BYTES", 20_000)
    rows: list[Any] = []

    async with joined(pattern(), recorder(tmp_path)) as link:
        pad = Pad(link)
        await pad.say("start")
        await pad.row(pictures=FPS // 2)
        works.clear()
        before = camera_pictures(link)
        await joining.until(lambda: camera_pictures(link) >= before + 3 * FPS)  # more than the tap may keep
        await pad.say("status")
        held = await pad.row(state="recording")
        works.set()
        await pad.row(pictures=held["pictures"] + 3 * FPS)
        await pad.say("stop")
        rows.append(await pad.row(state="ended"))
    assert rows[0]["dropped"] > 0
    movie = studio.watched(tmp_path / rows[0]["files"][0])
    assert len(movie.numbers) == rows[0]["pictures"]
    assert movie.keys >= 2
    assert_smooth(movie)
    gap = int(np.argmax(np.diff(movie.numbers)))
    assert np.diff(movie.numbers)[gap] >= FPS // 2
    assert np.diff(movie.times_s)[gap] == pytest.approx(np.diff(movie.captured_s)[gap], abs=0.0015)


async def test_a_robot_that_stops_finishes_its_files(studio: Any, tmp_path: Path) -> None:
    async with joined(pattern(), recorder(tmp_path)) as link:
        pad = Pad(link)
        await pad.say("start")
        await pad.row(pictures=FPS)
    (path,) = tmp_path.iterdir()
    movie = studio.watched(path)
    assert len(movie.numbers) >= FPS
    assert_smooth(movie)


ROBOT = """
import asyncio, runpy, sys
from pathlib import Path
from mosaic_core.adapters.video.shared_video import SharedVideo
from mosaic_core.laboratory import memory_network
from mosaic_core.testing import joined
memory_network.plain_streams = lambda prepare: SharedVideo
tests = runpy.run_path(sys.argv[1])

async def main():
    async with joined(tests["pattern"](), tests["recorder"](Path(sys.argv[2]))) as link:
        pad = tests["Pad"](link)
        await pad.say("start")
        row = await pad.row(pictures=3 * tests["FPS"])
        print(row["files"][0], flush=True)
        await asyncio.Event().wait()

asyncio.run(main())
"""


def test_a_robot_that_is_killed_leaves_a_file_that_plays(studio: Any, tmp_path: Path) -> None:
    words = [sys.executable, "-c", ROBOT, __file__, str(tmp_path)]
    with subprocess.Popen(words, stdout=subprocess.PIPE, text=True) as robot:
        try:
            assert robot.stdout is not None
            name = robot.stdout.readline().strip()
        finally:
            robot.kill()
        assert robot.wait() == -signal.SIGKILL
    movie = studio.watched(tmp_path / name)
    assert len(movie.numbers) >= FPS  # of three seconds, at most the last two are missing
    assert_smooth(movie)
