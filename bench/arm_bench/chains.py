"""Two arms of one joint, servo by servo made up behind real serial lines: what is read of one, and told to the other,
is written down with the time."""

from __future__ import annotations

import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path

sys.path.append(str(Path(__file__).parents[2] / "tests"))

from support.devices.servo_chain import ServoChain

from arm_bench.figures import Sighting

MOTOR = 1
START_TICKS = 1100
TICKS_PER_S = 100
"""A tick for each turn of a bus at 100 Hz."""
MOST_S = 25.0
"""Further the joint can't be led."""
_READ_ALL, _WRITE_ALL = 0x82, 0x83


@dataclass
class Chains:
    """A leader that a made-up hand leads from :meth:`lead` on, and a follower."""

    leader: ServoChain
    follower: ServoChain
    led: list[Sighting] = field(default_factory=list)
    told: list[Sighting] = field(default_factory=list)
    begun_s: float | None = None

    def lead(self) -> None:
        self.begun_s = time.monotonic()

    def read(self, _motor: int, code: int, _params: bytes) -> None:
        """Somebody reads the leader."""
        now_s, begun_s = time.monotonic(), self.begun_s
        if code == _READ_ALL:
            ticks = START_TICKS + (0 if begun_s is None else int((now_s - begun_s) * TICKS_PER_S))
            self.leader.motors[MOTOR].put(self.leader.present[0], ticks, 2)
            if begun_s is not None:
                self.led.append((now_s, ticks))

    def written(self, _motor: int, code: int, params: bytes) -> None:
        """Somebody tells the follower."""
        if code == _WRITE_ALL and params[0] == self.follower.goal[0] and self.begun_s is not None:
            self.told.append((time.monotonic(), int.from_bytes(params[3:5], "little")))


@contextmanager
def chains() -> Iterator[Chains]:
    with ServoChain([MOTOR]) as leader, ServoChain([MOTOR]) as follower:
        both = Chains(leader, follower)
        leader.motors[MOTOR].put(leader.present[0], START_TICKS, 2)
        follower.motors[MOTOR].put(follower.present[0], START_TICKS, 2)
        leader.heard, follower.heard = both.read, both.written
        leader.follows = False
        yield both
