"""May this command still act? Refuses what was overtaken, repeated, or too old on arrival.

Age is measured against the fastest message seen from the same sender: ``arrival - stamp`` holds the unknown offset of
the two clocks plus the delay, and its minimum is the offset plus the shortest delay. So no wall clock and no skew
between the two sides can stop or unlock driving.
"""

from __future__ import annotations

from mosaic_core.machines.delivery.framing import is_newer

CLOCK_DRIFT = 500e-6
"""Two oscillators drift apart by at most this share (NTP slews at up to 500 ppm, RFC 5905 §11.3): the minimum may
rise by it, or a session of hours would end up refusing everything."""


class ArrivalBaseline:
    """The smallest ``arrival - stamp`` of one sender; fed by every frame of that peer, whatever its channel."""

    def __init__(self) -> None:
        self._offset_s: float | None = None
        self._at_s = 0.0

    def age_s(self, stamp_us: int, now_s: float) -> float:
        """How much longer than the fastest message this one took. Stamp 0 means unknown and is of age 0."""
        if stamp_us == 0:
            return 0.0
        offset_s = now_s - stamp_us / 1e6
        if self._offset_s is not None:
            self._offset_s += CLOCK_DRIFT * max(0.0, now_s - self._at_s)
        self._at_s = now_s
        if self._offset_s is None or offset_s < self._offset_s:
            self._offset_s = offset_s
        return offset_s - self._offset_s


class CommandGate:
    """The gate of one channel of one peer. ``max_age_s`` ``None``: order only."""

    def __init__(self, baseline: ArrivalBaseline, max_age_s: float | None) -> None:
        self._baseline = baseline
        self._max_age_s = max_age_s
        self._newest_seq: int | None = None

    def refusal(self, seq: int, stamp_us: int, now_s: float) -> str | None:
        """The reason code if the message must not act, ``None`` if it may."""
        age_s = self._baseline.age_s(stamp_us, now_s)
        if self._newest_seq is not None and not is_newer(seq, self._newest_seq):
            return "safety.out_of_order"
        self._newest_seq = seq
        if self._max_age_s is not None and age_s > self._max_age_s:
            return "safety.stale"
        return None
