"""Pictures into files: formats that change, pauses, disks that fail."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from mosaic_recorder.clip_writer import ClipWriter
from mosaic_recorder.movie_file import Container

FPS = 30


class Paths:
    """Gives out names and remembers which are in use."""

    def __init__(self, folder: Path, container: Container) -> None:
        self._folder = folder
        self._container = container
        self.given: list[Path] = []
        self.in_use: list[Path] = []

    def claim(self) -> Path:
        self.given.append(self._folder / f"{len(self.given)}.{self._container}")
        self.in_use.append(self.given[-1])
        return self.given[-1]

    def clip(self) -> ClipWriter:
        return ClipWriter(self._container, self.claim, self.in_use.remove, "front")


@pytest.fixture(params=[("mp4", "h264"), ("mkv", "h264"), ("mkv", "vp8")], ids="-".join)
def kind(request: pytest.FixtureRequest) -> Any:
    return request.param


@pytest.fixture
def paths(tmp_path: Path, kind: Any) -> Paths:
    return Paths(tmp_path, kind[0])


def test_a_recording_has_every_picture_at_its_time(studio: Any, paths: Paths, kind: Any) -> None:
    pictures = studio.encoded(60, kind[1])
    clip = paths.clip()
    for picture in pictures:
        clip.add(picture)
    clip.close()

    movie = studio.watched(paths.given[0])
    assert movie.numbers == list(range(60))
    assert movie.times_s == pytest.approx([number / FPS for number in range(60)], abs=0.001)
    assert movie.duration_s == pytest.approx(60 / FPS, abs=0.002)
    assert clip.seconds == pytest.approx(60 / FPS)
    assert (clip.pictures, clip.size, clip.names) == (60, (320, 240), [paths.given[0].name])
    assert paths.given[0].stat().st_size <= clip.size_bytes
    assert paths.in_use == []


def test_irregular_captures_are_shown_irregularly(studio: Any, paths: Paths, kind: Any) -> None:
    times_s = [0.0, 0.01, 0.5, 0.503, 2.0]
    clip = paths.clip()
    for picture, at_s in zip(studio.encoded(5, kind[1]), times_s, strict=True):
        clip.add(replace(picture, captured_at_s=77.0 + at_s))
    clip.close()
    assert studio.watched(paths.given[0]).times_s == pytest.approx(times_s, abs=0.001)


def test_captures_that_do_not_rise_are_still_shown_one_after_the_other(studio: Any, paths: Paths, kind: Any) -> None:
    clip = paths.clip()
    for picture in studio.encoded(5, kind[1]):
        clip.add(replace(picture, captured_at_s=3.0))
    clip.close()
    assert studio.watched(paths.given[0]).times_s == pytest.approx([0, 0.001, 0.002, 0.003, 0.004], abs=0.0005)


def test_a_pause_is_left_out(studio: Any, paths: Paths, kind: Any) -> None:
    pictures = studio.encoded(60, kind[1], key_every=20)
    clip = paths.clip()
    for picture in pictures[:15]:
        clip.add(picture)
    clip.pause()
    for picture in pictures[40:]:
        clip.add(replace(picture, captured_at_s=picture.captured_at_s + 3600))
    clip.close()
    movie = studio.watched(paths.given[0])
    assert movie.numbers == [*range(15), *range(40, 60)]
    assert movie.times_s == pytest.approx([number / FPS for number in range(35)], abs=0.002)
    assert len(paths.given) == 1


def test_another_size_goes_on_in_another_file_and_the_recording_s_time_with_it(
    studio: Any, paths: Paths, kind: Any
) -> None:
    small = studio.encoded(30, kind[1])
    large = [
        replace(picture, captured_at_s=picture.captured_at_s + 1) for picture in studio.encoded(20, kind[1], (640, 480))
    ]
    clip = paths.clip()
    for picture in (*small, *large):
        clip.add(picture)
    assert paths.in_use == paths.given[1:]
    clip.close()
    first, second = (studio.watched(path) for path in paths.given)
    assert (first.numbers, second.numbers) == (list(range(30)), list(range(20)))
    assert first.duration_s == pytest.approx(1.0, abs=0.002)
    assert second.times_s[0] == 0.0
    assert clip.seconds == pytest.approx(50 / FPS)
    assert clip.size == (640, 480)


def test_nothing_recorded_leaves_no_file(paths: Paths) -> None:
    clip = paths.clip()
    clip.pause()
    clip.close()
    assert paths.given == []
    assert clip.seconds == 0.0


def test_a_file_that_cannot_be_made_gives_its_name_back(studio: Any, paths: Paths, kind: Any, tmp_path: Path) -> None:
    (tmp_path / f"0.{kind[0]}").mkdir()
    clip = paths.clip()
    with pytest.raises(FileExistsError):
        clip.add(studio.encoded(1, kind[1])[0])
    assert paths.in_use == []
    clip.close()


@pytest.mark.parametrize("count", [1, 7, 60])
def test_it_knows_before_how_long_and_large_it_will_be(studio: Any, paths: Paths, kind: Any, count: int) -> None:
    clip = paths.clip()
    for picture in studio.encoded(count, kind[1]):
        seconds, size_bytes = clip.seconds_with(picture), clip.size_bytes_with(picture)
        clip.add(picture)
        assert clip.seconds == pytest.approx(seconds)
    clip.close()
    assert paths.given[0].stat().st_size <= size_bytes
