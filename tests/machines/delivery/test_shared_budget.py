"""A shared budget: all together never hold more than it allows, and who holds little loses nothing to the greedy."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from mosaic_core.machines.delivery.reassembly import Chunk, ChunkCollector, Partials
from mosaic_core.machines.delivery.shared_budget import Holding, SharedBudget

LIMIT_BYTES = 1000


class Hoarder:
    """Gives back all that it holds when it is told to."""

    def __init__(self, budget: SharedBudget) -> None:
        self.times_told = 0
        self.holding = Holding(budget, self._give_back)

    def _give_back(self) -> None:
        self.times_told += 1
        self.holding.add(-self.holding.size_bytes)


@given(st.lists(st.tuples(st.integers(0, 4), st.integers(1, 700))))
def test_all_together_hold_no_more_than_the_budget(steps: list[tuple[int, int]]) -> None:
    budget = SharedBudget(LIMIT_BYTES)
    hoarders = [Hoarder(budget) for _ in range(5)]
    for who, more_bytes in steps:
        hoarders[who].holding.add(more_bytes)
        assert sum(one.holding.size_bytes for one in hoarders) == budget.size_bytes <= LIMIT_BYTES


@given(st.lists(st.integers(1, 700)), st.integers(1, 200))
def test_who_holds_little_loses_nothing_to_one_who_takes_without_end(steps: list[int], little_bytes: int) -> None:
    budget = SharedBudget(LIMIT_BYTES)
    modest, greedy = Hoarder(budget), Hoarder(budget)
    modest.holding.add(little_bytes)
    for more_bytes in steps:
        greedy.holding.add(more_bytes)
    assert (modest.holding.size_bytes, modest.times_told) == (little_bytes, 0)


def test_one_that_gives_nothing_back_is_asked_once() -> None:
    budget, asked = SharedBudget(LIMIT_BYTES), []
    Holding(budget, lambda: asked.append(True)).add(2 * LIMIT_BYTES)
    assert asked == [True]


def part(size_bytes: int, index: int = 0) -> Chunk:
    return Chunk(b"", index, 2, 2 * size_bytes, bytes(size_bytes))


def test_half_sent_messages_of_many_peers_share_one_budget() -> None:
    budget = SharedBudget(10_000)
    peers = [ChunkCollector(Partials(budget=budget)) for _ in range(40)]
    for number, peer in enumerate(peers):
        for seq in range(3):
            peer.add(seq, part(500 + number), 0.0)
            assert budget.size_bytes <= 10_000
    assert sum(peer.forgotten for peer in peers) > 100


def test_the_peer_with_the_most_loses_a_message_and_others_get_theirs_whole() -> None:
    budget = SharedBudget(10_000)
    modest, greedy = (ChunkCollector(Partials(budget=budget)) for _ in range(2))
    modest.add(1, part(1000), 0.0)
    for seq in range(1, 100):
        greedy.add(seq, part(4000), 0.0)
    assert greedy.forgotten > 90
    assert modest.add(1, part(1000, index=1), 0.0) == bytes(2000)


def test_a_message_that_alone_exceeds_the_budget_is_forgotten_while_it_grows() -> None:
    collector = ChunkCollector(Partials(budget=SharedBudget(1000)))
    assert collector.add(7, part(2000), 0.0) is None
    assert collector.add(7, part(2000, index=1), 0.0) is None
    assert collector.take_forgotten() == [7]
