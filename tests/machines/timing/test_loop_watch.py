"""When an event loop counts as blocked: never by the delays of the machine, always by what holds it, told once each."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from mosaic_core.machines.timing.loop_watch import (
    BLOCKED_S,
    GOES_ON_S,
    LOOK_PERIOD_S,
    AskLoop,
    LookAtStack,
    LoopWatch,
    StackFrame,
    TellBlocked,
    blamed,
)


class Loop:
    """A loop and its guard on one clock. ``told``: what the guard would tell."""

    def __init__(self) -> None:
        self.now_s = 50.0
        self.watch = LoopWatch(self.now_s)
        self.has_answered = False
        self.told: list[TellBlocked] = []
        self.looks = 0

    def pass_by(self, seconds: float, *, is_blocked: bool = False) -> None:
        """So long; the guard looks once a period."""
        end_s = self.now_s + seconds
        while self.now_s + LOOK_PERIOD_S <= end_s:
            self.now_s += LOOK_PERIOD_S
            self.look(is_blocked)
        self.now_s = end_s

    def stand_still(self, seconds: float) -> None:
        """The whole machine does, and the guard with it."""
        self.now_s += seconds

    def look(self, is_blocked: bool = False) -> None:
        if not is_blocked:
            self.has_answered = True
        for effect in self.watch.look(self.now_s, has_answered=self.has_answered):
            match effect:
                case AskLoop():
                    self.has_answered = False
                case LookAtStack():
                    self.looks += 1
                case TellBlocked():
                    self.told.append(effect)


@given(st.lists(st.floats(0.01, 5.0), max_size=20))
def test_a_loop_that_answers_is_never_told_of_however_late_everybody_is(pauses_s: list[float]) -> None:
    loop = Loop()
    for pause_s in pauses_s:
        loop.stand_still(pause_s)
        loop.look()
    assert (loop.told, loop.looks) == ([], 0)


@given(st.floats(BLOCKED_S + 3 * LOOK_PERIOD_S, 30.0))
def test_a_block_is_told_with_its_length_once_it_is_over(block_s: float) -> None:
    loop = Loop()
    loop.pass_by(1.0)
    loop.pass_by(block_s, is_blocked=True)
    loop.pass_by(1.0)
    over = [told for told in loop.told if told.is_over]
    assert len(over) == 1
    assert abs(over[0].duration_s - block_s) <= 2 * LOOK_PERIOD_S
    assert loop.looks >= 1


def test_one_that_goes_on_is_told_before_it_is_over() -> None:
    loop = Loop()
    loop.pass_by(1.0)
    loop.pass_by(GOES_ON_S + 1.0, is_blocked=True)
    assert [told.is_over for told in loop.told] == [False]
    assert loop.looks == 2, "the line it hangs in now is what counts"
    loop.pass_by(60.0, is_blocked=True)
    assert len(loop.told) == 1


@given(st.floats(0.0, BLOCKED_S - LOOK_PERIOD_S - 0.001))
def test_what_is_short_is_not_worth_a_word(block_s: float) -> None:
    loop = Loop()
    loop.pass_by(1.0)
    loop.pass_by(block_s, is_blocked=True)
    loop.pass_by(1.0)
    assert loop.told == []


@given(st.floats(0.3, 3600.0))
def test_a_machine_that_was_asleep_blames_nobody(asleep_s: float) -> None:
    loop = Loop()
    loop.pass_by(1.0)
    loop.stand_still(asleep_s)
    loop.look(is_blocked=True)
    loop.pass_by(1.0)
    assert loop.told == []


LINES = st.builds(
    StackFrame,
    file=st.sampled_from(["plugin.py", "core.py", "json.py"]),
    line=st.integers(1, 99),
    function=st.just("f"),
    label=st.sampled_from(["", "front"]),
    is_plugin=st.booleans(),
    is_library=st.booleans(),
)


@given(st.lists(LINES, max_size=8))
def test_the_innermost_line_of_a_plugin_is_to_blame_where_there_is_one(stack: list[StackFrame]) -> None:
    blame = blamed(stack)
    if not stack:
        assert blame is None
        return
    assert blame is not None
    of_plugins = [frame for frame in stack if frame.is_plugin and not frame.is_library]
    if of_plugins:
        assert (blame.file, blame.line) == (of_plugins[0].file, of_plugins[0].line)
    labels = [frame.label for frame in stack if frame.label]
    assert blame.label == (labels[0] if labels else "")
