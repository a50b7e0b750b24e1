"""The golden frames: the same bytes from Python and from TypeScript."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from mosaic_core.machines.delivery.framing import Frame, FrameFlag, FrameReader, PayloadKind, encode_frame
from mosaic_core.words.errors import WireError

GOLDEN = json.loads((Path(__file__).parent / "frames.json").read_text())
FRAMES = [pytest.param(entry, id=entry["name"]) for entry in GOLDEN["frames"]]


def frame_of(entry: dict[str, Any]) -> Frame:
    return Frame(
        kind=PayloadKind(entry["kind"]),
        payload=bytes.fromhex(entry["payload_hex"]),
        seq=entry["seq"],
        epoch=entry["epoch"],
        stamp_us=entry["stamp_us"],
        flags=FrameFlag.LATCHED if entry["latched"] else FrameFlag.NONE,
    )


@pytest.mark.parametrize("entry", FRAMES)
def test_a_golden_frame_is_encoded_to_its_bytes(entry: dict[str, Any]) -> None:
    messages = encode_frame(frame_of(entry), entry["max_payload_bytes"])
    assert [message.hex() for message in messages] == entry["messages_hex"]


@pytest.mark.parametrize("entry", FRAMES)
def test_the_bytes_of_a_golden_frame_are_read_as_the_frame(entry: dict[str, Any]) -> None:
    reader = FrameReader()
    *unfinished, last = [reader.read(bytes.fromhex(message), now_s=0.0) for message in entry["messages_hex"]]
    assert unfinished == [None] * len(unfinished)
    assert last == frame_of(entry)


@pytest.mark.parametrize("text", GOLDEN["malformed_hex"])
def test_malformed_bytes_are_refused(text: str) -> None:
    with pytest.raises(WireError):
        FrameReader().read(bytes.fromhex(text), now_s=0.0)
