"""What it costs to hold what a handler sends against the type that its class declares.

python bench/sent_messages.py [ROUNDS]

Nanoseconds for each message that a sender hands over, beside the same message made into JSON and handed over unchecked,
alternating in one run; the median of the rounds.
"""

from __future__ import annotations

import statistics
import sys
import time
from collections.abc import Callable
from typing import Any

from pydantic import BaseModel
from rich.console import Console
from rich.table import Table

from mosaic_core import DataChannelSendable, Message
from mosaic_core.contract.host import UnboundHost
from mosaic_core.machines.delivery.framing import PayloadKind
from mosaic_core.words.wire_model import to_json

MESSAGES = 5_000


class Reading(Message):
    voltage_v: float
    current_a: float | None = None


class Gauge(DataChannelSendable[Reading]):
    """Sends checked; :meth:`send_unchecked` is what it was without."""

    def send_unchecked(self, value: Any) -> bool:
        plain = value.model_dump(mode="json") if isinstance(value, BaseModel) else value
        return self._send(PayloadKind.JSON, to_json(plain).encode(), None)


def ns_per_message(send: Callable[[Any], bool], value: Any) -> float:
    began_ns = time.perf_counter_ns()
    for _ in range(MESSAGES):
        send(value)
    return (time.perf_counter_ns() - began_ns) / MESSAGES


def main(rounds: int = 21) -> None:
    gauge = Gauge("gauge")
    gauge.bind(UnboundHost())
    table = Table("sent", "unchecked", "checked", "more", "ratio")
    for name, value in (("message", Reading(voltage_v=1.5)), ("mapping", {"voltage_v": 1.5, "current_a": 2.5})):
        pairs = [
            (ns_per_message(gauge.send_unchecked, value), ns_per_message(gauge.send, value)) for _ in range(rounds)
        ]
        plain, checked = (statistics.median(times) for times in zip(*pairs, strict=True))
        table.add_row(
            name, f"{plain:.0f} ns", f"{checked:.0f} ns", f"{checked - plain:.0f} ns", f"{checked / plain:.2f}"
        )
    Console().print(table)


if __name__ == "__main__":
    main(*map(int, sys.argv[1:]))
