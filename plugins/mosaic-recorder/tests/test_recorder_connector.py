"""The connector `recorder` through the kit: commands of operators, refusals, news, stills."""

from __future__ import annotations

import base64
import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import av
import numpy as np
import pytest
from support.mcap_files import messages_in

from mosaic_core import ConfigError, MosaicDataType, OwnFolder, Sender, Shared
from mosaic_core.contract.data_tap import TappedChannel, TappedMessage
from mosaic_core.contract.media_tap import TappedImage
from mosaic_core.machines.delivery.framing import PayloadKind
from mosaic_core.testing import ANOTHER_OPERATOR, OPERATOR, From, build, fake_host, feed
from mosaic_core.words.codes import REASONS
from mosaic_recorder import desk as desk_module
from mosaic_recorder import snapshots as snapshots_module
from mosaic_recorder.params import RecorderParams, recordings_directory
from mosaic_recorder.recorder import Recorder, RecorderConfigurer

OBSERVER = Sender(peer_id="peer-9", session_id="session-9", role="observer")


class Bench:
    """A recorder whose cameras are scripted, on a robot that runs while it is entered."""

    def __init__(self, studio: Any, folder: Path, **params: Any) -> None:
        self.studio = studio
        self.folder = folder
        self.shared = Shared()
        self.taps: dict[str, list[Any]] = {}
        self.picture_taps: dict[str, list[Any]] = {}
        self.recorder: Recorder = build(
            RecorderConfigurer,
            label="recorder",
            params={"labels": ["front", "rear"], "directory": str(folder), "min_free_bytes": 0, **params},
            shared=self.shared,
        )
        self.host = fake_host(self.recorder)
        # taps that wait, instead of spinning
        self.host.tap_media = lambda label, codec: self._tap(self.taps, label)  # type: ignore[method-assign,assignment,return-value]
        self.host.tap_pictures = lambda label: self._tap(self.picture_taps, label)  # type: ignore[method-assign,assignment,return-value]

    def _tap(self, taps: dict[str, list[Any]], label: str) -> Any:
        waiting = taps.get(label)
        return waiting.pop(0) if waiting else self.studio.Tap(failure="channel.unknown_label")

    def looks(self, label: str, *images: Any, failure: str = "") -> Any:
        """The next tap of what ``label`` captures."""
        tap = self.studio.Tap([TappedImage(image, 0.0) for image in images], failure)
        self.picture_taps.setdefault(label, []).append(tap)
        return tap

    def camera(self, label: str = "front", count: int = 40, **words: Any) -> Any:
        """The next tap of ``label``."""
        tap = self.studio.Tap(self.studio.encoded(count, **words))
        self.taps.setdefault(label, []).append(tap)
        return tap

    @contextmanager
    def running(self) -> Iterator[Bench]:
        with self.shared.entered():
            yield self

    def says(self, *commands: Any) -> list[str]:
        """Codes of the refusals."""
        return [refused.code for refused in feed(self.recorder, commands).refused]

    def heard(self, kind: str) -> list[Any]:
        return [value for value in self.host.sent_values() if value["type"] == kind]

    def status(self) -> Any:
        return self.heard("status")[-1]

    def row(self, label: str = "front") -> Any:
        rows = self.heard("status")[-1]["recordings"] if self.heard("status") else []
        return next((row for row in rows if row["label"] == label), {"state": "none", "pictures": 0})

    def until(self, condition: Any) -> None:
        self.studio.until(condition)

    def recorded(self, pictures: int, label: str = "front") -> None:
        """Wait until somebody could read it in the news."""
        self.until(lambda: self.says({"command": "status"}) == [] and self.row(label)["pictures"] == pictures)


@pytest.fixture
def bench(studio: Any, tmp_path: Path) -> Iterator[Bench]:
    with Bench(studio, tmp_path / "recordings").running() as made:
        yield made


def test_it_is_announced_with_its_commands() -> None:
    assert Recorder.data_type is MosaicDataType.JSON_BI
    assert Recorder.widget == "recorder"


def test_the_commands_of_the_original_pad_are_understood(bench: Bench) -> None:
    camera = bench.camera()
    resumed = bench.camera()
    said = [{"command": word, "timestamp": 1777890615000} for word in ("start", "pause", "resume", "stop")]
    assert bench.says(said[0]) == []
    bench.recorded(40)
    assert bench.says(said[1]) == []
    bench.until(lambda: bench.row()["state"] == "paused")
    assert bench.status()["state"] == "paused"
    assert not camera.is_open
    assert bench.says(said[2]) == []
    bench.recorded(80)
    assert resumed.is_open
    assert bench.says(said[3]) == []
    bench.until(lambda: bench.row()["state"] == "ended")
    assert bench.status()["state"] == "idle"
    (name,) = bench.row()["files"]
    assert len(bench.studio.watched(bench.folder / name).numbers) == 80


def test_everybody_is_told_at_once_and_of_every_change(bench: Bench) -> None:
    bench.until(lambda: bench.heard("status"))
    assert bench.status()["state"] == "idle"
    assert bench.status()["labels"] == ["front", "rear"]
    assert bench.status()["free_bytes"] > 0
    bench.camera()
    bench.says({"command": "start", "labels": ["front"]})
    bench.until(lambda: bench.row()["state"] == "recording")
    assert {message.to for message in bench.host.sent} == {None}


def test_the_news_go_on_while_it_records(bench: Bench, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(desk_module, "STATUS_PERIOD_S", 0.02)
    bench.camera()
    bench.says({"command": "start", "labels": ["front"]})
    bench.until(lambda: bench.row()["pictures"] == 40)
    before = len(bench.heard("status"))
    bench.until(lambda: len(bench.heard("status")) >= before + 5)


def test_several_cameras_have_a_file_each(bench: Bench) -> None:
    bench.camera("front", 20)
    bench.camera("rear", 30)
    assert bench.says({"command": "start", "name": "../Hof Süd"}) == []
    bench.recorded(20, "front")
    bench.recorded(30, "rear")
    bench.says({"command": "stop"})
    bench.until(lambda: bench.row("front")["state"] == bench.row("rear")["state"] == "ended")
    for label, count in (("front", 20), ("rear", 30)):
        (name,) = bench.row(label)["files"]
        assert name.startswith("Hof-Sud_")
        assert name.endswith(f"_{label}.mp4")
        assert bench.studio.watched(bench.folder / name).numbers == list(range(count))


def test_one_camera_can_be_stopped_and_started_again_alone(bench: Bench) -> None:
    bench.camera("front", 10)
    bench.camera("rear", 10)
    bench.says({"command": "start"})
    bench.recorded(10, "rear")
    bench.recorded(10, "front")
    bench.says({"command": "stop", "labels": ["rear"]})
    bench.until(lambda: bench.row("rear")["state"] == "ended")
    bench.camera("rear", 15)
    assert bench.says({"command": "start"}) == []
    bench.recorded(15, "rear")
    assert bench.status()["state"] == "recording"
    assert len(list(bench.folder.iterdir())) == 3


@pytest.mark.parametrize("command", ["stop", "pause", "resume"])
def test_what_does_not_run_cannot_be_stopped(bench: Bench, command: str) -> None:
    assert bench.says({"command": command}) == ["recorder.not_recording"]


def test_what_runs_is_not_started_twice(bench: Bench) -> None:
    bench.camera()
    start = {"command": "start", "labels": ["front"]}
    assert bench.says(start, start) == ["recorder.already_recording"]


def test_a_camera_that_is_not_configured_is_refused_by_name(bench: Bench) -> None:
    (refused,) = feed(bench.recorder, [{"command": "start", "labels": ["back"]}]).refused
    assert refused.code == "recorder.unknown_camera"
    assert refused.message == "'back'; known: front, rear"


def test_observers_may_not_command(bench: Bench) -> None:
    assert bench.says(From(OBSERVER, {"command": "start"})) == ["lease.forbidden"]


@pytest.mark.parametrize(
    "message", [{}, {"command": "erase"}, {"command": "start", "max_bytes": 0}, {"command": "start", "labels": "front"}]
)
def test_what_is_no_command_is_refused(bench: Bench, message: Any) -> None:
    assert bench.says(message) == ["channel.invalid"]


def test_a_camera_that_the_robot_does_not_have_ends_at_once_with_a_code(bench: Bench) -> None:
    bench.says({"command": "start", "labels": ["front"]})
    bench.until(lambda: bench.row()["state"] == "ended")
    assert bench.status()["code"] == "channel.unknown_label"
    assert bench.status()["state"] == "idle"


@pytest.mark.parametrize(
    ("configured", "asked", "pictures"), [(1.0, None, 30), (None, 0.5, 15), (0.5, 1.0, 15), (1.0, 0.5, 15)]
)
def test_a_command_may_ask_for_less_than_configured_never_for_more(
    studio: Any, tmp_path: Path, configured: float | None, asked: float | None, pictures: int
) -> None:
    with Bench(studio, tmp_path, max_seconds=configured).running() as bench:
        bench.camera()
        bench.says({"command": "start", "labels": ["front"], "max_seconds": asked})
        bench.until(lambda: bench.row()["state"] == "ended")
        assert (bench.row()["code"], bench.row()["pictures"]) == ("recorder.max_seconds", pictures)


def test_when_the_robot_stops_every_file_is_finished(studio: Any, tmp_path: Path) -> None:
    with Bench(studio, tmp_path).running() as bench:
        bench.camera("front", 50)
        bench.says({"command": "start", "labels": ["front"]})
        bench.recorded(50)
    (path,) = tmp_path.iterdir()
    movie = studio.watched(path)
    assert movie.numbers == list(range(50))
    assert movie.duration_s == pytest.approx(50 / 30, abs=0.002)


# -- the disk ------------------------------------------------------------------------------------------------------


def with_free_bytes(monkeypatch: pytest.MonkeyPatch, *left: int) -> None:
    """The disk has so much left, one figure after the other, and then the last one."""
    figures = list(left)
    monkeypatch.setattr(
        shutil, "disk_usage", lambda path: SimpleNamespace(free=figures.pop(0) if len(figures) > 1 else figures[0])
    )


def test_a_full_disk_refuses_recordings_and_stills(
    studio: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    with_free_bytes(monkeypatch, 999)
    with Bench(studio, tmp_path, min_free_bytes=1000).running() as bench:
        bench.camera()
        assert bench.says({"command": "start", "labels": ["front"]}) == ["recorder.disk_full"]
        assert bench.says({"command": "snapshot", "labels": ["front"]}) == []
        bench.until(lambda: bench.heard("snapshot"))
        assert bench.heard("snapshot")[0]["code"] == "recorder.disk_full"
    assert list(tmp_path.iterdir()) == []


def test_a_disk_that_fills_up_ends_the_recording(studio: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    with Bench(studio, tmp_path, min_free_bytes=1000).running() as bench:
        bench.until(lambda: bench.heard("status"))
        tap = bench.camera("front", 10)
        bench.says({"command": "start", "labels": ["front"]})
        bench.recorded(10)
        with_free_bytes(monkeypatch, 999)
        assert tap.is_open
        bench.until(lambda: bench.row()["state"] == "ended")
        assert bench.row()["code"] == "recorder.disk_full"
        (path,) = tmp_path.iterdir()
        assert studio.watched(path).numbers == list(range(10))


def test_a_folder_that_cannot_be_made_ends_the_recording_with_a_code(studio: Any, tmp_path: Path) -> None:
    (tmp_path / "file").write_text("no folder")
    with Bench(studio, tmp_path / "file" / "recordings").running() as bench:
        bench.camera()
        assert bench.says({"command": "start", "labels": ["front"]}) == []
        bench.until(lambda: bench.row()["state"] == "ended")
        assert bench.row()["code"] == "recorder.write_failed"


def test_a_disk_that_is_plugged_in_again_is_recorded_on(studio: Any, tmp_path: Path) -> None:
    disk = tmp_path / "disk"
    disk.write_text("nothing is mounted here")
    with Bench(studio, disk / "recordings").running() as bench:
        bench.camera()
        assert bench.says({"command": "start", "labels": ["front"]}) == []
        bench.until(lambda: bench.row().get("code") == "recorder.write_failed")
        disk.unlink()
        disk.mkdir()
        bench.camera()
        assert bench.says({"command": "start", "labels": ["front"]}) == []
        bench.until(lambda: bench.row()["pictures"] > 0)
        assert bench.says({"command": "stop"}) == []
        bench.until(lambda: bench.row()["state"] == "ended")
        assert bench.row()["code"] == ""
        assert [path.name for path in (disk / "recordings").iterdir()] == bench.row()["files"]


def test_a_disk_that_cannot_be_asked_refuses_and_is_told_as_null(bench: Bench, monkeypatch: pytest.MonkeyPatch) -> None:
    def fails(path: Path) -> None:
        raise OSError(5, "Input/output error")

    monkeypatch.setattr(shutil, "disk_usage", fails)
    assert bench.says({"command": "start"}, {"command": "status"}) == ["recorder.write_failed"]
    bench.until(lambda: bench.status()["free_bytes"] is None)


def test_the_oldest_files_go_while_a_new_one_is_recorded(studio: Any, tmp_path: Path) -> None:
    for number in range(4):
        (tmp_path / f"old_20260101_00000{number}_front.mp4").write_bytes(b"x" * 1000)
    with Bench(studio, tmp_path, keep_files=2).running() as bench:
        bench.camera()
        bench.says({"command": "start", "labels": ["front"]})
        bench.until(lambda: len(list(tmp_path.iterdir())) == 2 and bench.row()["pictures"] > 0)
        assert bench.row()["files"][0] in {path.name for path in tmp_path.iterdir()}


def test_files_are_listed_and_deleted(bench: Bench) -> None:
    bench.camera("front", 10)
    bench.says({"command": "start", "labels": ["front"]})
    bench.recorded(10)
    (name,) = bench.row()["files"]
    bench.says(From(ANOTHER_OPERATOR, {"command": "list", "request_id": "7"}))
    (listed,) = bench.heard("files")
    assert (listed["request_id"], listed["directory"]) == ("7", str(bench.folder))
    assert [(entry["name"], entry["label"], entry["is_open"]) for entry in listed["files"]] == [(name, "front", True)]
    assert [one.to for one in bench.host.sent if b'"files"' in one.payload and b"request_id" in one.payload] == [
        "peer-2"
    ]

    delete = {"command": "delete", "files": [name]}
    assert bench.says(delete) == ["recorder.file_in_use"]
    bench.says({"command": "stop"})
    bench.until(lambda: bench.row()["state"] == "ended")
    assert bench.says(delete, delete) == ["recorder.unknown_file"]
    assert bench.heard("files")[-1]["files"] == []
    assert list(bench.folder.iterdir()) == []


# -- stills --------------------------------------------------------------------------------------------------------


def captured(width: int = 640, height: int = 480) -> Any:
    """Noise: no encoder would leave it as it is."""
    return np.random.default_rng(7).integers(0, 256, (height, width, 3), dtype=np.uint8)


@pytest.mark.parametrize("send", [True, False])
def test_a_snapshot_is_stored_in_full_size_and_sent_to_who_asked(bench: Bench, send: bool) -> None:
    bench.looks("front", captured())
    command = {"command": "snapshot", "labels": ["front"], "name": "gate", "send": send, "request_id": "a"}
    assert bench.says(command) == []
    bench.until(lambda: bench.heard("snapshot"))
    (taken,) = bench.heard("snapshot")
    path = bench.folder / taken["file"]
    assert taken["file"].startswith("gate_")
    assert (taken["request_id"], taken["label"], taken["code"]) == ("a", "front", "")
    assert (taken["width"], taken["height"], taken["bytes"]) == (640, 480, path.stat().st_size)
    sent = taken["png_base64"]
    assert (sent is not None) == send
    assert not send or base64.b64decode(sent) == path.read_bytes()
    assert [one.to for one in bench.host.sent if b'"snapshot"' in one.payload] == [OPERATOR.peer_id]
    assert [one.name for one in bench.folder.iterdir()] == [path.name]


@pytest.mark.parametrize("shape", [(480, 640, 3), (481, 641, 3), (48, 64)])
def test_a_still_is_the_picture_as_it_was_captured_to_the_last_bit(bench: Bench, shape: tuple[int, ...]) -> None:
    image = np.random.default_rng(7).integers(0, 256, shape, dtype=np.uint8)
    bench.looks("front", image)
    bench.says({"command": "snapshot", "labels": ["front"]})
    bench.until(lambda: bench.heard("snapshot"))
    with av.open(str(bench.folder / bench.heard("snapshot")[0]["file"])) as file:
        stored = next(file.decode(video=0)).to_ndarray(format="gray" if len(shape) == 2 else "bgr24")
    assert np.array_equal(stored, image)


def test_a_still_of_a_camera_that_encodes_by_itself_is_one_of_its_key_frames(bench: Bench) -> None:
    bench.looks("front", failure="media.encoded_only")
    bench.camera("front", 1, size=(640, 480))
    bench.says({"command": "snapshot", "labels": ["front"]})
    bench.until(lambda: bench.heard("snapshot"))
    taken = bench.heard("snapshot")[0]
    assert (taken["width"], taken["height"], taken["code"]) == (640, 480, "")


def test_where_nothing_can_make_h264_of_it_the_key_frame_is_in_vp8(bench: Bench) -> None:
    bench.looks("front", failure="media.encoded_only")
    bench.taps["front"] = [bench.studio.Tap(failure="media.no_encoder")]
    bench.camera("front", 1, codec="vp8")
    bench.says({"command": "snapshot", "labels": ["front"]})
    bench.until(lambda: bench.heard("snapshot"))
    assert bench.heard("snapshot")[0]["file"]


def test_snapshots_can_be_taken_while_it_records(bench: Bench) -> None:
    bench.camera("front", 20)
    bench.says({"command": "start", "labels": ["front"]})
    bench.recorded(20)
    bench.looks("front", captured())
    bench.says({"command": "snapshot", "labels": ["front"]})
    bench.until(lambda: bench.heard("snapshot"))
    assert bench.heard("snapshot")[0]["file"]
    assert bench.status()["state"] == "recording"


def test_a_picture_too_large_to_send_stays_on_the_robot(bench: Bench, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(snapshots_module, "MAX_MESSAGE_BYTES", 2000)
    bench.looks("front", captured())
    bench.says({"command": "snapshot", "labels": ["front"], "send": True})
    bench.until(lambda: bench.heard("snapshot"))
    (taken,) = bench.heard("snapshot")
    assert (taken["code"], taken["png_base64"]) == ("", None)
    assert (bench.folder / taken["file"]).exists()


def test_a_camera_without_a_picture_is_said_so(bench: Bench, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(snapshots_module, "WAKE_S", 0.01)
    monkeypatch.setattr(snapshots_module, "PATIENCE_S", 0.02)
    bench.looks("front")
    bench.looks("front", np.zeros((4, 4), np.float64))
    bench.looks("front", failure="media.encoded_only")
    bench.taps["front"] = [bench.studio.Tap([replace(bench.studio.encoded(1)[0], data=b"garbage")])]
    for _ in range(3):
        bench.says({"command": "snapshot", "labels": ["front"]})
    bench.says({"command": "snapshot", "labels": ["rear"]})
    bench.until(lambda: len(bench.heard("snapshot")) == 4)
    codes = sorted(taken["code"] for taken in bench.heard("snapshot"))
    assert codes == ["channel.unknown_label", *["recorder.no_picture"] * 3]
    assert {taken["file"] for taken in bench.heard("snapshot")} == {""}


def test_too_many_snapshots_at_once_are_refused(bench: Bench) -> None:
    silent = [bench.looks("front") for _ in range(desk_module.MAX_SNAPSHOTS)]
    command = {"command": "snapshot", "labels": ["front"]}
    assert bench.says(*[command] * (len(silent) + 1)) == ["recorder.busy"]
    for tap in silent:
        tap.give(TappedImage(captured(), 0.0))
    bench.until(lambda: len(bench.heard("snapshot")) == len(silent))
    bench.looks("front", captured())
    assert bench.says(command) == []


def test_a_disk_that_takes_no_still_is_said_so(studio: Any, tmp_path: Path) -> None:
    (tmp_path / "file").write_text("no folder")
    with Bench(studio, tmp_path / "file" / "recordings").running() as bench:
        bench.looks("front", captured())
        bench.says({"command": "snapshot", "labels": ["front"]})
        bench.until(lambda: bench.heard("snapshot"))
        assert bench.heard("snapshot")[0]["code"] == "recorder.write_failed"


# -- params --------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "params",
    [
        {},
        {"labels": []},
        {"labels": ["front", "front"]},
        {"labels": ["front"], "codec": "vp8"},
        {"labels": ["front"], "container": "avi"},
        {"labels": ["front"], "max_bytes": 0},
        {"labels": ["front"], "keep_files": 0},
    ],
)
def test_params_that_cannot_be_meant_are_refused(params: dict[str, Any]) -> None:
    with pytest.raises(ConfigError):
        build(RecorderConfigurer, params=params)


def test_recordings_belong_where_the_system_keeps_data(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    params = RecorderParams(labels=("front",))
    monkeypatch.setenv("MOSAIC_DATA_DIR", str(tmp_path))
    assert recordings_directory(params, "cam_recorder") == tmp_path / "recordings" / "cam_recorder"
    monkeypatch.delenv("MOSAIC_DATA_DIR")
    assert recordings_directory(params, "cam_recorder").parts[-3:] == ("mosaic", "recordings", "cam_recorder")
    monkeypatch.setenv("HOME", str(tmp_path))
    named = RecorderParams(labels=("front",), directory=OwnFolder("~/films"))
    assert named == RecorderParams(labels=("front",), directory=Path("~/films"))  # type: ignore[arg-type]
    assert recordings_directory(named, "cam_recorder") == tmp_path / "films"


def test_every_code_that_the_package_names_is_in_the_table() -> None:
    import re

    package = Path(desk_module.__file__).parent
    text = "".join(path.read_text() for path in package.glob("*.py"))
    named = set(re.findall(r'"((?:recorder|channel)\.[a-z_]+)"', text))
    assert named <= set(REASONS)
    assert named >= {code for code in REASONS if code.startswith("recorder.")}


def test_data_alone_may_be_recorded_but_not_nothing_and_no_camera_is_called_like_it() -> None:
    assert RecorderParams.model_validate({"data": "all"}).labels == ()
    assert RecorderParams.model_validate({"labels": ["data"]}).labels == ("data",)
    with pytest.raises(ValueError, match="name cameras in `labels`, or connectors in `data`"):
        RecorderParams.model_validate({})
    with pytest.raises(ValueError, match="it would be both"):
        RecorderParams.model_validate({"labels": ["data"], "data": ["pose"]})


def test_data_is_recorded_and_stopped_like_a_camera_but_no_still_is_taken_of_it(studio: Any, tmp_path: Path) -> None:
    with Bench(studio, tmp_path, labels=["front"], data=["pose"]).running() as bench:
        tap = studio.Tap([TappedMessage("pose", PayloadKind.JSON, b"{}", 1.0, 1.0)] * 3)
        tap.channels = [TappedChannel("pose", "sim-pose", MosaicDataType.JSON_R2U)]
        bench.host.tap_data = lambda labels: tap  # type: ignore[method-assign,assignment,return-value]
        bench.until(lambda: bench.heard("status"))
        assert bench.status()["labels"] == ["front", "data"]
        assert bench.says({"command": "snapshot", "labels": ["data"]}) == ["recorder.unknown_camera"]
        assert bench.says({"command": "start", "labels": ["data"]}) == []
        bench.until(lambda: bench.row("data").get("messages") == 3)
        assert bench.says({"command": "stop"}) == []
        bench.until(lambda: bench.row("data")["state"] == "ended")
        assert bench.says({"command": "list"}) == []
        (file,) = bench.heard("files")[-1]["files"]
        assert (file["label"], file["name"]) == ("data", bench.row("data")["files"][0])
        assert len(messages_in(tmp_path / file["name"])) == 3
