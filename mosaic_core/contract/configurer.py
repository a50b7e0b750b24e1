"""Configurers: what an entry point of the group ``mosaic.connectors`` names.

The entry point's name is the YAML ``type``. A configurer gets the validated ``params`` and makes the handler.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from contextlib import AbstractContextManager, ExitStack
from typing import Any, ClassVar, Generic, TypeVar, cast, get_args, get_origin

from mosaic_core.contract.handler import AudioReceivable, AudioTrackHandler, Handler, MediaTrackHandler
from mosaic_core.contract.params import NoParams, Params
from mosaic_core.words.config import SafetyConfig

P = TypeVar("P", bound=Params)
S = TypeVar("S", bound=AbstractContextManager[Any])

API_VERSION = 1
"""Version of this contract. A distribution may say ``MOSAIC_API_VERSION = 1`` in the module of its configurer; a
different number is refused at load, naming the distribution."""


class Shared:
    """Things that several connectors of one robot use together: a serial bus, a simulated world.

    The first ``get`` makes it; it is entered when the robot starts and left, in reverse order, when it stops.
    """

    def __init__(self) -> None:
        self._things: dict[str, AbstractContextManager[Any]] = {}

    def get(self, key: str, make: Callable[[], S]) -> S:
        """The thing under ``key`` (choose one that is yours: ``"mosaic-sim:world"``), made on first use."""
        if key not in self._things:
            self._things[key] = make()
        return cast(S, self._things[key])

    def entered(self) -> ExitStack:
        """Everything, entered; the caller closes the stack."""
        with ExitStack() as stack:  # if one can't be entered, the ones before it are left again
            for thing in self._things.values():
                stack.enter_context(thing)
            return stack.pop_all()


class Configurer(ABC, Generic[P]):
    """Validates ``params`` (by its type argument) and makes the handler or handlers of one connector.

    The docstring's first line describes the connector in ``mosaic connectors list``.
    """

    connector_type: ClassVar[str] = ""
    """The YAML ``type``: equals the entry point's name."""
    params_model: ClassVar[type[Params]] = NoParams
    example: ClassVar[dict[str, Any] | None] = None
    """``params`` to paste, shown by ``mosaic connectors show``; ``None``: made from the defaults."""

    trial: ClassVar[dict[str, Any] | None] = None
    """``params`` with which it runs on any machine, with a device that is made up: ``mosaic plugin check`` runs it with
    them. ``None``: those of the example."""

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
        for base in getattr(cls, "__orig_bases__", ()):
            origin = get_origin(base)
            if isinstance(origin, type) and issubclass(origin, Configurer):
                argument = get_args(base)[0]
                if isinstance(argument, type) and issubclass(argument, Params):
                    cls.params_model = argument

    @abstractmethod
    def configure(self) -> Handler | Sequence[Handler]:
        """Make the handler. Open no device here: that is the body's work, so that it can be retried."""


class DataChannelConfigurer(Configurer[P]):
    """Makes data channel handlers."""


class MediaTrackConfigurer(Configurer[P]):
    """Makes a media handler: pictures, a microphone or a loudspeaker."""

    @abstractmethod
    def configure(self) -> MediaTrackHandler | AudioTrackHandler | AudioReceivable: ...
