"""Requests: a question of one operator, and its answer. A plugin author derives from :class:`RequestHandler`.

::

    class Files(RequestHandler[ListFiles, FileList]):
        def answer(self, question: ListFiles, request: Request) -> FileList:
            return FileList(names=sorted(os.listdir(question.folder)))
"""

from __future__ import annotations

import threading
from collections.abc import Awaitable, Callable, Iterator
from typing import Any, ClassVar, Generic, TypeVar

from pydantic import BaseModel, TypeAdapter

from mosaic_core.contract.declared.json_values import encoded
from mosaic_core.contract.declared.nested_models import is_model
from mosaic_core.contract.declared.type_arguments import argument_of
from mosaic_core.contract.declared.wrong_declaration import wrong_declaration
from mosaic_core.contract.every import refuse_in_async
from mosaic_core.contract.handler import DataChannelBidirectional, message_type_of
from mosaic_core.contract.host import Sender
from mosaic_core.words.data_type import Delivery
from mosaic_core.words.delivery import DeliveryContract

Q = TypeVar("Q")
A = TypeVar("A")


class Request:
    """One request while it is answered. ``sender``: who asked. Every method may be called from any thread.

    In tests :func:`mosaic_core.testing.ask` makes one on the fake clock.
    """

    def __init__(self, sender: Sender | None = None, told: Callable[[Any], object] = lambda value: None) -> None:
        self.sender = sender or Sender("peer", "session")
        self._told = told
        self._cancelled = threading.Event()

    @property
    def is_cancelled(self) -> bool:
        """Nobody waits for the answer any more: cancelled, out of time, the operator gone, the robot stopping, or for
        one that needs a lease: stopped, or the lease lost. An ``async`` body is cancelled too."""
        return self._cancelled.is_set()

    def progress(self, value: Any) -> None:
        """Tell whoever asked how far it is: a message or anything else that is JSON. Never blocks; the newest goes
        out, five times a second at most. Raises :class:`ValueError` or :class:`TypeError` for what is no JSON."""
        plain = value.model_dump(mode="json") if isinstance(value, BaseModel) else value
        try:
            encoded(plain)
        except (TypeError, ValueError) as error:
            raise type(error)(f"request.progress takes a message, or what is JSON: {error}") from None
        if not self.is_cancelled:
            self._told(plain)

    def pause(self, seconds: float) -> bool:
        """Wait on a thread of the handler's own; ``True`` when the request is cancelled, which ends the wait at
        once. Raises :class:`MosaicError` (``plugin.blocks_loop``) in an ``async def``."""
        refuse_in_async("request.pause(…)", "await asyncio.sleep(…)")
        return self._wait(seconds)

    def _wait(self, seconds: float) -> bool:
        return self._cancelled.wait(seconds)

    def cancel(self) -> None:
        """The framework says so."""
        self._cancelled.set()


class RequestHandler(DataChannelBidirectional[Q], Generic[Q, A]):
    """Answers questions of operators, each for the one who asked. ``Q`` and ``A`` are
    :class:`~mosaic_core.contract.params.Message` subclasses, ``dict``, or anything else that pydantic reads from JSON.

    Whatever holds for the messages of a receiver holds for questions: ``requires_lease``, ``takes_observers``, and the
    YAML file's ``safety``. With a lease a stop, and the loss of the lease, cancels them. A question with a key that its
    model does not have is refused.
    """

    widget: ClassVar[str | None] = "request"
    at_once: ClassVar[int] = 4
    """So many are answered at the same time; the others wait for their turn."""
    answer_within_s: ClassVar[float] = 30.0
    """A request that has neither been answered nor refused so long after it came is refused (``request.timeout``)."""

    def answer(self, question: Q, request: Request) -> Any:
        """Return the ``A``. ``def``: on a thread of its own, ``async def``: on the event loop.

        Raise :class:`Refused` to refuse just this request. After any other exception the operator is told
        ``request.failed`` (of :class:`DeviceGone` ``plugin.no_device``) and no more; the robot's log says what and
        where, and the next question is taken.
        """
        raise NotImplementedError(f"{type(self).__name__} needs answer(self, question, request)")

    def handle_data(self, data: Q, *sender: Any, **_: Any) -> Awaitable[None] | None:
        """The framework's own; write :meth:`answer`."""
        raise TypeError(
            f"{type(self).__name__} answers requests: test it by `ask` of mosaic_core.testing, or by `joined`"
        )

    def __init_subclass__(cls, **kwargs: Any) -> None:
        _refuse_mistakes(cls)
        super().__init_subclass__(**kwargs)
        cls.position_fields = ()  # a question is asked as it is, also where its message is one of positions
        _refuse_mistakes(cls)  # also what follows from the question: one that is a Twist would have motion fields


def answer_type_of(handler: type[RequestHandler[Any, Any]]) -> Any:
    """The ``A`` of ``RequestHandler[Q, A]``; ``Any`` where none is written."""
    return argument_of(handler, RequestHandler, 1) or Any


def answer_schema(handler: type[RequestHandler[Any, Any]]) -> dict[str, Any]:
    """JSON Schema of an answer."""
    return TypeAdapter(answer_type_of(handler)).json_schema(mode="serialization")


def _refuse_mistakes(cls: type[RequestHandler[Any, Any]]) -> None:
    message, cure = next(_mistakes(cls), ("", ""))
    if message:
        raise wrong_declaration(cls, message, cure)


def _mistakes(cls: type[RequestHandler[Any, Any]]) -> Iterator[tuple[str, str]]:
    """What the class says that can't be meant, and the cure."""
    if "handle_data" in vars(cls):
        yield "a request is not handled by `handle_data`.", "Write `answer(self, question, request)` instead."
    if cls.sends is not None:
        cure = "Write the answer as the second type of `RequestHandler[Q, A]`."
        yield "`sends` is for what is sent unasked.", cure
    if cls.timeout_s is not None:
        message = "`timeout_s` is for receivers that move something on and on."
        yield message, "Write `answer_within_s`, which bounds a request."
    if name := next((one for one in ("motion_fields", "position_fields", "limits") if getattr(cls, one)), ""):
        yield f"a question has no `{name}`.", "Bound its numbers in its model, by `Field(le=…)`."
    if message_type_of(cls) in (str, bytes) or answer_type_of(cls) is bytes:
        yield "questions and answers are JSON.", "Use a `Message` or `dict`."
    mode = cls.delivery.mode if isinstance(cls.delivery, DeliveryContract) else cls.delivery
    if mode not in (None, Delivery.RELIABLE):
        yield f"a request can't be delivered as {mode}.", "Write `Delivery.RELIABLE`, or leave it out."
    question = message_type_of(cls)
    names = set(question.model_fields) if is_model(question) else set()
    if "id" in names and names & {"question", "cancel"}:
        message = "a question with a field `id` beside `question` or `cancel` can't be told from a numbered request."
        yield message, "Give the field `id` another name."
