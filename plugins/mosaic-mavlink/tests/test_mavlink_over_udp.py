"""Links with real sockets and lines, and real MAVLink bytes: as a vehicle would use them."""

from __future__ import annotations

import os
import socket
import sys
import threading
from collections.abc import Callable, Iterator
from typing import Any

import pytest
from support.live_drill import assert_safe, drilled
from support.waiting import wait_for

from mosaic_core.testing import connector
from mosaic_core.words.errors import DeviceGone
from mosaic_mavlink.control.manual import MavlinkManualConfigurer
from mosaic_mavlink.control.velocity import MavlinkVelocityConfigurer
from mosaic_mavlink.fake.autopilot import FakeAutopilot
from mosaic_mavlink.fake.fake_port import FakeVehicle
from mosaic_mavlink.link.codec import MavlinkCodec, signing_key
from mosaic_mavlink.link.contact import VehicleContact
from mosaic_mavlink.link.link import MavlinkLink
from mosaic_mavlink.params import VehicleParams

IN_TIME_S = 10.0
PASSPHRASE = "correct horse"  # noqa: S105 - of this test alone


def free_port() -> int:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as one:
        one.bind(("127.0.0.1", 0))
        return int(one.getsockname()[1])


class Ground:
    """A link that listens on this machine, and the vehicles that were sent to it."""

    def __init__(self, **params: Any) -> None:
        self.port = free_port()
        self.params = VehicleParams.model_validate(
            {"url": f"udpin:127.0.0.1:{self.port}", "heartbeat_timeout_s": 1.5, **params}
        )
        self.link = MavlinkLink(self.params)
        self.vehicles: list[FakeVehicle] = []

    def vehicle(self, kind: str = "copter", **more: Any) -> FakeVehicle:
        self.vehicles.append(FakeVehicle(FakeAutopilot(kind), ("127.0.0.1", self.port), **more))
        return self.vehicles[-1]

    def contact(self, **params: Any) -> VehicleContact:
        return VehicleContact(self.link, self.link.vehicle(self.params.model_copy(update=params)))


@pytest.fixture
def ground() -> Iterator[Callable[..., Ground]]:
    made: list[Ground] = []

    def make(**params: Any) -> Ground:
        made.append(Ground(**params))
        made[-1].contact()
        made[-1].link.__enter__()
        return made[-1]

    yield make
    for one in made:
        one.link.__exit__(None, None, None)
        for vehicle in one.vehicles:
            vehicle.close()
    assert not [thread for thread in threading.enumerate() if thread.name in ("mavlink-link", "fake-vehicle")]


def is_gone(contact: VehicleContact) -> bool:
    try:
        contact.is_there()
    except DeviceGone:
        return True
    return False


def test_a_vehicle_vanishes_and_returns_over_udp(ground: Callable[..., Ground]) -> None:
    station = ground()
    vehicle, contact = station.vehicle(), station.contact()
    wait_for(contact.is_there, "it is heard")
    vehicle.is_silent = True
    wait_for(lambda: is_gone(contact), "it is gone")
    vehicle.is_silent = False
    wait_for(lambda: not is_gone(contact) and contact.is_there(), "it is back")


def test_two_vehicles_on_one_socket_take_their_own_commands(ground: Callable[..., Ground]) -> None:
    station = ground()
    first, second = station.vehicle(system_id=1), station.vehicle("rover", system_id=2)
    one, two = station.contact(system_id=1), station.contact(system_id=2)
    wait_for(lambda: one.is_there() and two.is_there(), "both are heard")
    zeros = {f"param{place}": 0.0 for place in range(2, 8)}
    two.send(("command_long", {"command": 400, "confirmation": 0, "param1": 1.0, **zeros}))
    wait_for(lambda: second.autopilot.armed, "the second is armed")
    assert not first.autopilot.armed


def test_garbage_and_a_flood_from_strangers_leave_the_vehicle_as_it_is(ground: Callable[..., Ground]) -> None:
    station = ground()
    contact, vehicle = station.contact(), station.vehicle()
    wait_for(contact.is_there, "it is heard")
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as stranger:
        for number in range(2000):
            stranger.sendto(os.urandom(200) + bytes([0xFD, 255]), ("127.0.0.1", station.port))
            if number % 100 == 0:
                vehicle.write(os.urandom(30))
    flooded_at_s = contact.now_s()
    # The flood may have pushed some of its heartbeats out of the socket; those after it count again.
    wait_for(lambda: not is_gone(contact) and contact.facts().heard_at_s > flooded_at_s, "it goes on beating")


def test_with_a_key_only_who_has_it_is_heard(ground: Callable[..., Ground]) -> None:
    station = ground(signing_key=PASSPHRASE)
    contact, key = station.contact(), signing_key(PASSPHRASE)
    unsigned = station.vehicle()
    wait_for(lambda: is_gone(contact), "unsigned messages do not count")
    with pytest.raises(DeviceGone, match="check baud and signing_key"):
        contact.is_there()
    unsigned.is_silent = True
    signed = station.vehicle(key=key)
    wait_for(lambda: not is_gone(contact) and contact.is_there(), "signed ones do")
    zeros = {f"param{place}": 0.0 for place in range(2, 8)}
    contact.send(("command_long", {"command": 400, "confirmation": 0, "param1": 1.0, **zeros}))
    wait_for(lambda: signed.autopilot.armed, "it takes ours, which are signed")


def test_a_key_is_64_digits_or_a_passphrase() -> None:
    assert signing_key("00ff" * 16) == bytes([0, 255] * 16)
    assert signing_key(" \n") is None
    assert signing_key("a") == signing_key("a\n") != signing_key("b")


def test_a_stream_over_tcp_is_closed_and_opened_again() -> None:
    with socket.create_server(("127.0.0.1", 0)) as server:
        params = VehicleParams(url=f"tcp:127.0.0.1:{server.getsockname()[1]}")
        link, codec = MavlinkLink(params), MavlinkCodec("ardupilotmega", 1, 1)
        contact = VehicleContact(link, link.vehicle(params))
        heartbeat = {"type": 2, "autopilot": 3, "base_mode": 1, "custom_mode": 4, "system_status": 4}
        with link:
            first, _ = server.accept()
            frame = codec.packed("heartbeat", heartbeat)
            first.sendall(frame[:7])
            first.sendall(frame[7:])
            wait_for(contact.is_there, "it is heard, though in pieces")
            assert first.recv(100)[:1] == b"\xfd"  # our own heartbeat, in MAVLink 2
            first.close()
            wait_for(lambda: is_gone(contact), "the link is lost at once")
            second, _ = server.accept()
            second.sendall(codec.packed("heartbeat", heartbeat))
            wait_for(lambda: not is_gone(contact), "and opened again")
            second.close()


@pytest.mark.skipif(sys.platform == "win32", reason="pseudo-terminals are POSIX")
def test_a_serial_line_carries_it_too() -> None:
    ours, theirs = os.openpty()
    params = VehicleParams(url=os.ttyname(theirs), baud=115_200)
    link, codec = MavlinkLink(params), MavlinkCodec("ardupilotmega", 1, 1)
    contact = VehicleContact(link, link.vehicle(params))
    heartbeat = {"type": 10, "autopilot": 3, "base_mode": 1, "custom_mode": 4, "system_status": 4}
    with link:
        assert os.read(ours, 100)[:1] == b"\xfd"
        os.write(ours, b"boot noise \xfe\xfd" + codec.packed("heartbeat", heartbeat) * 20)
        wait_for(contact.is_there, "it is heard")
        assert contact.facts().kind == "rover"
        os.close(ours)
        wait_for(lambda: is_gone(contact), "unplugged")
    os.close(theirs)


def test_a_host_that_can_not_be_reached_is_told() -> None:
    params = VehicleParams(url=f"tcp:127.0.0.1:{free_port()}")
    link = MavlinkLink(params)
    told = r"tcp 127\.0\.0\.1:\d+ can't be opened: Connection refused; start the simulator"
    with pytest.raises(DeviceGone, match=told):
        link.open()
    with link:
        wait_for(lambda: link.keeper.absence, "its thread has tried, too")
        with pytest.raises(DeviceGone, match=told):
            link.require(link.vehicle(params))


class WillingAutopilot(FakeAutopilot):
    """Its pilot puts it back at once into the mode in which it takes commands: each exercise finds it ready."""

    def __init__(self, kind: str, takes_in: str) -> None:
        self.takes_in = takes_in
        super().__init__(kind)
        self.armed = True

    def _enter(self, mode: str) -> bool:
        return super()._enter(self.takes_in)


@pytest.mark.parametrize(
    ("configurer", "kind", "takes_in"),
    [
        (MavlinkVelocityConfigurer, "copter", "GUIDED"),
        (MavlinkVelocityConfigurer, "rover", "GUIDED"),
        (MavlinkManualConfigurer, "copter", "LOITER"),
    ],
)
async def test_an_armed_vehicle_passes_the_whole_drill(configurer: Any, kind: str, takes_in: str) -> None:
    port = free_port()
    vehicle = FakeVehicle(WillingAutopilot(kind, takes_in), ("127.0.0.1", port))
    try:
        assert_safe(await drilled(connector(configurer, params={"url": f"udpin:127.0.0.1:{port}"})))
        body = vehicle.autopilot.body
        wait_for(lambda: (body.forward_mps, body.right_mps, body.up_mps, body.yaw_radps) == (0, 0, 0, 0), "it stands")
    finally:
        vehicle.close()
