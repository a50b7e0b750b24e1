"""What a peer sends in part is forgotten in time, told to it, and bounded over all its channels."""

from __future__ import annotations

import time
from collections.abc import Iterator
from typing import Any

from mosaic_core.machines.delivery.framing import Frame, FrameReader, PayloadKind, encode_frame
from mosaic_core.runtime.delivery.data_port import PeerPartials


def parts(seq: int = 1) -> Iterator[bytes]:
    return encode_frame(Frame(PayloadKind.BYTES, b"0123456789", seq=seq), 4)


async def test_a_stalled_message_is_told_though_nothing_else_arrives(kit: Any) -> None:
    told: list[tuple[str, int]] = []
    partials = PeerPartials(lambda label, seq: told.append((label, seq)))
    reader = FrameReader(is_lossy=True, partials=partials.shared)
    reader.chunks.timeout_s = 0.05
    partials.opened("scan", reader)
    assert reader.read(next(parts(7)), time.monotonic()) is None
    partials.arrived()
    await kit.until(lambda: told == [("scan", 7)])
    assert partials.shared.size_bytes == 0


async def test_parts_on_a_closed_channel_are_let_go_and_told_to_nobody(kit: Any) -> None:
    told: list[tuple[str, int]] = []
    partials = PeerPartials(lambda label, seq: told.append((label, seq)))
    reader = FrameReader(partials=partials.shared)
    partials.opened("map", reader)
    reader.read(next(parts()), time.monotonic())
    partials.arrived()
    partials.closed(("map", "unknown"))
    assert partials.shared.size_bytes == 0
    assert partials.shared.next_expiry_s is None
    assert told == []
