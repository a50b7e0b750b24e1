"""Estimates the bit rate that one connection takes, where its receiver tells when each packet arrived.

A queue on the way is seen a tenth of a second after it began: sending pauses until it has drained, and goes on below
what came through meanwhile. Loss without a queue is no congestion, but for a lot of it.
"""

from __future__ import annotations

import math
from collections import deque

from mosaic_core.machines.congestion.congestion_controller import CongestionController, forget
from mosaic_core.machines.congestion.feedback import Feedback, ReceiverReport
from mosaic_core.machines.congestion.held_share import HeldShare
from mosaic_core.machines.congestion.path_share import PathShare
from mosaic_core.machines.congestion.path_watch import PathSeen

_GROWTH, _GUESSED_GROWTH, _CAREFUL_GROWTH = 1.6, 1.25, 1.1
"""Per second: where pictures came through fast enough for far more; where that is not known; and after a congestion."""
_IDLE_GROWTH, _USED = 1.08, 0.6
"""While less of the budget is sent, nothing is proved."""
_ROOM = 1.3
"""So much more room than the budget: the path takes more."""
_SHARE = 0.8
"""Of what the path takes: the rest is for key frames, and drains what is left of the queue."""
_NEAR_SHARE = 0.9
"""Where the last congestion was, it is approached no further while nothing speaks for more."""
_QUEUE_S = 0.05
"""All packets of a report waited so long: a queue stands, if the next report has it too."""
_USUAL_OVER_S, _MOST_USUAL_S = 5.0, 0.1
"""Radio links let packets wait for each other all the time: what is usual where less is sent than the path takes is
no queue of ours."""
_PLAIN_SHARE = 0.75
"""Of what is sent: if no more comes through, a queue needs no second report."""
_UNKNOWN_REPORTS = 4
"""So many, if nothing tells what the path takes: a busy processor is over by then."""
_KEY_ALLOWANCE_S, _KEY_PATIENCE_S = 0.12, 0.8
"""A key frame is a queue of its own for so long."""
_EMPTY_S = 0.03
_EASE_REPORTS, _EASED_SHARE, _FULL_SHARE = 5, 0.85, 0.94
"""A short queue that stands for so many, while so much of what the path takes is sent: a little less lets it drain."""
_UNKNOWN_CUT = 0.75
_PAUSE_FROM_S, _LONGEST_PAUSE_S = 0.08, 0.5
_PAUSE_LESS_S = 0.03
"""The next picture is on its way while the last of the queue drains."""
BAD_LOSS, _LOSS_WINDOW_S, _LEAST_PACKETS = 0.15, 1.0, 20
_SOME_LOSS = 0.02
"""With it, more is not sent than pictures came through at: the queue may be too short to be seen."""
_TRAINS_SHARE = 0.85
_LOSS_INTERVAL_S = 1.0
_SILENT_S = 1.0
"""Reports come ten times per second."""
_SILENT_CUT = 0.7
_MEMORY_S = 20.0


class PathRate(CongestionController):
    """Finds one connection's bit rate from arrival times."""

    silent_s = _SILENT_S

    def __init__(self, min_bps: int, max_bps: int, now_s: float, start_bps: float) -> None:
        super().__init__(min_bps, max_bps, now_s, start_bps)
        self._losses: deque[tuple[float, int, int]] = deque()
        self.loss = 0.0
        """Share of the packets of the last second that got lost."""
        self._cut_at_s = now_s - _LOSS_INTERVAL_S
        self._key_at_s = now_s - _KEY_PATIENCE_S
        self._grown_at_s = now_s
        self._takes_bps: float | None = None
        self._share, self._held = PathShare(), HeldShare(now_s)
        self._queued_reports = self._uneasy_reports = 0
        self.paused_until_s = now_s

    def most_bps(self, now_s: float) -> float:
        """With copies twice the budget where the path takes that."""
        if self.is_limited(now_s) or self.loss > BAD_LOSS:
            return self._budget_bps
        return min(2.0 * self._budget_bps, _TRAINS_SHARE * (self.room_bps(now_s) or math.inf))

    def room_bps(self, now_s: float) -> float | None:
        """What others leave of the speed that single pictures came through at."""
        return None if self.trains_bps is None else self._share.bps(self.trains_bps, now_s)

    def is_limited(self, now_s: float) -> bool:
        """Not long ago it was more than the path takes, and there is no room for twice the budget."""
        if self._congested is None or now_s - self._congested[0] >= _MEMORY_S:
            return False
        return self._takes_bps is None or _SHARE * self._takes_bps < 2.0 * self._budget_bps

    def sent(self, size_bytes: int, now_s: float, *, is_key: bool = False) -> None:
        super().sent(size_bytes, now_s, is_key=is_key)
        if is_key:
            self._key_at_s = now_s

    def handle(self, feedback: Feedback, now_s: float) -> None:
        """What came back. Arrival times tell all; of the rest only the round trip is used, for repeats."""
        if isinstance(feedback, PathSeen):
            self._heard_at_s = now_s
            self.trains_bps = feedback.trains_bps
            self._share.trains_came(feedback.trains_bps or 0.0, now_s)
            self._note_loss(feedback, now_s)
            self._held.reported(feedback, self._budget_bps, now_s)
            self._judge(feedback, now_s)
            self._hold(now_s)
        elif isinstance(feedback, ReceiverReport) and feedback.round_trip_s is not None:
            self.round_trip_s = feedback.round_trip_s

    def tick(self, now_s: float) -> None:
        forget(self._sent, now_s)
        if self._sent and now_s - self._heard_at_s >= _SILENT_S <= now_s - self._cut_at_s:
            self._cut_at_s = now_s
            self._set(self._budget_bps * _SILENT_CUT)

    # -- judging -------------------------------------------------------------------------------------------------

    def _judge(self, seen: PathSeen, now_s: float) -> None:
        elapsed_s = min(0.5, now_s - self._grown_at_s)
        self._grown_at_s = now_s
        if seen.newest_sent_s <= self._cut_at_s:
            self._refine(seen, now_s)
            return
        is_full = self._is_full(seen, now_s)
        if not is_full or seen.queue_s < _EMPTY_S:
            self.usual_s += (min(_MOST_USUAL_S, seen.queue_s) - self.usual_s) * elapsed_s / _USUAL_OVER_S
        self._uneasy_reports = self._uneasy_reports + 1 if seen.queue_s > _EMPTY_S + self.usual_s else 0
        if self._is_congested(seen, now_s):
            self._cut(seen, now_s)
        elif self._uneasy_reports >= _EASE_REPORTS and seen.path_bps is not None and is_full:
            self._ease(seen, seen.path_bps, now_s)
        elif self.loss > BAD_LOSS:
            self._cut_for_loss(now_s)
        elif self.loss > _SOME_LOSS and self._budget_bps > _TRAINS_SHARE * (seen.trains_bps or math.inf):
            self._congested, self._takes_bps = (now_s, seen.trains_bps or self._budget_bps), None
            self._set(_TRAINS_SHARE * self._congested[1])
        elif seen.queue_s < _EMPTY_S + self.usual_s:
            self._set(self._budget_bps * self._growth(now_s) ** elapsed_s)

    def _is_full(self, seen: PathSeen, now_s: float) -> bool:
        """As much is sent as the path takes, as far as anything tells: a queue may be of our own making."""
        takes_bps = self._takes_bps or seen.path_bps
        return takes_bps is not None and self.sent_bps(now_s) > _FULL_SHARE * takes_bps

    def _is_congested(self, seen: PathSeen, now_s: float) -> bool:
        """A queue stands for so many reports, or plainly less comes through than is sent."""
        allowed_s = _QUEUE_S + self.usual_s
        allowed_s += _KEY_ALLOWANCE_S if now_s - self._key_at_s < _KEY_PATIENCE_S else 0.0
        self._queued_reports = self._queued_reports + 1 if seen.queue_s > allowed_s else 0
        is_plain = (
            seen.path_bps is not None
            and seen.path_bps < _PLAIN_SHARE * self.sent_bps(now_s)
            and seen.newest_queue_s > allowed_s
        )
        self.is_queued = is_plain or self._queued_reports > 1
        return is_plain or self._queued_reports >= (_UNKNOWN_REPORTS if seen.path_bps is None else 2)

    def _cut(self, seen: PathSeen, now_s: float) -> None:
        if seen.path_bps is not None:
            self._share.congested(seen.path_bps, seen.left, now_s)
        path_bps = min(seen.path_bps or self._budget_bps, self._budget_bps / _SHARE)
        self._congested, self._takes_bps = (now_s, path_bps), seen.path_bps
        self._cut_at_s = now_s
        self._queued_reports = 0
        self._set(path_bps * _SHARE if seen.path_bps is not None else self._budget_bps * _UNKNOWN_CUT)
        self._pause(seen, now_s)

    def _ease(self, seen: PathSeen, path_bps: float, now_s: float) -> None:
        """Sends a little less, without a pause: what stands drains meanwhile. While a queue grows, more of ours comes
        through than others leave to us: if it does not drain, less is sent once more."""
        self._share.congested(path_bps, seen.left, now_s)
        left_bps = math.inf if seen.left is None or seen.trains_bps is None else seen.left * seen.trains_bps
        self._congested, self._takes_bps = (now_s, path_bps), min(path_bps, left_bps)
        self._uneasy_reports = 0
        self._set(min(self._budget_bps, _EASED_SHARE * path_bps))

    def _cut_for_loss(self, now_s: float) -> None:
        """Beyond that the rate itself is the cause: a queue so short that it never stands."""
        if now_s - self._cut_at_s > _LOSS_INTERVAL_S:
            self._cut_at_s = now_s
            self._congested, self._takes_bps = (now_s, self._budget_bps), None
            self._set(self._budget_bps * (1.0 - self.loss / 2))

    def _refine(self, seen: PathSeen, now_s: float) -> None:
        """Packets of before the cut: they only tell better what the path takes."""
        if self._congested is None or seen.path_bps is None or seen.queue_s < _QUEUE_S:
            return
        path_bps = min(self._congested[1], seen.path_bps)
        self._congested = (now_s, path_bps)
        self._takes_bps = min(self._takes_bps or seen.path_bps, seen.path_bps)
        self._set(min(self._budget_bps, path_bps * _SHARE))
        if now_s < self.paused_until_s:
            self._pause(seen, now_s)

    def _pause(self, seen: PathSeen, now_s: float) -> None:
        if seen.empties_in_s > _PAUSE_FROM_S or now_s < self.paused_until_s:
            longest_s = self._cut_at_s + _LONGEST_PAUSE_S
            self.paused_until_s = min(longest_s, now_s + max(0.0, seen.empties_in_s - _PAUSE_LESS_S))

    def _hold(self, now_s: float) -> None:
        """Others keep the queue full: without a pause, and not below a share."""
        if self._held.is_held:
            self.paused_until_s, self.is_queued = now_s, False
            self._set(max(self._budget_bps, self._held.least_bps(now_s)))

    def _growth(self, now_s: float) -> float:
        """Factor per second."""
        is_used = self.sent_bps(now_s) >= _USED * self._budget_bps
        if self._congested is not None and not is_used:
            return 1.0
        room_bps = self.room_bps(now_s)
        if room_bps is not None:
            if room_bps > _ROOM * self._budget_bps:
                return _GROWTH
            if room_bps * _NEAR_SHARE < self._budget_bps:
                return 1.0
        if self._congested is None:
            return _GUESSED_GROWTH if is_used else _IDLE_GROWTH
        is_near = self.is_limited(now_s) and self._budget_bps > _NEAR_SHARE * self._congested[1]
        return 1.0 if is_near else _CAREFUL_GROWTH

    # ------------------------------------------------------------------------------------------------------------

    def _note_loss(self, seen: PathSeen, now_s: float) -> None:
        self._losses.append((now_s, seen.lost, seen.received))
        while self._losses[0][0] < now_s - _LOSS_WINDOW_S:
            self._losses.popleft()
        lost = sum(lost for _, lost, _ in self._losses)
        total = lost + sum(received for _, _, received in self._losses)
        self.loss = lost / total if total >= _LEAST_PACKETS else 0.0
