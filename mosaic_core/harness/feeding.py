"""Feeds a receiver a script: messages, silence, stops, operators who leave. What the robot enforces is enforced here
too: validation before ``handle_data``, limits, the time-out, the lease, the stop, the safe action.
"""

from __future__ import annotations

import inspect
import json
import math
from collections.abc import Generator, Iterable
from typing import Any

from pydantic import BaseModel

from mosaic_core.contract.handler import DataChannelReceivable, Refused
from mosaic_core.contract.host import Sender
from mosaic_core.harness.fake_hosts import FakeHost, fake_host
from mosaic_core.harness.fake_loop import run_on
from mosaic_core.harness.feed_steps import (
    OPERATOR,
    Cleared,
    Fed,
    FeedStep,
    From,
    Leaves,
    LosesLease,
    MadeSafe,
    RefusedMessage,
    Silence,
    SlowedTo,
    Stopped,
)
from mosaic_core.harness.right_kind import check_has, check_script, check_step
from mosaic_core.machines.commands.admission import (
    ArrivedCommand,
    CommandChannel,
    refusal_on_acting,
    refusal_on_arrival,
)
from mosaic_core.machines.commands.release_first import PAUSE_S, ReleaseFirst
from mosaic_core.machines.commands.slow_down import Measures
from mosaic_core.machines.commands.watchdog import Watchdog
from mosaic_core.machines.timing.pacing import TokenBucket
from mosaic_core.runtime.commands.command_shaper import CommandShaper, ShapedCommand
from mosaic_core.runtime.commands.command_turn import CommandTurn
from mosaic_core.runtime.commands.safety_watch import ZEROS_FOR_S
from mosaic_core.runtime.configuration.receiver_safety import ReceiverSafety
from mosaic_core.runtime.handlers.receiver import ZERO_PERIOD_S, _takes_sender
from mosaic_core.words.config import SafetyConfig
from mosaic_core.words.errors import DeviceGone
from mosaic_core.words.safety_config import SafePolicy


def feed(handler: DataChannelReceivable[Any], script: Iterable[FeedStep]) -> Fed:
    """Play ``script`` on the fake clock and say what happened.

    ``dict``, ``list`` and models are sent as JSON; ``str`` and ``bytes`` exactly as they are, so that broken JSON can
    be sent too. While ``handle_data`` waits with ``self.pause``, or an ``async`` one with ``asyncio.sleep``, time
    passes and the time-out may strike, as on a robot (there on another thread). An error other than :class:`Refused` is
    raised here: on a robot it would end the handler.
    """
    check_has(handler, "handle_data")
    check_script(script)
    feeder = Feeder(handler, fake_host(handler))
    feeder.host.clock.watch(feeder)
    try:
        if inspect.iscoroutinefunction(handler.handle_data):
            run_on(feeder.host.clock, lambda: _play_async(feeder, script))
        else:
            for step in script:
                for _ in feeder.steps(step):
                    raise TypeError("handle_data returned an awaitable; write it as `async def`")
    finally:
        feeder.host.clock.forget(feeder)
    return feeder.fed


async def _play_async(feeder: Feeder, script: Iterable[FeedStep]) -> None:
    for step in script:
        playing = feeder.steps(step)
        for waiting in playing:
            try:
                await waiting
            except Exception as error:  # noqa: BLE001 - handed to the feeder, which knows what it means
                with_error = error
            else:
                continue
            try:
                playing.throw(with_error)
            except StopIteration:
                break


class Feeder:
    """Plays the steps; also the alarm that rings at the time-out, and when the framework's own zeros are due."""

    def __init__(self, handler: DataChannelReceivable[Any], host: FakeHost) -> None:
        self.host = host
        self.fed = Fed()
        self._handler = handler
        self._safety = host.safety or ReceiverSafety.of(SafetyConfig(), handler)
        self._watchdog = Watchdog(self._safety.timeout_s)
        self._shaper = CommandShaper(handler, self._safety, lambda: len(self.fed.made_safe), lambda: host.clock.now_s)
        self._takes_sender = _takes_sender(handler)
        self._start_s = host.clock.now_s
        self._factor = 1.0
        self.is_stopped = False
        self._mover: Sender | None = None
        self._without_lease: set[str] = set()
        self._release = ReleaseFirst()
        self._said_at_s: dict[str, float] = {}
        self._rates: dict[str, TokenBucket] = {}
        self._zeros_at_s: list[float] = []
        self._last_sender = OPERATOR
        self._is_handling = False
        self._overtaken_cause: str | None = None

    @property
    def due_at_s(self) -> float | None:
        due = [due_s for due_s in (self._watchdog.due_at_s, *self._zeros_at_s[:1]) if due_s is not None]
        return min(due, default=None)

    def ring(self, now_s: float) -> None:
        if self._watchdog.expire(now_s):
            self._follow(self._safety.on_timeout, "safety.timeout")
        elif self._zeros_at_s and now_s >= self._zeros_at_s[0]:
            del self._zeros_at_s[0]
            value = self._shaper.zeros()
            if value is not None and not self._is_handling:
                self._handler.handle_data(*((value, self._last_sender) if self._takes_sender else (value,)))

    def steps(self, step: FeedStep) -> Generator[Any, None, None]:
        """Play one step; yields what ``async def handle_data`` returned, to be awaited."""
        check_step(step)
        match step:
            case Silence(seconds):
                self.host.clock.advance(seconds)
            case Leaves(sender):
                if self._mover is not None and self._mover.peer_id == sender.peer_id:
                    self._follow(self._safety.on_loss, "safety.peer_left")
                self._handler.peer_left(sender)
            case Stopped():
                if self._safety.is_motion and not self.is_stopped:
                    self._make_safe("safety.stop")
                self.is_stopped = True
                self._release.stopped(self._said_at_s)
            case Cleared():
                self.is_stopped = False
            case LosesLease(sender):
                self._lease_lost(sender)
            case SlowedTo(factor):
                self._factor = factor
            case From(sender, data):
                yield from self._message(sender, data)
            case _:
                yield from self._message(OPERATOR, step)

    def _lease_lost(self, sender: Sender) -> None:
        self._without_lease.add(sender.peer_id)
        if self._safety.resource and self._mover is not None and self._mover.peer_id == sender.peer_id:
            self._make_safe("safety.lease_lost")

    def refusal(self, peer_id: str, resource: str, epoch: int | None, now_s: float) -> str | None:
        """Implements ``Leases``: everybody holds the lease but who has lost it."""
        return "lease.required" if peer_id in self._without_lease else None

    def _arrival(self, sender: Sender) -> ArrivedCommand:
        rate = self._rates.get(sender.peer_id)
        if rate is None and self._safety.max_rate_hz is not None:
            rate = self._rates[sender.peer_id] = TokenBucket.of_rate(self._safety.max_rate_hz)
        channel = CommandChannel(self._safety, self, self, rate=rate)
        return ArrivedCommand(channel, sender.peer_id, sender.role, not sender.is_original, 0, self.host.clock.now_s)

    def _message(self, sender: Sender, data: Any) -> Generator[Any, None, None]:
        try:
            command = self.admitted(sender, data)
            if command.is_idle:
                self._watchdog.disarm()
                self._mover = None
                self.fed.idle += 1
                return
            self._watchdog.feed(sender.peer_id, self.host.clock.now_s)
            self._mover = self._last_sender = sender
            self._zeros_at_s.clear()
            self._is_handling, self._overtaken_cause = True, None
            arguments = (command.value, sender) if self._takes_sender else (command.value,)
            waiting = self._handler.handle_data(*arguments)
            if waiting is not None:
                yield waiting
        except Refused as refused:
            self.fed.refused.append(RefusedMessage(self._elapsed_s(), refused.code, refused.message))
        except DeviceGone as gone:
            if self._handler.keeper is None:
                raise
            self._handler.keeper.lost(gone)
            self.fed.refused.append(RefusedMessage(self._elapsed_s(), gone.code, gone.message))
        else:
            self.fed.accepted.append(command.value)
        finally:
            self._is_handling = False
        if self._overtaken_cause is not None:
            # The command may have undone the safe action that ran in its middle.
            self._make_safe(self._overtaken_cause)

    def admitted(self, sender: Sender, data: Any) -> ShapedCommand:
        """Through the same gates as on a robot; raises :class:`Refused`."""
        must_release = lambda: self._release.is_holding(sender.peer_id)  # noqa: E731 - asked when its turn has come
        turn = _Turn(
            _payload(data), self._shaper, self._safety, lambda: _GOOD, lambda _: None, must_release=must_release
        )
        turn.share = self._factor if self._safety.is_slowed else 1.0
        refusal = refusal_on_arrival(self._arrival(sender))
        if self._has_paused(sender) and refusal is None:
            self._release.let_go(sender.peer_id)
        refusal = refusal or refusal_on_acting(turn)
        if refusal is not None:
            raise Refused(refusal.code, refusal.message)
        if not turn.command.wants_motion:
            self._release.let_go(sender.peer_id)
        return turn.command

    def _has_paused(self, sender: Sender) -> bool:
        now_s = self.host.clock.now_s
        before_s, self._said_at_s[sender.peer_id] = self._said_at_s.get(sender.peer_id, -math.inf), now_s
        return now_s - before_s >= (self._safety.timeout_s or PAUSE_S)

    def _follow(self, policy: SafePolicy, cause: str) -> None:
        if policy == "hold":
            return
        self._make_safe(cause)
        if policy == "zero":
            count = round(ZEROS_FOR_S / ZERO_PERIOD_S)
            self._zeros_at_s = [self.host.clock.now_s + number * ZERO_PERIOD_S for number in range(count)]

    def _make_safe(self, cause: str) -> None:
        if self._is_handling:
            self._overtaken_cause = cause
        self._watchdog.disarm()
        self._mover = None
        self._zeros_at_s.clear()
        try:
            self._handler.make_safe(cause)
        except DeviceGone:
            if self._handler.keeper is None:
                raise
        else:
            self.fed.made_safe.append(MadeSafe(self._elapsed_s(), cause))

    def _elapsed_s(self) -> float:
        """To the microsecond, so that a test can write ``0.3`` and mean it."""
        return round(self.host.clock.now_s - self._start_s, 6)


_GOOD = Measures(rtt_ms=0.0, loss=0.0, picture_ms=0.0)


class _Turn(CommandTurn):
    """A command whose sender's link is as bad as the script says; ``share`` is what that leaves of the speed."""

    share = 1.0

    def limit(self) -> None:
        self.factor *= self.share
        super().limit()


def _payload(data: Any) -> bytes:
    if isinstance(data, bytes):
        return data
    if isinstance(data, str):
        return data.encode()
    plain = data.model_dump(mode="json") if isinstance(data, BaseModel) else data
    return json.dumps(plain).encode()
