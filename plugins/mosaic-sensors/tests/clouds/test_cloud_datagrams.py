"""Datagrams of points become clouds again, whatever their order; what is lost or hostile disturbs nobody."""

from __future__ import annotations

import struct
from collections import deque
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mosaic_sensors.point_cloud.datagrams import FORGOTTEN_AFTER_S, Assembly, datagrams_of


def points(count: int, values: int = 3) -> Any:
    return np.arange(count * values, dtype=np.float32).reshape(-1, values)


@given(st.integers(0, 700), st.sampled_from([3, 4]), st.randoms(use_true_random=False))
def test_parts_in_any_order_with_some_twice_make_one_cloud(count: int, values: int, random: Any) -> None:
    sent = points(count, values)
    datagrams = list(datagrams_of(sent, 7))
    assert all(len(datagram) <= 1400 for datagram in datagrams)
    mixed = datagrams + random.sample(datagrams, len(datagrams) // 2)
    random.shuffle(mixed)
    assembly = Assembly()
    clouds = [cloud for cloud in (assembly.feed(datagram, "a", 5.0) for datagram in mixed) if cloud]
    assert len(clouds) == 1
    assert clouds[0].points.tolist() == sent.tolist()
    assert clouds[0].begun_at_s == 5.0


def test_a_newer_cloud_replaces_one_of_which_a_part_was_lost() -> None:
    assembly = Assembly()
    old, new = list(datagrams_of(points(300), 0xFFFF_FFFF)), list(datagrams_of(points(300), 0))
    assert [assembly.feed(datagram, "a", 1.0) for datagram in old[:-1]] == [None] * (len(old) - 1)
    whole = [assembly.feed(datagram, "a", 1.0) for datagram in new][-1]
    assert whole is not None
    assert [assembly.take_incomplete() for _ in range(2)] == [1, 0]
    assert assembly.feed(old[-1], "a", 1.0) is None


def test_a_sender_that_begins_anew_is_heard_after_a_moment() -> None:
    assembly = Assembly()
    assert assembly.feed(next(datagrams_of(points(1), 900)), "a", 1.0) is not None
    again = next(datagrams_of(points(2), 0))
    assert assembly.feed(again, "a", 1.5) is None
    assert assembly.feed(again, "a", 1.1 + FORGOTTEN_AFTER_S) is not None
    assert assembly.take_incomplete() == 0


def test_senders_do_not_mix_and_the_quietest_gives_way_to_a_fifth() -> None:
    assembly = Assembly()
    parts = list(datagrams_of(points(200), 1))
    for at, sender in enumerate("abcde"):
        assert assembly.feed(parts[0], sender, at / 10) is None
    rest = {sender: [assembly.feed(part, sender, 0.5) for part in parts[1:]][-1] for sender in "bcde"}
    assert all(rest.values())
    assert assembly.take_incomplete() == 1


def test_a_cloud_whose_parts_stop_coming_is_given_up_without_another_one() -> None:
    assembly = Assembly()
    first, *_ = datagrams_of(points(200), 1)
    assembly.feed(first, "a", 1.0)
    assembly.feed(next(datagrams_of(points(1), 1)), "b", 1.0)
    assembly.expire(1.0 + FORGOTTEN_AFTER_S)
    assert assembly.take_incomplete() == 0
    assembly.expire(1.1 + FORGOTTEN_AFTER_S)
    assert assembly.take_incomplete() == 1


GOOD = next(datagrams_of(points(3), 1))


@pytest.mark.parametrize(
    "datagram",
    [
        b"", GOOD[:10], GOOD[:-1], GOOD + b"x", b"XXXX" + GOOD[4:], GOOD[:4] + b"\x02" + GOOD[5:],
        GOOD[:5] + b"\x05" + GOOD[6:], GOOD[:12] + struct.pack("<HH", 1, 1) + GOOD[16:],
        GOOD[:12] + struct.pack("<HH", 0, 0) + GOOD[16:],
    ],
)  # fmt: skip
def test_what_is_no_datagram_of_points_is_refused(datagram: bytes) -> None:
    with pytest.raises(ValueError, match=r"."):
        Assembly().feed(datagram, "a", 0.0)


def test_parts_that_disagree_and_clouds_without_end_are_refused() -> None:
    assembly = Assembly()
    header = struct.Struct("<4sBBHIHH")
    assembly.feed(header.pack(b"MPTS", 1, 3, 0, 1, 0, 3), "a", 0.0)
    with pytest.raises(ValueError, match="disagree"):
        assembly.feed(header.pack(b"MPTS", 1, 3, 0, 1, 1, 2), "a", 0.0)
    body = bytes(4 * 3 * 5400)
    parts = (header.pack(b"MPTS", 1, 3, 5400, 2, part, 60_000) + body for part in range(1000))
    with pytest.raises(ValueError, match="more than 2000000 points"):
        deque(assembly.feed(part, "a", 0.0) for part in parts)


def test_arrays_that_are_no_points_are_not_sent() -> None:
    with pytest.raises(ValueError, match="shape"):
        next(datagrams_of(np.zeros((2, 5)), 1))
    with pytest.raises(ValueError, match="65535 are the most"):
        next(datagrams_of(np.zeros((100_000, 3)), 1, payload_bytes=28))
