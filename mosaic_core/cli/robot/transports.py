"""Chooses the libraries that carry a robot's pictures, sound and peer connections; a library is loaded only for a robot
that needs it.

Encoders for a camera, aiortc with its codecs for peers: together they take as much memory as all the rest.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial

from mosaic_core.adapters.peers.later_answerer import LaterAnswererFactory, load_aiortc
from mosaic_core.contract.handler import AudioReceivable, AudioTrackHandler, MediaTrackHandler
from mosaic_core.runtime.configuration.connector import Connector
from mosaic_core.runtime.handlers.routes import handlers_of
from mosaic_core.runtime.media.plain_stream import plain_sound, plain_streams
from mosaic_core.runtime.transport.media_transport import PictureStreamFactory, SoundStreamFactory
from mosaic_core.runtime.transport.transport import AnswererFactory


@dataclass(frozen=True, slots=True)
class Transports:
    """Makes WebRTC's ends for :class:`mosaic_core.runtime.robot.Robot`, as it takes them."""

    make_answerer: AnswererFactory
    open_stream: PictureStreamFactory
    open_sound: SoundStreamFactory


def loaded_transports(connectors: Sequence[Connector], *, relay_only: bool, for_all: bool = False) -> Transports:
    """For a robot with these connectors. One with media loads all at once, so that nobody waits for it later; any
    other loads aiortc with its first operator. ``for_all``: it may have media later."""
    has_cameras, has_microphones, has_speakers = (
        for_all or any(handlers_of(connectors, kind))
        for kind in (MediaTrackHandler, AudioTrackHandler, AudioReceivable)
    )
    has_media = has_cameras or has_microphones or has_speakers
    load = partial(load_aiortc, relay_only=relay_only)
    return Transports(
        load() if has_media else LaterAnswererFactory(load),
        _video() if has_cameras else plain_streams(lambda captured: captured),
        _sound() if has_microphones else plain_sound,
    )


def _video() -> PictureStreamFactory:
    from mosaic_core.adapters.video.shared_video import SharedVideo

    return SharedVideo


def _sound() -> SoundStreamFactory:
    from mosaic_core.adapters.sound.shared_sound import SharedSound

    return SharedSound
