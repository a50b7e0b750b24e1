"""A viewer is never sent a picture that builds on one it was not sent."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from mosaic_core.machines.media.rung_switch import RungSwitch

A, B = "a", "b"


def test_it_begins_at_a_key_frame() -> None:
    switch: RungSwitch[str] = RungSwitch()
    switch.want(A)
    assert switch.needs_key == A
    assert [switch.takes(A, is_key) for is_key in (False, True, False)] == [False, True, True]
    assert switch.needs_key is None


def test_the_old_rung_goes_on_until_the_new_one_has_a_key_frame() -> None:
    switch: RungSwitch[str] = RungSwitch()
    switch.want(A)
    switch.takes(A, True)
    switch.want(B)
    assert switch.used == (A, B)
    assert switch.takes(A, False)
    assert not switch.takes(B, False)
    assert switch.takes(B, True)
    assert not switch.takes(A, True)
    assert switch.used == (B,)


def test_after_a_picture_was_left_out_it_waits_for_any_key_frame() -> None:
    switch: RungSwitch[str] = RungSwitch()
    switch.want(A)
    switch.takes(A, True)
    switch.tear()
    assert switch.needs_key == A
    assert not switch.takes(A, False)
    assert switch.takes(A, True)
    switch.want(B)
    switch.tear()
    assert switch.takes(A, True), "the old rung's key frame is shown while the new one has none"


def test_a_viewer_that_looks_away_starts_over() -> None:
    switch: RungSwitch[str] = RungSwitch()
    switch.want(A)
    switch.takes(A, True)
    switch.want(None)
    assert switch.used == ()
    assert not switch.takes(A, False)
    switch.want(A)
    assert not switch.takes(A, False)
    assert switch.takes(A, True)


STEPS = st.one_of(
    st.tuples(st.just("want"), st.sampled_from([A, B, None])),
    st.tuples(st.just("tear"), st.none()),
    st.tuples(st.sampled_from([A, B]), st.booleans()),
)


@given(st.lists(STEPS, max_size=80))
def test_what_is_sent_always_builds_on_what_was_sent(steps: list[tuple[str, object]]) -> None:
    switch: RungSwitch[str] = RungSwitch()
    number = {A: 0, B: 0}
    shown: tuple[str, int] | None = None
    for what, value in steps:
        if what == "want":
            switch.want(value)  # type: ignore[arg-type]
            shown = None if value is None else shown
        elif what == "tear":
            switch.tear()
            shown = None
        else:
            number[what] += 1
            if switch.takes(what, bool(value)):
                assert value or shown == (what, number[what] - 1)
                shown = (what, number[what])
            elif shown is not None and shown[0] == what:
                shown = None
