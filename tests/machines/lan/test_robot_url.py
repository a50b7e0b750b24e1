"""Addresses of robots' own servers: as browsers write them, and what people type for one."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from mosaic_core.machines.lan.robot_url import robot_url, url_of
from mosaic_core.words.errors import SignalingError


@pytest.mark.parametrize(
    ("scheme", "host", "port", "url"),
    [
        ("http", "10.0.0.7", 9002, "http://10.0.0.7:9002"),
        ("http", "10.0.0.7", 80, "http://10.0.0.7"),
        ("wss", "fd00::7", 443, "wss://[fd00::7]"),
        ("https", "rover.local", 80, "https://rover.local:80"),
    ],
)
def test_an_address_as_browsers_write_it(scheme: str, host: str, port: int, url: str) -> None:
    assert url_of(scheme, host, port) == url


@pytest.mark.parametrize(
    ("typed", "url"),
    [
        ("10.0.0.7", "http://10.0.0.7:9002"),
        ("10.0.0.7:80", "http://10.0.0.7"),
        ("fd00::7", "http://[fd00::7]:9002"),
        ("[fd00::7]:9003", "http://[fd00::7]:9003"),
        ("rover.local", "http://rover.local:9002"),
        ("localhost:9100", "http://localhost:9100"),
        ("bench:9002", "http://bench:9002"),
        ("https://rover.example.org/", "https://rover.example.org"),
        ("http://10.0.0.7:9002", "http://10.0.0.7:9002"),
    ],
)
def test_what_is_typed_for_an_address(typed: str, url: str) -> None:
    assert robot_url(typed) == url


@pytest.mark.parametrize("name", ["Rover", "Rover 7", "rover.7", "Ann's arm: left", "10.0.0.7:99999", "a:b:c", ""])
def test_everything_else_is_a_name(name: str) -> None:
    assert robot_url(name) is None


@pytest.mark.parametrize(
    "url",
    [
        "ftp://rover",
        "http://",
        "http://a@rover",
        "http://rover/x",
        "http://rover/?a",
        "http://rover:99999",
        "http://[x",
    ],
)
def test_a_url_that_leads_to_no_robot_is_refused(url: str) -> None:
    with pytest.raises(SignalingError) as caught:
        robot_url(url)
    assert caught.value.code == "lan.not_found"


def test_the_code_in_a_scanned_url_is_not_repeated() -> None:
    with pytest.raises(SignalingError) as caught:
        robot_url("http://10.0.0.7:9002/#pair=secret")
    assert "secret" not in f"{caught.value.message} {caught.value.cure}"


@given(st.text(max_size=60))
def test_an_address_is_read_as_itself(typed: str) -> None:
    try:
        url = robot_url(typed)
    except SignalingError:
        return
    assert url is None or robot_url(url) == url
