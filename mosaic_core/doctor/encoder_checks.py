"""Whether pictures can be encoded here, and by what; ``mosaic doctor encoders`` tells more."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator

from mosaic_core.words.finding import Finding, failed, passed

CODECS = ("VP8", "H264")


async def encoder_checks() -> AsyncIterator[Finding]:
    """One finding per codec; opening encoders takes a moment, on a thread."""
    for codec in CODECS:
        yield await asyncio.to_thread(_chosen, codec)


def _chosen(codec: str) -> Finding:
    from mosaic_core.adapters.video.encoder_choice import EncoderUnavailable, chosen_kind

    check = f"video.{codec.lower()}"
    try:
        kind = chosen_kind(codec)  # type: ignore[arg-type] # one of CODECS
    except EncoderUnavailable as error:
        return failed(check, "media.no_encoder", error.message)
    where = "in hardware" if kind.is_hardware else "in software"
    return passed(check, f"{codec} is encoded {where}, by {kind.name}.", encoder=kind.name, hardware=kind.is_hardware)
