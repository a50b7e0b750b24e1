"""After a stop whoever sent on must let go first; what the link lost is no pause."""

from __future__ import annotations

import pytest

from mosaic_core.machines.commands.release_first import MAX_HOLDING, OPENING_S, CommandPauses, ReleaseFirst
from mosaic_core.machines.delivery.framing import SEQ_MODULUS


def test_who_was_there_at_a_stop_or_came_during_it_holds_until_it_lets_go() -> None:
    release = ReleaseFirst()
    assert not release.is_holding("ann")
    release.stopped(["ann", "bob"])
    release.joined("cid")
    release.let_go("ann")
    release.let_go("nobody")
    assert [release.is_holding(key) for key in ("ann", "bob", "cid", "dan")] == [False, True, True, False]
    release.stopped(["ann"])
    assert [release.is_holding(key) for key in ("ann", "bob")] == [True, True], "bob has not let go since the first"


def test_whoever_comes_again_and_again_does_not_fill_the_memory() -> None:
    release = ReleaseFirst()
    for number in range(MAX_HOLDING):
        release.joined(f"session {number}")
    release.joined("session 0")
    release.joined("one more")
    assert not release.is_holding("session 1"), "the one that came first, and not again"
    assert all(release.is_holding(key) for key in ("session 0", "session 2", "one more"))


@pytest.mark.parametrize(
    ("seqs", "pauses"),
    [
        ((1, 2), (0.5, 1.5)),
        ((None, None), (0.5, 1.5)),
        ((1, 3), (0.5, 0.0)),
        ((3, 3), (0.5, 0.0)),
        ((3, 2), (0.5, 0.0)),
        ((SEQ_MODULUS - 1, 0), (0.5, 1.5)),
        ((7, None), (0.5, 1.5)),
    ],
)
def test_a_silence_is_a_pause_where_no_number_is_missing(
    seqs: tuple[int | None, ...], pauses: tuple[float, ...]
) -> None:
    it = CommandPauses(10.0 - OPENING_S)
    assert (it.arrived(seqs[0], 10.5), it.arrived(seqs[1], 12.0)) == pauses


def test_a_pause_ends_with_every_message() -> None:
    it = CommandPauses(10.0 - OPENING_S)
    assert [it.arrived(seq, 10.0 + seq / 10) for seq in (1, 2, 3)] == pytest.approx([0.1] * 3)


@pytest.mark.parametrize(
    ("stamps_us", "pause_s"),
    [((7_000_000, 7_050_000), 0.05), ((7_000_000, 9_000_000), 0.5), ((7_000_000, 0), 0.5), ((0, 7_000_000), 0.5)],
    ids=["held up", "paused", "unknown", "unknown before"],
)
def test_what_the_link_held_up_is_no_pause(stamps_us: tuple[int, int], pause_s: float) -> None:
    it = CommandPauses(10.0 - OPENING_S)
    it.arrived(1, 10.0, stamps_us[0])
    assert it.arrived(2, 10.5, stamps_us[1]) == pause_s


def test_before_the_first_command_no_stamp_is_known() -> None:
    assert CommandPauses(10.0 - OPENING_S).arrived(1, 10.5, 50_000) == 0.5, "the sender's clock began just now"


@pytest.mark.parametrize(("after_s", "pause_s"), [(0.4, 0.0), (OPENING_S, 0.0), (OPENING_S + 0.5, 0.5)])
@pytest.mark.parametrize("seq", [None, 7])
def test_who_sends_as_soon_as_the_channel_is_known_to_be_open_has_not_paused(
    seq: int | None, after_s: float, pause_s: float
) -> None:
    assert CommandPauses(10.0).arrived(seq, 10.0 + after_s) == pytest.approx(pause_s)
