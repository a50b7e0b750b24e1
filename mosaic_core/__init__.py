"""MOSAIC: robots and operators connected peer to peer.

These are the public names for plugin authors and for programs; importing them loads no WebRTC, video or OpenCV.
"""

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

__version__ = "0.1.0"

__all__ = [
    "API_VERSION",
    "AudioReceivable",
    "AudioTrackHandler",
    "CameraLabel",
    "Captured",
    "ConfigError",
    "Configurer",
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
