"""Tells how old a command is on arrival, and whether it is newer than all before it: facts for the gates of age and
sequence in ``admission.py``.

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


class CommandOrder:
    """The order of the commands on one channel of one peer."""

    def __init__(self, baseline: ArrivalBaseline) -> None:
        self._baseline = baseline
        self._newest_seq: int | None = None

    def arrived(self, seq: int, stamp_us: int, now_s: float) -> tuple[float, bool]:
        """The age of a message, and whether it is newer than every one before. Its number counts as seen whatever
        becomes of it: what another gate refuses must not let an older one pass later."""
        age_s = self._baseline.age_s(stamp_us, now_s)
        is_newest = self._newest_seq is None or is_newer(seq, self._newest_seq)
        if is_newest:
            self._newest_seq = seq
        return age_s, is_newest
