"""The spellings of links."""

from __future__ import annotations

import pytest
from pydantic import ValidationError

from mosaic_core.contract.devices.shared import Shared
from mosaic_mavlink.link.address import LinkAddress, link_address
from mosaic_mavlink.link.link import MavlinkLink
from mosaic_mavlink.params import VehicleParams


@pytest.mark.parametrize(
    ("url", "address"),
    [
        ("udpin:0.0.0.0:14550", LinkAddress("udpin", "0.0.0.0", 14550)),  # noqa: S104 - spelt, not opened
        ("udp:127.0.0.1:14551", LinkAddress("udpin", "127.0.0.1", 14551)),
        ("udpout:drone.local:14550", LinkAddress("udpout", "drone.local", 14550)),
        ("udpin:[::1]:14550", LinkAddress("udpin", "::1", 14550)),
        ("tcp:127.0.0.1:5760", LinkAddress("tcp", "127.0.0.1", 5760)),
        ("/dev/ttyACM0", LinkAddress("serial", "/dev/ttyACM0")),
        ("COM7", LinkAddress("serial", "COM7")),
        ("fake:", LinkAddress("fake", "copter")),
        ("fake:px4", LinkAddress("fake", "px4")),
    ],
)
def test_a_link_is_spelt_as_pymavlink_spells_it(url: str, address: LinkAddress) -> None:
    assert link_address(url) == address


@pytest.mark.parametrize(
    "url",
    ["", "udpin:", "udpin:host", "udpin:a:70000", "udpin:a:0", "tcp:a:b", "http://a", "fake:ufo", "tty", "udpin:a b:1"],
)
def test_what_is_no_link_is_refused_with_the_spellings(url: str) -> None:
    with pytest.raises(ValidationError, match=r"is no link; write udpin:0\.0\.0\.0:14550"):
        VehicleParams(url=url)


def test_connectors_with_the_same_link_share_it_and_its_vehicles() -> None:
    shared, params = Shared(), VehicleParams(url="fake:")
    first, second = MavlinkLink.of(shared, params), MavlinkLink.of(shared, VehicleParams(url="fake:", system_id=2))
    assert first is second
    assert first.vehicle(params) is first.vehicle(params)
    assert first.vehicle(params) is not first.vehicle(VehicleParams(url="fake:", system_id=2))


def test_one_device_with_two_speeds_is_a_mistake_that_names_it() -> None:
    shared = Shared()
    MavlinkLink.of(shared, VehicleParams(url="/dev/ttyACM0", baud=57_600))
    with pytest.raises(ValueError, match=r"baud differs from that of another connector on /dev/ttyACM0"):
        MavlinkLink.of(shared, VehicleParams(url="/dev/ttyACM0", baud=115_200))


def test_a_signing_key_does_not_show() -> None:
    assert "hunter2" not in repr(VehicleParams.model_validate({"url": "fake:", "signing_key": "hunter2"}))
