"""What one attempt to connect finds."""

from __future__ import annotations

import time
from collections.abc import Awaitable, Callable
from dataclasses import dataclass
from typing import Any

ATTEMPT_S = 30.0


@dataclass(frozen=True, slots=True)
class Firsts:
    """Seconds from the click to the first value in the program or page, and to the first decoded picture."""

    data_s: float
    frame_s: float


Attempt = Callable[[], Awaitable[Firsts]]


async def taken(work: Awaitable[Any], since_s: float) -> float:
    await work
    return time.perf_counter() - since_s
