"""Names, lists and limits of the folder."""

from __future__ import annotations

import os
import stat
from collections.abc import Callable
from datetime import datetime
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from mosaic_recorder.disk_watch import PERIOD_S, DiskWatch
from mosaic_recorder.folder import MAX_NAME_CHARACTERS, RecordingsFolder, StoredFile, new_file, safe_name, surplus

NOON = datetime(2026, 5, 4, 12, 30, 15)
FILES = st.lists(
    st.builds(StoredFile, st.uuids().map(str), st.just("front"), st.integers(0, 1000), st.integers(0, 50)),
    max_size=20,
    unique_by=lambda file: file.name,
)
LIMITS = st.one_of(st.none(), st.integers(0, 3000))


def stored(folder: RecordingsFolder, name: str, size_bytes: int = 10, age: int = 0) -> str:
    path = folder.path / name
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes(b"x" * size_bytes)
    os.utime(path, ns=(10**18 - age, 10**18 - age))
    return name


def recorded(number: int) -> str:
    return f"drive_20260504_12{number:02d}00_front.mp4"


@given(st.text())
def test_whatever_is_asked_for_becomes_one_harmless_part_of_a_name(text: str) -> None:
    name = safe_name(text, "recording")
    assert name
    assert len(name) <= MAX_NAME_CHARACTERS
    assert set(name) <= set("abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_-")
    assert name[0] not in "-_"


@pytest.mark.parametrize(
    ("text", "name"),
    [
        ("../../etc/passwd", "etc-passwd"),
        ("Hof Süd, Tor 3", "Hof-Sud-Tor-3"),
        ("", "recording"),
        ("..", "recording"),
        ("a\x00b", "a-b"),
        ("C:\\run", "C-run"),
    ],
)
def test_paths_and_accents_are_made_plain(text: str, name: str) -> None:
    assert safe_name(text, "recording") == name


@given(st.text(max_size=50), st.text(max_size=50))
def test_a_claimed_path_is_always_in_the_folder_and_listed_again(name: str, label: str) -> None:
    folder = RecordingsFolder(Path("/tmp"))  # noqa: S108 - nothing is written
    path = folder.claim(name, label, "mp4", NOON)
    assert path.parent == folder.path
    assert path.resolve().parent == folder.path.resolve()


def test_two_files_of_one_moment_have_two_names(tmp_path: Path) -> None:
    folder = RecordingsFolder(tmp_path / "new")
    first, second = (folder.claim("drive", "front", "mp4", NOON) for _ in range(2))
    assert (first.name, second.name) == ("drive_20260504_123015_front.mp4", "drive_20260504_123015_front~2.mp4")
    assert folder.is_in_use(first.name)
    folder.release(first)
    assert not folder.is_in_use(first.name)


def test_a_file_that_exists_is_never_claimed(tmp_path: Path) -> None:
    folder = RecordingsFolder(tmp_path)
    stored(folder, "drive_20260504_123015_front.mp4")
    assert folder.claim("drive", "front", "mp4", NOON).name == "drive_20260504_123015_front~2.mp4"


def test_only_the_owner_reads_what_is_stored(tmp_path: Path) -> None:
    before = os.umask(0)
    path = RecordingsFolder(tmp_path / "recordings").claim("tour", "front", "png")
    with new_file(path) as file:
        file.write(b"x")
    os.umask(before)
    assert (path.parent.stat().st_mode & 0o777, path.stat().st_mode & 0o777) == (0o700, 0o600)
    with pytest.raises(FileExistsError):
        new_file(path)


@pytest.mark.parametrize("names", [(), (recorded(1), recorded(2))], ids=["empty", "of recordings"])
def test_a_folder_of_recordings_is_closed_to_others_though_it_was_there(tmp_path: Path, names: tuple[str, ...]) -> None:
    folder = RecordingsFolder(tmp_path / "recordings")
    folder.path.mkdir()
    folder.path.chmod(0o755)
    for name in names:
        stored(folder, name)
    folder.claim("tour", "front", "png")
    assert folder.path.stat().st_mode & 0o7777 == 0o700


def with_a_letter(path: Path, patch: pytest.MonkeyPatch) -> None:
    (path / "letter.odt").touch()


def made_for_several(path: Path, patch: pytest.MonkeyPatch) -> None:
    path.chmod(0o2775)


def with_a_sticky_bit(path: Path, patch: pytest.MonkeyPatch) -> None:
    path.chmod(0o1777)


def at_home(path: Path, patch: pytest.MonkeyPatch) -> None:
    patch.setenv("HOME", str(path))


def of_somebody_else(path: Path, patch: pytest.MonkeyPatch) -> None:
    patch.setattr(os, "geteuid", lambda: path.stat().st_uid + 1)


def a_disk_of_its_own(path: Path, patch: pytest.MonkeyPatch) -> None:
    patch.setattr(Path, "is_mount", lambda it: it == path)


def without_modes(path: Path, patch: pytest.MonkeyPatch) -> None:
    def refused(*_: object, **__: object) -> None:
        raise PermissionError

    patch.setattr(Path, "chmod", refused)


@pytest.mark.parametrize(
    "shared",
    [with_a_letter, made_for_several, with_a_sticky_bit, at_home, of_somebody_else, a_disk_of_its_own, without_modes],
)
def test_a_folder_that_others_may_need_stays_as_it_is_and_the_log_says_so_once(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    caplog: pytest.LogCaptureFixture,
    shared: Callable[[Path, pytest.MonkeyPatch], None],
) -> None:
    folder = RecordingsFolder(tmp_path / "recordings")
    folder.path.mkdir()
    folder.path.chmod(0o755)
    shared(folder.path, monkeypatch)
    before = folder.path.stat().st_mode
    for _ in range(2):
        folder.claim("tour", "front", "png")
    assert folder.path.stat().st_mode == before
    (said,) = caplog.messages
    assert str(folder.path) in said
    assert f"mode {before & 0o7777:04o}" in said


def test_the_list_has_what_was_recorded_newest_first_and_nothing_else(tmp_path: Path) -> None:
    folder = RecordingsFolder(tmp_path)
    old, new = stored(folder, recorded(1), 5, age=100), stored(folder, recorded(2), 7)
    for other in ("holiday.mp4", "notes.txt", "drive_20260504_120000_front.mp4.part"):
        stored(folder, other)
    (tmp_path / recorded(3)).symlink_to("/etc/passwd")
    (tmp_path / recorded(4)).mkdir()
    files = folder.files()
    assert [(file.name, file.label, file.size_bytes) for file in files] == [(new, "front", 7), (old, "front", 5)]


def test_a_folder_that_does_not_exist_is_empty(tmp_path: Path) -> None:
    folder = RecordingsFolder(tmp_path / "a" / "b")
    assert folder.files() == []
    assert folder.free_bytes() > 0


def test_names_with_the_suffix_of_a_second_file_keep_their_label(tmp_path: Path) -> None:
    folder = RecordingsFolder(tmp_path)
    stored(folder, "drive_20260504_123015_front_left~2.mkv")
    assert [file.label for file in folder.files()] == ["front_left"]


@pytest.mark.parametrize("name", ["../secret", "/etc/passwd", "holiday.mp4", "", ".", recorded(9)])
def test_only_listed_files_can_be_deleted(tmp_path: Path, name: str) -> None:
    secret = tmp_path / "secret"
    secret.write_text("kept")
    folder = RecordingsFolder(tmp_path / "recordings")
    stored(folder, "holiday.mp4")
    assert folder.delete([name]) == [name]
    assert secret.read_text() == "kept"
    assert (folder.path / "holiday.mp4").exists()


def test_deleting_leaves_what_is_being_written(tmp_path: Path) -> None:
    folder = RecordingsFolder(tmp_path)
    done = stored(folder, recorded(1))
    writing = folder.claim("drive", "front", "mp4", NOON)
    writing.write_bytes(b"x")
    assert folder.delete([done, writing.name]) == [writing.name]
    assert [file.name for file in folder.files()] == [writing.name]


@pytest.mark.parametrize(
    ("limits", "left"),
    [
        ({"max_files": 2}, [4, 3]),
        ({"max_bytes": 35}, [4, 3, 2]),
        ({"max_files": 3, "max_bytes": 15}, [4]),
        ({"max_bytes": 1}, []),
        ({}, [4, 3, 2, 1]),
    ],
)
def test_the_oldest_files_go_first(tmp_path: Path, limits: dict[str, int], left: list[int]) -> None:
    folder = RecordingsFolder(tmp_path, **limits)
    for number in range(1, 5):
        stored(folder, recorded(number), 10, age=100 - number)
    folder.tidy()
    assert [file.name for file in folder.files()] == [recorded(number) for number in left]


def test_what_is_being_written_counts_but_stays(tmp_path: Path) -> None:
    folder = RecordingsFolder(tmp_path, max_files=1)
    old = stored(folder, recorded(1), age=5)
    writing = folder.claim("drive", "front", "mp4", NOON)
    stored(folder, writing.name, age=50)
    assert folder.tidy() == [old]
    assert [file.name for file in folder.files()] == [writing.name]


@given(FILES, LIMITS, LIMITS)
def test_what_is_left_is_within_the_limits_and_no_more_goes_than_must(
    files: list[StoredFile], max_files: int | None, max_bytes: int | None
) -> None:
    gone = surplus(files, max_files, max_bytes)
    left = [file for file in files if file not in gone]

    def fits(some: list[StoredFile]) -> bool:
        return (max_files is None or len(some) <= max_files) and (
            max_bytes is None or sum(file.size_bytes for file in some) <= max_bytes
        )

    assert fits(left)
    assert not gone or not fits([*left, gone[-1]])
    assert all(one.modified_at_ns <= other.modified_at_ns for one in gone for other in left)


def test_the_disk_is_looked_at_once_per_period(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    now_s = 50.0
    folder = RecordingsFolder(tmp_path, max_files=1)
    watch = DiskWatch(folder, 1000, clock=lambda: now_s)
    free = iter([1000, 999])
    monkeypatch.setattr(folder, "free_bytes", lambda: next(free))
    for number in (1, 2):
        stored(folder, recorded(number), age=100 - number)

    assert watch.check() == ""
    assert [file.name for file in folder.files()] == [recorded(2)]
    assert watch.check() == ""  # not looked at again
    now_s += PERIOD_S
    assert watch.check() == "recorder.disk_full"


@pytest.mark.skipif(os.name == "nt", reason="modes of POSIX")
def test_the_folders_above_that_were_missing_are_closed_to_others_too(tmp_path: Path) -> None:
    tmp_path.chmod(0o755)
    RecordingsFolder(tmp_path / "recordings" / "front").claim("walk", "front", "mp4")
    modes = [
        stat.S_IMODE(one.stat().st_mode) for one in (tmp_path, tmp_path / "recordings", tmp_path / "recordings/front")
    ]
    assert modes == [0o755, 0o700, 0o700]
