"""A keeper takes turns on one thread, and never on two."""

import logging
import threading
import weakref
from collections.abc import Callable, Iterator
from contextlib import contextmanager

import pytest

from mosaic_core import DeviceGone, Keeper, MosaicError
from mosaic_core.machines.timing.backoff import BackoffPolicy

IN_TIME_S = 20.0
LONG_S = 600.0


@contextmanager
def started(keeper: Keeper) -> Iterator[None]:
    keeper.start()
    try:
        yield
    finally:
        keeper.stop()


def counting(rests_s: float | None) -> tuple[Callable[[], float | None], threading.Semaphore]:
    """A turn that rests, and what is released with each."""
    taken = threading.Semaphore(0)

    def turn() -> float | None:
        taken.release()
        return rests_s

    return turn, taken


@pytest.mark.parametrize("rests_s", [None, LONG_S])
def test_a_keeper_rests_after_its_turn_until_it_is_woken(rests_s: float | None) -> None:
    turn, taken = counting(rests_s)
    keeper = Keeper("bus", turn)
    with started(keeper):
        assert taken.acquire(timeout=IN_TIME_S)
        assert not taken.acquire(timeout=0.05)
        keeper.wake()
        assert taken.acquire(timeout=IN_TIME_S)


def test_turns_follow_each_other_where_there_is_no_rest() -> None:
    turn, taken = counting(0.0)
    with started(Keeper("bus", turn)):
        for _ in range(10):
            assert taken.acquire(timeout=IN_TIME_S)


def test_what_happens_during_a_turn_is_followed_by_another_one() -> None:
    news, second = ["something"], threading.Event()

    def turn() -> float | None:
        if news:
            news.clear()
            keeper.wake()
        else:
            second.set()
        return None

    keeper = Keeper("bus", turn)
    with started(keeper):
        assert second.wait(IN_TIME_S)


def test_a_wait_within_a_turn_ends_when_it_is_woken_and_when_it_shall_end() -> None:
    waits, found = threading.Semaphore(0), list[bool]()

    def turn() -> float | None:
        while not (found and found[-1]):
            waits.release()
            found.append(keeper.wait())
        return None

    keeper = Keeper("bus", turn)
    with started(keeper):
        assert waits.acquire(timeout=IN_TIME_S)
        keeper.wake()
        assert waits.acquire(timeout=IN_TIME_S)
    assert found == [False, True]


def test_a_wait_within_a_turn_may_be_short() -> None:
    found = list[bool]()
    keeper = Keeper("bus", lambda: found.append(keeper.wait(0.001)))
    with started(keeper):
        while not found:
            keeper.wake()
    assert found[0] is False


def test_stop_waits_for_the_turn_and_for_what_comes_last() -> None:
    order = list[str]()
    is_in_turn, may_end = threading.Event(), threading.Event()

    def turn() -> float | None:
        is_in_turn.set()
        may_end.wait(IN_TIME_S)
        order.append("turn")
        return 0.0

    keeper = Keeper("bus", turn, lambda: order.append("leave"), patience_s=IN_TIME_S)
    keeper.start()
    assert is_in_turn.wait(IN_TIME_S)
    threading.Timer(0.01, may_end.set).start()
    keeper.stop()
    assert order == ["turn", "leave"]
    assert keeper.is_stopping


def no_such_register() -> float:
    raise RuntimeError("no such register")


@pytest.mark.parametrize(("wrong", "said"), [(no_such_register, "no such register"), (lambda: "1", "not '1'")])
def test_a_turn_that_is_wrong_is_told_and_followed_by_another_one(
    caplog: pytest.LogCaptureFixture, wrong: Callable[[], float], said: str
) -> None:
    works, left = threading.Event(), threading.Event()

    def turn() -> float | None:
        if not keeper.failures:
            return wrong()
        works.set()
        return None

    keeper = Keeper("bus", turn, left.set, retry=BackoffPolicy(0.001, max_s=0.001))
    with started(keeper):
        assert works.wait(IN_TIME_S)
    assert left.is_set()
    (told,) = caplog.records
    assert told.getMessage().startswith("bus: a turn failed: ")
    assert told.getMessage().endswith("; the next one comes at once")
    assert said in str(told.exc_info)


@pytest.mark.parametrize(
    ("error", "code"), [(AttributeError("no"), "plugin.failed"), (OSError("no port"), "plugin.no_device")]
)
def test_a_bug_in_its_opening_is_no_absent_device(error: Exception, code: str) -> None:
    keeper = Keeper("bus", lambda: None)
    keeper.broke(error)
    assert keeper.absence is not None
    assert keeper.absence.code == code


def no_port() -> float:
    raise FileNotFoundError("/dev/ttyUSB9")


def test_a_device_whose_opening_breaks_is_away_and_one_that_is_open_stays(caplog: pytest.LogCaptureFixture) -> None:
    turns: list[Callable[[], float | None]] = [no_port, no_port, lambda: 0.0, no_port, lambda: None]
    heard, over = Listener(), threading.Event()

    def turn() -> float | None:
        if len(turns) == 1:
            over.set()
        return turns.pop(0)() if turns else None

    keeper = Keeper("bus", turn, retry=BackoffPolicy(0.001, max_s=0.001, jitter=0.0))
    keeper.listen(heard)
    with started(keeper):
        assert over.wait(IN_TIME_S)
    words = "bus could not be opened: FileNotFoundError: /dev/ttyUSB9"
    assert heard.heard == [f"{words} 0.001", f"{words} 0.001", "back"]
    told = [one.getMessage() for one in caplog.records if one.levelname == "ERROR"]
    hint = "if the device may be away, raise DeviceGone from it"
    assert told == [f"bus: a turn failed: FileNotFoundError: /dev/ttyUSB9; {hint}; the next one comes at once"] * 2


def test_a_keeper_that_was_not_started_stops_and_is_woken_for_nothing() -> None:
    turn, taken = counting(0.0)
    keeper = Keeper("bus", turn)
    keeper.wake()
    keeper.stop()
    assert keeper.is_stopping
    assert keeper.wait(LONG_S)
    assert not taken.acquire(blocking=False)


def test_a_thread_that_hangs_is_abandoned_and_takes_no_turn_when_another_one_does(
    caplog: pytest.LogCaptureFixture,
) -> None:
    hangs, may_go, asked, left = threading.Event(), threading.Event(), list[bool](), list[str]()
    turns = threading.Semaphore(0)

    def turn() -> float | None:
        if not hangs.is_set():
            hangs.set()
            may_go.wait(IN_TIME_S)
            asked.append(keeper.is_stopping)
            return 0.0
        turns.release()
        return None

    keeper = Keeper("bus", turn, lambda: left.append(threading.current_thread().name), patience_s=0.01)
    keeper.start()
    assert hangs.wait(IN_TIME_S)
    (abandoned,) = (one for one in threading.enumerate() if one.name == "bus")
    with caplog.at_level(logging.ERROR):
        keeper.stop()
    assert caplog.messages == ["bus did not close within 0.01 s and was abandoned"]
    with started(keeper):
        assert turns.acquire(timeout=IN_TIME_S)
        assert not keeper.is_stopping
        may_go.set()
        abandoned.join(IN_TIME_S)
        assert asked == [True]
        assert left == []
        assert not turns.acquire(blocking=False)


def test_waits_after_failures_grow_and_begin_anew_after_a_success() -> None:
    keeper = Keeper("bus", lambda: None)
    assert keeper.failures == 0
    assert [keeper.failed() for _ in range(6)] == [0.5, 1.0, 2.0, 4.0, 5.0, 5.0]
    assert keeper.failures
    keeper.worked()
    assert keeper.failures == 0
    assert keeper.failed() == 0.5


class Listener:
    """What a handler's owner hears."""

    def __init__(self) -> None:
        self.heard: list[str] = []
        self.is_there = threading.Event()

    def away(self, gone: DeviceGone, tries_again_in_s: float) -> None:
        self.heard.append(f"{gone} {tries_again_in_s:g}")

    def is_back(self) -> None:
        self.heard.append("back")
        self.is_there.set()


SOON = BackoffPolicy(0.001, factor=2.0, max_s=0.004, jitter=0.0)


def absent_for(turns: int) -> Callable[[], float | None]:
    """A turn that opens nothing so often."""
    left = [turns]

    def turn() -> float | None:
        left[0] -= 1
        if left[0] >= 0:
            raise DeviceGone("no motor on ttyUSB0", "plug it in")
        return None

    return turn


def test_a_device_that_is_away_is_told_with_each_try_and_once_when_it_is_back() -> None:
    listener, keeper = Listener(), Keeper("motor", absent_for(3), retry=SOON)
    keeper.listen(listener)
    with started(keeper):
        assert listener.is_there.wait(IN_TIME_S)
    gone = "no motor on ttyUSB0; plug it in"
    assert listener.heard == [f"{gone} 0.001", f"{gone} 0.002", f"{gone} 0.004", "back"]
    assert (keeper.absence, keeper.failures) == (None, 0)


def test_where_nobody_listens_the_log_tells_it_once(caplog: pytest.LogCaptureFixture) -> None:
    caplog.set_level(logging.INFO)
    turn, works = absent_for(3), threading.Event()

    def turn_or_say() -> float | None:
        turn()
        works.set()
        return None

    with started(Keeper("motor", turn_or_say, retry=SOON)):
        assert works.wait(IN_TIME_S)
    assert caplog.messages == [
        "motor: no motor on ttyUSB0; plug it in; tries again at once",
        "motor: the device is back",
    ]
    assert [record.levelname for record in caplog.records] == ["WARNING", "INFO"]


def test_whoever_finds_it_gone_makes_the_next_turn_come_now_but_only_the_first_time() -> None:
    turn, taken = counting(None)
    listener, keeper = Listener(), Keeper("motor", turn)
    gone = DeviceGone("it does not answer")
    keeper.listen(listener)
    with started(keeper):
        assert taken.acquire(timeout=IN_TIME_S)
        keeper.lost(gone)
        assert taken.acquire(timeout=IN_TIME_S)
        assert listener.is_there.wait(IN_TIME_S)
    keeper.lost(gone)
    keeper.lost(DeviceGone("still not"))
    assert listener.heard == ["it does not answer 0", "back", "it does not answer 0"]
    assert str(keeper.absence) == "it does not answer"


def test_who_listens_late_hears_at_once_that_it_is_away_and_who_ignores_it_hears_no_more() -> None:
    listener, keeper = Listener(), Keeper("motor", lambda: None)
    keeper.lost(DeviceGone("unplugged"))
    keeper.listen(listener)
    assert listener.heard == ["unplugged 0"]
    keeper.ignore(listener)
    keeper.worked()
    assert listener.heard == ["unplugged 0"]


class HalfOpen:
    """What a device holds that could not be opened wholly."""


def test_what_was_half_opened_is_let_go_before_the_next_turn() -> None:
    held, were_free = list["weakref.ref[HalfOpen]"](), threading.Event()

    def turn() -> float | None:
        if held:
            if held[0]() is None and keeper.absence is not None:
                were_free.set()
            return None
        half = HalfOpen()
        held.append(weakref.ref(half))
        raise DeviceGone("no motor on ttyUSB0", "plug it in") from OSError(half)

    keeper = Keeper("motor", turn, retry=SOON)
    with started(keeper):
        assert were_free.wait(IN_TIME_S)


def test_an_absence_that_is_kept_has_the_cure_of_the_error() -> None:
    keeper = Keeper("motor", lambda: None)
    keeper.lost(DeviceGone("no motor", "plug it in"))
    assert keeper.absence is not None
    assert (str(keeper.absence), keeper.absence.cure) == ("no motor; plug it in", "plug it in")


def test_a_turn_in_which_the_device_is_lost_does_not_say_by_its_end_that_it_is_back() -> None:
    turns = 0

    def turn() -> float | None:
        nonlocal turns
        turns += 1
        if turns == 1:
            keeper.lost(DeviceGone("pulled out"))
        return None

    listener, keeper = Listener(), Keeper("motor", turn)
    keeper.listen(listener)
    with started(keeper):
        assert listener.is_there.wait(IN_TIME_S)
        assert turns == 2
    assert listener.heard == ["pulled out 0", "back"]


class Line:
    def turn(self) -> None: ...
    async def later(self) -> None: ...


@pytest.mark.parametrize(
    ("make", "said"),
    [
        (lambda: Keeper(Line().turn, "bus"), "Keeper(…) got a method in place of its name. Write Keeper(name, turn): "),  # type: ignore[arg-type]
        (
            lambda: Keeper("bus", Line().turn()),
            "Keeper('bus', …) got None in place of a turn. Name the method without ",
        ),  # type: ignore[func-returns-value, arg-type]
        (lambda: Keeper("bus", Line().turn, 2.0), "Keeper('bus', …) got a float in place of a leave. Name the method "),  # type: ignore[arg-type]
        (
            lambda: Keeper("bus", Line().later),
            "the turn of Keeper('bus', …) is async or yields, and nothing of it would",
        ),  # type: ignore[arg-type]
    ],
)
def test_what_can_not_take_turns_is_told_where_the_keeper_is_made(make: Callable[[], Keeper], said: str) -> None:
    with pytest.raises(MosaicError) as told:
        make()
    line = make.__code__.co_firstlineno
    assert told.value.message.startswith(f"{__file__}:{line}: {said}")
    assert told.value.code == "config.broken_plugin"


def test_a_turn_that_returns_no_time_is_told_with_its_line(caplog: pytest.LogCaptureFixture) -> None:
    taken = threading.Event()

    def turn() -> float | None:
        taken.set()
        return "soon"  # type: ignore[return-value]

    with started(Keeper("bus", turn)):
        assert taken.wait(IN_TIME_S)
    said = "a turn returns the seconds until the next one, or None, and not 'soon'"
    assert f"TypeError: {__file__}:{turn.__code__.co_firstlineno}: {said}" in caplog.text
