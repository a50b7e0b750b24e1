"""A viewer is never sent a picture that builds on one it was not sent, and none from before what it has seen."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

from hypothesis import given
from hypothesis import strategies as st

from mosaic_core.machines.media.rung_switch import MAX_HELD, RungSwitch

A, B = "a", "b"


@dataclass(frozen=True)
class Picture:
    rung: str
    number: int
    is_key: bool
    at: int


class Viewer:
    """Films both rungs, and keeps what it was sent."""

    def __init__(self) -> None:
        self.switch: RungSwitch[str, Picture] = RungSwitch()
        self.numbers = {A: 0, B: 0}
        self.sent: list[Picture] = []

    def film(self, rung: str, at: int, *, is_key: bool = False) -> list[int]:
        """The capture times of what this picture brings."""
        self.numbers[rung] += 1
        picture = Picture(rung, self.numbers[rung], is_key, at)
        taken = self.switch.taken(rung, picture, is_key=is_key, captured_at=at)
        self.sent += taken
        return [one.at for one in taken]


def watching(rung: str, at: int) -> Viewer:
    viewer = Viewer()
    viewer.switch.want(rung)
    assert viewer.film(rung, at, is_key=True) == [at]
    return viewer


def test_it_begins_at_a_key_frame() -> None:
    viewer = Viewer()
    viewer.switch.want(A)
    assert viewer.switch.needs_key == A
    assert [viewer.film(A, at, is_key=at == 2) for at in (1, 2, 3)] == [[], [2], [3]]
    assert viewer.switch.needs_key is None


def test_the_old_rung_goes_on_until_the_new_one_has_a_key_frame() -> None:
    viewer = watching(A, 1)
    viewer.switch.want(B)
    assert viewer.switch.used == (A, B)
    assert viewer.film(A, 2) == [2]
    assert viewer.film(B, 2) == []
    assert viewer.film(B, 3, is_key=True) == [3]
    assert viewer.film(A, 4, is_key=True) == []
    assert viewer.switch.used == (B,)


def test_a_rung_that_is_behind_is_shown_when_it_has_caught_up() -> None:
    """Its key frame came later and is older: nobody steps back in time, and nobody waits for another key frame."""
    viewer = watching(A, 1)
    viewer.film(A, 5)
    viewer.switch.want(B)
    assert viewer.film(B, 3, is_key=True) == []
    assert viewer.switch.needs_key is None
    assert viewer.film(A, 6) == [], "the old rung would run away from the new one"
    assert viewer.film(B, 4) == []
    assert viewer.film(B, 5) == [3, 4, 5], "the same moment is no step back"
    assert viewer.film(B, 6) == [6]


def test_of_two_key_frames_that_are_behind_the_second_begins_the_run() -> None:
    viewer = watching(A, 9)
    viewer.switch.want(B)
    assert viewer.film(B, 3, is_key=True) == []
    assert viewer.film(B, 4, is_key=True) == []
    assert viewer.film(B, 9) == [4, 9]


def test_one_that_never_catches_up_is_shown_all_the_same() -> None:
    viewer = watching(A, 1000)
    viewer.switch.want(B)
    shown = [viewer.film(B, at, is_key=at == 0) for at in range(MAX_HELD + 2)]
    assert shown == [[]] * (MAX_HELD - 1) + [[*range(MAX_HELD)], [MAX_HELD], [MAX_HELD + 1]]


def test_after_a_picture_was_left_out_it_waits_for_any_key_frame() -> None:
    viewer = watching(A, 1)
    viewer.switch.tear()
    assert viewer.switch.needs_key == A
    assert viewer.film(A, 2) == []
    assert viewer.film(A, 3, is_key=True) == [3]
    viewer.switch.want(B)
    viewer.switch.tear()
    assert viewer.film(A, 4, is_key=True) == [4], "the old rung's key frame is shown while the new one has none"


def test_what_waited_when_a_picture_was_left_out_is_never_sent() -> None:
    viewer = watching(A, 9)
    viewer.switch.want(B)
    viewer.film(B, 3, is_key=True)
    viewer.switch.tear()
    assert viewer.film(B, 10) == []
    assert viewer.film(B, 11, is_key=True) == [11]


def test_a_viewer_that_looks_away_starts_over() -> None:
    viewer = watching(A, 9)
    viewer.switch.want(None)
    assert viewer.switch.used == ()
    assert viewer.film(A, 10) == []
    viewer.switch.want(A)
    assert viewer.film(A, 10) == []
    assert viewer.film(A, 3, is_key=True) == [3], "what it saw before it looked away is long gone"


STEPS = st.one_of(
    st.tuples(st.just("want"), st.sampled_from([A, B, None])),
    st.tuples(st.just("tear"), st.none()),
    st.tuples(st.sampled_from([A, B]), st.tuples(st.booleans(), st.integers(0, 9))),
)


@given(st.lists(STEPS, max_size=80))
def test_what_is_sent_always_builds_on_what_was_sent_and_steps_back_only_to_end_a_long_wait(
    steps: list[tuple[str, object]],
) -> None:
    viewer, clocks = Viewer(), {A: 0, B: 0}
    seen: Picture | None = None
    for what, value in steps:
        if what == "want":
            viewer.switch.want(value)  # type: ignore[arg-type]
            seen = None if value is None else seen
        elif what == "tear":
            viewer.switch.tear()
        else:
            is_key, later = value  # type: ignore[misc]
            clocks[what] += later
            before = len(viewer.sent)
            viewer.film(what, clocks[what], is_key=is_key)
            brought = viewer.sent[before:]
            assert len(brought) <= MAX_HELD
            run = [*viewer.sent[before - 1 : before], *brought]
            assert all(after.is_key or after.number == first.number + 1 for first, after in pairwise(run))
            assert all(after.is_key or after.rung == first.rung for first, after in pairwise(run))
            if brought and seen is not None:
                assert brought[-1].at >= seen.at or len(brought) == MAX_HELD
            seen = brought[-1] if brought else seen
