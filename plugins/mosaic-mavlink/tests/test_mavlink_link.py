"""A link and its vehicles in fake time: who is heard, who is not, and what is sent."""

from __future__ import annotations

from typing import Any

import pytest

from mosaic_core.words.errors import DeviceGone
from mosaic_mavlink.fake.autopilot import FakeAutopilot
from mosaic_mavlink.link.link import MAX_BYTES_PER_S, MavlinkLink
from mosaic_mavlink.params import VehicleParams


def test_a_ground_station_beats_once_a_second(air: Any, copter: FakeAutopilot) -> None:
    before = len(air.sent("HEARTBEAT"))
    air.pass_time(5.0)
    assert len(air.sent("HEARTBEAT")) - before in (4, 5)
    beat = air.sent("HEARTBEAT")[-1]
    assert (beat.get_srcSystem(), beat.get_srcComponent(), beat.type) == (255, 190, 6)


def test_the_heartbeat_says_what_it_is(air: Any, copter: FakeAutopilot) -> None:
    facts = air.contact().vehicle.facts
    assert (facts.system_id, facts.kind, facts.autopilot, facts.vehicle_type) == (
        1,
        "copter",
        "ardupilotmega",
        "quadrotor",
    )
    assert (facts.mode, facts.armed, facts.status) == ("LOITER", False, "standby")


def test_before_it_is_heard_there_is_patience_and_then_it_is_gone_with_a_cure(air: Any) -> None:
    contact = air.contact()
    air.pass_time(2.0)
    assert not contact.is_there()
    air.pass_time(1.5)
    with pytest.raises(DeviceGone, match=r"no heartbeat of any vehicle on udpin:.* switched on"):
        contact.is_there()


def test_a_vehicle_that_is_away_for_thirty_seconds_is_gone_and_then_asked_anew_for_what_it_tells(
    air: Any, copter: FakeAutopilot
) -> None:
    contact = air.contact()
    contact.vehicle.rates.want("ATTITUDE", 0.1)
    air.pass_time(1.0)
    assert contact.is_there()
    assert copter.periods_s["ATTITUDE"] == 0.1
    air.silent.add(1)
    for _ in range(6):
        air.pass_time(5.0)
        with pytest.raises(DeviceGone, match="no heartbeat"):
            contact.is_there()
    copter.periods_s = {"HEARTBEAT": 1.0}  # it has booted
    air.silent.clear()
    air.pass_time(1.5)
    assert contact.is_there()
    assert copter.periods_s["ATTITUDE"] == 0.1


def test_the_wrong_system_is_named_in_the_cure(air: Any) -> None:
    air.add(system_id=7)
    contact = air.contact(system_id=2)
    air.pass_time(4.0)
    assert contact.vehicle.facts is None
    with pytest.raises(DeviceGone, match=r"no heartbeat of system 2 .* heard instead: system 7; check system_id"):
        contact.is_there()


def test_two_vehicles_on_one_link_are_two(air: Any) -> None:
    air.add("copter", 1).body.up_m = 10.0
    air.add("rover", 2)
    air.sources[2] = ("10.0.0.2", 14550)
    first, second = air.contact(system_id=1), air.contact(system_id=2)
    air.pass_time(0.5)
    assert (first.facts().kind, second.facts().kind) == ("copter", "rover")
    second.send(("command_long", command(400, 1.0)))
    air.pass_time(1.0)
    assert (first.facts().armed, second.facts().armed) == (False, True)


def command(number: int, first: float) -> dict[str, Any]:
    zeros = {f"param{place}": 0.0 for place in range(2, 8)}
    return {"command": number, "confirmation": 0, "param1": first, **zeros}


def test_the_first_that_is_heard_stays_the_one_even_when_it_is_gone(air: Any, copter: FakeAutopilot) -> None:
    contact = air.contact()
    air.silent.add(1)
    air.add("rover", 9)
    air.pass_time(4.0)
    assert contact.vehicle.facts.system_id == 1
    with pytest.raises(DeviceGone, match="heard instead: system 9"):
        contact.is_there()


def test_a_vehicle_that_falls_silent_is_not_named_as_somebody_else(air: Any, copter: FakeAutopilot) -> None:
    contact = air.contact()
    air.pass_time(0.5)
    air.silent.add(1)
    air.pass_time(4.0)
    with pytest.raises(DeviceGone, match="it was heard before: check that it is still switched on") as told:
        contact.is_there()
    assert "system_id" not in str(told.value)


def test_nobody_else_speaks_as_a_vehicle_whose_heart_beats(air: Any, copter: FakeAutopilot) -> None:
    heartbeat = {"type": 2, "autopilot": 3, "base_mode": 0x81, "custom_mode": 9, "system_status": 4}
    air.sources[1] = ("6.6.6.6", 666)
    air.say("heartbeat", **heartbeat)
    air.silent.add(1)
    air.pass_time(0.2)
    assert air.contact().facts().mode == "LOITER"
    air.pass_time(3.5)
    air.say("heartbeat", **heartbeat)
    air.pass_time(0.1)
    assert air.contact().facts().mode == "LAND"  # it may have got a new address


def test_ground_stations_and_cameras_are_no_vehicles(air: Any) -> None:
    air.add()
    air.silent.add(1)
    contact = air.contact()
    air.say("heartbeat", type=6, autopilot=8, base_mode=0, custom_mode=0, system_status=4)
    air.pass_time(0.2)
    assert contact.vehicle.facts is None


def test_garbage_between_messages_costs_nothing_but_itself(air: Any, copter: FakeAutopilot) -> None:
    contact = air.contact()
    source = air.sources[1]
    air.waiting.extend((bytes([0xFD, 255, 0, *range(30)]) * 20, source) for _ in range(20))
    air.pass_time(3.0)
    assert contact.is_there()
    assert air.link._codec.bad_frames > 0


def test_garbage_of_a_stranger_can_not_swallow_what_the_vehicle_says(air: Any, copter: FakeAutopilot) -> None:
    contact = air.contact()
    contact.vehicle.rates.want("ATTITUDE", 0.05)
    air.pass_time(0.5)
    for _ in range(20):
        air.waiting.append((bytes([0xFD, 255]), ("6.6.6.6", 666)))
        before = contact.vehicle.latest("ATTITUDE").number
        air.pass_time(0.1)
        assert contact.vehicle.latest("ATTITUDE").number > before


def test_garbage_alone_suggests_baud_and_key(air: Any) -> None:
    contact = air.contact()
    for _ in range(4):
        air.waiting.append((bytes(range(250)), ("10.0.0.1", 1)))
        air.pass_time(1.0)
    with pytest.raises(DeviceGone, match="no valid MAVLink: check baud and signing_key"):
        contact.is_there()


def test_a_flood_is_not_read_beyond_its_limit_and_the_vehicle_stays(air: Any, copter: FakeAutopilot) -> None:
    contact = air.contact()
    text = air._codecs[1].packed("statustext", {"severity": 6, "text": b"flood " * 8})
    for _ in range(2):
        air.waiting.extend((text * 100, air.sources[1]) for _ in range(MAX_BYTES_PER_S // (50 * len(text))))
        air.pass_time(1.0)
    assert air.link.flood_bytes > 0
    assert len(contact.vehicle.texts.since(0)) <= 100
    air.pass_time(1.5)
    assert contact.is_there()


def test_a_flood_of_strangers_takes_nothing_of_what_a_vehicle_may_say(air: Any, copter: FakeAutopilot) -> None:
    contact = air.contact()
    for _ in range(4):
        air.waiting.extend((b"\xfd" * 5000, ("6.6.6.6", 666)) for _ in range(2 * MAX_BYTES_PER_S // 5000))
        air.pass_time(1.0)
        assert contact.is_there()
    assert air.link.flood_bytes > 0


def test_a_port_that_breaks_is_gone_at_once(air: Any, copter: FakeAutopilot) -> None:
    contact = air.contact()
    air.broken = OSError(5, "Input/output error")
    assert not contact.send(("command_long", command(400, 1.0)))
    with pytest.raises(DeviceGone, match=r"udpin:.* is lost: .*Input/output error"):
        contact.is_there()


def test_a_port_that_can_not_be_opened_says_why() -> None:
    params = VehicleParams(url="/dev/mosaic-no-such-device")
    with pytest.raises(DeviceGone, match=r"serial /dev/mosaic-no-such-device can't be opened: .*; plug it in"):
        MavlinkLink(params).open()


def test_long_texts_are_put_together_and_lost_chunks_are_seen(air: Any, copter: FakeAutopilot) -> None:
    texts = air.contact().vehicle.texts
    before = texts.count
    air.say("statustext", severity=4, text=b"a" * 50, id=3, chunk_seq=0)
    air.say("statustext", severity=4, text=b"b", id=3, chunk_seq=1)
    air.say("statustext", severity=2, text=b"c" * 50, id=4, chunk_seq=0)
    air.say("statustext", severity=2, text=b"d", id=4, chunk_seq=2)
    air.say("statustext", severity=7, text=b"short\x1b[31m")
    air.pass_time(0.1)
    told = [(one.level, one.text) for one in texts.since(before)]
    assert told == [("warn", "a" * 50 + "b"), ("fatal", "c" * 50 + "…d"), ("debug", "short [31m")]


def test_a_rate_is_asked_for_again_while_nothing_comes(air: Any, copter: FakeAutopilot) -> None:
    air.contact().vehicle.rates.want("HIGHRES_IMU", 0.1)
    air.pass_time(11.0)
    asked = [one for one in air.heard if one.get_type() == "COMMAND_LONG" and one.param1 == 105]
    assert 2 <= len(asked) <= 3
