"""The arm: one thread owns its bus, reads all motors and writes all goals at a fixed rate, and opens it again when it
was lost. Connectors and safety threads only say where joints shall go.

Each joint moves toward its goal at its own rate at most, whoever set the goal: from where it is when the bus is opened,
so that nothing swings when the power comes.
"""

from __future__ import annotations

import math
import threading
import time
from collections.abc import Callable, Iterable, Mapping

from mosaic_arm.arm_joint import ArmJoint, ArmSnapshot
from mosaic_arm.bus_session import BusSession
from mosaic_core import DeviceGone, Keeper, Refused
from mosaic_core.contract.devices.kept_device import KeptDevice

HOLD_NEAR_RAD = 0.05
"""A joint this near to its goal has arrived: held where it is instead, it would sink a little at every stop."""
MAX_STEP_S = 0.1
"""After a longer gap between two turns a joint goes on, instead of catching up."""
SILENCE = "safety.timeout"
"""The one cause that speaks of a single connector; a stop or a loss is of all."""
OPENING = DeviceGone("the arm is not open yet", "Wait a moment.")


class Arm(KeptDevice):
    """Keeps one arm. Enter it with the robot (``Shared``); entering never fails and never blocks.

    :meth:`aim`, :meth:`hold`, :meth:`standing_rad` and :attr:`snapshot` may be used from any thread and never wait for
    the bus.
    """

    def __init__(
        self, joints: tuple[ArmJoint, ...], session: BusSession, rate_hz: float,
        clock: Callable[[], float] = time.monotonic, *, is_free: bool = False, gripper: str | None = None,
    ) -> None:  # fmt: skip
        """``is_free``: the motors are off from the beginning, as those of an arm that hands lead. ``gripper``: the
        joint that grips what it can't close upon."""
        self.joints = {joint.name: joint for joint in joints}
        self._session = session
        self._gripper = gripper
        self._period_s = 1 / rate_hz
        self._clock = clock
        self._lock = threading.Lock()
        self._snapshot: ArmSnapshot | None = None
        self._gone: DeviceGone = OPENING
        self._goals: dict[str, float] = {}
        self._sent: dict[str, float] = {}
        self._rates: dict[str, float] = {}
        self._strength: dict[str, float] = {}
        self._aimed_by: dict[str, object] = {}
        self._wants_power = not is_free
        self._turned_at_s = 0.0
        self._opened = threading.Event()
        self.keeper = Keeper("mosaic-arm-bus", self.turn, self.close)

    # -- any thread ------------------------------------------------------------------------------------------------

    @property
    def snapshot(self) -> ArmSnapshot | None:
        """The last turn's; ``None`` while the bus is away."""
        return self._snapshot

    def present(self) -> ArmSnapshot:
        """The same. Raises :class:`Refused` (``plugin.no_device``) while the bus is away."""
        snapshot = self._snapshot
        if snapshot is None:
            raise Refused("plugin.no_device", self._gone.message)
        return snapshot

    @property
    def gone(self) -> DeviceGone:
        """Why there is no snapshot."""
        return self._gone

    @property
    def is_opening(self) -> bool:
        """The bus was not tried yet."""
        return self._gone is OPENING and self._snapshot is None

    @property
    def is_free(self) -> bool:
        """The motors are off on purpose."""
        return not self._wants_power

    @property
    def lost_replies(self) -> int:
        """Replies of motors that never came or were broken, since the robot started."""
        return self._session.lost_replies

    def wait_open(self, timeout_s: float) -> bool:
        """Block until the bus was read; ``False`` when that took too long."""
        return self._opened.wait(timeout_s)

    def standing_rad(self, name: str) -> float | None:
        """Where a joint stands: its goal if it is there but for what its load bends it. ``None``: not known now."""
        with self._lock:
            return self._standing(name)

    def aim(
        self, angles_rad: Mapping[str, float], by: object, *, duration_s: float | None = None,
        strength_percent: float | None = None,
    ) -> None:  # fmt: skip
        """Go there, each joint within its limits, in ``duration_s`` if its rate allows, ``None``: as fast as that
        allows. ``strength_percent``: with so much of the torque allowed. Raises
        :class:`Refused` while the bus is away (``plugin.no_device``) or the motors are off (``arm.free``)."""
        with self._lock:
            self.present()
            if not self._wants_power:
                raise Refused("arm.free")
            for name, angle_rad in angles_rad.items():
                self._goals[name] = goal = self.joints[name].within(angle_rad)
                self._rates[name] = abs(goal - self._sent[name]) / duration_s if duration_s else math.inf
                self._aimed_by[name] = by
                if strength_percent is not None:
                    self._strength[name] = strength_percent

    def make_safe(self, cause: str, by: object) -> None:
        """Hold what ``by`` moves if it only fell silent, for another connector may go on; after anything else, such as
        a stop, a lost lease or a lost operator, hold all."""
        self.hold(by if cause == SILENCE else None)

    def hold(self, aimed_by: object | None = None) -> None:
        """Stand still, at once. The gripper presses on as it does: what it holds would fall. ``aimed_by``: only the
        joints that were told by this one last, for it fell silent and others may go on."""
        with self._lock:
            for name in self._goals:
                if aimed_by is None or self._aimed_by.get(name) is aimed_by:
                    self._stay(name)

    def is_led_by(self, by: object, names: Iterable[str]) -> bool:
        """Whether ``by`` was the last to say where these joints shall go, and nothing held them since."""
        with self._lock:
            return all(self._aimed_by.get(name) is by for name in names)

    def _stay(self, name: str) -> None:
        self._aimed_by.pop(name, None)
        standing = self._sent[name] if name == self._gripper else self._standing(name)
        if standing is not None:
            self._goals[name] = self._sent[name] = standing

    def power(self, *, on: bool) -> None:
        """Let the motors go, or hold the arm where it is then. Takes effect in the next turn. Raises :class:`Refused`
        while the bus is away."""
        with self._lock:
            self.present()
            self._wants_power = on
            self._aimed_by.clear()

    def _standing(self, name: str) -> float | None:
        if self._snapshot is None:
            return None
        present, sent = self._snapshot.angles_rad[name], self._sent.get(name)
        is_there = sent is not None and self._session.has_power and abs(sent - present) <= HOLD_NEAR_RAD
        return sent if is_there else present

    # -- the arm's thread ------------------------------------------------------------------------------------------

    def turn(self) -> float:
        """Read and write once, or try to open the bus; the seconds until the next turn."""
        began_s = self._clock()
        try:
            if not self._session.is_open:
                self._session.open()
            self._read(began_s)
            self._write(began_s)
        except DeviceGone as gone:
            self._lose(gone)
            return self.keeper.away(gone)
        self.keeper.worked()
        return max(0.0, began_s + self._period_s - self._clock())

    def close(self) -> None:
        """The last turn: the arm holds, or falls, as the params say."""
        with self._lock:
            self._snapshot, self._gone = None, OPENING
        self._session.leave()
        self._opened.clear()

    def _read(self, now_s: float) -> None:
        snapshot = self._session.read(now_s)
        with self._lock:
            is_first, self._snapshot = self._snapshot is None, snapshot
            if is_first or not self._wants_power:
                self._goals = dict(snapshot.angles_rad)
                self._sent = dict(snapshot.angles_rad)
        if is_first:
            self._turned_at_s = now_s
            self._opened.set()

    def _write(self, now_s: float) -> None:
        step_s, self._turned_at_s = min(now_s - self._turned_at_s, MAX_STEP_S), now_s
        with self._lock:
            wants_power, strength, self._strength = self._wants_power, self._strength, {}
            for name, goal in self._goals.items():
                most = min(self.joints[name].max_radps, self._rates.get(name, math.inf)) * step_s
                self._sent[name] += min(max(goal - self._sent[name], -most), most)
            sent = dict(self._sent)
        if strength:
            self._session.strengthen(strength)
        self._session.write(sent, wants_power=wants_power)

    def _lose(self, gone: DeviceGone) -> None:
        with self._lock:
            self._snapshot, self._gone = None, gone
            self._aimed_by.clear()
        self._opened.clear()
        self._session.abandon()
