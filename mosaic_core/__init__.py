"""MOSAIC: robots and operators connected peer to peer.

These are the public names for plugin authors and for programs; importing them loads no WebRTC, video or OpenCV.
"""

from importlib import import_module
from typing import TYPE_CHECKING

from mosaic_core.contract.configurer import (
    API_VERSION,
    Configurer,
    DataChannelConfigurer,
    MediaTrackConfigurer,
    Shared,
)
from mosaic_core.contract.handler import (
    AudioReceivable,
    AudioTrackHandler,
    DataChannelBidirectional,
    DataChannelByteReceivable,
    DataChannelJsonReceivable,
    DataChannelReceivable,
    DataChannelSendable,
    DataChannelStringReceivable,
    Handler,
    MediaTrackHandler,
    Refused,
)
from mosaic_core.contract.hooks import hookimpl
from mosaic_core.contract.host import Sender
from mosaic_core.contract.media import Captured, EncodingParams
from mosaic_core.contract.params import CameraLabel, Message, NoParams, Params, unit
from mosaic_core.contract.sound import Sound, SoundEncoding
from mosaic_core.words.data_type import Delivery, MosaicDataType
from mosaic_core.words.delivery import DeliveryContract
from mosaic_core.words.errors import ConfigError, MosaicError, PluginError

if TYPE_CHECKING:
    from mosaic_core.runtime.configuration.auto_configurer import AutoConfigurer
    from mosaic_core.runtime.configuration.resolver import ConnectorResolver

__version__ = "0.1.0"

AMediaTrackHandler = MediaTrackHandler  # the name in MOSAIC's own documentation

_LAZY = {
    "AutoConfigurer": "mosaic_core.runtime.configuration.auto_configurer",
    "ConnectorResolver": "mosaic_core.runtime.configuration.resolver",
}
"""Where those names are that plugins rarely need: loaded when asked for, since they read YAML and look for plugins."""

__all__ = [
    "API_VERSION",
    "AMediaTrackHandler",
    "AudioReceivable",
    "AudioTrackHandler",
    "AutoConfigurer",
    "CameraLabel",
    "Captured",
    "ConfigError",
    "Configurer",
    "ConnectorResolver",
    "DataChannelBidirectional",
    "DataChannelByteReceivable",
    "DataChannelConfigurer",
    "DataChannelJsonReceivable",
    "DataChannelReceivable",
    "DataChannelSendable",
    "DataChannelStringReceivable",
    "Delivery",
    "DeliveryContract",
    "EncodingParams",
    "Handler",
    "MediaTrackConfigurer",
    "MediaTrackHandler",
    "Message",
    "MosaicDataType",
    "MosaicError",
    "NoParams",
    "Params",
    "PluginError",
    "Refused",
    "Sender",
    "Shared",
    "Sound",
    "SoundEncoding",
    "hookimpl",
    "unit",
]


def __getattr__(name: str) -> object:
    if name in _LAZY:
        return getattr(import_module(_LAZY[name]), name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
