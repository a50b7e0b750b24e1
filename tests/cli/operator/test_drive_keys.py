"""The keyboard as a dead man's switch: silence, slips and escapes."""

from __future__ import annotations

import asyncio
import os
import pty
import termios

import pytest
from hypothesis import given
from hypothesis import strategies as st

from mosaic_core.cli.operator.drive_keys import HELD_S, HeldKeys, Key, KeyedVelocity, KeyReader
from mosaic_core.cli.operator.terminal_keys import terminal_keys


@pytest.mark.parametrize(
    ("data", "keys"),
    [
        (b"w", ["forward"]),
        (b"\x1b[A\x1b[D", ["forward", "left"]),
        (b"\x1bOB", ["back"]),
        (b" ", ["stand"]),
        (b"x", ["stop"]),
        (b"q", ["quit"]),
        (b"C", ["clear"]),
        (b"G", ["give"]),
        (b"j", ["stand"]),
        (b"\x1b[1;5A", ["stand"]),
        (b"\x1b\x1b", ["stop"]),
        (b"\x1bw", ["stand"]),
        ("ä".encode(), ["stand", "stand"]),
    ],
)
def test_bytes_become_keys_and_what_is_no_key_stands(data: bytes, keys: list[Key]) -> None:
    assert KeyReader().feed(data) == keys


def test_an_escape_alone_is_a_stop_once_nothing_follows() -> None:
    reader = KeyReader()
    assert reader.feed(b"\x1b") == []
    assert reader.is_waiting
    assert reader.flush() == ["stop"]
    assert not reader.is_waiting
    assert reader.flush() == []


def test_an_arrow_key_may_arrive_in_pieces() -> None:
    reader = KeyReader()
    assert [key for part in (b"\x1b", b"[", b"C") for key in reader.feed(part)] == ["right"]


@given(st.binary(max_size=40))
def test_no_bytes_break_the_reader_and_it_always_comes_to_rest(data: bytes) -> None:
    reader = KeyReader()
    reader.feed(data)
    reader.flush()
    assert reader.feed(b"w") == ["forward"]


def test_a_key_counts_as_held_until_its_repeat_is_overdue() -> None:
    keys = HeldKeys()
    keys.press("forward", 0.0)
    assert keys.velocity(HELD_S) == KeyedVelocity(1, 0)
    assert keys.velocity(HELD_S + 0.01) == KeyedVelocity(0, 0)


def test_the_opposite_key_turns_at_once_and_two_axes_go_together() -> None:
    keys = HeldKeys()
    keys.press("forward", 0.0)
    keys.press("left", 0.1)
    assert keys.velocity(0.2) == KeyedVelocity(1, 1)
    keys.press("back", 0.2)
    assert keys.velocity(0.2) == KeyedVelocity(-1, 1)


@pytest.mark.parametrize("key", ["stand", "stop", "clear", "give", "quit"])
def test_every_other_key_lets_go(key: Key) -> None:
    keys = HeldKeys()
    keys.press("forward", 0.0)
    keys.press(key, 0.1)
    assert keys.velocity(0.1).is_zero


def test_zeros_follow_for_a_second_and_then_nothing() -> None:
    keys = HeldKeys()
    assert not keys.wants_to_send(0.0)
    keys.press("forward", 0.0)
    assert keys.wants_to_send(0.5)
    keys.press("stand", 0.5)
    assert keys.wants_to_send(1.4)
    assert not keys.wants_to_send(1.6)


@given(st.lists(st.tuples(st.sampled_from(["forward", "back", "left", "right", "stand", "stop"]), st.floats(0, 2))))
def test_nothing_moves_longer_than_its_key_was_heard(presses: list[tuple[Key, float]]) -> None:
    keys, now_s, heard_s = HeldKeys(), 0.0, -10.0
    for key, pause_s in presses:
        now_s += pause_s
        if not keys.velocity(now_s).is_zero:
            assert now_s - heard_s <= HELD_S
        keys.press(key, now_s)
        heard_s = now_s


def test_a_terminal_gives_its_keys_and_gets_its_settings_back() -> None:
    async def scenario(controller: int, terminal: int) -> list[Key]:
        pressed: list[Key] = []
        arrived = asyncio.Event()

        def take(key: Key) -> None:
            pressed.append(key)
            arrived.set()

        async with asyncio.timeout(30), terminal_keys(take, terminal):
            for data in (b"w", b"\x1b[A", b"\x1b"):
                os.write(controller, data)
                await arrived.wait()
                arrived.clear()
        return pressed

    controller, terminal = pty.openpty()
    try:
        before = termios.tcgetattr(terminal)
        assert asyncio.run(scenario(controller, terminal)) == ["forward", "forward", "stop"]
        assert termios.tcgetattr(terminal) == before
    finally:
        os.close(controller)
        os.close(terminal)
