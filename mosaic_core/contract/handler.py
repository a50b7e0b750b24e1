"""Handlers: what sends, receives or streams. A plugin author derives from one of them.

Threads: a ``def`` body runs on a thread of its own for life, an ``async def`` body as a task on the robot's event
loop. ``send_*`` may be called from any thread, never blocks, and says whether the message was accepted.
"""

from __future__ import annotations

from collections.abc import AsyncIterator, Awaitable, Callable, Iterable, Mapping, Sequence
from typing import Any, ClassVar, Generic, Literal, TypeVar

from pydantic import BaseModel

from mosaic_core.contract.data_tap import DataTap
from mosaic_core.contract.declared.class_bodies import check_bodies
from mosaic_core.contract.declared.class_names import check_derived, check_names
from mosaic_core.contract.declared.class_safety import (
    check_bounds,
    check_fields,
    check_item_names,
    check_limits,
    check_lists,
    check_resource,
    check_timeout,
)
from mosaic_core.contract.declared.class_values import (
    check_delivery,
    check_media_delivery,
    check_runs,
    check_sent,
    check_values,
    check_widget,
    is_said_later,
)
from mosaic_core.contract.declared.declared_message import DeclaredMessage
from mosaic_core.contract.declared.instance_names import check_instance_names
from mosaic_core.contract.declared.sent_picture import check_picture, check_stamp
from mosaic_core.contract.declared.sent_sound import check_sound
from mosaic_core.contract.declared.type_arguments import TypeArguments, argument_of
from mosaic_core.contract.declared.wrong_declaration import wrong_declaration
from mosaic_core.contract.devices.keeper import Keeper
from mosaic_core.contract.devices.named_keeper import check_keeper
from mosaic_core.contract.every import Every, refuse_in_async
from mosaic_core.contract.host import HandlerHost, Loss, Outgoing, Sender, UnboundHost
from mosaic_core.contract.media import Captured, EncodingParams, PacketCodec, Picture
from mosaic_core.contract.media_tap import MediaTap, PictureTap, TapCodec
from mosaic_core.contract.message_fields import MessageFields, message_fields
from mosaic_core.contract.params import Message, Params
from mosaic_core.contract.sound import Sound, SoundEncoding
from mosaic_core.machines.delivery.framing import PayloadKind
from mosaic_core.words.data_type import Delivery, Direction, Kind, MosaicDataType
from mosaic_core.words.delivery import DeliveryContract
from mosaic_core.words.errors import Refused as Refused
from mosaic_core.words.limits import MOTION_KINDS
from mosaic_core.words.safety_config import FieldBounds

T = TypeVar("T")
Runs = Literal["always", "watched"]


class Handler(TypeArguments):
    """The base of all handlers. ``label`` is the name of the data channel or track."""

    runs: ClassVar[Runs] = "always"
    """``always``: while the robot runs. ``watched``: only while an operator listens or watches."""
    kind: ClassVar[Kind] = Kind.DATA
    delivery: ClassVar[Delivery | DeliveryContract] = Delivery.RELIABLE
    """The default of this handler: a mode, or one with bounds of its own; the YAML file's ``delivery`` overrides it."""
    is_for_originals: bool = False
    """A channel that only original dashboards know: no operator of ours is told of it. It repeats the handler that
    ``configure()`` returns before it: whoever opens it wakes the ``watched`` body of that one."""
    is_part: ClassVar[bool] = False
    """It means something only together with the other handlers of its connector: operators see them as one."""
    widget: ClassVar[str | None] = None
    """The widget that shows it best, a hint for the dashboard: one of
    :data:`~mosaic_core.words.catalogue.WIDGET_HINTS`, or one that a distribution ships, which is named with its module:
    ``acme-arm/ArmPanel``."""
    keeper: Keeper | None = None
    """What keeps the device open that this handler drives; set it in ``__init__``. While the device is away, so is the
    handler for whoever looks at it, and its commands are refused. :class:`~mosaic_core.DeviceGone` of ``handle_data``
    and ``make_safe`` is told to the keeper; once the device is back, whoever commands it must let go first."""
    data_type: MosaicDataType

    def __init__(self, label: str) -> None:
        """Raises :class:`MosaicError` for a base that nobody has derived from: it does not know what it sends."""
        check_derived(type(self))
        self.label = label
        self._host: HandlerHost = UnboundHost()

    def __init_subclass__(cls, **kwargs: Any) -> None:
        """Raises :class:`MosaicError` for what is declared and nothing would follow."""
        super().__init_subclass__(**kwargs)
        if not cls.__module__.startswith(f"{__package__}."):
            _check_way(cls)
            check_names(cls)
            check_bodies(cls)
            check_runs(cls, ("messages", "frames", "sounds"))
            check_said(cls, cls)

    def bind(self, host: HandlerHost) -> None:
        """Called once by the runtime (or the test kit) before the handler runs."""
        self._host = host

    def every(self, period_s: float) -> Every:
        """``for _ in self.every(0.1): yield …``: a tick per period until the handler shall stop."""
        return Every(self._host, period_s)

    def pause(self, seconds: float) -> bool:
        """Wait on this handler's own thread; ``True`` when the handler shall stop. Stop wakes it at once. Raises
        :class:`MosaicError` (``plugin.blocks_loop``) in an ``async def``."""
        refuse_in_async("self.pause(…)", "await asyncio.sleep(…)")
        return self._host.wait(seconds)

    @property
    def direction(self) -> Direction:
        """Which way its data flows."""
        return self.data_type.direction

    @property
    def is_stopping(self) -> bool:
        """Whether the handler shall stop: leave the body soon. Any thread."""
        return self._host.is_stopping

    @property
    def is_heard(self) -> bool:
        """Whether anybody has this data channel open now: what nobody gets need not be computed. Any thread."""
        return self._host.is_heard(self.label)

    def monotonic_s(self) -> float:
        """The robot's monotonic clock; the kit's fake clock in tests."""
        return self._host.monotonic_s()

    def count_loss(self, reason: Loss, messages: int = 1) -> None:
        """Count messages that this handler itself left out, under a reason that operators know: ``refused`` for input
        that made no sense, ``lost`` for what came in part or not at all, ``thinned`` for what came before its turn,
        ``dropped`` for what found a queue full. What ``send_*`` does not take is counted without it. Any thread."""
        self._host.count_loss(reason, messages)

    def tap_media(self, label: str, codec: TapCodec = "h264") -> MediaTap:
        """The encoded pictures of the connector ``label``, without encoding them again where that is possible:
        ``with self.tap_media("front") as tap: picture = tap.next(timeout_s=1.0)``. Any thread."""
        return self._host.tap_media(label, codec)

    def tap_pictures(self, label: str) -> PictureTap:
        """The pictures of the connector ``label`` as they were captured:
        ``with self.tap_pictures("front") as tap: picture = tap.next(timeout_s=1.0)``. Any thread."""
        return self._host.tap_pictures(label)

    def tap_data(self, *labels: str) -> DataTap:
        """What the connectors ``labels`` send, and what operators command them; none named: all of the robot but this
        one. ``with self.tap_data("pose", "cmd_vel") as tap: message = tap.next(timeout_s=1.0)``. Any thread."""
        return self._host.tap_data(labels)

    def _send(
        self,
        kind: PayloadKind,
        payload: bytes,
        to: Sender | None,
        followers: tuple[bytes, ...] = (),
        original_text: Callable[[], str] | None = None,
    ) -> bool:
        return self._host.send(
            Outgoing(
                channel=self.label,
                kind=kind,
                payload=payload,
                stamp_us=int(self._host.monotonic_s() * 1e6),
                to=to.peer_id if to else None,
                followers=followers,
                original_text=original_text,
            )
        )


def _check_way(cls: type[Handler]) -> None:
    """Refuse two bases of which one would go unheard: a handler is one channel or one track."""
    ways = (DataChannelSendable, DataChannelReceivable, MediaTrackHandler, AudioTrackHandler, AudioReceivable)
    one, *others = [base.__name__ for base in ways if issubclass(cls, base)] or [""]
    if others:
        message = f"it derives from {one} and from {others[0]}, and has one channel or track."
        cure = "Write two handlers, which configure() returns together; DataChannelBidirectional sends and receives."
        raise wrong_declaration(cls, message, cure)


def check_said(cls: type[Handler], said: Any) -> None:
    """Raises :class:`MosaicError` for what ``said``, the class or an instance of it, says and nothing would follow."""
    check_values(cls, said)
    check_delivery(cls, said.delivery)
    if getattr(cls, "data_type", None) is MosaicDataType.MEDIA:
        check_media_delivery(cls, said.delivery)
    check_widget(cls, said.widget, cls.kind)
    if not is_said_later(said.keeper):
        check_keeper(cls, said.keeper)


def message_type_of(handler: type) -> Any:
    """The ``T`` of ``DataChannelSendable[T]`` or ``DataChannelReceivable[T]``; ``dict`` where none is written."""
    return argument_of(handler, Handler, 0) or dict[str, Any]


def _data_type_of(handler: type, way: Literal["r2u", "u2r"]) -> MosaicDataType:
    words, declared = {str: "string", bytes: "byte"}, message_type_of(handler)
    if isinstance(declared, type) and issubclass(declared, Params):
        message = f"its messages are {declared.__name__}, which is a class of params."
        raise wrong_declaration(handler, message, "Name a class of messages: `class Mine(Message)` with what travels.")
    return MosaicDataType(f"{words.get(declared, 'json')}-{way}")


_DECLARED: dict[type, DeclaredMessage] = {}


def _declared_by(handler: type) -> DeclaredMessage:
    """What this class of handlers sends."""
    found = _DECLARED.get(handler)
    if found is None:
        declared = sent_type_of(handler) if _declares(handler) else None
        found = _DECLARED[handler] = DeclaredMessage(handler, declared)
    return found


def why_unsent(handler: Handler, value: Any) -> str:
    """Which number of it keeps a message from being sent, with class and line; empty where none does."""
    declared = _declared_by(type(handler))
    return next((declared.told_of(field) for field in declared.unsent(value)), "")


def sent_type_of(handler: type) -> Any:
    """What it sends: the ``T`` of a sender, ``sends`` of a bidirectional one; ``None``: nothing is declared."""
    if issubclass(handler, DataChannelSendable):
        return message_type_of(handler)
    return handler.sends if issubclass(handler, DataChannelBidirectional) else None


def _declares(handler: type) -> bool:
    return issubclass(handler, DataChannelSendable) or sent_type_of(handler) is not None


class _Sends(Handler):
    def send_json(self, value: BaseModel | Mapping[str, Any] | list[Any], to: Sender | None = None) -> bool:
        """Send JSON to everybody who listens, or ``to`` one. A number that is not finite becomes null where the class
        declares that it may be absent; else the message is counted as ``refused``. Raises :class:`MosaicError`
        (``plugin.wrong_message``) for what the class does not declare."""
        declared = _declared_by(type(self))
        payload = declared.json_of(value, self.label)
        if payload is None:
            self.count_loss("refused")
            return False
        if _declares(type(self)):
            declared.check(value)
        return self._send(PayloadKind.JSON, payload, to)

    def send_string(self, text: str, to: Sender | None = None) -> bool:
        return self._send(PayloadKind.STRING, _declared_by(type(self)).text_of(text), to)

    def send_bytes(
        self, data: bytes, to: Sender | None = None, *, original_text: Callable[[], str] | None = None
    ) -> bool:
        """``original_text`` makes the text that original dashboards expect instead, if they do; it runs on the event
        loop, once for each of them, and must be quick."""
        return self._send(PayloadKind.BYTES, bytes(data), to, original_text=original_text)

    def send_burst(self, parts: Sequence[bytes], to: Sender | None = None) -> bool:
        """Binary messages that mean something only together, in order. Waiting, they are one: replaced or dropped
        as a whole."""
        first, *followers = (bytes(part) for part in parts)
        return self._send(PayloadKind.BYTES, first, to, tuple(followers))

    def send(self, value: Any, to: Sender | None = None) -> bool:
        """Whatever ``messages()`` yields: a message or mapping as JSON, ``str``, or ``bytes``. Raises
        :class:`MosaicError` (``plugin.wrong_message``) for what the class does not declare."""
        if isinstance(value, str | bytes | bytearray | memoryview) and _declares(type(self)):
            _declared_by(type(self)).check(value)
        if isinstance(value, str):
            return self.send_string(value, to)
        if isinstance(value, bytes | bytearray | memoryview):
            return self.send_bytes(bytes(value), to)
        return self.send_json(value, to)


class DataChannelSendable(_Sends, Generic[T]):
    """Sends data from the robot to operators. Write ``messages()``, or push with ``send_*`` from any thread.

    ``T`` is a :class:`~mosaic_core.contract.params.Message` subclass, ``dict``, ``str`` or ``bytes``.
    """

    def messages(self) -> Iterable[T] | AsyncIterator[T]:
        """Yield what to send. ``def``: on a thread of its own; ``async def``: on the event loop."""
        return ()

    def __init_subclass__(cls, **kwargs: Any) -> None:
        super().__init_subclass__(**kwargs)
        cls.data_type = _data_type_of(cls, "r2u")


class DataChannelReceivable(Handler, Generic[T]):
    """Receives data from operators. Data that does not validate as ``T`` is refused and never gets here.

    A receiver that moves something is ``def``, sets :attr:`timeout_s` and implements :meth:`make_safe`; the framework
    then stops it on silence, when its commander is gone, and when anybody says stop.
    """

    timeout_s: float | None = None
    """Seconds without a valid message after which :meth:`make_safe` runs; ``None``: never. ``safety.timeout_s`` in
    the YAML file overrides it."""
    requires_lease: bool = False
    """Take messages only from the operator who holds the lease of ``safety.resource``; ``safety.requires_lease`` in
    the YAML file overrides it."""
    resource: str = "motion"
    """Whose lease that is: a name of your own separates an arm. ``safety.resource`` in the YAML file overrides it."""
    limits: Mapping[str, FieldBounds] = {}
    """How far and how fast the numbers of its messages may go, by field, as ``safety.limits`` in the YAML file, which
    overrides each bound that it says: ``{"positions.shoulder": FieldBounds(min=-1.5, max=1.5)}``."""
    item_names: Sequence[str] = ()
    """The names that its messages' lists may have (:attr:`Message.keyed_by`), such as those of the joints; set it in
    the class or in ``__init__``. A message with another name is refused, and so is a limit. Empty: nobody knows."""
    motion_fields: ClassVar[tuple[str, ...]] = ()
    """Dotted paths of the numbers in its JSON message that mean motion and are 0 at a standstill (``"linear.x"``). The
    framework slows them down on a bad link, and sends zeros nobody needs no further. Where none are named: those that
    its message says are velocities (``Message.motion_kinds``); ``()`` says that it moves nothing."""
    position_fields: ClassVar[tuple[str, ...]] = ()
    """Dotted paths of the numbers in its JSON message that mean a position: 0 is a place like any other. On a bad link
    the framework slows their change down and never scales the position itself. Where none are named: the numbers that
    its message says are positions. In a list ``"positions.shoulder"``, or ``"positions.*"`` for all."""
    takes_observers: ClassVar[bool] = False
    """Messages of operators who may only observe are refused, unless this is true."""

    def handle_data(self, data: T, *sender: Any, **_: Any) -> Awaitable[None] | None:
        """Act on one message. Write ``handle_data(self, data)`` or ``handle_data(self, data, sender)``, ``def`` or
        ``async def``; ``sender`` is a :class:`~mosaic_core.contract.sender.Sender`.

        ``def`` runs on this receiver's own thread, one message at a time, newest first under ``delivery: latest``.
        Raising ends and restarts the handler; raise :class:`Refused` to refuse just this message.
        """
        raise NotImplementedError(f"{type(self).__name__} needs handle_data(self, data)")

    def make_safe(self, cause: str) -> None:
        """Bring what this receiver moves into its safe state; ``cause`` is a ``safety.*`` code. Of a velocity that is
        0, of a position where it is now: it holds, and neither folds nor goes home.

        Runs on the robot's safety thread, possibly *while* ``handle_data`` runs or hangs: be quick, take no lock
        that ``handle_data`` holds for long, and be prepared to be called twice: when a command that it overtook
        returns, it is called again, and 20 times a second while that one hangs. If it raises, it is called again until
        it returns or a newer command is carried out.
        """

    def reported_position(self, field: str) -> float | None:
        """Where the position field ``field`` is now, in the unit of the message; ``None``: not known now. For a number
        in a list the field is that of one number: ``"positions.shoulder"``, ``"positions.0"``.

        A limited rate begins there. Asked before the first command, the first after a safe action, and the first after
        a second without any; in between the position that was sent last counts. Runs where ``handle_data`` runs, just
        before it: a ``def`` one on the receiver's own thread, an ``async`` one on the event loop. A live safety drill
        asks it on a thread of its own, also while ``handle_data`` runs. It must not block: answer from what was read
        last. Raising fails the command as ``handle_data`` would.
        """
        return None

    def peer_left(self, sender: Sender) -> None:
        """A peer that had this channel open is gone. Runs on the safety thread."""

    def __init_subclass__(cls, **kwargs: Any) -> None:
        super().__init_subclass__(**kwargs)
        cls.data_type = _data_type_of(cls, "u2r")
        check_lists(cls, message_type_of(cls))
        fields = _fields_of(cls)
        _take_moving_fields(cls, fields)
        check_fields(cls, fields, cls.motion_fields, cls.position_fields)
        check_item_names(cls, fields, cls.item_names)
        check_said_safety(cls, cls)
        check_limits(cls, fields, cls.limits, cls.motion_fields, cls.position_fields)


def check_said_safety(cls: type[DataChannelReceivable[Any]], said: Any) -> None:
    """As :func:`check_said`, of the safety of a receiver."""
    check_bounds(cls, said.limits)
    check_resource(cls, said.resource)
    check_timeout(cls, said.timeout_s, has_safe_action=has_safe_action(cls))


def _take_moving_fields(receiver: type[DataChannelReceivable[Any]], fields: MessageFields) -> None:
    """What a class does not name itself, its message says: which numbers are velocities, and which positions."""
    named = {name for one in receiver.__mro__ if one is not DataChannelReceivable for name in vars(one)}
    velocities, positions = (fields.of_kind(kind) for kind in MOTION_KINDS)
    if velocities and "motion_fields" not in named:
        receiver.motion_fields = tuple(one for one in velocities if one not in receiver.position_fields)
    if positions and "position_fields" not in named:
        receiver.position_fields = tuple(one for one in positions if one not in receiver.motion_fields)


def _fields_of(receiver: type[DataChannelReceivable[Any]]) -> MessageFields:
    """What its messages have, as far as its class says."""
    used = (*receiver.motion_fields, *receiver.position_fields, *_known(receiver.limits))
    return message_fields(message_type_of(receiver), used, _known(receiver.item_names))


def _known(said: Any) -> Any:
    """Nothing yet of what a property says: only an instance knows."""
    return () if is_said_later(said) else said


def check_made(handler: Handler) -> None:
    """What a handler says by itself, in ``__init__`` or by a property, is held against the same rules as its class.
    Raises :class:`MosaicError`."""
    check_instance_names(handler)
    check_said(type(handler), handler)
    if isinstance(handler, DataChannelReceivable):
        check_said_safety(type(handler), handler)


def has_safe_action(receiver: type[DataChannelReceivable[Any]]) -> bool:
    """Whether its author wrote :meth:`DataChannelReceivable.make_safe`: the inherited one does nothing."""
    return receiver.make_safe is not DataChannelReceivable.make_safe


def reports_position(handler: DataChannelReceivable[Any]) -> bool:
    """Whether its author wrote :meth:`DataChannelReceivable.reported_position`, and not one that says nothing of any
    field: a body without a name can't know."""
    written = type(handler).reported_position
    if written is DataChannelReceivable.reported_position:
        return False
    code = getattr(written, "__code__", None)
    return code is None or bool(code.co_names or code.co_freevars) or written(handler, "") is not None


class DataChannelJsonReceivable(DataChannelReceivable[dict[str, Any]]):
    """Receives JSON objects as ``dict``."""


class DataChannelStringReceivable(DataChannelReceivable[str]):
    """Receives text."""


class DataChannelByteReceivable(DataChannelReceivable[bytes]):
    """Receives bytes."""


class DataChannelBidirectional(DataChannelReceivable[T], _Sends):
    """Sends and receives on one channel: implement ``handle_data``, answer with ``send_json(value, to=sender)``.

    ``T`` is what it takes, :attr:`sends` what it sends.
    """

    sends: ClassVar[type[Message] | None] = None
    """The type of what it sends: its schema goes into the catalogue, and what it sends is held against it. ``None``:
    any JSON."""

    def __init_subclass__(cls, **kwargs: Any) -> None:
        super().__init_subclass__(**kwargs)
        cls.data_type = MosaicDataType.JSON_BI
        check_sent(cls, cls.sends)


class MediaTrackHandler(Handler):
    """Sends pictures to operators. Write ``frames()``, or push with :meth:`send_frame`."""

    runs: ClassVar[Runs] = "watched"
    kind: ClassVar[Kind] = Kind.VIDEO
    delivery: ClassVar[Delivery | DeliveryContract] = Delivery.LATEST
    data_type = MosaicDataType.MEDIA
    encoding: EncodingParams = EncodingParams()
    """How the pictures are encoded; set it in ``__init__``, before the robot starts."""
    packet_codec: PacketCodec | None = None
    """The codec of the ``av.Packet`` that it yields, if it yields such; set it in the class or in ``__init__``.

    It is agreed with an operator before the first packet is known. Where it is not declared, those who connect before
    get pictures that are decoded and encoded anew if another codec was agreed; those who connect later do not."""

    def frames(self) -> Iterable[Picture] | AsyncIterator[Picture]:
        """Yield pictures. ``def``: on a thread of its own; ``async def``: on the event loop."""
        return ()

    def send_frame(self, picture: Picture) -> bool:
        """Hand over one picture from any thread; ``False`` if nobody watches. Raises :class:`MosaicError`
        (``plugin.wrong_message``) for what is no picture."""
        check_picture(type(self), picture.image if isinstance(picture, Captured) else picture)
        if isinstance(picture, Captured):
            check_stamp(type(self), picture.captured_at_s)
        return self._host.offer(self.label, picture)


class AudioTrackHandler(Handler):
    """Sends sound to operators. Write ``sounds()``, or push with :meth:`send_sound`."""

    runs: ClassVar[Runs] = "watched"
    kind: ClassVar[Kind] = Kind.AUDIO
    delivery: ClassVar[Delivery | DeliveryContract] = Delivery.LATEST
    data_type = MosaicDataType.MEDIA
    encoding: SoundEncoding = SoundEncoding()
    """How the sound is encoded; set it in ``__init__``, before the robot starts."""

    def sounds(self) -> Iterable[Sound] | AsyncIterator[Sound]:
        """Yield sound, piece after piece. ``def``: on a thread of its own; ``async def``: on the event loop."""
        return ()

    def send_sound(self, sound: Sound) -> bool:
        """Hand over one piece from any thread; ``False`` if nobody listens. Raises :class:`MosaicError`
        (``plugin.wrong_message``) for what is no sound."""
        check_sound(type(self), sound)
        return self._host.offer(self.label, sound)


class AudioReceivable(Handler):
    """Receives the voice of one operator at a time. Both methods run on this receiver's own thread."""

    kind: ClassVar[Kind] = Kind.AUDIO
    delivery: ClassVar[Delivery | DeliveryContract] = Delivery.LATEST
    data_type = MosaicDataType.MEDIA

    @property
    def direction(self) -> Direction:
        return Direction.TO_ROBOT

    def handle_sound(self, sound: Sound, sender: Sender) -> None:
        """Play the next 20 ms: 48 kHz, ``int16`` (960, 2); silence where something was lost on the way.

        Called at the pace of the sound while somebody talks. A device that takes it more slowly loses what is oldest.
        Raising rests the receiver for the back-off.
        """
        raise NotImplementedError(f"{type(self).__name__} needs handle_sound(self, sound, sender)")

    def talk_ended(self) -> None:
        """Nobody talks any more: fall silent at once, let the device go. Called once after the last sound."""
