"""Configurers: what an entry point of the group ``mosaic.connectors`` names.

The entry point's name is the YAML ``type``. A configurer gets the validated ``params`` and makes the handler.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence, Set
from contextlib import AbstractContextManager, ExitStack
from typing import Any, ClassVar, Generic, Protocol, TypeVar, cast, get_args, get_origin

from mosaic_core.contract.declared.class_bodies import check_bodies
from mosaic_core.contract.declared.class_names import check_names
from mosaic_core.contract.declared.type_arguments import TypeArguments, bare_bases
from mosaic_core.contract.declared.wrong_declaration import wrong_declaration
from mosaic_core.contract.handler import AudioReceivable, AudioTrackHandler, Handler, MediaTrackHandler
from mosaic_core.contract.params import NoParams, Params
from mosaic_core.words.config import SafetyConfig
from mosaic_core.words.errors import MosaicError

P = TypeVar("P", bound=Params)
S = TypeVar("S", bound=AbstractContextManager[Any])

API_VERSION = 1
"""Version of this contract. A distribution may say ``MOSAIC_API_VERSION = 1`` in the module of its configurer; a
different number is refused at load, naming the distribution."""


class HasParams(AbstractContextManager[Any], Protocol):
    """A thing that remembers the ``params`` it was made of."""

    params: Any


D = TypeVar("D", bound=HasParams)


class Shared:
    """Things that several connectors of one robot use together: a serial bus, a simulated world.

    The first ``get`` makes it; it is entered when the robot starts and left, in reverse order, when it stops.
    """

    def __init__(self) -> None:
        self._things: dict[str, AbstractContextManager[Any]] = {}
        self._open: dict[str, ExitStack] = {}
        self._users: dict[str, set[str]] = {}

    def get(self, key: str, make: Callable[[], S], user: str = "") -> S:
        """The thing under ``key`` (choose one that is yours: ``"mosaic-sim:world"``), made on first use. ``user``: the
        label of the connector that asks."""
        if key not in self._things:
            self._things[key] = make()
        self._users.setdefault(key, set()).add(user)
        return cast(S, self._things[key])

    def agreed(self, key: str, make: Callable[[], D], params: Params, what: str) -> D:
        """As :meth:`get`, of a thing that has :attr:`~HasParams.params`: raises :class:`MosaicError`
        (``config.invalid``) where the connector that asked first said others. ``what``: how errors call it, such as
        ``the bus can0``."""
        thing = self.get(key, make)
        if thing.params != params:
            said, others = params.model_dump(), thing.params.model_dump()
            names = ", ".join(name for name, value in said.items() if name not in others or others[name] != value)
            cure = "Give all its connectors the same params: write them once with an anchor (&it), then *it."
            message = f"two connectors describe {what} differently: {names}. {cure}"
            raise MosaicError(message, code="config.invalid", cure=cure)
        return thing

    def of(self, user: str) -> Shared:
        """The same things, as the connector ``user`` gets them."""
        return _SharedOf(self, user)

    def entered(self) -> ExitStack:
        """Everything, entered; the caller closes the stack."""
        self.enter()
        stack = ExitStack()
        stack.callback(self.leave)
        return stack

    def enter(self) -> None:
        """Enter what is not entered yet; if one can't be, those that this call entered are left again."""
        entered: list[str] = []
        try:
            for key, thing in self._things.items():
                if key not in self._open:
                    stack = ExitStack()
                    stack.enter_context(thing)
                    self._open[key] = stack
                    entered.append(key)
        except BaseException:
            self._leave(entered)
            raise

    def leave(self) -> None:
        """Leave everything, the last one first; what one of them raises is raised when all are left."""
        self._leave(list(self._open))

    def _leave(self, keys: list[str]) -> None:
        with ExitStack() as stack:
            for key in keys:
                stack.callback(self._open.pop(key).close)

    # -- for a robot that is given other connectors while it runs ------------------------------------------------

    def without(self, users: Set[str]) -> Shared:
        """Another one with what somebody beside ``users`` has; they get theirs anew."""
        kept = Shared()
        for key, thing in self._things.items():
            if self._users.get(key, set()) - users:
                kept.put(key, thing)
        return kept

    def leave_to(self, successor: Shared) -> None:
        """Leave what ``successor`` does not have; the rest is open there as it is here."""
        kept = [key for key in self._open if successor.has(key, self._things[key])]
        for key in kept:
            successor.adopt(key, self._open.pop(key))
        self.leave()

    def put(self, key: str, thing: AbstractContextManager[Any]) -> None:
        """It is here from the beginning."""
        self._things[key] = thing

    def has(self, key: str, thing: object) -> bool:
        """Whether it has this very thing under ``key``."""
        return self._things.get(key) is thing

    def adopt(self, key: str, opened: ExitStack) -> None:
        """This one leaves it, though another one entered it."""
        self._open[key] = opened


class _SharedOf(Shared):
    """The things of another one, which remembers who asked for them."""

    def __init__(self, whole: Shared, user: str) -> None:
        super().__init__()
        self._whole = whole
        self._user = user

    def get(self, key: str, make: Callable[[], S], user: str = "") -> S:
        return self._whole.get(key, make, user or self._user)


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
