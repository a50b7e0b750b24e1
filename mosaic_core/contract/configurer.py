"""Configurers: what an entry point of the group ``mosaic.connectors`` names.

The entry point's name is the YAML ``type``. A configurer gets the validated ``params`` and makes the handler.
"""

from __future__ import annotations

import inspect
from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from typing import Any, ClassVar, Generic, TypeVar, get_args, get_origin

from pydantic import BaseModel

from mosaic_core.contract.declared.class_bodies import check_bodies
from mosaic_core.contract.declared.class_names import check_names
from mosaic_core.contract.declared.type_arguments import TypeArguments, bare_bases
from mosaic_core.contract.declared.wrong_declaration import wrong_declaration
from mosaic_core.contract.devices.shared import Shared
from mosaic_core.contract.handler import AudioReceivable, AudioTrackHandler, Handler, MediaTrackHandler
from mosaic_core.contract.params import NoParams, Params
from mosaic_core.words.config import SafetyConfig

P = TypeVar("P", bound=Params)

API_VERSION = 1
"""Version of this contract. A distribution may say ``MOSAIC_API_VERSION = 1`` in the module of its configurer; a
different number is refused at load, naming the distribution."""


class Configurer(TypeArguments, ABC, Generic[P]):
    """Validates ``params`` (by its type argument) and makes the handler or handlers of one connector.

    The docstring's first line describes the connector in ``mosaic connectors list``.
    """

    connector_type: ClassVar[str] = ""
    """The YAML ``type``: equals the entry point's name."""
    is_called_as_by_originals: ClassVar[bool] = False
    """The type is spelt as the files of original robots spell it, which need not be kebab-case."""
    params_model: ClassVar[type[Params]] = NoParams
    example: ClassVar[dict[str, Any] | None] = None
    """``params`` to paste, shown by ``mosaic connectors show``; ``None``: made from the defaults."""

    trial: ClassVar[dict[str, Any] | None] = None
    """``params`` with which it runs on any machine, with a device that is made up, on a port that is free (0):
    ``mosaic plugin check`` runs it with them, drives it and asks it. ``None``: those of the example, and it is neither
    driven nor asked, for there may be a real device."""

    safety_model: ClassVar[type[SafetyConfig]] = SafetyConfig
    """What ``safety:`` of this connector may say; a subclass adds clamps with defaults."""

    def __init__(
        self, label: str, params: P, *, safety: SafetyConfig | None = None, shared: Shared | None = None
    ) -> None:
        self.label = label
        self.params = params
        self.safety = safety or self.safety_model()
        self.shared = shared or Shared()

    def __init_subclass__(cls, **kwargs: Any) -> None:
        super().__init_subclass__(**kwargs)
        if cls.__module__ != __name__:
            check_names(cls)
            check_bodies(cls)
            _check_init(cls)
        for base in getattr(cls, "__orig_bases__", ()):
            origin = get_origin(base)
            if isinstance(origin, type) and issubclass(origin, Configurer):
                argument = get_args(base)[0]
                if isinstance(argument, type) and issubclass(argument, Params):
                    _check_model(cls, argument)
                    cls.params_model = argument
                elif not isinstance(argument, TypeVar):
                    said = argument.__qualname__ if isinstance(argument, type) else repr(argument)
                    message = f"its params are {said}, which is not derived from Params."
                    raise wrong_declaration(cls, message, "Derive them from it, so that they can be checked.")
        _check_params_said(cls)

    @abstractmethod
    def configure(self) -> Handler | Sequence[Handler]:
        """Make the handler. Open no device here: that is the body's work, so that it can be retried."""


def check_configurer(configurer: object, function: str) -> None:
    """Raise :class:`TypeError` for what is no class of a configurer, given to ``function`` of the kit."""
    if isinstance(configurer, type) and issubclass(configurer, Configurer):
        return
    name = configurer.__name__ if isinstance(configurer, type) else f"an instance of {type(configurer).__name__}"
    raise TypeError(f"`{function}` takes the class of a configurer, whose `configure()` it calls, and not {name}")


def check_written(function: str, **given: object) -> None:
    """Raise :class:`TypeError` for a part of a connector, given to ``function`` of the kit, that is no mapping."""
    for name, value in given.items():
        if value is not None and not isinstance(value, Mapping | BaseModel):
            message = (
                f"`{function}` takes {name} as the YAML file has it, a mapping of keys to values, and not {value!r}"
            )
            raise TypeError(message)


def _check_init(cls: type[Configurer[Any]]) -> None:
    """Refuse an ``__init__`` that can't be called as the robot calls it."""
    if "__init__" not in vars(cls):
        return
    try:
        inspect.signature(vars(cls)["__init__"]).bind(None, "", None, safety=None, shared=None)
    except TypeError as error:
        message = f"__init__ can't be called with (label, params, safety=…, shared=…): {error}."
        how = "def __init__(self, label, params, *, safety=None, shared=None)"
        cure = f"Write `{how}`, which begins with super().__init__(label, params, safety=safety, shared=shared)."
        raise wrong_declaration(cls, message, cure) from None


def _check_params_said(cls: type[Configurer[Any]]) -> None:
    """Refuse a class that reads its ``params`` and leaves open what they are: whatever the file says would be an
    unknown key."""
    base = next((one for one in bare_bases(cls) if issubclass(one, Configurer)), None)
    if base is not None and cls.params_model is NoParams and "params_model" not in vars(cls) and _reads_params(cls):
        cure = f"Write `{base.__name__}[YourParams]`."
        raise wrong_declaration(cls, "it reads its params, and does not say what they are.", cure)


def _reads_params(cls: type[Configurer[Any]]) -> bool:
    codes = (getattr(body, "__code__", None) for body in vars(cls).values())
    return any("params" in code.co_names for code in codes if code is not None)


def _check_model(cls: type[Configurer[Any]], argument: type[Params]) -> None:
    """Refuse a params_model beside another one in the brackets, which counts."""
    written = vars(cls).get("params_model", argument)
    if written is not argument:
        message = (
            f"its params_model is {getattr(written, '__name__', written)}, and its base has [{argument.__name__}]."
        )
        raise wrong_declaration(cls, message, "Name the right one in the brackets, and leave params_model out.")


class DataChannelConfigurer(Configurer[P]):
    """Makes data channel handlers."""


class MediaTrackConfigurer(Configurer[P]):
    """Makes a media handler: pictures, a microphone or a loudspeaker."""

    @abstractmethod
    def configure(self) -> MediaTrackHandler | AudioTrackHandler | AudioReceivable: ...
