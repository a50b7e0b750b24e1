"""Programs pair with a robot's own server and find it again; nobody else who answers there gets the sign-in."""

from __future__ import annotations

import json
import logging
import ssl
import threading
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from typing import Any
from uuid import UUID

import httpx
import pytest

from mosaic_core.machines.lan.announced_robots import AnnouncedRobot
from mosaic_core.operator import MosaicOperator
from mosaic_core.operator.lan import pairing, robot_door
from mosaic_core.operator.lan.paired_robots import PairedRobot, PairedRobots
from mosaic_core.words.errors import AuthError, MosaicError, SignalingError
from mosaic_server.lan.offers import pairing_page
from mosaic_server.settings import Settings
from mosaic_server.storage.devices import adopt_robot, devices, open_offer, revoke_device
from mosaic_server.storage.grants import Actor

ROVER, ARM = str(UUID(int=7)), str(UUID(int=8))
NOWHERE = "http://127.0.0.1:9"
Start = Callable[..., Any]


@pytest.fixture(autouse=True)
def announced(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> list[AnnouncedRobot]:
    """What is announced on the network of this machine, which is paired with nobody yet."""
    monkeypatch.setenv("MOSAIC_DATA_DIR", str(tmp_path / "mine"))
    found: list[AnnouncedRobot] = []

    async def search(for_s: float) -> list[AnnouncedRobot]:
        return list(found)

    monkeypatch.setattr(pairing, "announced_robots", search)
    return found


@pytest.fixture
def start(tmp_path: Path, start_server: Start) -> Iterator[Start]:
    """Starts the own server of a robot, with data of its own unless `home` says otherwise."""
    with ExitStack() as stack:

        def started(robot_id: str = ROVER, name: str = "Rover", home: str = "", **tls: Path) -> Any:
            settings = Settings(data_dir=tmp_path / (home or robot_id), pairs_with=name, revocation_check_s=0.2)
            server = stack.enter_context(start_server(settings, **tls))
            server.work(adopt_robot, robot_id, name, "mrt_of_the_robot")
            return server

        yield started


def url_of(server: Any) -> str:
    return f"http://127.0.0.1:{server.listening.port}"


def pin_of(server: Any) -> str:
    return str(server.work(open_offer)[1].pin)


def wrong(pin: str) -> str:
    return f"{(int(pin) + 1) % 10**8:08d}"


async def pair(server: Any, robot: str = "") -> None:
    async with await MosaicOperator.pair(robot or url_of(server), pin=pin_of(server), name="bench"):
        pass


async def refusal(paired: Any) -> MosaicError:
    with pytest.raises(MosaicError) as caught:
        await paired
    return caught.value


def as_announced(server: Any, robot_id: str = ROVER, name: str = "Rover") -> AnnouncedRobot:
    return AnnouncedRobot(name, robot_id, (NOWHERE, url_of(server)))


async def test_a_program_pairs_by_address_and_is_signed_in_afterwards(
    start: Start, caplog: pytest.LogCaptureFixture
) -> None:
    rover = start()
    with caplog.at_level(logging.DEBUG):
        async with await MosaicOperator.pair(url_of(rover), pin=pin_of(rover), name="bench") as operator:
            [robot] = await operator.robots()
        assert (robot.id, operator.paired_id, operator.is_person) == (ROVER, ROVER, False)
        async with await MosaicOperator.find("Rover", is_person=True) as operator:
            assert [one.id for one in await operator.robots()] == [ROVER]
            assert operator.is_person
    assert [one.name for one in rover.work(devices)] == ["bench"]
    [kept] = PairedRobots().all()
    assert kept.access_token.rpartition(".")[2] not in caplog.text


async def test_by_name_it_is_the_robot_that_announces_itself(start: Start, announced: list[AnnouncedRobot]) -> None:
    rover = start()
    announced.append(as_announced(rover))
    await pair(rover, "Rover")
    assert PairedRobots().named("Rover").url == url_of(rover)
    error = await refusal(MosaicOperator.pair("Rovr", pin="12345678"))
    assert error.code == "lan.not_found"
    assert "did you mean 'Rover'" in error.message
    announced.append(as_announced(rover, ARM))
    assert (await refusal(MosaicOperator.pair("Rover", pin="12345678"))).code == "lan.several"


async def test_the_code_of_the_qr_code_pairs_as_well(start: Start) -> None:
    rover = start()
    page = pairing_page(url_of(rover), rover.work(open_offer)[1].code)
    await (await MosaicOperator.pair(url_of(rover), pin=page)).close()
    assert PairedRobots().of_id(ROVER) is not None


async def test_a_wrong_pin_is_told_with_the_tries_left_and_then_locked(
    start: Start, monkeypatch: pytest.MonkeyPatch
) -> None:
    rover = start()
    pin = pin_of(rover)
    error = await refusal(MosaicOperator.pair(url_of(rover), pin=wrong(pin)))
    assert isinstance(error, AuthError)
    assert (error.code, "4 more" in error.message) == ("auth.pairing", True)
    assert "mosaic lan pair" in error.cure
    monkeypatch.setattr(rover.server.services.pin_limits, "wait_s", lambda now_s: 1234.0)
    error = await refusal(MosaicOperator.pair(url_of(rover), pin=pin))
    assert error.code == "auth.pairing_locked"
    assert "try again in 21 min" in error.message
    assert PairedRobots().all() == []


async def test_too_many_wrong_codes_from_this_address_are_a_lock_too(
    start: Start, monkeypatch: pytest.MonkeyPatch
) -> None:
    rover = start()
    monkeypatch.setattr(rover.server.services.login_limits, "wait_s", lambda *_: 12.3)
    error = await refusal(MosaicOperator.pair(url_of(rover), pin="a-code"))
    assert error.code == "auth.pairing_locked"
    assert "try again in 13 s" in error.message


async def test_a_server_of_many_robots_pairs_nobody(server: Any) -> None:
    assert (await refusal(MosaicOperator.pair(url_of(server), pin="12345678"))).code == "lan.not_found"


async def test_nothing_there_is_told(announced: list[AnnouncedRobot]) -> None:
    assert (await refusal(MosaicOperator.pair(NOWHERE, pin="12345678"))).code == "signal.unreachable"
    assert (await refusal(MosaicOperator.find("Rover"))).code == "lan.not_paired"


async def test_a_robot_that_moved_is_found_by_its_announcement(start: Start, announced: list[AnnouncedRobot]) -> None:
    rover = start()
    await pair(rover)
    [kept] = PairedRobots().all()
    PairedRobots().keep(kept.model_copy(update={"url": NOWHERE}))
    assert (await refusal(MosaicOperator.find("Rover"))).code == "lan.not_found"
    announced.append(as_announced(rover))
    await (await MosaicOperator.find("Rover")).close()
    assert PairedRobots().all() == [kept]


async def test_a_robot_with_a_new_name_is_known_by_it(start: Start) -> None:
    rover = start()
    await pair(rover)
    rover.work(adopt_robot, ROVER, "Rover 2", "mrt_of_the_robot")
    await (await MosaicOperator.find("Rover")).close()
    assert PairedRobots().named("Rover 2").robot_id == ROVER


async def test_another_robot_at_the_address_under_the_id_and_the_name_is_shown_nothing(
    start: Start, announced: list[AnnouncedRobot]
) -> None:
    rover, other = start(), start(home="other")
    await pair(rover)
    [kept] = PairedRobots().all()
    PairedRobots().keep(kept.model_copy(update={"url": url_of(other)}))
    announced.append(AnnouncedRobot("Rover", ROVER, (url_of(other),)))
    error = await refusal(MosaicOperator.find("Rover"))
    assert error.code == "lan.other_robot"
    assert other.work(devices) == []


class Impostor(BaseHTTPRequestHandler):
    """Answers everything with what `answers` says, and keeps what it is told."""

    answers: bytes = b"{}"
    endless = False
    told: list[str]
    is_over: threading.Event

    def do_POST(self) -> None:
        length = int(self.headers.get("Content-Length") or 0)
        self.told.append(f"{self.path} {self.headers} {self.rfile.read(length).decode()}")
        self.send_response(200)
        self.end_headers()
        self.wfile.write(self.answers)
        while self.endless and not self.is_over.is_set():
            try:
                self.wfile.write(b" " * 10_000)
            except OSError:
                return

    do_GET = do_DELETE = do_POST

    def log_message(self, *_: Any) -> None:
        pass


@pytest.fixture
def impostor() -> Iterator[Callable[..., tuple[str, list[str]]]]:
    """Starts one; its address, and what it was told so far."""
    over = threading.Event()
    with ExitStack() as stack:

        def started(answers: Any, *, endless: bool = False) -> tuple[str, list[str]]:
            told: list[str] = []
            words = {"answers": json.dumps(answers).encode(), "endless": endless, "told": told, "is_over": over}
            httpd = ThreadingHTTPServer(("127.0.0.1", 0), type("ThisImpostor", (Impostor,), words))
            serving = threading.Thread(target=httpd.serve_forever, kwargs={"poll_interval": 0.01})
            serving.start()
            for end in (httpd.server_close, serving.join, httpd.shutdown, over.set):
                stack.callback(end)
            return f"http://127.0.0.1:{httpd.server_address[1]}", told

        yield started


@pytest.mark.parametrize("answers", [{}, {"resultCode": 100, "resultData": {"proof": "0" * 64}}, [1], "x"])
async def test_an_impostor_hears_nothing_that_signs_in(start: Start, impostor: Any, answers: Any) -> None:
    await pair(start())
    [kept] = PairedRobots().all()
    url, told = impostor(answers)
    PairedRobots().keep(kept.model_copy(update={"url": url}))
    assert (await refusal(MosaicOperator.find("Rover"))).code == "lan.other_robot"
    assert told
    assert not any(kept.access_token.rpartition(".")[2] in one for one in told)


@pytest.mark.parametrize("token", ["", "no token", "a.b.c" * 1000, "a.b.\n"])
async def test_a_sign_in_that_is_none_is_refused_and_not_repeated(impostor: Any, token: str) -> None:
    answers = {"pairsWith": "Rover", "accessToken": token, "role": "operator", "robotId": ROVER, "robotName": "Rover"}
    url, _ = impostor({"resultCode": 100, "resultData": answers})
    error = await refusal(MosaicOperator.pair(url, pin="12345678"))
    assert error.code == "signal.bad_message"
    assert not token or token not in error.message
    assert PairedRobots().all() == []


async def test_where_nothing_can_be_kept_nothing_is_paired(
    start: Start, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    rover = start()
    (tmp_path / "file").write_text("")
    monkeypatch.setenv("MOSAIC_DATA_DIR", str(tmp_path / "file"))
    assert (await refusal(MosaicOperator.pair(url_of(rover), pin=pin_of(rover)))).code == "lan.unreadable"
    assert rover.work(devices) == []


async def test_an_answer_without_an_end_is_given_up(impostor: Any) -> None:
    url, told = impostor({}, endless=True)
    error = await refusal(MosaicOperator.pair(url, pin="12345678"))
    assert error.code == "signal.bad_message"
    assert not any("12345678" in one for one in told), "no PIN before it is a robot's own server"


async def test_who_never_answers_is_given_up(monkeypatch: pytest.MonkeyPatch, impostor: Any) -> None:
    monkeypatch.setattr(robot_door, "ANSWER_S", 0.0)
    url, _ = impostor({})
    assert (await refusal(MosaicOperator.pair(url, pin="12345678"))).code == "signal.unreachable"


async def test_who_announces_the_id_of_another_is_not_paired(start: Start, announced: list[AnnouncedRobot]) -> None:
    arm = start(ARM, "Arm")
    announced.append(as_announced(arm))
    pin = pin_of(arm)
    assert (await refusal(MosaicOperator.pair("Rover", pin=pin))).code == "lan.other_robot"
    assert PairedRobots().all() == []
    assert arm.work(devices) == []


async def test_a_robot_under_the_id_of_a_paired_one_never_takes_its_place(start: Start) -> None:
    await pair(start())
    [kept] = PairedRobots().all()
    other = start(home="other")
    assert (await refusal(MosaicOperator.pair(url_of(other), pin=pin_of(other)))).code == "lan.other_robot"
    assert PairedRobots().all() == [kept]


async def test_pairing_again_leaves_one_device(start: Start) -> None:
    rover = start()
    await pair(rover)
    [before] = PairedRobots().all()
    await pair(rover)
    [kept] = PairedRobots().all()
    assert kept.access_token != before.access_token
    assert len(rover.work(devices)) == 1


async def test_unpairing_is_told_to_the_robot(start: Start) -> None:
    rover = start()
    await pair(rover)
    assert await pairing.unpair("Rover")
    assert rover.work(devices) == []
    assert PairedRobots().all() == []


async def test_a_robot_that_is_away_is_forgotten_all_the_same() -> None:
    PairedRobots().keep(PairedRobot(robot_id=ROVER, name="Rover", url=NOWHERE, access_token="a.b.c"))  # noqa: S106
    assert not await pairing.unpair("Rover")
    assert PairedRobots().all() == []
    with pytest.raises(SignalingError, match="not paired"):
        await pairing.unpair("Rover")


async def test_a_machine_that_was_revoked_is_told_to_pair_again(start: Start) -> None:
    rover = start()
    await pair(rover)
    [device] = rover.work(devices)
    rover.work(revoke_device, device.id, Actor("test"))
    error = await refusal(MosaicOperator.find("Rover"))
    assert error.code == "lan.not_paired"
    assert "mosaic operator pair" in error.cure
    assert await pairing.unpair("Rover"), "it has let go already"


async def test_over_tls_the_certificate_of_the_pairing_is_the_only_one(
    start: Start, certificate: tuple[Path, Path]
) -> None:
    file, key = certificate
    rover = start(ssl_certfile=file, ssl_keyfile=key)
    url = url_of(rover).replace("http:", "https:")
    async with await MosaicOperator.pair(url, pin=pin_of(rover)) as operator:
        assert [one.id for one in await operator.robots()] == [ROVER]
    [kept] = PairedRobots().all()
    assert kept.certificate.split() == file.read_text().split()
    async with await MosaicOperator.find("Rover") as operator:
        operator.watch([ROVER])
        await operator._signaling.wait_ready(10)
    another = ssl.DER_cert_to_PEM_cert(httpx.create_ssl_context().get_ca_certs(binary_form=True)[0])
    PairedRobots().keep(kept.model_copy(update={"certificate": another}))
    assert (await refusal(MosaicOperator.find("Rover"))).code == "lan.not_found"
