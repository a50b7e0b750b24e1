"""What robots announce: bounded, plain, and picked by id or name."""

from __future__ import annotations

from ipaddress import ip_address
from urllib.parse import urlsplit
from uuid import UUID

import pytest
from hypothesis import given
from hypothesis import strategies as st

from mosaic_core.machines.lan.announced_robots import (
    LONGEST_NAME,
    MOST_ADDRESSES,
    AnnouncedRobot,
    announced_robot,
    meant_robot,
)
from mosaic_core.words.errors import SignalingError
from mosaic_core.words.lan import SERVICE_TYPE
from mosaic_core.words.plain_text import plain

ID = str(UUID(int=7))
SERVICE = f"Rover 7.{SERVICE_TYPE}"
FINGERPRINT = ":".join(["AB"] * 32)


def read(hosts: list[str] | None = None, port: int | None = 9002, **words: str | None) -> AnnouncedRobot | None:
    return announced_robot(SERVICE, {"id": ID, **words}, hosts or ["10.0.0.7"], port)


def test_a_robot_is_read_as_it_announces_itself() -> None:
    found = read(["10.0.0.7", "fd00::7", "rover-7.local"], name="Rover", version="0.1.0", scheme="https",
                 fingerprint=FINGERPRINT)  # fmt: skip
    urls = ("https://10.0.0.7:9002", "https://[fd00::7]:9002", "https://rover-7.local:9002")
    assert found == AnnouncedRobot("Rover", ID, urls, "0.1.0", FINGERPRINT)


def test_without_a_name_of_its_own_it_goes_by_that_of_its_service() -> None:
    found = read()
    assert found is not None
    assert (found.name, found.urls) == ("Rover 7", ("http://10.0.0.7:9002",))


@pytest.mark.parametrize(
    "host",
    ["127.0.0.1", "::1", "0.0.0.0", "::ffff:127.0.0.1", "224.0.0.251", "fe80::1", "evil.example", "a b.local"],  # noqa: S104
)
def test_what_leads_to_no_other_machine_of_this_network_is_left_out(host: str) -> None:
    assert read([host]) is None
    found = read([host, "10.0.0.7"])
    assert found is not None
    assert found.urls == ("http://10.0.0.7:9002",)


@pytest.mark.parametrize("robot_id", [None, "", "rover", "../../x", ID * 1000])
def test_without_an_id_it_is_no_robot(robot_id: str | None) -> None:
    assert read(id=robot_id) is None


@pytest.mark.parametrize("port", [None, 0, -1, 65536])
def test_without_a_port_it_is_no_robot(port: int | None) -> None:
    assert read(port=port) is None


def test_a_name_that_acts_on_a_terminal_becomes_plain() -> None:
    found = read(name="\x1b[2JRover\n\u202eevil", version="\a1", fingerprint="\x1b")
    assert found is not None
    assert found.name.isprintable()
    assert found.version.isprintable()
    assert found.fingerprint == ""


@given(
    st.text(max_size=300),
    st.dictionaries(st.sampled_from(["name", "version", "fingerprint", "scheme", "id"]), st.none() | st.text()),
    st.lists(st.ip_addresses().map(str) | st.text(max_size=80), max_size=60),
    st.integers() | st.none(),
)
def test_whatever_is_announced_is_bounded_and_plain(
    service: str, words: dict[str, str | None], hosts: list[str], port: int | None
) -> None:
    found = announced_robot(service, {"id": ID, **words}, hosts, port)
    if found is None:
        return
    assert 0 < len(found.name) <= LONGEST_NAME
    assert found.name == plain(found.name)
    assert UUID(found.robot_id)
    assert 0 < len(found.urls) <= MOST_ADDRESSES
    for url in found.urls:
        host = urlsplit(url).hostname or ""
        assert host.endswith(".local") or not ip_address(host).is_loopback
        assert urlsplit(url).port or url.count(":") == 1 or "[" in url


ROVER = AnnouncedRobot("Rover", ID, ("http://10.0.0.7:9002",))
TWIN = AnnouncedRobot("Rover", str(UUID(int=8)), ("http://10.0.0.8:9002",))
ARM = AnnouncedRobot("Arm", str(UUID(int=9)), ("http://10.0.0.9:9002",))


def test_the_robot_of_an_id_or_a_name() -> None:
    assert meant_robot("Arm", [ROVER, TWIN, ARM]) == ARM
    assert meant_robot(TWIN.robot_id, [ROVER, TWIN, ARM]) == TWIN


def test_no_robot_is_told_with_the_nearest_name() -> None:
    with pytest.raises(SignalingError, match="did you mean 'Rover'") as caught:
        meant_robot("Rovr", [ROVER, ARM])
    assert caught.value.code == "lan.not_found"


def test_several_of_one_name_are_told_with_id_and_address() -> None:
    with pytest.raises(SignalingError, match=f"{TWIN.robot_id} at http://10.0.0.8:9002") as caught:
        meant_robot("Rover", [ROVER, TWIN, ARM])
    assert caught.value.code == "lan.several"
