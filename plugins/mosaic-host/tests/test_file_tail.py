"""Log files that grow, rotate, vanish and flood."""

from __future__ import annotations

import os
from contextlib import closing
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st
from support.devices.absence import thirty_seconds

from mosaic_core.messages import Log
from mosaic_core.testing import build, collect, fake_host
from mosaic_core.words.errors import ConfigError, DeviceGone
from mosaic_host.logs.file_tail import FileTail, FileTailConfigurer
from mosaic_host.logs.growing_file import AWAY_S, MAX_BEHIND_BYTES
from mosaic_host.logs.log_lines import level_of, readable


class Writer:
    """A program that writes a log while it is followed: each thing it does comes with the next look at the file."""

    def __init__(self, path: Path, monkeypatch: pytest.MonkeyPatch, handler: FileTail) -> None:
        self.path = path
        self.steps: list[Any] = []
        wait = fake_host(handler).wait

        def after_a_look(seconds: float) -> bool:
            if self.steps:
                self.steps.pop(0)()
            return wait(seconds)

        monkeypatch.setattr(fake_host(handler), "wait", after_a_look)

    def adds(self, data: bytes) -> None:
        with self.path.open("ab") as file:
            file.write(data)

    def rotates(self, first: bytes = b"", then: bytes = b"") -> None:
        """Adds ``first`` to the old file and begins the new one with ``then``; empty: there is none yet."""
        self.adds(first)
        self.path.rename(self.path.with_suffix(".1"))
        if then:
            self.adds(then)


@pytest.fixture
def path(tmp_path: Path) -> Path:
    path = tmp_path / "nav.log"
    path.write_bytes(b"old\n")
    return path


@pytest.fixture
def tail(path: Path) -> FileTail:
    return build(FileTailConfigurer, params={"source": str(path)})


@pytest.fixture
def writer(path: Path, tail: FileTail, monkeypatch: pytest.MonkeyPatch) -> Writer:
    return Writer(path, monkeypatch, tail)


def texts(messages: list[Log]) -> list[str]:
    return [one.message for one in messages]


def test_only_what_is_added_is_sent_with_its_level_and_name(tail: FileTail, writer: Writer) -> None:
    writer.steps = [lambda: writer.adds(b"12:00 [WARN] lo"), lambda: writer.adds(b"w battery\r\n\x1b[31mhot\x1b[0m\n")]
    first, second = collect(tail, 2)
    assert (first.level, first.message, first.name) == ("warn", "12:00 [WARN] low battery", "nav.log")
    assert (second.level, second.message) == ("info", "hot")


def test_a_rotation_loses_nothing_even_with_a_gap(tail: FileTail, writer: Writer) -> None:
    writer.steps = [
        lambda: writer.adds(b"a\n"),
        lambda: writer.rotates(b"b\n"),
        lambda: None,
        lambda: writer.adds(b"c\n"),
        lambda: writer.rotates(then=b"d\n"),
    ]
    assert texts(collect(tail, 4)) == ["a", "b", "c", "d"]


def test_a_truncated_file_is_read_from_its_beginning(tail: FileTail, writer: Writer) -> None:
    writer.steps = [lambda: writer.adds(b"long line\n"), lambda: writer.path.write_bytes(b"new\n")]
    assert texts(collect(tail, 2)) == ["long line", "new"]


def test_a_file_that_is_away_for_thirty_seconds_is_gone_and_its_successor_is_read_whole(
    tail: FileTail, writer: Writer
) -> None:
    writer.steps = [lambda: writer.adds(b"a\n"), writer.path.unlink]
    clock = fake_host(tail).clock
    with closing(tail.messages()) as messages:
        assert next(messages).message == "a"
        began_s = clock.now_s
        with pytest.raises(DeviceGone, match=r"nav\.log: No such file"):
            next(messages)
    assert clock.now_s >= began_s + AWAY_S
    for _ in thirty_seconds(clock):
        with pytest.raises(DeviceGone, match="looked for again"):
            next(iter(tail.messages()))
    writer.adds(b"b\n")
    assert texts(collect(tail, 1)) == ["b"]


def test_a_restart_goes_on_where_it_was(tail: FileTail, writer: Writer) -> None:
    writer.steps = [lambda: writer.adds(b"a\n")]
    collect(tail, 1)
    writer.adds(b"b\n")
    assert texts(collect(tail, 1)) == ["b"]


def test_a_flood_of_lines_is_thinned_and_counted(tail: FileTail, writer: Writer) -> None:
    writer.steps = [lambda: writer.adds(b"x\n" * 3000), lambda: None, lambda: None]
    sent = collect(tail, within_s=2.0)
    assert len(sent) <= 15
    assert fake_host(tail).losses == {"thinned": 3000 - len(sent)}


def test_more_than_can_be_read_is_skipped_and_the_end_arrives(tail: FileTail, writer: Writer) -> None:
    writer.steps = [lambda: writer.adds(b"x" * 2 * MAX_BEHIND_BYTES + b"\nlast\n")]
    assert texts(collect(tail, 1)) == ["last"]
    assert fake_host(tail).losses == {"refused": 1}


def test_a_line_without_end_costs_no_memory_and_the_next_one_arrives(tail: FileTail, writer: Writer) -> None:
    writer.steps = [lambda: writer.adds(b"x" * 100_000), lambda: writer.adds(b"x\nnext\n")]
    assert texts(collect(tail, 1)) == ["next"]
    assert fake_host(tail).losses == {"refused": 1}


def test_a_pipe_is_no_log_and_holds_nobody(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe")
    with pytest.raises(DeviceGone, match="no file of lines"):
        collect(build(FileTailConfigurer, params={"source": str(tmp_path / "pipe")}), 1)


@given(st.binary(max_size=300))
def test_whatever_stands_in_a_line_is_readable(raw: bytes) -> None:
    text = readable(raw)
    assert not any(ord(one) < 32 and one != "\t" for one in text)
    assert Log(level=level_of(text), message=text)


@pytest.mark.parametrize("source", ["nav.log", "", "/var/\0log"])
def test_a_path_that_cannot_be_meant_is_refused(source: str) -> None:
    with pytest.raises(ConfigError):
        build(FileTailConfigurer, params={"source": source})
