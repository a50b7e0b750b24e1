"""Runs one link to vehicles: opens its port, reads it on a thread of its own, beats as a ground station once a second,
and says of each vehicle whether it is there.

Connectors with the same link params share it (``Shared``). Entering never fails and never blocks.
"""

from __future__ import annotations

import logging
import threading
import time
from collections.abc import Callable
from typing import Any, Self

from pymavlink.dialects.v20 import ardupilotmega as words

from mosaic_core.contract.devices.keeper import Keeper
from mosaic_core.contract.devices.shared import Shared
from mosaic_core.words.errors import DeviceGone
from mosaic_mavlink.link.address import LinkAddress, Source, link_address
from mosaic_mavlink.link.codec import MavlinkCodec, signing_key
from mosaic_mavlink.link.opening import opened_port
from mosaic_mavlink.link.outgoing import OutgoingMessage
from mosaic_mavlink.link.ports import Port
from mosaic_mavlink.link.vehicle import Vehicle
from mosaic_mavlink.params import VehicleParams

_log = logging.getLogger(__name__)

READ_TIMEOUT_S = 0.05
HEARTBEAT_S = 1.0
MAX_BYTES_PER_S = 250_000
"""More than twice the fastest telemetry line; what comes beyond it is a flood and is not read."""
CLOSE_TIMEOUT_S = 1.5
LAST_ORDERS_S = 0.7
"""A mode that is insisted on when the robot ends is ordered for so long before the link is closed."""
MAX_HEARD_SYSTEMS = 16
Opens = Callable[[LinkAddress, int], Port]


class MavlinkLink:
    """One link, with all the vehicles on it that connectors name."""

    def __init__(
        self, params: VehicleParams, opens: Opens = opened_port, clock: Callable[[], float] = time.monotonic
    ) -> None:
        self.url = params.url
        self.own_system_id = params.own_system_id
        self.now_s = clock
        self.params = params
        self._opens = opens
        self._codec = self._fresh_codec()
        self._vehicles: dict[tuple[int, int], Vehicle] = {}
        self._sources: dict[Vehicle, Source] = {}
        self._heard: set[int] = set()
        self._port: Port | None = None
        self._opened_s = clock()
        self._writes = threading.Lock()
        self.keeper = Keeper("mavlink-link", self._turn, patience_s=CLOSE_TIMEOUT_S)
        self._beat_s = self._window_s = float("-inf")
        self._window_bytes: dict[bool, int] = {}
        self.flood_bytes = 0
        """What came beyond the limit and was not read."""

    @classmethod
    def of(cls, shared: Shared, params: VehicleParams) -> MavlinkLink:
        """The robot's one link with these params. Raises :class:`ValueError` where another connector wants the same
        device with other ones."""
        url = params.url
        link = shared.get(f"mosaic-mavlink:{url}", lambda: cls(params))
        for name in ("baud", "own_system_id", "own_component_id", "dialect", "signing_key"):
            if getattr(link.params, name) != getattr(params, name):
                raise ValueError(f"{name} differs from that of another connector on {url}; one link has one {name}")
        return link

    def _fresh_codec(self) -> MavlinkCodec:
        one = self.params
        return MavlinkCodec(
            one.dialect, one.own_system_id, one.own_component_id, signing_key(one.signing_key.get_secret_value())
        )

    def vehicle(self, params: VehicleParams) -> Vehicle:
        """The vehicle that ``params`` mean; made once."""
        key = (params.system_id, params.component_id)
        if key not in self._vehicles:
            self._vehicles[key] = Vehicle(*key, params.heartbeat_timeout_s, self.own_system_id)
        return self._vehicles[key]

    def require(self, vehicle: Vehicle) -> bool:
        """Whether ``vehicle`` is there; ``False`` while it may still be heard. Any thread. Raises :class:`DeviceGone`
        that says what was heard instead."""
        absence, now_s = self.keeper.absence, self.now_s()
        if absence is not None:
            raise DeviceGone(absence.message)
        if vehicle.is_present(now_s):
            return True
        since_s = max(self._opened_s, vehicle.facts.heard_at_s if vehicle.facts is not None else 0.0)
        if now_s - since_s <= vehicle.timeout_s:
            return False
        which = f"system {vehicle.wanted_id}" if vehicle.wanted_id else "any vehicle"
        raise DeviceGone(f"no heartbeat of {which} on {self.url} for {now_s - since_s:.0f} s", self._cure(vehicle))

    def _cure(self, vehicle: Vehicle) -> str:
        its = set() if vehicle.facts is None else {vehicle.facts.system_id}
        heard = ", ".join(map(str, sorted(self._heard - its)))
        if its and not heard:
            return "it was heard before: check that it is still switched on, and the radio or cable to it"
        if self._codec.bad_frames and not heard:
            return "what came is no valid MAVLink: check baud and signing_key"
        if heard:
            return f"heard instead: system {heard}; check system_id and component_id"
        return "check that it is switched on and sends to this link"

    def send(self, vehicle: Vehicle, message: OutgoingMessage) -> bool:
        """Send to ``vehicle`` now; ``False`` when it was never heard or the link is lost. Any thread, never blocks
        for longer than half a second."""
        facts = vehicle.facts
        if facts is None:
            return False
        name, fields = message
        target = {"target_system": facts.system_id, "target_component": facts.component_id}
        if name == "manual_control":
            target = {"target": facts.system_id}
        return self._write(self._codec.packed(name, {**target, **fields}), self._sources.get(vehicle))

    def _write(self, frame: bytes, to: Source) -> bool:
        try:
            with self._writes:
                if self._port is None:
                    return False
                self._port.write(frame, to)
        except OSError as error:
            self._lose(error)
            return False
        return True

    def _lose(self, error: OSError) -> None:
        """The link's thread opens it anew."""
        self.keeper.lost(DeviceGone(f"the MAVLink link {self.url} is lost: {error}"))

    def __enter__(self) -> Self:
        self._opened_s = self.now_s()
        self.keeper.start()
        return self

    def __exit__(self, *_: object) -> None:
        ends_s = time.monotonic() + LAST_ORDERS_S
        while any(one.is_insisting for one in self._vehicles.values()) and time.monotonic() < ends_s:
            time.sleep(READ_TIMEOUT_S)
        self.keeper.stop()

    # -- the link's own thread --

    def _turn(self) -> float:
        self.open()
        self._attend()
        return self.keeper.failed()

    def open(self) -> None:
        """Open the port. Raises :class:`DeviceGone`."""
        port = self._opens(link_address(self.url), self.params.baud)
        with self._writes:
            self._port = port
        self._opened_s = self.now_s()
        self.keeper.worked()

    def _attend(self) -> None:
        assert self._port is not None
        try:
            while not self.keeper.is_stopping and self.keeper.absence is None:
                self.step()
        except OSError as error:
            self._lose(error)
        finally:
            with self._writes:
                self._port.close()
                self._port = None

    def step(self) -> None:
        """Read what has come, and send what is due. Raises :class:`OSError` when the port is lost."""
        assert self._port is not None
        data, source = self._port.read(READ_TIMEOUT_S)
        now_s = self.now_s()
        if data and self._is_within_budget(len(data), source, now_s):
            for message in self._codec.messages(data, source, now_s):
                self._dispatch(message, source, now_s)
        if now_s - self._beat_s >= HEARTBEAT_S:
            self._beat_s = now_s
            self._beat()
        for vehicle in tuple(self._vehicles.values()):
            for outgoing in vehicle.tick(now_s):
                self.send(vehicle, outgoing)

    def _is_within_budget(self, size: int, source: Source, now_s: float) -> bool:
        """Vehicles that are known have a budget of their own: a flood of strangers costs them nothing."""
        if now_s - self._window_s >= 1.0:
            self._window_s, self._window_bytes = now_s, {}
        is_known = source in self._sources.values()
        spent = self._window_bytes[is_known] = self._window_bytes.get(is_known, 0) + size
        if spent <= MAX_BYTES_PER_S:
            return True
        if not self.flood_bytes:
            message = "MAVLink link %s brings more than %d bytes a second; the rest is not read"
            _log.warning(message, self.url, MAX_BYTES_PER_S)
        self.flood_bytes += size
        return False

    def _dispatch(self, message: Any, source: Source, now_s: float) -> None:
        system, component = message.get_srcSystem(), message.get_srcComponent()
        if message.get_type() == "HEARTBEAT" and len(self._heard) < MAX_HEARD_SYSTEMS and system not in self._heard:
            self._heard.add(system)
            _log.info("MAVLink link %s: system %d is heard", self.url, system)
        for vehicle in tuple(self._vehicles.values()):
            if vehicle.is_meant(system, component) and self._is_its_source(vehicle, source, now_s):
                vehicle.hear(message, now_s)
                if vehicle.facts is not None:
                    self._sources[vehicle] = source

    def _is_its_source(self, vehicle: Vehicle, source: Source, now_s: float) -> bool:
        """While its heart beats, nobody else at another address may speak as this vehicle."""
        return vehicle not in self._sources or self._sources[vehicle] == source or not vehicle.is_present(now_s)

    def _beat(self) -> None:
        frame = self._codec.packed("heartbeat", {
            "type": words.MAV_TYPE_GCS, "autopilot": words.MAV_AUTOPILOT_INVALID, "base_mode": 0, "custom_mode": 0,
            "system_status": words.MAV_STATE_ACTIVE,
        })  # fmt: skip
        for source in set(self._sources.values()) or {None}:
            self._write(frame, source)
