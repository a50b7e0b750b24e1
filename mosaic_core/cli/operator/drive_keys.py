"""Keys of a terminal as a dead man's switch: pure, so that every key and every pause can be tested.

A terminal tells no key-up, only repeats of the key that was pressed last; so a key counts as held for 0.6 s after it
was last heard (keyboards wait up to half a second before they repeat), then the robot stands.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

HELD_S = 0.6
ESCAPE_WAIT_S = 0.05
"""An Esc that nothing follows for this long is the key Esc, not the beginning of an arrow key."""
IDLE_S = 1.0
"""Zeros are sent for this long after the last motion, then nothing: a program may want to drive."""

Key = Literal["forward", "back", "left", "right", "stand", "stop", "clear", "give", "quit"]
_SEQUENCES: dict[bytes, Key] = {
    b"\x1b[A": "forward", b"\x1b[B": "back", b"\x1b[C": "right", b"\x1b[D": "left",
    b"\x1bOA": "forward", b"\x1bOB": "back", b"\x1bOC": "right", b"\x1bOD": "left",
}  # fmt: skip
_LETTERS: dict[int, Key] = {
    ord("w"): "forward", ord("s"): "back", ord("a"): "left", ord("d"): "right",
    ord(" "): "stand", ord("x"): "stop", ord("X"): "stop", ord("C"): "clear", ord("G"): "give",
    ord("q"): "quit", 3: "quit", 4: "quit",
    ord("W"): "forward", ord("S"): "back", ord("A"): "left", ord("D"): "right",
}  # fmt: skip


class KeyReader:
    """Turns the bytes of a terminal into keys. What is no key of ours counts as ``stand``: a slip must not drive on."""

    def __init__(self) -> None:
        self._escape = b""

    @property
    def is_waiting(self) -> bool:
        """An Esc has come that may begin an arrow key; call :meth:`flush` after :data:`ESCAPE_WAIT_S`."""
        return bool(self._escape)

    def feed(self, data: bytes) -> list[Key]:
        keys: list[Key] = []
        for code in data:
            keys += self._take(code)
        return keys

    def flush(self) -> list[Key]:
        """Nothing followed: it was the key Esc."""
        was_escape, self._escape = bool(self._escape), b""
        return ["stop"] if was_escape else []

    def _take(self, code: int) -> list[Key]:
        byte = bytes([code])
        if not self._escape:
            if byte == b"\x1b":
                self._escape = byte
                return []
            return [_LETTERS.get(code, "stand")]
        if byte == b"\x1b":  # a second Esc: the first one was the key
            return ["stop"]
        self._escape += byte
        if len(self._escape) == 2 and byte in b"[O":
            return []
        if len(self._escape) > 2 and not 0x40 <= code <= 0x7E:
            return []  # parameters of a longer sequence, e.g. with a modifier
        sequence, self._escape = self._escape, b""
        return [_SEQUENCES.get(sequence, "stand")]


@dataclass(frozen=True, slots=True)
class KeyedVelocity:
    """The velocity that the pressed keys ask for, in shares of full speed: ahead and left are positive."""

    ahead: int = 0
    left: int = 0

    @property
    def is_zero(self) -> bool:
        return self.ahead == 0 and self.left == 0


class HeldKeys:
    """Which keys count as held. ``now_s`` is any monotonic clock."""

    def __init__(self) -> None:
        self._heard_s: dict[Key, float] = {}
        self._moved_s: float | None = None

    def press(self, key: Key, now_s: float) -> None:
        """One of the four directions; the opposite one ends. Everything else lets go."""
        opposite: dict[Key, Key] = {"forward": "back", "back": "forward", "left": "right", "right": "left"}
        if key not in opposite:
            self._heard_s.clear()
            return
        self._heard_s.pop(opposite[key], None)
        self._heard_s[key] = now_s

    def velocity(self, now_s: float) -> KeyedVelocity:
        held = {key for key, heard_s in self._heard_s.items() if now_s - heard_s <= HELD_S}
        velocity = KeyedVelocity(("forward" in held) - ("back" in held), ("left" in held) - ("right" in held))
        if not velocity.is_zero:
            self._moved_s = now_s
        return velocity

    def wants_to_send(self, now_s: float) -> bool:
        """While it moves, and for a second of zeros after."""
        return not self.velocity(now_s).is_zero or (self._moved_s is not None and now_s - self._moved_s <= IDLE_S)
