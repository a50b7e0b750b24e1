"""The program that serves a robot's own network, as a process: it tells, announces, pairs, and ends with its robot."""

from __future__ import annotations

import asyncio
import json
import os
import socket
import ssl
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from uuid import UUID

import httpx
import pytest
from support.waiting import wait_for
from typer.testing import CliRunner

from mosaic_core.adapters.lan.robot_search import announced_robots
from mosaic_core.adapters.signaling.websocket import open_websocket
from mosaic_core.cli.main import app as mosaic
from mosaic_core.machines.lan.announced_robots import AnnouncedRobot
from mosaic_core.words.errors import MosaicError, SignalingError
from mosaic_core.words.lan import LanChild
from mosaic_core.words.lan_wish import LanWish
from mosaic_server.lan.addresses import lan_addresses
from mosaic_server.lan.commands import app
from mosaic_server.lan.entry import RobotsOwnServer
from mosaic_server.lan.home import LanHome

ROBOT = str(UUID(int=7))
LOOPBACK = "127.0.0.1"
HOST = next(iter(lan_addresses("0.0.0.0")), "")  # noqa: S104 - nothing is bound
"""Of this machine on a network: loopback is announced to nobody."""
MOSAIC = [sys.executable, "-m", "mosaic_core.cli.main"]


@dataclass
class Child:
    """The running program; the test is its robot."""

    data_dir: Path
    host: str
    port: int
    child: LanChild
    process: subprocess.Popen[str]
    news: list[dict[str, Any]]

    @property
    def url(self) -> str:
        return f"http://{self.host}:{self.port}"

    def read(self) -> None:
        assert self.process.stdout is not None
        with self.process.stdout:
            for line in self.process.stdout:
                self.news.append(json.loads(line))

    def wait_for(self, condition: Any, timeout_s: float = 30.0) -> None:
        wait_for(condition, f"the news come, after {self.news}", timeout_s, alive=self.process)

    def lan(self, *words: str) -> Any:
        """A command of `mosaic lan`, beside the running server."""
        return CliRunner().invoke(app, [*words], env={"MOSAIC_DATA_DIR": str(self.data_dir)})

    def end(self) -> int:
        """As the robot's end would."""
        assert self.process.stdin is not None
        self.process.stdin.close()
        return self.process.wait(timeout=5)


def started(
    data_dir: Path, host: str = LOOPBACK, *, screen: bool = False, tls: tuple[Path, Path] | None = None
) -> Child:
    with socket.socket() as probe:
        probe.bind((host, 0))
        port = int(probe.getsockname()[1])
    certificate, key = tls or (None, None)
    wish = LanWish(host, port, ROBOT, "Rover 7", certificate, key, has_screen=screen)
    child = RobotsOwnServer(LanHome(data_dir / "lan")).prepared(wish)
    pipe = subprocess.PIPE
    process = subprocess.Popen(child.command, stdin=pipe, stdout=pipe, text=True, start_new_session=True)
    running = Child(data_dir, host, port, child, process, [])
    assert process.stdout is not None
    threading.Thread(target=running.read, daemon=True).start()
    running.wait_for(lambda: running.news)
    return running


@pytest.fixture(scope="module")
def child(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Child]:
    if not HOST:
        pytest.skip("this machine is on no network")
    running = started(tmp_path_factory.mktemp("data"), HOST, screen=True)
    yield running
    running.process.kill()
    with running.process:
        pass


def test_it_tells_where_it_is_and_what_pairs_with_it(child: Child) -> None:
    news = child.news[0]
    assert news["urls"] == [child.url, f"http://rover-7.local:{child.port}"]
    assert news["page"].startswith(f"{child.url}/#pair=")
    assert len(news["pin"]) == 8
    assert news["devices"] == 0
    assert httpx.get(f"{child.url}/healthz").json() == {"status": "ok"}


def test_the_robot_finds_its_place_there(child: Child) -> None:
    async def authorized() -> Any:
        robot_socket = await open_websocket(f"{child.child.server.ws_url}/ws/robot")
        token = child.child.server.auth.params.token
        assert token is not None
        try:
            async for text in robot_socket:
                message = json.loads(text)
                if message["type"] == "authorize.res":
                    return message["data"]
                data = {"robotId": ROBOT, "data": token.get_secret_value()}
                await robot_socket.send(json.dumps({"type": "authorize", "data": data}))
        finally:
            await robot_socket.close()

    assert asyncio.run(asyncio.wait_for(authorized(), 10)) == 100


def test_it_is_found_by_its_announcement(child: Child) -> None:
    found: list[AnnouncedRobot] = []
    for _ in range(5):  # on a busy machine the first answer may come too late
        found = [one for one in asyncio.run(announced_robots(1.0, [HOST])) if one.urls[0] == child.url]
        if found:
            break
    [robot] = found
    assert (robot.name, robot.robot_id, robot.fingerprint) == ("Rover 7", ROBOT, "")
    assert robot.urls == (child.url, f"http://rover-7.local:{child.port}")


def test_a_pin_from_the_screen_pairs_and_the_next_one_is_shown(child: Child) -> None:
    pin, devices, seen = child.news[-1]["pin"], child.news[-1]["devices"], len(child.news)
    answer = httpx.post(f"{child.url}/api/v1/pairing", json={"pin": pin, "name": "Ann's phone"})
    assert answer.status_code == 200
    child.wait_for(lambda: len(child.news) > seen)
    assert child.news[-1]["devices"] == devices + 1
    assert child.news[-1]["pin"] not in ("", pin)


def test_mosaic_lan_pair_waits_for_a_device_and_names_it(child: Child) -> None:
    environment = {**os.environ, "MOSAIC_DATA_DIR": str(child.data_dir)}
    words = [*MOSAIC, "lan", "pair", "--role", "observer", "--json"]
    with subprocess.Popen(words, env=environment, stdout=subprocess.PIPE, text=True) as command:
        assert command.stdout is not None
        offer = json.loads(command.stdout.readline())
        assert offer["robot"] == "Rover 7"
        httpx.post(f"{child.url}/api/v1/pairing", json={"pin": offer["pin"], "name": "tablet"}).raise_for_status()
        told = json.loads(command.stdout.readline())
        assert command.wait(timeout=10) == 0
    assert (told["name"], told["role"]) == ("tablet", "observer")


def test_devices_are_listed_given_roles_and_revoked_beside_the_running_server(child: Child) -> None:
    offer = json.loads(child.lan("pair", "--no-wait", "--json").stdout)
    paired = httpx.post(
        f"{child.url}/api/v1/pairing", json={"code": offer["page"].partition("#pair=")[2], "name": "mug"}
    )
    token = paired.json()["resultData"]["accessToken"]
    headers = {"Authorization": f"Bearer {token}"}
    listed = {one["name"]: one for one in json.loads(child.lan("devices", "list", "--json").stdout)}
    assert (listed["mug"]["role"], listed["mug"]["last connected"]) == ("operator", "never")
    assert "supervisor now" in child.lan("devices", "role", "mug", "supervisor").stdout
    [robot] = httpx.get(f"{child.url}/api/v1/robots", headers=headers).json()["resultData"]["data"]
    assert robot["myRole"] == "supervisor"
    wrong = child.lan("devices", "revoke", "mugg")
    assert wrong.exit_code == 1
    assert "did you mean 'mug'?" in wrong.stderr
    assert "revoked mug" in child.lan("devices", "revoke", listed["mug"]["id"][:8]).stdout
    assert httpx.get(f"{child.url}/api/v1/users/me", headers=headers).status_code == 401


def test_for_people_the_command_draws_a_box(child: Child) -> None:
    shown = child.lan("pair", "--no-wait").stdout
    assert child.url in shown
    assert "PIN" in shown
    assert "▀" in shown


def test_a_second_robot_in_the_same_directory_is_refused(child: Child) -> None:
    with pytest.raises(MosaicError, match="another robot is served"):
        RobotsOwnServer(LanHome(child.data_dir / "lan")).prepared(LanWish(LOOPBACK, 9, ROBOT))


def test_without_a_running_robot_the_commands_say_so(tmp_path: Path) -> None:
    done = CliRunner().invoke(app, ["pair"], env={"MOSAIC_DATA_DIR": str(tmp_path)})
    assert isinstance(done.exception, MosaicError)
    assert "mosaic run --serve" in done.exception.cure


def operator(data_dir: Path, *words: str, stdin: str = "") -> subprocess.CompletedProcess[str]:
    """`mosaic operator …` on a machine with data of its own, where no account is named."""
    clean = {key: value for key, value in os.environ.items() if not key.startswith("MOSAIC_")}
    environment = {**clean, "MOSAIC_DATA_DIR": str(data_dir)}
    command = [*MOSAIC, "operator", *words]
    return subprocess.run(command, env=environment, input=stdin, capture_output=True, text=True, timeout=60)


def operator_here(data_dir: Path, *words: str) -> Any:
    """The same in this process, half a second of a processor sooner; what it fails with stays an exception."""
    environment: dict[str, str | None] = dict.fromkeys(name for name in os.environ if name.startswith("MOSAIC_"))
    return CliRunner().invoke(mosaic, ["operator", *words], env={**environment, "MOSAIC_DATA_DIR": str(data_dir)})


def test_from_a_terminal_it_is_paired_by_name_found_and_unpaired(child: Child, tmp_path: Path) -> None:
    offer = json.loads(child.lan("pair", "--no-wait", "--json").stdout)
    paired = operator(tmp_path, "pair", ROBOT, "--pin-stdin", "--name", "bench", "--json", stdin=f"{offer['pin']}\n")
    assert paired.returncode == 0, paired.stderr
    told = json.loads(paired.stdout)
    assert (told["id"], told["name"], told["url"]) == (ROBOT, "Rover 7", child.url)
    assert "plain http" in paired.stderr
    assert offer["pin"] not in paired.stdout + paired.stderr
    listed = [json.loads(line) for line in operator_here(tmp_path, "robots", "--lan", "--json").stdout.splitlines()]
    assert [one["asksForPin"] for one in listed if one["id"] == ROBOT] == [False]
    away = operator(tmp_path, "lease", "Rover 7")
    assert (away.returncode, "code: signal.robot_offline" in away.stderr) == (1, True), "signed in, and it is offline"
    assert operator_here(tmp_path, "unpair", "Rover 7").exit_code == 0
    assert "bench" not in child.lan("devices", "list").stdout
    unknown = operator_here(tmp_path, "unpair", "Rover 7").exception
    assert isinstance(unknown, MosaicError)
    assert unknown.code == "lan.not_paired"


def test_it_ends_with_its_robot_and_comes_back_with_everything_in_it(child: Child) -> None:
    """Last: the others need it alive."""
    httpx.post(f"{child.url}/api/v1/pairing", json={"pin": child.news[-1]["pin"], "name": "kettle"}).raise_for_status()
    paired = json.loads(child.lan("devices", "list", "--json").stdout)
    began_s = time.monotonic()
    assert child.end() == 0
    assert time.monotonic() - began_s < 3.0
    assert LanHome(child.data_dir / "lan").reach() is None
    again = started(child.data_dir)
    assert again.news[0]["devices"] == len(paired) > 0
    assert again.news[0]["pin"] == again.news[0]["page"] == "", "without a screen nothing stands open"
    with again.process:
        again.process.terminate()
        assert again.process.wait(timeout=5) == 0


def test_on_loopback_it_says_that_nobody_else_can_open_it_and_announces_nothing(tmp_path: Path) -> None:
    running = started(tmp_path, LOOPBACK, screen=True)
    try:
        [news] = running.news
        assert news["onlyHere"] is True
        assert news["urls"] == [running.url]
        assert "hostname" not in news or news["hostname"] == ""
        assert len(news["pin"]) == 8
        shown = running.lan("pair", "--no-wait").stdout
        assert "Only this machine can open it" in shown
        assert "▀" not in shown
        assert asyncio.run(announced_robots(0.5, [LOOPBACK])) == []
    finally:
        assert running.end() == 0


def test_over_tls_the_robot_trusts_that_certificate_alone(tmp_path: Path, certificate: tuple[Path, Path]) -> None:
    running = started(tmp_path, tls=certificate)
    url = f"{running.child.server.ws_url}/ws/robot"

    async def opened(trusted: Path | None) -> None:
        await (await open_websocket(url, certificate=trusted)).close()

    try:
        asyncio.run(opened(running.child.certificate))
        with pytest.raises(SignalingError, match="certificate"):
            asyncio.run(opened(None))
        assert running.news[0]["urls"][0] == f"https://rover.example.org:{running.port}"
        context = ssl.create_default_context(cafile=str(certificate[0]))
        context.check_hostname = False
        answer = httpx.get(f"https://{LOOPBACK}:{running.port}/healthz", verify=context)
        assert "strict-transport-security" not in answer.headers, "the name may be served without TLS tomorrow"
    finally:
        assert running.end() == 0
