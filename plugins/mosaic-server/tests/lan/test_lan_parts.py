"""The parts of a robot's own server: where it keeps things, how it is reached, what a person at the robot sees."""

from __future__ import annotations

import socket
import stat
import subprocess
import sys
from pathlib import Path
from uuid import UUID

import cv2
import numpy as np
import pytest
from support.processes import free_port

from mosaic_core.machines.lan.robot_url import url_of
from mosaic_core.words.errors import MosaicError
from mosaic_core.words.lan import LanNews
from mosaic_core.words.lan_wish import LanWish
from mosaic_server.lan import addresses
from mosaic_server.lan.addresses import (
    InterfaceAddress,
    lan_addresses,
    mdns_label,
    names_of_certificate,
    usable,
)
from mosaic_server.lan.announcement import Announced
from mosaic_server.lan.child import ServingPlace, fingerprint_of
from mosaic_server.lan.entry import RobotsOwnServer
from mosaic_server.lan.home import LanHome, Reach
from mosaic_server.lan.offers import pairing_page
from mosaic_server.lan.screen import pairing_box, qr_text, spoken_pin
from mosaic_server.storage.database import Database

ROBOT = str(UUID(int=7))
PAGE = pairing_page("http://192.168.178.120:9002", "Zv-JLF9Ly_SeUfAQ")
NEWS = LanNews(urls=("http://192.168.178.120:9002", "http://rover.local:9002"), pin="12345678", page=PAGE)


def mode(file: Path) -> int:
    return stat.S_IMODE(file.stat().st_mode)


# -- home --------------------------------------------------------------------------------------------------------


def test_id_and_token_are_made_once_and_for_nobody_else(tmp_path: Path) -> None:
    home = LanHome(tmp_path / "lan")
    home.make()
    assert (home.robot_id(), home.robot_token()) == (home.robot_id(), home.robot_token())
    assert home.robot_token().startswith("mrt_")
    assert mode(home.directory) == 0o700
    assert {mode(file) for file in home.directory.iterdir()} == {0o600}


def test_a_damaged_id_is_made_anew(tmp_path: Path) -> None:
    (tmp_path / "robot-id").write_text("nonsense")
    assert UUID(LanHome(tmp_path).robot_id())


def test_only_a_running_server_can_be_reached(tmp_path: Path) -> None:
    home, reach = LanHome(tmp_path), Reach("Rover", ROBOT, ("http://10.0.0.7:9002",))
    assert home.reach() is None
    home.tell_reach(reach)
    assert home.reach() is None, "a file that a killed server left behind"
    database = Database(tmp_path)
    database.lock()
    assert home.reach() == reach
    database.close()
    assert not home.is_served


def test_a_second_handle_takes_no_lock_of_the_first_one_away(tmp_path: Path) -> None:
    """Closing any descriptor of a file drops this process's locks on it (POSIX); then whoever else uses the database
    believes to be the last one, and takes the write-ahead log away from under the server."""
    first = Database(tmp_path)
    first.migrate()
    Database(tmp_path).close()
    look = f"import sqlite3; c = sqlite3.connect({str(first.file)!r}); c.execute('select * from account'); c.close()"
    subprocess.run([sys.executable, "-c", look], check=True, timeout=30)
    assert (tmp_path / "mosaic-server.sqlite3-wal").exists()
    first.close()


# -- addresses ---------------------------------------------------------------------------------------------------


def test_addresses_that_a_phone_can_use_private_ones_first() -> None:
    found = [
        InterfaceAddress(interface, address)
        for interface, address in (
            ("lo", "127.0.0.1"),
            ("docker0", "172.17.0.1"),
            ("br-0123456789ab", "172.18.0.1"),
            ("vethab12cd3", "172.19.0.1"),
            ("wwan0", "8.8.8.8"),
            ("wlan0", "192.168.1.20"),
            ("eth0", "169.254.1.1"),
            ("wlan0", "fe80::1"),
            ("wlan0", "fd00::1"),
            ("br-lan", "10.0.0.1"),
            ("wlan0", "192.168.1.20"),
        )
    ]
    assert usable(found, 4) == ["192.168.1.20", "10.0.0.1", "8.8.8.8"]
    assert usable(found, 6) == ["fd00::1"]


def test_a_server_on_one_address_is_reached_there_alone(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(
        addresses, "places", lambda: [InterfaceAddress("wlan0", "10.0.0.7"), InterfaceAddress("wlan0", "fd00::7")]
    )
    assert lan_addresses("10.0.0.7") == ["10.0.0.7"]
    assert lan_addresses(addresses.ANY_IPV4) == ["10.0.0.7"]
    assert lan_addresses(addresses.ANY_IPV6) == ["fd00::7"]


@pytest.mark.parametrize("host", ["127.0.0.1", "127.9.9.9", "::1", "localhost"])
def test_loopback_is_no_address_on_any_network(host: str, tmp_path: Path) -> None:
    assert lan_addresses(host) == []
    place = ServingPlace(LanHome(tmp_path), host, 9002, ROBOT, "Rover", None, None)
    assert place.is_only_here
    assert place.urls([], "") == (url_of("http", host, 9002),)


def test_an_address_on_a_network_is_for_others_too(tmp_path: Path) -> None:
    for host in ("10.0.0.7", "0.0.0.0", "::", "rover.example.org"):  # noqa: S104 - nothing is bound
        assert not ServingPlace(LanHome(tmp_path), host, 9002, ROBOT, "Rover", None, None).is_only_here


def test_this_machine_has_its_interfaces() -> None:
    assert any(place.address == "127.0.0.1" for place in addresses.places())
    assert addresses.own_names()[-1].endswith(".local")


@pytest.mark.parametrize(
    ("name", "label"), [("Rover 7", "rover-7"), ("vm", "vm"), ("Ä", ""), ("a" * 80, "a" * 63), ("-x-", "x")]
)
def test_a_name_that_may_stand_before_local(name: str, label: str) -> None:
    assert mdns_label(name) == label
    assert Announced(name, ROBOT, 9002, "http", "1").hostname == f"{label or 'mosaic'}.local"


def test_the_announcement_tells_who_and_where_and_no_secret() -> None:
    properties = Announced("Rover", ROBOT, 9002, "https", "0.1.0", "AA:BB").properties()
    assert properties == {
        "txtvers": "1", "id": ROBOT, "name": "Rover", "path": "/", "scheme": "https", "version": "0.1.0",
        "fingerprint": "AA:BB",
    }  # fmt: skip


# -- the screen --------------------------------------------------------------------------------------------------


def qr_picture(lines: list[str], on_white: bool = True) -> np.ndarray:
    """As a phone's camera sees it."""
    halves = {" ": (0, 0), "▀": (1, 0), "▄": (0, 1), "█": (1, 1)}
    rows = [[halves[letter][half] for letter in line] for line in lines for half in (0, 1)]
    dark = np.kron(np.array(rows, dtype=np.uint8), np.ones((8, 8), dtype=np.uint8))
    return np.pad(np.where(dark == 1, 0, 255).astype(np.uint8), 32, constant_values=255 if on_white else 0)


def test_the_qr_code_reads_as_the_page() -> None:
    text, _, _ = cv2.QRCodeDetector().detectAndDecode(qr_picture(qr_text(PAGE)))
    assert text == PAGE


def test_the_first_device_gets_a_box_with_addresses_pin_and_code() -> None:
    box = pairing_box(NEWS, height=40, width=100)
    for part in (*NEWS.urls, "1234 5678", "▀", "no microphone"):
        assert part in box
    assert "38;2;0;0;0;48;2;255;255;255m" in box, "black on white, whatever the terminal's colours are"
    assert max(len(line) for line in qr_text(PAGE)) <= 37


@pytest.mark.parametrize(("height", "width"), [(12, 100), (40, 60)])
def test_where_the_code_does_not_fit_the_words_do(height: int, width: int) -> None:
    box = pairing_box(NEWS, height, width)
    assert "▀" not in box
    assert "1234 5678" in box


def test_once_somebody_is_paired_two_lines_are_enough() -> None:
    shown = pairing_box(NEWS.model_copy(update={"devices": 2}), 40, 160)
    assert len(shown.splitlines()) == 2
    assert "2 devices paired" in shown
    assert "1234 5678" in shown
    assert "1 device paired" in pairing_box(NEWS.model_copy(update={"devices": 1, "pin": ""}), 40, 160)


def test_what_only_this_machine_can_open_is_offered_to_no_phone() -> None:
    news = LanNews(urls=("http://127.0.0.1:9123",), only_here=True, pin="12345678", page=PAGE)
    box = pairing_box(news, height=40, width=120)
    for part in ("on this machine", "Only this machine can open it", "--serve 0.0.0.0:9123", "1234 5678"):
        assert part in box
    for part in ("phone or computer nearby", "▀", "Scan"):
        assert part not in box
    assert "only this machine can open it" in pairing_box(news.model_copy(update={"devices": 1}), 40, 120)


def test_over_tls_nothing_is_missing_and_a_notice_is_shown() -> None:
    news = LanNews(urls=("https://rover.example.org",), pin="", page=PAGE, notice="Too many wrong PINs.")
    box = pairing_box(news, 40, 100)
    assert "no microphone" not in box
    assert "Too many wrong PINs." in box


def test_a_pin_is_read_in_two_breaths() -> None:
    assert spoken_pin("12345678") == "1234 5678"
    assert spoken_pin("") == ""


# -- what the robot starts ---------------------------------------------------------------------------------------


def test_the_robot_gets_its_server_and_no_secret_stands_on_a_command_line(tmp_path: Path) -> None:
    server, port = RobotsOwnServer(LanHome(tmp_path / "lan")), free_port()
    child = server.prepared(LanWish("127.0.0.1", port, ROBOT, "Rover", has_screen=True))
    assert child.server.ws_url == f"ws://127.0.0.1:{port}"
    assert str(child.server.auth.robot_id) == ROBOT
    token = child.server.auth.params.token
    assert token is not None
    assert token.get_secret_value() not in " ".join(child.command)
    assert "--offer-pins" in child.command
    again = server.prepared(LanWish("127.0.0.1", port, ROBOT))
    assert again.server.auth.params.token == token
    assert "--offer-pins" not in again.command


def test_without_widgets_its_server_serves_none(tmp_path: Path) -> None:
    home, port = LanHome(tmp_path / "lan"), free_port()
    wishes = [LanWish("127.0.0.1", port, ROBOT, serves_widgets=serves) for serves in (True, False)]
    assert ["--no-widgets" in RobotsOwnServer(home).prepared(wish).command for wish in wishes] == [False, True]
    place = ServingPlace(home, "127.0.0.1", port, ROBOT, "Rover", None, None, serves_widgets=False)
    assert not place.settings(place.announced()).serves_widgets


@pytest.mark.parametrize(("host", "own"), [("0.0.0.0", "127.0.0.1"), ("127.0.0.1", "127.0.0.1")])  # noqa: S104
def test_the_robot_itself_comes_by_loopback_where_it_can(tmp_path: Path, host: str, own: str) -> None:
    port = free_port()
    child = RobotsOwnServer(LanHome(tmp_path)).prepared(LanWish(host, port))
    assert child.server.ws_url == f"ws://{own}:{port}"


def refusal(home: LanHome, wish: LanWish) -> MosaicError:
    with pytest.raises(MosaicError) as caught:
        RobotsOwnServer(home).prepared(wish)
    assert caught.value.code == "config.lan"
    return caught.value


def test_a_port_that_is_taken_is_told_with_another_one(tmp_path: Path) -> None:
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = int(taken.getsockname()[1])
        error = refusal(LanHome(tmp_path), LanWish("127.0.0.1", port))
    assert f"port {port} of 127.0.0.1 is taken" in error.message
    assert "--serve 127.0.0.1:" in error.cure


def test_an_address_that_is_not_ours_is_told(tmp_path: Path) -> None:
    assert "can't be used" in refusal(LanHome(tmp_path), LanWish("203.0.113.9", 9002)).message
    error = refusal(LanHome(tmp_path), LanWish("no-such-host.invalid", 9123))
    assert "no address" in error.message
    assert error.cure == "write for example 0.0.0.0:9123"


def test_a_directory_that_is_in_use_or_can_not_be_made_is_told(tmp_path: Path) -> None:
    database = Database(tmp_path)
    database.lock()
    error = refusal(LanHome(tmp_path), LanWish("127.0.0.1", free_port()))
    assert "another robot is served" in error.message
    assert "MOSAIC_DATA_DIR" in error.cure
    database.close()
    (tmp_path / "file").write_text("")
    assert "can't be used" in refusal(LanHome(tmp_path / "file"), LanWish("127.0.0.1", free_port())).message


def test_with_a_certificate_it_is_https_under_the_certificates_names(
    tmp_path: Path, certificate: tuple[Path, Path]
) -> None:
    file, key = certificate
    child = RobotsOwnServer(LanHome(tmp_path / "lan")).prepared(
        LanWish("127.0.0.1", free_port(), ROBOT, tls_certificate=file, tls_key=key)
    )
    assert child.server.ws_url.startswith("wss://127.0.0.1:")
    assert child.certificate == file
    assert names_of_certificate(file) == ["rover.example.org"]
    place = ServingPlace(LanHome(tmp_path), "10.0.0.7", 443, ROBOT, "Rover", file, key)
    assert place.urls(["10.0.0.7"], "rover.local") == ("https://rover.example.org", "https://10.0.0.7")
    assert place.announced().fingerprint == fingerprint_of(file)
    assert len(fingerprint_of(file)) == 32 * 3 - 1
    assert "rover.example.org" in place.settings(place.announced()).allowed_hosts


def test_a_certificate_that_can_not_be_used_is_told_before_anything_starts(
    tmp_path: Path, certificate: tuple[Path, Path]
) -> None:
    file, _ = certificate
    wish = LanWish("127.0.0.1", free_port(), ROBOT, tls_certificate=file, tls_key=file)
    assert "no certificate and its key" in refusal(LanHome(tmp_path / "lan"), wish).message
