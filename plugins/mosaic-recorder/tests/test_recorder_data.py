"""The file of data: every byte comes back, with its time, its shape and its sender, whatever the disk does."""

from __future__ import annotations

import errno
import json
from collections.abc import Callable
from itertools import count
from pathlib import Path
from typing import Any

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from support.mcap_files import messages_in, schemas_in, value_of, whole_messages_in, words_in

from mosaic_core import MosaicDataType
from mosaic_core.contract.data_tap import TappedChannel, TappedMessage
from mosaic_core.contract.host import Sender
from mosaic_core.machines.delivery.framing import PayloadKind
from mosaic_core.messages import Pose, Twist
from mosaic_recorder.data.data_file import DataFile
from mosaic_recorder.data.data_recording import DataRecording
from mosaic_recorder.data.data_writer import COMMANDS, MAX_REFUSED_BYTES, MOVIES, DataWriter
from mosaic_recorder.data.movie_log import MovieLog, MovieStretch
from mosaic_recorder.disk_file import DiskFile
from mosaic_recorder.recording import Limits
from mosaic_recorder.robot_clock import RobotClock

CLOCK = RobotClock(zero_ns=1_700_000_000_000_000_000)
ANN = Sender("p1", "s1", "u-1", "Ann")
CHANNELS = (
    TappedChannel("pose", "sim-pose", MosaicDataType.JSON_R2U, Pose.schema_id, Pose.model_json_schema()),
    TappedChannel("cmd_vel", "cmd-vel", MosaicDataType.JSON_U2R, Twist.schema_id, Twist.model_json_schema()),
    TappedChannel("survey", "sim-survey", MosaicDataType.JSON_BI, "", {"type": "object", "title": "Question"}),
    TappedChannel("cloud", "point-cloud", MosaicDataType.BYTE_R2U),
    TappedChannel("words", "log", MosaicDataType.STRING_R2U),
)


def message(label: str, payload: bytes = b"{}", at_s: float = 10.0, **more: Any) -> TappedMessage:
    kind = {"cloud": PayloadKind.BYTES, "words": PayloadKind.STRING}.get(label, PayloadKind.JSON)
    return TappedMessage(label, kind, payload, at_s, at_s + 0.002, **more)


def writer_into(path: Path) -> DataWriter:
    return DataWriter("recorder", lambda: path, lambda gone: None, CLOCK)


def written(path: Path, *messages: TappedMessage) -> DataWriter:
    writer = writer_into(path)
    writer.open(CHANNELS)
    for one in messages:
        writer.add(one)
    writer.close()
    return writer


def test_a_channel_has_the_label_the_schema_id_and_the_schema_of_its_connector(tmp_path: Path) -> None:
    path = tmp_path / "a.mcap"
    payload = b'{"position":{"x":1.0,"y":2.0}}'
    written(path, message("pose", payload), message("words", "ö".encode()), message("cloud", b"\x00\xff"))
    pose, words, cloud = messages_in(path)
    assert (pose.topic, pose.encoding, pose.schema, pose.payload) == ("pose", "json", "mosaic/Pose@1", payload)
    assert json.loads(schemas_in(path)["mosaic/Pose@1"]) == Pose.model_json_schema()
    assert (words.encoding, words.schema, words.payload.decode()) == ("text/plain", "", "ö")
    assert (cloud.encoding, cloud.payload) == ("application/octet-stream", b"\x00\xff")


def test_times_are_the_robots_clock_moved_to_wall_time(tmp_path: Path) -> None:
    path = tmp_path / "a.mcap"
    written(path, message("pose", at_s=10.5))
    (pose,) = messages_in(path)
    assert pose.publish_ns == CLOCK.zero_ns + 10_500_000_000
    assert pose.log_ns == CLOCK.zero_ns + 10_502_000_000
    assert words_in(path, "mosaic")["zero_ns"] == str(CLOCK.zero_ns)


def test_the_clock_of_this_robot_is_wall_time_now() -> None:
    import time

    assert abs(RobotClock().wall_ns(time.monotonic()) - time.time_ns()) < 1_000_000_000


def test_a_command_is_there_with_who_sent_it_and_a_refused_one_only_in_its_note(tmp_path: Path) -> None:
    path = tmp_path / "a.mcap"
    refused = message("cmd_vel", b"\xff" * 5000, sender=ANN, code="safety.stopped", gate="stop")
    written(path, message("cmd_vel", b'{"linear":{"x":1}}', sender=ANN), refused)
    (command,) = messages_in(path, "cmd_vel")
    assert (command.payload, command.schema) == (b'{"linear":{"x":1}}', "mosaic/Twist@1")
    done, not_done = map(value_of, messages_in(path, COMMANDS))
    assert (done["accepted"], done["sequence"], done["operator"], done["operator_id"]) == (True, 1, "Ann", "u-1")
    assert (not_done["accepted"], not_done["code"], not_done["gate"]) == (False, "safety.stopped", "stop")
    assert len(not_done["refused"]) == MAX_REFUSED_BYTES
    assert "sequence" not in not_done


def test_what_goes_both_ways_has_a_topic_for_each(tmp_path: Path) -> None:
    path = tmp_path / "a.mcap"
    written(path, message("survey", b'{"q":1}', sender=ANN), message("survey", b'{"a":1}'))
    question, answer = (one for one in messages_in(path) if one.topic != COMMANDS)
    assert (question.topic, question.payload) == ("survey/commands", b'{"q":1}')
    assert (answer.topic, answer.payload, answer.schema) == ("survey", b'{"a":1}', "")
    assert question.schema == "sim-survey/survey/commands"


def test_a_movie_is_aligned_by_its_notes(tmp_path: Path) -> None:
    path = tmp_path / "a.mcap"
    log = MovieLog()
    log.add(MovieStretch("front", "old.mp4", 0.0, 1.0))
    log.add(MovieStretch("front", "a.mp4", 0.0, 5.0))
    news = log.reader(lambda file: file == "a.mp4")
    writer = writer_into(path)
    writer.open(CHANNELS)
    stretches = news()
    log.add(MovieStretch("front", "a.mp4", 2.5, 60.0))
    for stretch in (*stretches, *news(), *news()):
        writer.note(stretch, 61.0)
    writer.close()
    first, second = map(value_of, messages_in(path, MOVIES))
    assert first == {"label": "front", "file": "a.mp4", "at_s": 0.0, "captured_at_ns": CLOCK.zero_ns + 5_000_000_000}
    assert (second["at_s"], second["captured_at_ns"]) == (2.5, CLOCK.zero_ns + 60_000_000_000)


Messages = st.lists(
    st.tuples(st.sampled_from([one.label for one in CHANNELS]), st.binary(max_size=300), st.floats(0, 1e6)), max_size=40
)


@given(Messages, st.sets(st.integers(0, 40)))
@settings(max_examples=40, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
def test_whatever_is_recorded_comes_back_byte_for_byte_within_what_was_foretold(
    tmp_path: Path, given_messages: list[tuple[str, bytes, float]], flushes: set[int]
) -> None:
    path = tmp_path / "any.mcap"
    path.unlink(missing_ok=True)
    writer = writer_into(path)
    writer.open(CHANNELS)
    for number, (label, payload, at_s) in enumerate(given_messages):
        foretold = writer.size_bytes_with(message(label, payload, at_s))
        writer.add(message(label, payload, at_s))
        assert writer.size_bytes <= foretold
        if number in flushes:
            writer.flush()
    foretold = writer.size_bytes
    writer.close()
    assert path.stat().st_size <= foretold
    read = [(one.topic, one.payload, one.publish_ns) for one in messages_in(path)]
    assert sorted(read) == sorted((label, payload, CLOCK.wall_ns(at_s)) for label, payload, at_s in given_messages)


def test_what_was_flushed_is_readable_whatever_byte_is_the_last(tmp_path: Path) -> None:
    path, cut = tmp_path / "a.mcap", tmp_path / "cut.mcap"
    writer = writer_into(path)
    writer.open(CHANNELS)
    sizes = []
    for number in range(5):
        writer.add(message("pose", b'{"n":%d}' % number))
        writer.flush()
        sizes.append(path.stat().st_size)
    writer.close()
    whole = path.read_bytes()
    for size in range(sizes[0], len(whole), 7):
        cut.write_bytes(whole[:size])
        assert len(whole_messages_in(cut)) >= sum(one <= size for one in sizes)


class Full(DiskFile):
    """A disk with room for a few kilobytes."""

    room_bytes = 6000

    def write(self, data: bytes) -> int:
        if self.failure is None and self.tell() + len(data) > self.room_bytes:
            self._file.write(data[:100])
            self.failure = OSError(errno.ENOSPC, "No space left on device")
        return super().write(data)


def test_a_full_disk_ends_it_and_what_fitted_is_whole(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("mosaic_recorder.data.data_file.DiskFile", Full)
    path = tmp_path / "a.mcap"
    writer = writer_into(path)
    writer.open(CHANNELS)

    def fill() -> None:
        for number in count():
            writer.add(message("cloud", bytes(str(number), "ascii") * 50))
            writer.flush()

    with pytest.raises(OSError, match="No space left"):
        fill()
    writer.close()
    found = whole_messages_in(path)
    assert len(found) > 5
    assert [one.payload for one in found] == [bytes(str(number), "ascii") * 50 for number in range(len(found))]


def test_a_disk_without_room_for_the_beginning_leaves_nothing_open(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(Full, "room_bytes", 4)
    monkeypatch.setattr("mosaic_recorder.data.data_file.DiskFile", Full)
    with pytest.raises(OSError, match="No space left"):
        DataFile(tmp_path / "a.mcap")
    released: list[Path] = []
    writer = DataWriter("recorder", lambda: tmp_path / "b.mcap", released.append, CLOCK)
    with pytest.raises(OSError, match="No space left"):
        writer.open(CHANNELS)
    assert released == [tmp_path / "b.mcap"]
    writer.close()


class Tap:
    """Gives its messages, then does what the test wants."""

    def __init__(self, *messages: TappedMessage, failure: str = "", dropped: int = 0) -> None:
        self.channels = CHANNELS
        self.dropped = dropped
        self.failure = failure
        self._messages = list(messages)
        self.then: Callable[[], object] = lambda: None

    def next(self, timeout_s: float) -> TappedMessage | None:
        if self._messages:
            return self._messages.pop(0)
        self.then()
        return None

    def __enter__(self) -> Tap:
        return self

    def __exit__(self, *_: object) -> None:
        """Nothing is held."""


class Stage:
    """A recording of data that is run on the test's own thread, to its end."""

    def __init__(self, path: Path, *taps: Tap, limits: Limits | None = None, disk: str = "") -> None:
        waiting = list(taps)
        seconds = count(0.0, 0.5)
        self.told: list[str] = []
        self.recording = DataRecording(
            lambda: waiting.pop(0), writer_into(path), limits or Limits(), check_disk=lambda: disk,
            clock=lambda: next(seconds), changed=lambda: self.told.append(self.recording.status().state),
        )  # fmt: skip
        for tap in taps:
            tap.then = lambda: self.recording.wish("stop")

    def run(self) -> Any:
        self.recording.run()
        return self.recording.status()


def test_it_records_until_it_is_stopped(tmp_path: Path) -> None:
    stage = Stage(tmp_path / "a.mcap", Tap(message("pose"), message("pose")))
    row = stage.run()
    assert (row.kind, row.label, row.state, row.code) == ("data", "data", "ended", "")
    assert (row.messages, row.files, row.pictures) == (2, ("a.mcap",), 0)
    assert row.bytes == (tmp_path / "a.mcap").stat().st_size
    assert stage.told == ["recording", "ended"]


def test_a_pause_goes_on_in_the_same_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    first, second = Tap(message("pose", b"1"), dropped=3), Tap(message("pose", b"2"))
    stage = Stage(tmp_path / "a.mcap", first, second)
    first.then = lambda: stage.recording.wish("pause")
    rest = stage.recording._rest
    monkeypatch.setattr(stage.recording, "_rest", lambda: (stage.recording.wish("record"), rest()))
    row = stage.run()
    assert (row.messages, row.dropped) == (2, 3)
    assert [one.payload for one in messages_in(tmp_path / "a.mcap")] == [b"1", b"2"]


@pytest.mark.parametrize(
    ("limits", "tap", "disk", "code"),
    [
        (Limits(max_seconds=5.0), Tap(*[message("pose")] * 50), "", "recorder.max_seconds"),
        (Limits(max_bytes=20_000), Tap(*[message("cloud", bytes(1000))] * 50), "", "recorder.max_bytes"),
        (Limits(), Tap(message("pose")), "recorder.disk_full", "recorder.disk_full"),
        (Limits(), Tap(failure="channel.unknown_label"), "", "channel.unknown_label"),
    ],
)
def test_it_ends_by_itself_and_says_why(tmp_path: Path, limits: Limits, tap: Tap, disk: str, code: str) -> None:
    row = Stage(tmp_path / "a.mcap", tap, limits=limits, disk=disk).run()
    assert row.code == code
    assert row.seconds <= 5.0 or limits.max_seconds is None
    assert (tmp_path / "a.mcap").stat().st_size <= (limits.max_bytes or 10**9)
    assert len(messages_in(tmp_path / "a.mcap")) == row.messages
