"""Chunks become messages again. What never completes is forgotten in time, and nobody makes us keep more than a bound:
over all channels of a peer the message that was touched longest ago goes first.

There is no timer here: :meth:`Partials.expire` forgets what is overdue, also where nothing else arrives.
``tests/wire/reassembly.json`` is replayed by the TypeScript twin of this module too.
"""

from __future__ import annotations

from collections import OrderedDict, deque
from collections.abc import Iterator
from dataclasses import dataclass, field

from mosaic_core.machines.delivery.shared_budget import Holding, SharedBudget
from mosaic_core.words.errors import WireError

MAX_MESSAGE_BYTES = 16 * 1024 * 1024
"""Largest message that a receiver reassembles."""
MAX_CHUNKS = 4096
"""Chunks of one message at most: the largest one in 4 KiB each. Smaller ones would cost a receiver more in bookkeeping
than in data."""
MAX_PARTIAL = 4
"""The most unfinished messages of one channel: an ordered one has one, under ``latest`` a few may overlap."""
PARTIALS_BYTES = 2 * MAX_MESSAGE_BYTES
"""What all unfinished messages of one peer may hold: the largest one, and as much again for the others."""
ALL_PARTIALS_BYTES = 2 * PARTIALS_BYTES
"""What those of all peers of a robot may hold: whose peer holds most is forgotten first."""
PART_COST_BYTES = 128
"""What a chunk costs beside its payload: a peer that sends crumbs shall not get more memory than one that doesn't."""
CHUNK_TIMEOUT_S = 5.0
"""On a channel that loses messages, one whose chunks stop arriving for this long is forgotten."""
RELIABLE_CHUNK_TIMEOUT_S = 60.0
"""The same on a channel that loses none: they will still come as long as the connection lives, and that is lost much
earlier than this."""
_REMEMBERED = 16


@dataclass(frozen=True, slots=True)
class Chunk:
    """A part of a message. ``header`` is the same in all of its parts."""

    header: bytes
    index: int
    count: int
    total_bytes: int
    part: bytes


@dataclass(slots=True, eq=False)
class _Partial:
    collector: ChunkCollector
    seq: int
    header: bytes
    total_bytes: int
    touched_at_s: float
    parts: dict[int, bytes] = field(default_factory=dict)
    received_bytes: int = 0

    @property
    def cost_bytes(self) -> int:
        return self.received_bytes + len(self.parts) * PART_COST_BYTES


class Partials:
    """The unfinished messages of one peer, on all its channels. ``now_s``: any monotonic clock; ``budget``: what they
    share with those of all other peers."""

    def __init__(self, limit_bytes: int = PARTIALS_BYTES, budget: SharedBudget | None = None) -> None:
        self._limit_bytes = limit_bytes
        self._holding = Holding(budget or SharedBudget(limit_bytes), self._forget_stalest)
        self._by_age: OrderedDict[_Partial, None] = OrderedDict()
        self.size_bytes = 0

    def expire(self, now_s: float) -> None:
        """Forget what is overdue; its collector tells which."""
        for partial in [one for one in self._by_age if now_s - one.touched_at_s > one.collector.timeout_s]:
            partial.collector.forget(partial.seq)

    @property
    def next_expiry_s(self) -> float | None:
        """When :meth:`expire` has something to forget, if nothing else arrives; ``None``: never."""
        return min((one.touched_at_s + one.collector.timeout_s for one in self._by_age), default=None)

    def touched(self, partial: _Partial, more_bytes: int) -> None:
        """It has grown; make room, if need be."""
        self._by_age[partial] = None
        self._by_age.move_to_end(partial)
        self.size_bytes += more_bytes
        while self.size_bytes > self._limit_bytes and len(self._by_age) > 1:
            self._forget_stalest()
        self._holding.add(self.size_bytes - self._holding.size_bytes)

    def _forget_stalest(self) -> None:
        stalest = next(iter(self._by_age))
        stalest.collector.forget(stalest.seq)

    def gone(self, partial: _Partial) -> None:
        del self._by_age[partial]
        self.size_bytes -= partial.cost_bytes
        self._holding.add(self.size_bytes - self._holding.size_bytes)


class ChunkCollector:
    """Collects the chunks of one channel's messages. ``forgotten`` counts the messages that did not complete."""

    def __init__(
        self,
        partials: Partials,
        max_message_bytes: int = MAX_MESSAGE_BYTES,
        max_partial: int = MAX_PARTIAL,
        timeout_s: float = CHUNK_TIMEOUT_S,
    ) -> None:
        self.timeout_s = timeout_s
        self.forgotten = 0
        self._shared = partials
        self._max_message_bytes = max_message_bytes
        self._max_partial = max_partial
        self._partials: dict[int, _Partial] = {}
        self._given_up: deque[int] = deque(maxlen=_REMEMBERED)
        self._untold: deque[int] = deque(maxlen=_REMEMBERED)

    def add(self, seq: int, chunk: Chunk, now_s: float) -> bytes | None:
        """The payload that ``chunk`` completes. Raises :class:`WireError`; the collector stays usable."""
        if not 0 < chunk.total_bytes <= self._max_message_bytes:
            raise WireError("frame: announced size out of range", code="channel.too_large")
        if not (chunk.index < chunk.count <= MAX_CHUNKS and len(chunk.part) > 0 and chunk.count <= chunk.total_bytes):
            raise WireError("frame: chunk index out of range")
        self._shared.expire(now_s)
        if seq in self._given_up:
            return None
        partial = self._partials.get(seq) or self._begin(seq, chunk, now_s)
        if partial.total_bytes != chunk.total_bytes or partial.header != chunk.header:
            self.drop(seq)
            raise WireError("frame: chunks of one message disagree")
        self._keep(partial, chunk, now_s)
        if seq not in self._partials:
            return None  # forgotten: all peers together hold too much, and this one most
        if partial.received_bytes < chunk.total_bytes and len(partial.parts) < chunk.count:
            return None
        self.drop(seq)
        if partial.received_bytes != chunk.total_bytes or len(partial.parts) != chunk.count:
            raise WireError("frame: chunks do not add up")
        return b"".join(partial.parts[position] for position in range(chunk.count))

    def _begin(self, seq: int, chunk: Chunk, now_s: float) -> _Partial:
        if len(self._partials) >= self._max_partial:
            self.forget(min(self._partials, key=lambda key: self._partials[key].touched_at_s))
        partial = self._partials[seq] = _Partial(self, seq, chunk.header, chunk.total_bytes, now_s)
        self._shared.touched(partial, 0)
        return partial

    def _keep(self, partial: _Partial, chunk: Chunk, now_s: float) -> None:
        partial.touched_at_s = now_s
        more_bytes = 0
        if chunk.index not in partial.parts:
            before_bytes = partial.cost_bytes
            partial.parts[chunk.index] = chunk.part
            partial.received_bytes += len(chunk.part)
            more_bytes = partial.cost_bytes - before_bytes
        self._shared.touched(partial, more_bytes)

    def unfinished(self) -> Iterator[int]:
        """Numbers of the messages whose parts are kept."""
        return iter(tuple(self._partials))

    def forget(self, seq: int) -> None:
        """This one will not complete: count it, and take no more of it."""
        self.drop(seq)
        self._given_up.append(seq)
        self._untold.append(seq)
        self.forgotten += 1

    def drop(self, seq: int) -> None:
        """Without a word: it is complete, useless or broken."""
        self._shared.gone(self._partials.pop(seq))

    def take_forgotten(self) -> list[int]:
        """The numbers of those forgotten since the last call; of very many the last ones."""
        told = list(self._untold)
        self._untold.clear()
        return told

    def close(self) -> None:
        """The channel is gone."""
        for seq in self.unfinished():
            self.drop(seq)
