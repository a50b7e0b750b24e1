"""Notes the moments between the click and the first picture: each moment once, so it is bounded by itself.

Addresses may be in a detail, for the user's own eyes; :meth:`ConnectionTimeline.summary`, which is for logs, has none.
Secrets never are.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from mosaic_core.words.timeline import MOMENT_TITLES, MOMENTS, Moment

MAX_DETAIL = 200


@dataclass(frozen=True, slots=True)
class TimelineMark:
    """One moment; ``at_ms`` since the beginning."""

    moment: Moment
    at_ms: float
    detail: str = ""


class ConnectionTimeline:
    """Notes the moments of one attempt to connect, each once. ``now_s`` is any monotonic clock; one thread (the event
    loop)."""

    def __init__(self, now_s: float) -> None:
        self._began_s = now_s
        self._marks: dict[Moment, TimelineMark] = {}
        self.code = ""
        """Why it ended; empty while it lives."""
        self.ended_ms: float | None = None

    @property
    def marks(self) -> tuple[TimelineMark, ...]:
        """By time."""
        return tuple(sorted(self._marks.values(), key=lambda mark: (mark.at_ms, MOMENTS.index(mark.moment))))

    def mark(self, moment: Moment, now_s: float, detail: str = "") -> None:
        """It happened now; what happens again is not told, nor what comes after the end."""
        if moment not in self._marks and self.ended_ms is None:
            self._marks[moment] = TimelineMark(moment, self._since_ms(now_s), detail[:MAX_DETAIL])

    def end(self, code: str, now_s: float) -> None:
        """The connection, or the attempt, is over; the first reason counts."""
        if self.ended_ms is None:
            self.code, self.ended_ms = code, self._since_ms(now_s)

    def at_ms(self, moment: Moment) -> float | None:
        """When it was; ``None``: it was not."""
        mark = self._marks.get(moment)
        return None if mark is None else mark.at_ms

    def summary(self) -> str:
        """``offered 3, answered 12, ice 40 ms``: for a log, without details."""
        told = ", ".join(f"{mark.moment} {mark.at_ms:.0f}" for mark in self.marks)
        end = "" if self.ended_ms is None else f"; ended {self.ended_ms:.0f} ({self.code})"
        return f"{told or 'nothing'}{end} ms"

    def wire(self) -> dict[str, Any]:
        """For JSON; the dashboard copies the same."""
        marks = [
            {
                "moment": one.moment,
                "title": MOMENT_TITLES[one.moment],
                "atMs": round(one.at_ms, 1),
                "detail": one.detail,
            }
            for one in self.marks
        ]
        ended = {} if self.ended_ms is None else {"code": self.code, "endedMs": round(self.ended_ms, 1)}
        return {"marks": marks, **ended}

    def _since_ms(self, now_s: float) -> float:
        return max(0.0, (now_s - self._began_s) * 1000)
