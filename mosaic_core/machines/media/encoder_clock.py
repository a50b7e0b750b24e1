"""Steers the bit rate of an encoder that can't be told another one, by the times that its pictures are given.

Such an encoder spends what its rate allows for the time since the picture before. A clock that runs at half speed
halves the bits of every picture, at once and without the key frame that an encoder made anew begins with. The real
times belong to the packets.
"""

from __future__ import annotations

import math

FEWEST, MOST = 1 / 12, 2.0
"""How far the bit rate may be from the one that the encoder began at: its rate buffer is made for that one."""
_LONGEST_INTERVALS = 1.5
"""Of the usual time between pictures. A pause saves up no bits: the picture after it would be a burst."""


class EncoderClock:
    """Gives an encoder its times. ``bitrate_bps``: what it began at. Times are in ticks of any clock."""

    def __init__(self, bitrate_bps: int) -> None:
        self._began_bps = bitrate_bps
        self._ticks = 0.0
        self._last: int | None = None
        self.bitrate_bps = bitrate_bps
        """What is aimed at."""

    @property
    def has_begun(self) -> bool:
        return self._last is not None

    def nearest_bps(self, bitrate_bps: int) -> int:
        """What it reaches of this: beyond, the encoder must begin at another bit rate."""
        return int(min(MOST * self._began_bps, max(math.ceil(FEWEST * self._began_bps), bitrate_bps)))

    def at(self, ticks: int, usual_interval: float | None) -> int:
        """The encoder's time of the picture taken at ``ticks``; it rises with every picture. ``usual_interval``:
        between pictures, once it is known."""
        elapsed = 0 if self._last is None else ticks - self._last
        if usual_interval is not None:
            elapsed = min(elapsed, round(_LONGEST_INTERVALS * usual_interval))
        before, self._last = int(self._ticks), ticks
        self._ticks = max(before + 1.0, self._ticks + elapsed * self.bitrate_bps / self._began_bps)
        return int(self._ticks)
