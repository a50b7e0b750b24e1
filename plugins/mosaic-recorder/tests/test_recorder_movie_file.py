"""Files of real encoders, read back by a real decoder; disks that fail; processes that die."""

from __future__ import annotations

import errno
import os
import signal
import subprocess
import sys
from itertools import pairwise
from pathlib import Path
from typing import Any

import pytest

from mosaic_core.contract.media_tap import TapCodec, TappedPicture
from mosaic_recorder import disk_file
from mosaic_recorder.movie_file import Container, MovieFile

KINDS: list[tuple[Container, TapCodec]] = [("mp4", "h264"), ("mkv", "h264"), ("mkv", "vp8")]


FPS = 30


def written(file: MovieFile, pictures: tuple[TappedPicture, ...]) -> None:
    for picture in pictures:
        at_s = picture.captured_at_s - pictures[0].captured_at_s
        file.write(picture.data, at_s, 1 / FPS, is_key=picture.is_key)


@pytest.mark.parametrize(("container", "codec"), KINDS)
def test_what_goes_in_is_what_a_player_shows(
    studio: Any, tmp_path: Path, container: Container, codec: TapCodec
) -> None:
    file = MovieFile(tmp_path / f"a.{container}", container, codec, 320, 240)
    written(file, studio.encoded(100, codec))
    file.close()

    movie = studio.watched(file.path)
    assert movie.codec == codec
    assert movie.numbers == list(range(100))
    assert movie.times_s == pytest.approx([number / FPS for number in range(100)], abs=0.001)
    assert movie.duration_s == pytest.approx(100 / FPS, abs=1 / FPS)


@pytest.mark.parametrize(("container", "codec"), KINDS)
def test_nothing_is_encoded_again(studio: Any, tmp_path: Path, container: Container, codec: TapCodec) -> None:
    pictures = studio.encoded(100, codec)
    file = MovieFile(tmp_path / f"a.{container}", container, codec, 320, 240)
    written(file, pictures)
    file.close()
    size_bytes = file.path.stat().st_size
    assert size_bytes == pytest.approx(sum(len(picture.data) for picture in pictures), abs=100 * 32 + 2048)


@pytest.mark.parametrize(("container", "codec"), KINDS)
def test_an_unfinished_file_plays_up_to_its_last_second(
    studio: Any, tmp_path: Path, container: Container, codec: TapCodec
) -> None:
    file = MovieFile(tmp_path / f"a.{container}", container, codec, 320, 240)
    written(file, studio.encoded(100, codec))
    torn = tmp_path / f"torn.{container}"
    torn.write_bytes(file.path.read_bytes())
    file.close()
    assert_plays_from_the_start(studio.watched(torn), at_least=60)


WRITER = """
import runpy, sys
from pathlib import Path
from mosaic_recorder.movie_file import MovieFile
file = MovieFile(Path(sys.argv[2]), sys.argv[3], sys.argv[4], 320, 240)
for picture in runpy.run_path(sys.argv[1])["encoded"](100, sys.argv[4]):
    file.write(picture.data, picture.captured_at_s - 5000, 1 / 30, is_key=picture.is_key)
print("written", flush=True)
sys.stdin.read()
"""


@pytest.mark.parametrize(("container", "codec"), KINDS)
def test_the_file_of_a_process_that_was_killed_plays(
    studio: Any, tmp_path: Path, container: Container, codec: TapCodec
) -> None:
    path = tmp_path / f"a.{container}"
    words = [sys.executable, "-c", WRITER, str(Path(__file__).with_name("conftest.py")), str(path), container, codec]
    where = os.environ | {"PYTHONPATH": os.pathsep.join(sys.path)}
    with subprocess.Popen(words, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, env=where) as process:
        assert process.stdout is not None
        assert process.stdout.readline() == "written\n"
        process.kill()
        assert process.wait() == -signal.SIGKILL
    assert_plays_from_the_start(studio.watched(path), at_least=60)


def assert_plays_from_the_start(movie: Any, at_least: int) -> None:
    assert len(movie.numbers) >= at_least
    assert movie.numbers == list(range(len(movie.numbers)))
    assert all(later > earlier for earlier, later in pairwise(movie.times_s))


class NearlyFull:
    """A disk that takes so many bytes and then no more, in the middle of a write."""

    closed = False

    def __init__(self, path: Path, room_bytes: int) -> None:
        self._file = path.open("xb", buffering=0)
        self._left = room_bytes

    def write(self, data: Any) -> int:
        if not self._left:
            raise OSError(errno.ENOSPC, "No space left on device")
        taken = self._file.write(data[: self._left])
        self._left -= taken
        return taken

    def __getattr__(self, name: str) -> Any:
        return getattr(self._file, name)


@pytest.mark.parametrize(("container", "codec"), KINDS)
def test_a_full_disk_is_told_once_and_what_fitted_plays(
    studio: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, container: Container, codec: TapCodec
) -> None:
    pictures = studio.encoded(100, codec)
    room_bytes = round(sum(len(picture.data) for picture in pictures) * 0.8)
    path = tmp_path / f"a.{container}"
    disk = NearlyFull(path, room_bytes)
    monkeypatch.setattr(disk_file, "new_file", lambda *_, **__: disk)
    file = MovieFile(path, container, codec, 320, 240)
    with pytest.raises(OSError, match="No space left") as raised:
        written(file, pictures)
    assert raised.value.errno == errno.ENOSPC
    file.close()
    monkeypatch.undo()
    assert room_bytes * 0.3 < path.stat().st_size < room_bytes  # the fragment that did not fit is cut off
    assert_plays_from_the_start(studio.watched(path), at_least=30)


def test_a_disk_that_fills_at_the_very_end_is_told_by_close(
    studio: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "a.mp4"
    disk = NearlyFull(path, 10**9)
    monkeypatch.setattr(disk_file, "new_file", lambda *_, **__: disk)
    file = MovieFile(path, "mp4", "h264", 320, 240)
    written(file, studio.encoded(100))
    disk._left = 0
    with pytest.raises(OSError, match="No space left") as raised:
        file.close()
    assert raised.value.errno == errno.ENOSPC


def test_a_disk_that_does_not_keep_what_it_took_is_an_error(
    studio: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fails(number: int) -> None:
        raise OSError(errno.EIO, "Input/output error")

    monkeypatch.setattr(disk_file, "SYNC_S", 0.0)
    file = MovieFile(tmp_path / "a.mp4", "mp4", "h264", 320, 240)
    monkeypatch.setattr("mosaic_recorder.disk_file.os.fsync", fails)
    with pytest.raises(OSError, match="Input/output error"):
        written(file, studio.encoded(3))
    file.close()


def test_a_file_is_never_overwritten(tmp_path: Path) -> None:
    path = tmp_path / "a.mp4"
    path.write_text("kept")
    with pytest.raises(FileExistsError):
        MovieFile(path, "mp4", "h264", 320, 240)
    assert path.read_text() == "kept"


def test_a_codec_that_the_container_does_not_take_leaves_no_open_file(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match="mp4"):
        MovieFile(tmp_path / "a.mp4", "mp4", "rawvideo", 320, 240)  # type: ignore[arg-type] # no such tap
