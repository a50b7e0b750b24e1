"""Decides when an operator is told of refusals: each by itself while they are few, a flood of them counted in the next
one that is told. None is passed over.
"""

from __future__ import annotations

from dataclasses import dataclass

from mosaic_core.machines.timing.deadline import DeadlinePassed
from mosaic_core.words.control import Refusal

PERIOD_S = 0.5
EACH = 10
"""So many alike in one period are told each: requests that came together. More are a stream of commands, of which
nobody wants to read each."""
MAX_KINDS = 256
"""Labels come from the other side: never let them fill our memory."""


@dataclass(slots=True)
class _Kind:
    """Refusals alike. ``waiting``: the newest that is not told yet, with how many it stands for."""

    ends_s: float
    told: int = 0
    waiting: Refusal | None = None


class RefusalNews:
    """Merges the refusals of one operator into news. Events are its refusals, effects those to tell now."""

    def __init__(self) -> None:
        self._kinds: dict[tuple[str, str, str | None], _Kind] = {}

    @property
    def deadline_s(self) -> float | None:
        """When what waits must be told."""
        return min((kind.ends_s for kind in self._kinds.values() if kind.waiting is not None), default=None)

    def handle(self, event: Refusal | DeadlinePassed, now_s: float) -> list[Refusal]:
        effects = self._overdue(now_s)
        if isinstance(event, Refusal):
            effects += self._refused(event, now_s)
        return effects

    def _refused(self, refusal: Refusal, now_s: float) -> list[Refusal]:
        effects: list[Refusal] = []
        key = (refusal.label, refusal.code, refusal.gate)
        kind = self._kinds.get(key)
        if kind is None:
            if len(self._kinds) >= MAX_KINDS:
                oldest = self._kinds.pop(next(iter(self._kinds)))
                effects += [oldest.waiting] if oldest.waiting is not None else []
            kind = self._kinds[key] = _Kind(now_s + PERIOD_S)
        if kind.told < EACH:
            kind.told += 1
            return [*effects, refusal]
        before = 0 if kind.waiting is None else kind.waiting.count or 1
        kind.waiting = refusal.model_copy(update={"count": before + 1 if before else None})
        return effects

    def _overdue(self, now_s: float) -> list[Refusal]:
        effects: list[Refusal] = []
        for key, kind in list(self._kinds.items()):
            if now_s < kind.ends_s:
                continue
            if kind.waiting is None:
                del self._kinds[key]
            else:
                effects.append(kind.waiting)
                self._kinds[key] = _Kind(now_s + PERIOD_S, told=EACH)  # a stream: counted as long as it goes on
        return effects
