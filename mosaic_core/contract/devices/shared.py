"""What several connectors of one robot use together."""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Iterator, Set
from contextlib import AbstractContextManager, ExitStack, contextmanager, nullcontext
from traceback import extract_tb
from typing import Any, Protocol, TypeVar, cast

from pydantic import BaseModel

from mosaic_core.contract.declared.wrong_declaration import called, wrong_call
from mosaic_core.contract.params import Params
from mosaic_core.words.errors import NOWHERE, CodeLine, DeviceGone, MosaicError

_BY_A_KEEPER = "Open its device with a Keeper, which __enter__ starts: then the robot starts without the device, too."
S = TypeVar("S", bound=AbstractContextManager[Any])


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
        label of the connector that asks. Raises :class:`MosaicError` (``config.broken_plugin``) for what makes nothing
        that can be entered."""
        if key not in self._things:
            self._things[key] = _made(key, make)
        self._users.setdefault(key, set()).add(user)
        return cast(S, self._things[key])

    def agreed(self, key: str, make: Callable[[], D], params: Params, what: str) -> D:
        """As :meth:`get`, of a thing that has :attr:`~HasParams.params`: raises :class:`MosaicError`
        (``config.invalid``) where the connector that asked first said others, and (``config.broken_plugin``) for a
        thing without them. ``what``: how errors call it, such as ``the bus can0``."""
        thing = self.get(key, make)
        _check_remembers(key, thing)
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

    def enter(self, around: Callable[[str], AbstractContextManager[object]] | None = None) -> None:
        """Enter what is not entered yet; if one can't be, those that this call entered are left again. ``around`` what
        each ``__enter__`` does; it is told which one that is. Raises :class:`MosaicError` (``plugin.failed``,
        ``plugin.no_device``, or its own)."""
        entered: list[str] = []
        try:
            for key, thing in self._things.items():
                if key not in self._open:
                    stack, what = ExitStack(), self._called(key)
                    with (
                        (around or nullcontext)(f"the __enter__ of {what}"),
                        _explained(f"{what} can't be entered", _BY_A_KEEPER),
                    ):
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
                stack.callback(self._close, key)

    def _close(self, key: str) -> None:
        with _explained(f"{self._called(key)} can't be left", "Let its __exit__ end whatever it finds."):
            self._open.pop(key).close()

    def _called(self, key: str) -> str:
        """The thing with its connectors, for people."""
        users = [f"'{user}'" for user in sorted(self._users.get(key, ())) if user]
        whose = f" of connector{'s' if len(users) > 1 else ''} {', '.join(users)}" if users else ""
        return f"{called(self._things[key])}{whose}"

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


def _made(key: str, make: Callable[[], S]) -> S:
    if not callable(make):
        message = f"shared.get({key!r}, …) got a {type(make).__name__} in place of what makes one."
        raise wrong_call(message, "Write `lambda:` before it: it is made once, for all who ask.")
    thing = make()
    lacking = [name for name in ("__enter__", "__exit__") if not callable(getattr(type(thing), name, None))]
    if lacking:
        message = f"what shared.get({key!r}, …) makes is {called(thing)}, which has no {' and no '.join(lacking)}."
        cure = "Write both: the robot enters it when it starts, where a Keeper begins, and leaves it when it stops."
        raise wrong_call(message, cure)
    return thing


def _check_remembers(key: str, thing: object) -> None:
    if not isinstance(getattr(thing, "params", None), BaseModel):
        has = "no params" if not hasattr(thing, "params") else "params that are none of a connector"
        message = f"what shared.agreed({key!r}, …) makes is {called(thing)}, which has {has}."
        cure = "Let its __init__ remember what it is made of: self.params = params; shared.get(…) asks for none."
        raise wrong_call(message, cure)


@contextmanager
def _explained(what: str, cure: str) -> Iterator[None]:
    """Tell which thing is concerned, and where, by what the code of an author raises within; ``what`` begins the
    sentence. An error that says itself what is wrong is let through."""
    try:
        yield
    except BaseException as error:
        is_own = isinstance(error, MosaicError) and not isinstance(error, DeviceGone)
        if is_own or isinstance(error, KeyboardInterrupt):
            raise
        at = _raised_at(error)
        is_absent = isinstance(error, DeviceGone)
        said = str(error) if is_absent else f"{type(error).__name__}: {error}"
        code = "plugin.no_device" if is_absent else "plugin.failed"
        raise MosaicError(f"{at.heading}{what}: {said}.", code=code, cure=cure, at=at) from error


def _raised_at(error: BaseException) -> CodeLine:
    """The first line outside this module, which is that of ``__enter__`` or ``__exit__``."""
    frames = [frame for frame in extract_tb(error.__traceback__) if frame.filename != __file__]
    others = [frame for frame in frames if frame.filename != contextlib.__file__]
    return CodeLine(others[0].filename, others[0].lineno) if others else NOWHERE
