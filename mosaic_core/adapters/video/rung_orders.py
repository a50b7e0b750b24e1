"""Computes rungs from a source and its viewers: what a viewer may choose from, and what must be encoded for all of
them.
"""

from __future__ import annotations

from collections.abc import Hashable, Iterable
from dataclasses import dataclass

from mosaic_core.adapters.video.encoder_thread import EncodedRung, EncoderOrder
from mosaic_core.adapters.video.packet_source import SourceState
from mosaic_core.adapters.video.video_encoder import CodecName, EncoderSettings
from mosaic_core.adapters.video.viewer_feed import ViewerFeed
from mosaic_core.contract.media import EncodingParams, PacketCodec
from mosaic_core.machines.congestion.rate_control import START_BPS
from mosaic_core.machines.media.rung_ladder import ASSUMED_FPS, MAX_CEILING_BPS, Rung, ladder

PASSED_ON: Hashable = "passed on"
"""The rung of packets that came encoded and are sent as they are."""
_SOURCE_FLOOR = 0.75
"""Of a source's own bit rate, which nobody can lower: with less, an operator gets pictures encoded anew."""


@dataclass(frozen=True, slots=True)
class SourceShape:
    """The shape of a source, as far as it is known: the size of its pictures once one was seen, and its packets if it
    sends such."""

    size: tuple[int, int] | None = None
    packets: SourceState | None = None

    def passes_on(self, codec: CodecName | None, *, is_local: bool = False) -> bool:
        """Whether a viewer of ``codec`` can be sent the source's own packets. Their rate can't be lowered: if it is
        above the ceiling, or not known yet, only who is on this robot gets them."""
        packets = self.packets
        if packets is None or codec is None or packets.sendable_as != codec:
            return False
        return is_local or packets.is_within_ceiling

    def is_hopeless(self, codec: CodecName | None) -> bool:
        """Whether a viewer of ``codec`` can't be sent anything."""
        return self.packets is not None and not self.packets.is_decodable and not self.passes_on(codec)


def codecs_of(
    shape: SourceShape, encoding: EncodingParams, declared: PacketCodec | None, found: CodecName
) -> tuple[CodecName, CodecName]:
    """Both codecs, the one to prefer first. ``declared``: that of packets that the handler says it yields; ``found``:
    the one that suits this machine's encoders."""
    wish = (encoding.encoders_codec if encoding.codec == "auto" else encoding.codec) or declared
    seen = shape.packets.sendable_as if shape.packets is not None else None
    first = found
    if wish is not None:
        first = "VP8" if wish == "vp8" else "H264"
    elif seen is not None and shape.passes_on(seen):
        first = seen
    return first, "H264" if first == "VP8" else "VP8"


def limits_bps(shape: SourceShape, encoding: EncodingParams, *, is_local: bool = False) -> tuple[int, int]:
    """Least and most that one viewer is sent."""
    if shape.packets is not None:
        most_bps = max(START_BPS, 2 * shape.packets.bitrate_bps)
        if encoding.max_bitrate_bps is not None and not is_local:
            most_bps = min(most_bps, encoding.max_bitrate_bps)
        return encoding.least_bps, most_bps
    rungs = _encoded_rungs(shape, encoding)
    most_bps = rungs[0].ceiling_bps if rungs else encoding.max_bitrate_bps or MAX_CEILING_BPS
    return encoding.least_bps, most_bps


def options_of(
    codec: CodecName | None, shape: SourceShape, encoding: EncodingParams, *, is_local: bool = False
) -> list[tuple[Hashable, Rung]]:
    """What a viewer of ``codec`` may be sent, best first; nothing while nothing is known."""
    if codec is None:
        return []
    encoded: list[tuple[Hashable, Rung]] = [
        (EncodedRung(codec, rung), rung) for rung in _encoded_rungs(shape, encoding)
    ]
    if not shape.passes_on(codec, is_local=is_local):
        return encoded
    assert shape.packets is not None
    bitrate_bps = shape.packets.bitrate_bps
    # Under a ceiling, what the budget leaves up to it is given to copies: all that the source sends must be within.
    share = 1.0 if encoding.max_bitrate_bps is not None and not is_local else _SOURCE_FLOOR
    own = Rung(0, 0, 1, round(bitrate_bps * share), max(1, bitrate_bps))
    return [(PASSED_ON, own), *((key, rung) for key, rung in encoded if rung.ceiling_bps < bitrate_bps)]


def orders_of(
    label: str, viewers: Iterable[ViewerFeed], encoding: EncodingParams, fps: float | None
) -> dict[EncodedRung, EncoderOrder]:
    """What must be encoded for all of them; a rung's bit rate is that of its slowest viewer. ``fps``: of the source."""
    rates: dict[EncodedRung, int] = {}
    for viewer in viewers:
        for key in viewer.switch.used:
            if isinstance(key, EncodedRung):
                affords = min(key.rung.ceiling_bps, max(key.rung.floor_bps, viewer.budget_bps))
                rates[key] = min(affords, rates.get(key, affords))
    return {key: _order(label, key, bitrate_bps, fps, encoding) for key, bitrate_bps in rates.items()}


def _encoded_rungs(shape: SourceShape, encoding: EncodingParams) -> tuple[Rung, ...]:
    if shape.size is None:
        return ()
    return ladder(
        *shape.size,
        max_bps=encoding.max_bitrate_bps,
        min_bps=encoding.least_bps,
        preset=encoding.preset,
        rungs=encoding.rungs,
    )


def _order(label: str, key: EncodedRung, bitrate_bps: int, fps: float | None, encoding: EncodingParams) -> EncoderOrder:
    rung = key.rung
    settings = EncoderSettings(
        rung.width, rung.height, (fps or ASSUMED_FPS) / rung.frame_step, bitrate_bps, rung.ceiling_bps, encoding.preset
    )
    return EncoderOrder(label, key, settings, encoding.encoder)
