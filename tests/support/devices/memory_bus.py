"""A bus of ROS in memory, on the fake clock of the kit: waiting for a message lets time pass, and a script says what
happens meanwhile."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Sequence

from mosaic_core.testing import FakeClock
from mosaic_ros2.bus.bus import Arrived, BusError, HeardEndpoint, NotTaken, ServiceCaller
from mosaic_ros2.bus.qos import QosProfile, misfits
from mosaic_ros2.bus.shared_bus import BusChoice, SharedBus

PATIENCE_S = 7200.0


class MemoryBus:
    """Holds endpoints that tests put there, and hands messages to whoever subscribes."""

    where = "a bus in memory"

    def __init__(self, clock: FakeClock) -> None:
        self.clock = clock
        clock.watch(self)
        self._began_s = clock.now_s
        self.heard: list[HeardEndpoint] = []
        self.subscriptions: list[MemorySubscription] = []
        self.published: list[bytes] = []
        self.readers = 1
        self.fails = False
        """Nothing can be opened, and whatever is written to is lost."""
        self.ends_badly = False
        """A publication raises also when it is closed."""
        self.is_slow = False
        """Subscriptions find no room for messages."""
        self.asked = 0
        """How often a publication was asked for."""
        self.opened = 0
        self.learns = ""
        self._script: deque[tuple[float, Callable[[], object]]] = deque()

    def at(self, seconds: float, act: Callable[[], object]) -> None:
        """Do this so many seconds from now, whoever lets the time pass."""
        self._script = deque(sorted([*self._script, (self.clock.now_s + seconds, act)], key=lambda one: one[0]))

    @property
    def due_at_s(self) -> float | None:
        """When the script goes on, for the clock."""
        return self._script[0][0] if self._script else None

    def ring(self, now_s: float) -> None:
        """The next of the script."""
        self._script.popleft()[1]()

    def wait(self, is_over: Callable[[], object], timeout_s: float) -> None:
        """Let time pass until it is over. Raises :class:`TimeoutError` after two hours of a test."""
        until_s = self.clock.now_s + timeout_s
        if self.clock.now_s > self._began_s + PATIENCE_S:
            raise TimeoutError("nothing came in two hours")
        while not is_over() and self.clock.now_s < until_s:
            next_s = self._script[0][0] if self._script else until_s
            self.clock.advance(min(next_s, until_s) - self.clock.now_s)

    def send(self, *messages: bytes) -> None:
        """A publisher's messages to whoever hears them now."""
        for subscription in self.subscriptions:
            subscription.waiting.extend(Arrived(one) for one in messages)

    def endpoints(self) -> Sequence[HeardEndpoint]:
        return tuple(self.heard)

    def subscribe(self, topic: str, type_name: str, qos: QosProfile) -> MemorySubscription:
        self.subscriptions.append(MemorySubscription(self, topic, qos))
        return self.subscriptions[-1]

    def publish(self, topic: str, type_name: str, qos: QosProfile) -> MemoryPublication:
        self.asked += 1
        if self.fails:
            raise BusError("the bus is away")
        self.opened += 1
        return MemoryPublication(self)

    def caller(self, service: str, type_name: str) -> ServiceCaller:
        raise BusError("no services in memory")

    def learn_type(self, topic: str) -> str:
        return self.learns

    def close(self) -> None:
        self.subscriptions.clear()


class MemorySubscription:
    def __init__(self, bus: MemoryBus, topic: str, qos: QosProfile) -> None:
        self.topic = topic
        self.qos = qos
        self.waiting: deque[Arrived] = deque(maxlen=qos.depth)
        self._bus = bus

    def take(self, timeout_s: float) -> Sequence[Arrived]:
        self._bus.wait(lambda: self.waiting, timeout_s)
        taken = list(self.waiting)
        self.waiting.clear()
        return taken

    @property
    def publishers(self) -> int:
        here = (one for one in self._bus.heard if one.name == self.topic and one.role == "publisher")
        return sum(not misfits(one.qos, self.qos) for one in here)

    def close(self) -> None:
        self._bus.subscriptions.remove(self)


class MemoryPublication:
    def __init__(self, bus: MemoryBus) -> None:
        self._bus = bus
        self._is_lost = False

    def write(self, data: bytes) -> None:
        self._is_lost |= self._bus.fails
        if self._is_lost:
            raise BusError("the bus is away")
        if self._bus.is_slow:
            raise NotTaken("no room")
        self._bus.published.append(data)

    @property
    def readers(self) -> int:
        return self._bus.readers

    def close(self) -> None:
        if self._bus.ends_badly:
            raise RuntimeError("its session is gone")


class SharedMemoryBus(SharedBus):
    """Shares a bus in memory."""

    def __init__(self, bus: MemoryBus) -> None:
        super().__init__(BusChoice())
        self.memory = bus

    def joined(self) -> MemoryBus:
        return self.memory
