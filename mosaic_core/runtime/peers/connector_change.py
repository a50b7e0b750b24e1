"""Tells which connector may take over the ways of another one without anybody noticing, and what changes else."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

from mosaic_core.contract.handler import (
    AudioReceivable,
    AudioTrackHandler,
    DataChannelReceivable,
    Handler,
    MediaTrackHandler,
)
from mosaic_core.contract.media import EncodingParams
from mosaic_core.contract.sound import SoundEncoding
from mosaic_core.machines.delivery.delivery_terms import DeliveryTerms
from mosaic_core.runtime.configuration.connector import Connector
from mosaic_core.runtime.configuration.receiver_safety import ReceiverSafety
from mosaic_core.runtime.peers.site import RouteChange
from mosaic_core.words.data_type import Direction, MosaicDataType

ConnectorShape = tuple[str, MosaicDataType, Direction, bool, bool, DeliveryTerms, object, object]


def takes_ways(old: Connector | None, new: Connector) -> bool:
    """Whether ``new`` sends and takes on the same channels and tracks, in the same form, so that open ones go on."""
    if old is None or len(old.handlers) != len(new.handlers):
        return False
    pairs = zip(old.handlers, new.handlers, strict=True)
    return all(_shape(one, old) == _shape(other, new) for one, other in pairs)


def _shape(handler: Handler, connector: Connector) -> ConnectorShape:
    return (
        handler.label,
        handler.data_type,
        handler.direction,
        handler.is_for_originals,
        handler.is_part,
        connector.terms_of(handler),
        _encoding(handler),
        _is_repeated(handler, connector),
    )


def _encoding(handler: Handler) -> object:
    """What the stream of a camera or microphone was opened with."""
    if isinstance(handler, MediaTrackHandler):
        return handler.encoding.model_dump(include=set(EncodingParams.model_fields)), handler.packet_codec
    if isinstance(handler, AudioTrackHandler):
        return handler.encoding.model_dump(include=set(SoundEncoding.model_fields))
    return isinstance(handler, AudioReceivable)


def _is_repeated(handler: Handler, connector: Connector) -> object:
    """What decides whether commands are numbered across connections: what moves something is never repeated."""
    if not isinstance(handler, DataChannelReceivable):
        return None
    safety = ReceiverSafety.of(connector.safety, handler)
    return safety.is_motion, safety.max_rate_hz is None


def route_change(
    gone: Iterable[Connector], fresh: Iterable[Connector], replaced: Mapping[str, Connector]
) -> RouteChange:
    """What becomes of the labels of handlers. ``replaced``: by the connector's label, whose ways were taken over."""
    new = list(fresh)
    taken = [one for one in new if one.config.label in replaced]
    added = [one for one in new if one.config.label not in replaced]
    removed = [one for one in gone if one.config.label not in replaced]
    return RouteChange(_labels(removed), _labels(added), _data_labels(taken))


def _labels(connectors: Iterable[Connector]) -> frozenset[str]:
    return frozenset(handler.label for connector in connectors for handler in connector.handlers)


def _data_labels(connectors: Iterable[Connector]) -> frozenset[str]:
    handlers = (handler for connector in connectors for handler in connector.handlers)
    return frozenset(one.label for one in handlers if one.data_type is not MosaicDataType.MEDIA)
