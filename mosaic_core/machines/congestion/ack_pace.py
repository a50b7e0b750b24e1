"""Decides how many packets of a dense flow one acknowledgement stands for.

Acknowledgements are up to half of all work, but some senders wait for them: after each they send only a few packets,
whatever the window (RFC 9260 §6.1 D leaves it to them). So fewer and fewer are sent, until the sender is seen to wait.
"""

from __future__ import annotations

LEAST = 2
"""RFC 9260 §6.2: at least every second packet, where nothing speaks for less."""
MOST = 16
FEWER_AFTER = 32
"""So many acknowledgements in a row without waiting: trying for more has a price when it fails."""


class AckPace:
    """Decides how many packets of one association an acknowledgement stands for."""

    def __init__(self) -> None:
        self.packets = LEAST
        self._in_a_row = 0

    def kept_up(self) -> None:
        """The flow went on until the acknowledgement was due."""
        self._in_a_row += 1
        if self._in_a_row >= FEWER_AFTER:
            self._in_a_row = 0
            self.packets = min(MOST, self.packets + 1)

    def stalled(self, packets: int) -> None:
        """After so many packets no more came: the sender has no more, or waits for us. Half of that, so that it has
        more on its way next time."""
        self._in_a_row = 0
        self.packets = max(LEAST, min(self.packets, packets // 2))
