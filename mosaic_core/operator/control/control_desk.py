"""Commanding a robot: take and give back leases, stop, clear, and see who else is there.

Carries out what ``machines.control.operator_control`` decides.
"""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Callable, Mapping, Sequence

from mosaic_core.machines.control import operator_control as machine
from mosaic_core.machines.control.operator_control import LeaseView
from mosaic_core.machines.control.stop_call import StopReport
from mosaic_core.operator.control.control_channel import ControlChannel
from mosaic_core.operator.control.lease import Lease, LeaseDenied
from mosaic_core.operator.control.lease_takers import LeaseTakers
from mosaic_core.operator.control.needed_leases import MOTION, NeededLeases
from mosaic_core.operator.control.robot_answers import RobotAnswers
from mosaic_core.operator.control.stop_caller import StopCaller
from mosaic_core.operator.delivery.data_port import now_us
from mosaic_core.operator.delivery.listeners import Listeners
from mosaic_core.runtime.timing.background_tasks import BackgroundTasks
from mosaic_core.runtime.timing.machine_driver import MachineDriver
from mosaic_core.words import control
from mosaic_core.words.codes import reason
from mosaic_core.words.control import JournalEntry, PeerInfo, SafetyLimit
from mosaic_core.words.errors import ConnectionFailed, MosaicError

_log = logging.getLogger(__name__)

ANSWER_S = 5.0
"""A robot that is connected answers within a round trip."""


class ControlDesk:
    """The operator's side of leases and stop, ``connection.control``. All calls and callbacks on the event loop.

    Original robots know none of this: :attr:`is_available` is false, what asks for a lease raises
    :class:`LeaseDenied`, and anything else that asks the robot :class:`ConnectionFailed`.
    """

    def __init__(self, peer_id: str, clock_us: Callable[[], int] = now_us) -> None:
        self._clock_us = clock_us
        self._takers = LeaseTakers(self._gave_up)
        self._answers = RobotAnswers()
        self._stops: StopCaller | None = None
        self._has_said_stop = False
        self._channel: ControlChannel | None = None
        self._is_original = False
        self._extensions: Mapping[str, int] = {}
        self._listeners: Listeners[[]] = Listeners()
        self._missed: list[Lease] = []
        self.needed = NeededLeases()
        """Which leases the connectors of this robot need; the connection says so with each catalogue."""
        self._tasks = BackgroundTasks()
        self.renew(peer_id)

    # -- what is known -----------------------------------------------------------------------------------------------

    @property
    def is_available(self) -> bool:
        """The robot knows leases and the stop."""
        return self._channel is not None and "lease" in self._extensions

    @property
    def leases(self) -> Mapping[str, LeaseView]:
        """Resource → who commands it, who waits for it, and whether it is this connection."""
        return self._machine.leases

    @property
    def peers(self) -> tuple[PeerInfo, ...]:
        """Everybody who is connected to the robot, this operator too."""
        return self._machine.peers

    @property
    def stop_state(self) -> control.StopState | None:
        """Whether the robot was stopped, by whom and why; ``None`` until it has told."""
        return self._machine.stop_state

    @property
    def limits(self) -> Mapping[str, SafetyLimit]:
        """Label → what is left of the speed, and why; only of what this operator commands."""
        return self._machine.limits

    def epoch_of(self, resource: str) -> int:
        """What commands for ``resource`` carry; 0 where nothing is held."""
        return self._machine.held.get(resource, 0)

    def on_change(self, callback: Callable[[], None]) -> Callable[[], None]:
        """Call ``callback()`` after every change of what is known; returns what ends it."""
        return self._listeners.add(callback)

    async def wait_for(self, condition: Callable[[], object], timeout_s: float = 10.0) -> None:
        """Until ``condition()`` is true, looked at after every change; raises :class:`TimeoutError`."""
        changed = asyncio.Event()
        end = self.on_change(changed.set)
        try:
            async with asyncio.timeout(timeout_s):
                while not condition():
                    changed.clear()
                    await changed.wait()
        finally:
            end()

    # -- the lease ---------------------------------------------------------------------------------------------------

    async def take(
        self, resource: str | None = None, *, reason: str = "", force: bool = False, wait_s: float = 0.0
    ) -> Lease:
        """Ask to command ``resource``; ``async with await control.take() as lease:`` gives it back at the end. Where
        none is named: ``motion``, or the only one that the robot's connectors need.

        Somebody who commands already is asked and has ``wait_s`` seconds to answer. ``force`` takes it over: only
        supervisors, with a reason. Raises :class:`LeaseDenied` with the robot's code (``lease.queued``: nobody answered
        in time; ``lease.unknown_resource``: the robot knows no leases, as an original one, which needs none), and
        :class:`ConnectionFailed` if the connection ends.
        """
        self._channel_for("lease")
        name = self.needed.asked_for(resource)
        try:
            return await self._takers.take(
                name, lambda: self._driver.tell(machine.Asked(name, reason[:200], force)), wait_s
            )
        except LeaseDenied as denied:
            raise self.needed.denied(denied, self.leases) from None

    def release(self, resource: str | None = None) -> None:
        """Give back what this connection holds of ``resource``, by default what :meth:`take` takes by default; nothing
        if it holds none."""
        self._takers.release(resource or self.needed.usual)

    def answer(self, peer_id: str, *, grant: bool, resource: str | None = None, message: str = "") -> None:
        """As the holder, hand the lease over to somebody who waits (``leases[resource].queue``), or refuse."""
        name = resource or self.needed.usual
        self._channel_for("lease").send(
            control.LeaseAnswer(resource=name, peer_id=peer_id, grant=grant, message=message[:200])
        )

    # -- the stop ----------------------------------------------------------------------------------------------------

    async def stop(self, reason: str = "") -> StopReport:
        """Stop the robot: any operator may. Said on a channel of its own every 30 ms until the robot has answered.

        The robot stays stopped until :meth:`clear_stop`. Being cancelled does not unsay it. This is software: it is no
        certified emergency stop. Raises :class:`ConnectionFailed` if the connection ends before the answer, or where
        the robot knows no stop (``safety.no_stop``, an original one: :meth:`RobotConnection.send_zeros` is all it has).
        """
        self._channel_for("stop")
        assert self._stops is not None
        self._has_said_stop = True
        return await self._stops.stop(reason[:200])

    async def clear_stop(self) -> None:
        """Let commands act again. Look at the robot first.

        Only a person who holds a lease, or who supervises: a program, whatever it holds, is refused with
        ``safety.person_clears``.

        Whoever sent commands meanwhile lets go first, by a zero or a pause as long as the connector's time-out: what
        goes on is refused with ``safety.release_first``.

        Raises :class:`LeaseDenied` with the robot's code, or :class:`ConnectionFailed`.
        """
        channel = self._channel_for("stop")
        # Our own stop was acknowledged on a faster channel than the one that tells the robot's state.
        if not self._has_said_stop and self.stop_state is not None and not self.stop_state.is_stopped:
            return
        cleared = self._answers.expect(lambda m: isinstance(m, control.StopState) and not m.is_stopped)
        channel.send(control.StopClear())
        await self._answers.wait(cleared, ANSWER_S, "The robot does not answer; it may still be stopped.")
        self._has_said_stop = False

    async def change_stop_right(self, peer_id: str, *, may_stop: bool) -> None:
        """As a supervisor, take from an observer (:attr:`peers`) the right to say stop, or give it back. Everybody is
        told, and it is journaled; nothing but a supervisor gives it back.

        Raises :class:`LeaseDenied` (``auth.forbidden``, ``safety.always_stops``), or :class:`ConnectionFailed`.
        """
        channel = self._channel_for("stopRight")
        answered = self._answers.expect(
            lambda m: (
                isinstance(m, control.Peers)
                and any(one.peer_id == peer_id and (one.may_stop is not False) == may_stop for one in m.peers)
            )
        )
        channel.send(control.StopRight(peer_id=peer_id, may_stop=may_stop))
        await self._answers.wait(answered, ANSWER_S, "The robot does not answer.")

    def picture_seen(self, label: str, capture_us: int | None) -> None:
        """Tell the robot how old the picture is by which this operator drives: when it was captured, on the robot's
        clock; ``None``: watching, but nothing shown yet. Its age slows commands down. Ten times a second is enough."""
        if self._channel is not None and "safetyLimit" in self._extensions:
            self._channel.send(control.MediaSeen(label=label, capture_us=capture_us))

    # -- who did what ------------------------------------------------------------------------------------------------

    async def journal(self, limit: int = 100, before: int | None = None) -> Sequence[JournalEntry]:
        """The newest entries (``limit`` of 200 at most), newest first; with ``before``, those older than that number.

        Supervisors only: raises :class:`LeaseDenied` (``auth.forbidden``) for others.
        """
        channel = self._channel_for("journal")
        answered = self._answers.expect(lambda m: isinstance(m, control.Journal))
        channel.send(control.JournalRead(limit=limit, before=before))
        answer = await self._answers.wait(answered, ANSWER_S, "The robot does not answer.")
        return answer.entries if isinstance(answer, control.Journal) else ()

    # -- told by the connection --------------------------------------------------------------------------------------

    def greeted(self, channel: ControlChannel, extensions: Mapping[str, int]) -> None:
        """The robot has said hello and what it knows."""
        self._channel, self._extensions, self._is_original = channel, extensions, False
        self._stops = StopCaller(channel, self._clock_us)

    def found_original(self) -> None:
        """Called by the connection: the robot is an original one."""
        self._is_original = True

    def heard(self, message: control.ControlMessage) -> None:
        """Called by the connection with every message of the control channel."""
        self._answers.heard(message)
        if isinstance(message, control.StopAck) and self._stops is not None:
            self._stops.acknowledged(message)
        if isinstance(message, control.Refusal) and message.code == "safety.stop_taken" and self._stops is not None:
            self._stops.ended(LeaseDenied("", message.code, reason(message.code).sentence))
        self._driver.tell(machine.ControlHeard(message))

    def ended(self, error: ConnectionFailed, *, comes_back: bool = False) -> None:
        """The connection has ended: every lease with it. ``comes_back``: :meth:`regain` will ask for them again."""
        self._channel = None
        if comes_back:
            self._missed += self._takers.held_for_long()
        if self._stops is not None:
            self._stops.ended(error)
        self._answers.ended(error)
        self._driver.tell(machine.ConnectionEnded(error.code, error.message))

    def renew(self, peer_id: str) -> None:
        """The connection is being made, or made anew; nothing is known yet."""
        self._machine = machine.OperatorControl(peer_id)
        self._driver = MachineDriver(self._machine, self._carry_out)
        self._is_original = False

    def regain(self) -> None:
        """It is back: ask for what was held when it was lost, and for nothing else. A refusal leaves it lost."""
        missed, self._missed = self._missed, []
        for resource in dict.fromkeys(lease.resource for lease in missed):
            leases = [lease for lease in missed if lease.resource == resource]
            self._tasks.start(self._regain(resource, leases))

    async def _regain(self, resource: str, leases: Sequence[Lease]) -> None:
        try:
            again = await self.take(resource, reason="the connection came back")
        except MosaicError as error:
            _log.warning("the lease of %r did not come back: %s", resource, error.message)
        else:
            self._takers.regained(leases, again)
            self._listeners.tell()

    # -- the machine -------------------------------------------------------------------------------------------------

    def _channel_for(self, extension: str) -> ControlChannel:
        if self._is_original:
            raise _of_an_original(extension)
        if self._channel is None:
            raise ConnectionFailed("The connection is not up.", code="peer.closed")
        if extension not in self._extensions:
            raise _not_known(extension, f"This robot does not know {extension!r}.", "Update MOSAIC on the robot.")
        return self._channel

    def _gave_up(self, resource: str) -> None:
        self._driver.tell(machine.GaveUp(resource))

    def _carry_out(self, effect: machine.Effect) -> None:
        match effect:
            case machine.Say(message):
                if self._channel is not None:
                    self._channel.send(message)
            case machine.ControlChanged():
                self._listeners.tell()
            case _:
                self._takers.decided(effect)


def _of_an_original(extension: str) -> MosaicError:
    if extension == "stop":
        return ConnectionFailed(reason("safety.no_stop").sentence, code="safety.no_stop")
    message = "This robot runs an original MOSAIC: it knows no leases and keeps no journal, and obeys who is connected."
    cure = "Ask `connection.is_original` or `control.is_available` first; there, send without a lease."
    return _not_known(extension, message, cure)


def _not_known(extension: str, message: str, cure: str) -> MosaicError:
    """What the robot has no notion of; a lease of it is denied like any other."""
    if extension == "lease":
        return LeaseDenied(MOTION, "lease.unknown_resource", message, cure=cure)
    return ConnectionFailed(message, code="lease.unknown_resource", cure=cure)
