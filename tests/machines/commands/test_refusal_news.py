"""Every refusal is told, or counted in one that is; and nobody floods the operator, nor the robot's memory."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from mosaic_core.machines.commands.refusal_news import EACH, MAX_KINDS, PERIOD_S, RefusalNews
from mosaic_core.machines.timing.deadline import DeadlinePassed
from mosaic_core.words.control import Refusal

NOW = DeadlinePassed()


def refusal(seq: int, label: str = "arm", code: str = "lease.required", gate: str = "lease") -> Refusal:
    return Refusal(label=label, seq=seq, code=code, gate=gate)


def told(news: RefusalNews, count: int, now_s: float) -> list[Refusal]:
    return [one for seq in range(count) for one in news.handle(refusal(seq), now_s)]


def test_what_comes_together_is_told_each() -> None:
    news = RefusalNews()
    assert told(news, EACH, 1.0) == [refusal(seq) for seq in range(EACH)]
    assert news.deadline_s is None
    assert told(news, EACH, 1.0 + PERIOD_S) == [refusal(seq) for seq in range(EACH)], "and so is what comes later"


def test_a_flood_is_counted_and_told_when_its_period_is_over() -> None:
    news = RefusalNews()
    assert len(told(news, EACH + 1, 1.0)) == EACH
    assert news.deadline_s == 1.0 + PERIOD_S
    assert news.handle(NOW, 1.0 + PERIOD_S - 0.001) == []
    assert news.handle(NOW, 1.0 + PERIOD_S) == [refusal(EACH)], "one needs no number"
    assert news.deadline_s is None
    assert told(news, 3, 1.1 + PERIOD_S) == [], "the flood goes on, so nothing is told by itself"
    assert news.handle(NOW, 1.0 + 2 * PERIOD_S) == [refusal(2).model_copy(update={"count": 3})]
    assert news.handle(NOW, 1.0 + 3 * PERIOD_S) == []
    assert len(told(news, 3, 1.0 + 3 * PERIOD_S)) == 3, "after a quiet period each is told again"


def test_another_label_code_or_gate_is_another_kind() -> None:
    news = RefusalNews()
    told(news, EACH, 1.0)
    others = [refusal(1, label="base"), refusal(2, code="lease.expired"), refusal(3, gate="act")]
    assert [one for other in others for one in news.handle(other, 1.0)] == others
    assert news.handle(refusal(4), 1.0) == []


def test_each_kind_is_told_when_its_own_period_is_over() -> None:
    """Two floods, of which the one that began first is in its second period when the other's first one ends."""
    news = RefusalNews()
    told(news, EACH + 1, 1.0)
    of_base = [refusal(seq, label="base") for seq in range(EACH + 1)]
    assert [one for other in of_base for one in news.handle(other, 1.2)] == of_base[:EACH]
    assert news.deadline_s == 1.0 + PERIOD_S, "the earlier of the two"
    assert news.handle(NOW, 1.0 + PERIOD_S) == [refusal(EACH)]
    assert news.deadline_s == 1.2 + PERIOD_S
    assert news.handle(NOW, 1.2 + PERIOD_S) == [of_base[EACH]]


def test_thousands_of_labels_fill_no_memory_and_what_is_forgotten_is_told_first() -> None:
    news = RefusalNews()
    told(news, EACH + 2, 1.0)
    for number in range(MAX_KINDS - 1):
        assert len(news.handle(refusal(0, label=f"{number}"), 1.0)) == 1
    last = refusal(0, label="last")
    assert news.handle(last, 1.0) == [refusal(EACH + 1).model_copy(update={"count": 2}), last]
    assert news.deadline_s is None


@given(st.lists(st.tuples(st.sampled_from("ab"), st.floats(0.0, 0.3)), max_size=200))
def test_all_that_is_told_adds_up_to_all_that_was_refused(steps: list[tuple[str, float]]) -> None:
    news, now_s, counts = RefusalNews(), 0.0, 0
    for seq, (label, gap_s) in enumerate(steps):
        now_s += gap_s
        for one in news.handle(refusal(seq, label=label), now_s):
            counts += one.count or 1
    while news.deadline_s is not None:
        counts += sum(one.count or 1 for one in news.handle(NOW, news.deadline_s))
    assert counts == len(steps)
