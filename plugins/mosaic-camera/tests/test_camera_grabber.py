"""The grab thread: newest only for live sources, every one for recordings, and nobody ever waits for a driver."""

import threading
import time
from collections.abc import Callable
from typing import Any

import pytest

from mosaic_camera.grabber import Grabber
from mosaic_camera.source import Source
from mosaic_camera.source_error import SourceError

Make = Callable[..., Any]


def numbers(grabber: Grabber, count: int) -> list[int]:
    found: list[int] = []
    while len(found) < count and (grabbed := grabber.next(2.0)) is not None:
        found.append(int(grabbed.image[0, 0, 0]))
    return found


def test_a_recording_loses_no_picture_however_slow_its_reader(scripted: Make) -> None:
    source = scripted(20, is_live=False)
    with Grabber(lambda: source, is_looping=False, name="x") as grabber:
        assert numbers(grabber, 99) == list(range(20))
        assert grabber.has_ended
        assert grabber.count == 20
    assert source.is_closed.wait(2)


def test_a_looped_recording_starts_again(scripted: Make) -> None:
    source = scripted(3, is_live=False)
    with Grabber(lambda: source, is_looping=True, name="x") as grabber:
        assert numbers(grabber, 8) == [0, 1, 2, 0, 1, 2, 0, 1]


def test_a_looped_recording_without_pictures_ends_instead_of_spinning(scripted: Make) -> None:
    source = scripted(0, is_live=False)
    with Grabber(lambda: source, is_looping=True, name="x") as grabber:
        assert grabber.next(2.0) is None
        assert grabber.has_ended


def test_only_as_many_as_are_wanted_are_handed_over(scripted: Make) -> None:
    source = scripted(20, is_live=False)
    with Grabber(lambda: source, is_looping=False, name="x", fps=0.2) as grabber:
        assert numbers(grabber, 99) == [0, 4, 9, 14, 19]
        assert grabber.count == 20, "those left out tell that the source lives"


def test_live_packets_are_never_left_out(scripted: Make) -> None:
    source = scripted(20, is_live=True, key_every=10)
    with Grabber(lambda: source, is_looping=False, name="x", fps=0.2) as grabber:
        assert source.is_closed.wait(2)
        assert numbers(grabber, 99) == list(range(20))


def test_of_a_live_source_a_late_reader_gets_the_newest_picture(scripted: Make) -> None:
    source = scripted(50, is_live=True)
    with Grabber(lambda: source, is_looping=False, name="x") as grabber:
        assert source.is_closed.wait(2), "it was read to its end without a reader"
        assert numbers(grabber, 99) == [49]


def test_live_packets_are_all_handed_over_in_order(scripted: Make) -> None:
    source = scripted(50, is_live=True, key_every=10)
    with Grabber(lambda: source, is_looping=False, name="x") as grabber:
        assert source.is_closed.wait(2)
        assert numbers(grabber, 99) == list(range(50))


def test_live_packets_that_nobody_takes_begin_anew_at_a_key_frame(scripted: Make) -> None:
    source = scripted(75, is_live=True, key_every=8)
    with Grabber(lambda: source, is_looping=False, name="x") as grabber:
        assert source.is_closed.wait(2)
        assert numbers(grabber, 99) == list(range(64, 75))


def test_an_error_of_the_source_reaches_the_reader(scripted: Make) -> None:
    def broken() -> Source:
        raise SourceError("it is gone", "plug it in")

    with (
        Grabber(broken, is_looping=False, name="x") as grabber,
        pytest.raises(SourceError, match="it is gone; plug it in"),
    ):
        grabber.next(2.0)


def test_leaving_does_not_wait_for_a_read_that_hangs(scripted: Make) -> None:
    source = scripted(5, is_live=True)
    source.may_read.clear()
    began_s = time.monotonic()
    with Grabber(lambda: source, is_looping=False, name="x") as grabber:
        assert grabber.next(0.05) is None
    assert time.monotonic() - began_s < 5.0
    assert not source.is_closed.is_set()
    source.may_read.set()
    assert source.is_closed.wait(2), "the thread closes the source by itself once the read returns"


def test_leaving_ends_a_recording_that_waits_to_be_taken(scripted: Make) -> None:
    source = scripted(5, is_live=False)
    with Grabber(lambda: source, is_looping=False, name="left") as grabber:
        assert grabber.next(2.0) is not None
    assert source.is_closed.wait(2)
    assert "grab left" not in {thread.name for thread in threading.enumerate()}
