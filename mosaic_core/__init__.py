"""MOSAIC: robots and operators connected peer to peer.

These are the public names for plugin authors and for programs; importing them loads no WebRTC, video or OpenCV. Each is
imported when it is asked for: `mosaic --help`, like every command, imports this package, and needs none of them.
"""

from importlib import import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:  # the same names for type checkers and editors
    from collections.abc import Callable, Coroutine
    from typing import Any

    from mosaic_core.contract.configurer import (
        API_VERSION,
        Configurer,
        DataChannelConfigurer,
        MediaTrackConfigurer,
    )
    from mosaic_core.contract.devices.keeper import Keeper
    from mosaic_core.contract.devices.shared import Shared
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
    from mosaic_core.contract.params import CameraLabel, DataLabel, Message, NoParams, OwnFolder, Params, unit
    from mosaic_core.contract.request_handler import Request, RequestHandler
    from mosaic_core.contract.sound import Sound, SoundEncoding
    from mosaic_core.runtime.configuration.auto_configurer import AutoConfigurer, Configured
    from mosaic_core.runtime.configuration.resolver import ConnectorResolver
    from mosaic_core.words.data_type import Delivery, MosaicDataType
    from mosaic_core.words.delivery import DeliveryContract
    from mosaic_core.words.errors import ConfigError, DeviceGone, MosaicError, PluginError
    from mosaic_core.words.safety_config import FieldBounds, SafetyConfig

    AMediaTrackHandler = MediaTrackHandler
    """MOSAIC's own name for :class:`MediaTrackHandler`."""
    run_configured: Callable[[Configured], Coroutine[Any, Any, None]]  # declared: its module asks this one's version
    """Run a robot that :class:`AutoConfigurer` has read, until it is cancelled."""
__version__ = "0.1.0"

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
    "DataLabel",
    "Delivery",
    "DeliveryContract",
    "DeviceGone",
    "EncodingParams",
    "FieldBounds",
    "Handler",
    "Keeper",
    "MediaTrackConfigurer",
    "MediaTrackHandler",
    "Message",
    "MosaicDataType",
    "MosaicError",
    "NoParams",
    "OwnFolder",
    "Params",
    "PluginError",
    "Refused",
    "Request",
    "RequestHandler",
    "SafetyConfig",
    "Sender",
    "Shared",
    "Sound",
    "SoundEncoding",
    "hookimpl",
    "run_configured",
    "unit",
]

_PLACES = ("contract.configurer", "contract.devices.keeper", "contract.devices.shared", "contract.handler",
           "contract.hooks", "contract.host", "contract.media", "contract.params", "contract.request_handler",
           "contract.sound",
           "words.data_type", "words.delivery", "words.errors", "words.safety_config",
           "runtime.configuration.resolver", "runtime.configuration.auto_configurer",
           "cli.robot.run_command")  # fmt: skip
_OLD_NAMES = {"AMediaTrackHandler": "MediaTrackHandler"}
"""Names of MOSAIC's own documentation, and ours."""


def __getattr__(name: str) -> object:
    """A public name, imported now and kept."""
    wanted = _OLD_NAMES.get(name, name)
    for place in _PLACES if name in __all__ else ():
        module = import_module(f"{__name__}.{place}")
        if hasattr(module, wanted):
            globals()[name] = found = getattr(module, wanted)
            return found
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
