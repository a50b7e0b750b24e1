"""Runs ``handle_data``: a ``def`` one on the receiver's own thread, an ``async`` one on the event loop, one message at
a time. What is refused is reported; an error is a failure of the handler, which rests for the back-off.
"""

from __future__ import annotations

import asyncio
import contextlib
import inspect
import logging
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from mosaic_core.contract.handler import DataChannelReceivable, Refused
from mosaic_core.contract.host import Sender
from mosaic_core.machines.commands.admission import refusal_on_acting
from mosaic_core.machines.commands.gates import Gate, GateRefusal
from mosaic_core.machines.commands.slow_down import Measures
from mosaic_core.machines.delivery.send_scheduler import QueueLimits
from mosaic_core.runtime.commands.command_shaper import CommandShaper, ShapedCommand
from mosaic_core.runtime.commands.command_turn import CommandTurn
from mosaic_core.runtime.commands.inbox import Inbox, Incoming
from mosaic_core.runtime.commands.safety_watch import GONE, SafetyWatch
from mosaic_core.runtime.handlers.request_desk import RequestDesk
from mosaic_core.runtime.handlers.task_runner import leave_behind
from mosaic_core.runtime.threads.error_words import meant_by
from mosaic_core.runtime.threads.failures import Failures, failure_code
from mosaic_core.runtime.threads.handler_thread import STOP_PATIENCE_S, HandlerThread, tell_abandoned
from mosaic_core.runtime.threads.handover import on_loop
from mosaic_core.words.errors import DeviceGone

logger = logging.getLogger(__name__)

_OVERTAKEN = "a safe action came while this command was carried out"
FORGIVEN_S = 60.0
"""So long after its rest a peer's next error counts as a first one."""
ZERO_PERIOD_S = 0.1
"""Between two zeros of the policy ``zero``: the rate of the slowest usual command loop."""


@dataclass(frozen=True, slots=True)
class Outcome:
    """The outcome of one message; without a ``refusal`` it was accepted."""

    item: Incoming
    refusal: GateRefusal | None = None


class Receiver:
    """Takes the messages for one receiver of the robot and has it act on them. Methods are called on the event loop;
    ``tell`` is called on any thread."""

    def __init__(
        self,
        handler: DataChannelReceivable[Any],
        watch: SafetyWatch,
        failures: Failures,
        tell: Callable[[Outcome], object],
        *,
        newest_only: bool,
        limits: QueueLimits,
        max_age_s: float | None,
        measures_of: Callable[[str], Measures] = lambda peer_id: Measures(),
        requests: RequestDesk | None = None,
    ) -> None:
        """``requests``: answers instead of ``handle_data``."""
        self.label = handler.label
        self.max_age_s = max_age_s
        self.watch = watch
        self.requests = requests
        self._handle: Callable[..., Any] = handler.handle_data if requests is None else requests.begin
        self._is_async = inspect.iscoroutinefunction(self._handle)
        self._takes_sender = _takes_sender(handler)
        self._shaper = CommandShaper(handler, watch.safety, lambda: watch.fired)
        self._measures_of = measures_of
        self._last_sender: Sender | None = None
        self._failures = failures
        self._keeper = handler.keeper
        self._tell = tell
        self.inbox = Inbox(newest_only=newest_only, limits=limits)
        self._rests: dict[str, tuple[float, str]] = {}
        """By peer, until when and with which code: whose command broke the handler waits, the others' are taken."""
        self._loop = asyncio.get_running_loop()
        self._arrived = asyncio.Event()
        self._task: asyncio.Task[None] | None = None
        self._thread: HandlerThread | None = None
        watch.dropped = self._forget
        watch.woken = self._wake

    @property
    def waits_for_device(self) -> bool:
        """Whether its safe action has failed while its kept device is away, and is tried until that is back; one that
        runs just now may hang, and is no such one."""
        is_away = self._keeper is not None and self._keeper.absence is not None
        return is_away and self.watch.failures > 0 and not self.watch.is_acting

    def start(self) -> None:
        if self._is_async:
            self._task = self._loop.create_task(self._live_async(), name=f"mosaic-{self.label}")
        else:
            self._thread = HandlerThread(self.label, self._live)
            self._thread.start()

    def accept(self, item: Incoming) -> None:
        """A message has arrived and passed its gates."""
        if item.has_paused:
            self.watch.paused(item)
        if self.requests is not None:
            try:
                item = self.requests.arrived(item)
            except Refused as refused:
                self._tell(Outcome(item, GateRefusal(Gate.QUEUE, refused.code, refused.message)))
                return
        if self.inbox.put(item):
            self._arrived.set()
        else:
            self._tell(Outcome(item, GateRefusal(Gate.QUEUE, "channel.queue_full")))

    def channel_opened(self, sender: Sender) -> int:
        """A peer may command from now on; what its messages must carry as ``opening``."""
        return self.watch.peer_joined(sender.peer_id, sender.session_id)

    def channel_closed(self, sender: Sender) -> None:
        """A peer is gone, or has closed the channel: forget what it still wanted, make safe what it moved."""
        self._forget(sender.peer_id, "request.lost")
        self.watch.peer_left(sender)

    def _forget(self, peer_id: str | None, code: str = "") -> None:
        """Drop what this peer (``None``: anybody) has waiting; ``code``: why, where not by a stop or a lost lease."""
        self.inbox.forget(peer_id)
        if self.requests is not None:
            self.requests.dropped(peer_id, code or ("safety.stopped" if peer_id is None else "lease.old_epoch"))

    def hold(self) -> None:
        """Let no command act until :meth:`resume`."""
        self.inbox.hold()

    def resume(self) -> None:
        """Go on with what has come meanwhile; nothing happens after :meth:`close`."""
        self.inbox.resume()
        self._arrived.set()

    def close(self) -> None:
        self.inbox.close()
        if self.requests is not None:
            self.requests.close()
        if self._task is not None:
            self._task.cancel()

    async def closed(self) -> None:
        """Wait until ``handle_data`` has ended, or has been abandoned."""
        if self._thread is not None:
            await self._thread.ended()
        if self._task is not None:
            _, pending = await asyncio.wait({self._task}, timeout=STOP_PATIENCE_S)
            if pending:
                tell_abandoned(self.label)
                leave_behind(self._task)
        if self.requests is not None:
            await self.requests.closed()

    @property
    def is_resting(self) -> bool:
        """A message has just broken the handler: its sender's next ones are refused at the gate ``rest``."""
        now_s = time.monotonic()
        return any(until_s > now_s for until_s, _ in self._rests.values())

    # -- the receiver's own thread, or its task ------------------------------------------------------------------

    def _wake(self) -> None:
        """There are zeros to send. Any thread."""
        self.inbox.poke()
        if self._is_async:
            on_loop(self._loop, self._arrived.set)

    def _live(self) -> None:
        while not self.inbox.is_closed:
            item = self.inbox.wait(self._pause_s())
            arguments = self._zeros() if item is None else self._admitted(item)
            if arguments is None:
                continue
            try:
                self._handle(*arguments)
            except BaseException as error:  # noqa: BLE001 (a plugin may raise anything; none ends its thread unnoticed)
                self._raised(item, error)
            else:
                self._succeeded(item)

    async def _live_async(self) -> None:
        while not self.inbox.is_closed:  # also where ``handle_data`` has swallowed what cancels it
            with contextlib.suppress(TimeoutError):
                await asyncio.wait_for(self._arrived.wait(), self._pause_s())
            self._arrived.clear()
            while (item := self.inbox.take()) is not None:
                await self._handle_async(item, self._admitted(item))
            await self._handle_async(None, self._zeros())

    async def _handle_async(self, item: Incoming | None, arguments: tuple[Any, ...] | None) -> None:
        if arguments is None:
            return
        try:
            waiting = self._handle(*arguments)
            if waiting is not None:
                await waiting
        except (KeyboardInterrupt, asyncio.CancelledError) as error:
            if self.inbox.is_closed:
                self.watch.finish(accepted=True)
                raise
            self._raised(item, error)  # nobody but the plugin: something was cancelled that it waited for
        except GeneratorExit:  # Python's own, to a task that was abandoned with its event loop
            raise
        except BaseException as error:  # noqa: BLE001 (a plugin may raise anything)
            self._raised(item, meant_by(error))
        else:
            self._succeeded(item)

    def _admitted(self, item: Incoming) -> tuple[Any, ...] | None:
        """The arguments of ``handle_data``, with the watchdog fed; ``None`` if the message must not act."""
        turn = self._turn_of(item)
        try:
            refusal = refusal_on_acting(turn)
        except (Exception, SystemExit) as error:  # noqa: BLE001 (a model's validator may raise anything)
            self._failed(item, error)
            return None
        if refusal is not None:
            if refusal.code != GONE:
                self._tell(Outcome(item, refusal))
            return None
        if turn.command.is_idle:
            self._tell(Outcome(item))
            return None
        value = turn.command.value
        if self.requests is not None:
            return value, item
        self._last_sender = item.sender
        return (value, item.sender) if self._takes_sender else (value,)

    def _turn_of(self, item: Incoming) -> CommandTurn:
        def begin(command: ShapedCommand) -> str | None:
            wants_motion = command.wants_motion
            return self.watch.begin(item, fired=command.fired, is_idle=command.is_idle, wants_motion=wants_motion)

        now_s = time.monotonic()
        return CommandTurn(
            item.payload,
            self._shaper,
            self.watch.safety,
            lambda: self._measures_of(item.sender.peer_id),
            begin,
            must_release=lambda: self.watch.must_release(item),
            waited_s=now_s - item.arrived_at_s,
            max_age_s=self.max_age_s,
            rest_code=self._rest_code(item.sender.peer_id, now_s),
        )

    def _rest_code(self, peer_id: str, now_s: float) -> str | None:
        """Why it takes nothing of this peer now: its device is away, or his last command has just broken it."""
        if self._keeper is not None and self._keeper.absence is not None:
            return failure_code(self._keeper.absence)
        until_s, code = self._rests.get(peer_id, (0.0, ""))
        return code if now_s < until_s else None

    def _pause_s(self) -> float | None:
        return None if self.watch.zeros_until_s is None else ZERO_PERIOD_S

    def _zeros(self) -> tuple[Any, ...] | None:
        """The arguments of a ``handle_data`` of the framework's own."""
        if self.watch.zeros_until_s is None or self._last_sender is None:
            return None
        try:
            value = self._shaper.zeros()
        except Exception as error:  # noqa: BLE001 (a model may take no zero; its safe action has run, commands go on)
            self.watch.no_zeros()
            logger.error("%r takes no zeros: %s", self.label, error, extra={"label": self.label})
            return None
        if value is None or not self.watch.begin_zero():
            return None
        return (value, self._last_sender) if self._takes_sender else (value,)

    def _succeeded(self, item: Incoming | None) -> None:
        overtaken_by = self.watch.finish(accepted=True)
        self._failures.alive()
        overtaken = GateRefusal(Gate.HANDLER, overtaken_by, _OVERTAKEN) if overtaken_by is not None else None
        self._tell_of(item, overtaken)

    def _raised(self, item: Incoming | None, error: BaseException) -> None:
        self.watch.finish(accepted=False, failed=not isinstance(error, Refused))
        if item is not None:  # also what broke half-way: a zero that did not arrive is no second of standing
            self._shaper.undone()
        if isinstance(error, Refused):
            self._tell_of(item, GateRefusal(Gate.HANDLER, error.code, error.message))
        else:
            self._failed(item, error)

    def _failed(self, item: Incoming | None, error: BaseException) -> None:
        if self._keeper is not None and isinstance(error, DeviceGone):
            self._keeper.lost(error)
        else:
            self._rest(item.sender.peer_id if item is not None else "", error)
        self._tell_of(item, self._could_not(error))

    def _could_not(self, error: BaseException) -> GateRefusal:
        """What the plugin raised is for the robot's log: it may name files, addresses, passwords."""
        text = f"{self.label!r} could not carry it out; the robot's log says why"
        return GateRefusal(Gate.HANDLER, failure_code(error), text)

    def _rest(self, peer_id: str, error: BaseException) -> None:
        """For a while nothing of this peer is taken."""
        now_s = time.monotonic()
        rests = {peer: rest for peer, rest in self._rests.items() if rest[0] > now_s - FORGIVEN_S}
        last_until_s, _ = rests.get(peer_id, (0.0, ""))
        rests[peer_id] = (now_s + self._failures.failed(error, now_s - last_until_s), failure_code(error))
        self._rests = rests

    def _tell_of(self, item: Incoming | None, refusal: GateRefusal | None = None) -> None:
        """What became of it; nobody waits for news of the framework's own zeros (``None``)."""
        if item is not None:
            self._tell(Outcome(item, refusal))


def _takes_sender(handler: DataChannelReceivable[Any]) -> bool:
    """Whether ``handle_data`` was written with ``sender``."""
    kinds = (inspect.Parameter.POSITIONAL_ONLY, inspect.Parameter.POSITIONAL_OR_KEYWORD)
    parameters = inspect.signature(handler.handle_data).parameters.values()
    if any(parameter.kind is inspect.Parameter.VAR_POSITIONAL for parameter in parameters):
        return True
    return sum(parameter.kind in kinds for parameter in parameters) >= 2
