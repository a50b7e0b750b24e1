"""Checks what encodes pictures, and says which encoder is taken; ``mosaic doctor encoders`` tells more."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Literal, TypeAlias

from mosaic_core.doctor.board_checks import ROOT, board_model
from mosaic_core.machines.diagnosis.board_verdicts import Board
from mosaic_core.words.finding import Finding, failed, passed

if TYPE_CHECKING:
    from mosaic_core.adapters.video.video_encoder import EncoderKind

TriedCodec: TypeAlias = Literal["VP8", "H264"]
CODECS: tuple[TriedCodec, ...] = ("VP8", "H264")


async def encoder_checks(root: Path = ROOT) -> AsyncIterator[Finding]:
    """What encodes each codec, and which one is taken; opening encoders takes a moment, on a thread."""
    found = await asyncio.to_thread(found_encoders)
    for codec in CODECS:
        yield _of_codec(codec, found)
    if found:
        yield passed("video.taken", taken_sentence(found, Board(board_model(root))))


def found_encoders() -> dict[TriedCodec, EncoderKind]:
    """The encoder of each codec, as cameras would find it; a codec that nothing encodes is not there. Blocks."""
    from mosaic_core.adapters.video.encoder_choice import EncoderUnavailable, chosen_kind

    found: dict[TriedCodec, EncoderKind] = {}
    for codec in CODECS:
        try:
            found[codec] = chosen_kind(codec)
        except EncoderUnavailable:
            continue
    return found


def taken_sentence(found: Mapping[TriedCodec, EncoderKind], board: Board) -> str:
    """Which of ``found`` cameras take, and where the documentation tells what this board could do."""
    from mosaic_core.adapters.video.found_encoders import preferred_of

    kind = found.get(preferred_of(found)) or next(iter(found.values()))
    where = "hardware" if kind.is_hardware else "software"
    taken = f"Cameras are sent as {kind.codec} by {kind.name} in {where}, where they don't name a codec or an encoder"
    return f"{taken}; see {board.page}."


def _of_codec(codec: TriedCodec, found: Mapping[TriedCodec, EncoderKind]) -> Finding:
    check = f"video.{codec.lower()}"
    kind = found.get(codec)
    if kind is None:
        return failed(check, "media.no_encoder", f"no encoder for {codec} works here; see `mosaic doctor encoders`")
    where = "in hardware" if kind.is_hardware else "in software"
    return passed(check, f"{codec} is encoded {where}, by {kind.name}.", encoder=kind.name, hardware=kind.is_hardware)
