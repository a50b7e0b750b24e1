"""Decides who may be heard on a loudspeaker: who comes first keeps the floor until it was silent for half a second; the
others are told once per attempt that somebody else talks.
"""

from __future__ import annotations

from typing import Literal

SILENCE_S = 0.5
"""Longer than a pause between two sentences, shorter than the wait for an answer."""
MAX_OTHERS = 64
"""Talkers that are remembered as told; more than a robot has peers."""
TalkVerdict = Literal["heard", "refused", "refused again"]


class TalkFloor:
    """The floor of one loudspeaker. ``now_s`` is the robot's monotonic clock."""

    def __init__(self) -> None:
        self._holder: str | None = None
        self._heard_at_s = 0.0
        self._told_at_s: dict[str, float] = {}

    def holder(self, now_s: float) -> str | None:
        """Who has the floor."""
        if self._holder is not None and now_s - self._heard_at_s > SILENCE_S:
            self._holder = None
        return self._holder

    def silent_at_s(self) -> float:
        """When the floor is free again if nobody is heard until then."""
        return self._heard_at_s + SILENCE_S

    def heard(self, talker: str, now_s: float, *, may_talk: bool = True) -> TalkVerdict:
        """Sound of ``talker`` has arrived. ``refused``: and it is to be told."""
        holder = self.holder(now_s)
        if may_talk and holder in (None, talker):
            self._holder, self._heard_at_s = talker, now_s
            self._told_at_s.pop(talker, None)
            return "heard"
        told_at_s = self._told_at_s.pop(talker, None)
        if len(self._told_at_s) >= MAX_OTHERS:
            del self._told_at_s[next(iter(self._told_at_s))]
        self._told_at_s[talker] = now_s
        return "refused" if told_at_s is None or now_s - told_at_s > SILENCE_S else "refused again"

    def left(self, talker: str) -> bool:
        """It is gone. Whether it had the floor."""
        self._told_at_s.pop(talker, None)
        was_holder = self._holder == talker
        if was_holder:
            self._holder = None
        return was_holder
