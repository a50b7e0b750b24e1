"""`mosaic run --serve [HOST:PORT]`: what may be left out, what belongs together, and what is missing."""

from __future__ import annotations

import subprocess
import sys
from importlib.metadata import EntryPoint
from pathlib import Path

import pytest

from mosaic_core.cli.robot import lan_serving
from mosaic_core.cli.robot.lan_serving import LanServing, lan_server
from mosaic_core.cli.robot.run_options import address_of, wish_of, with_address
from mosaic_core.cli.terminal.error_report import exit_code_of
from mosaic_core.words.config import AuthConfig, ServerConfig
from mosaic_core.words.errors import MosaicError, PluginError
from mosaic_core.words.lan import GROUP, LanChild, LanNews
from mosaic_core.words.lan_wish import DEFAULT_ADDRESS, LanWish

MOSAIC = [sys.executable, "-m", "mosaic_core.cli.main"]
EVERYWHERE = DEFAULT_ADDRESS.rpartition(":")[0]
YAML = "connectors:\n  - { type: connection-check, label: link }\n"


@pytest.mark.parametrize(
    ("typed", "meant"),
    [
        (["--serve"], [f"--serve={DEFAULT_ADDRESS}"]),
        (["--serve", "robot.yaml"], [f"--serve={DEFAULT_ADDRESS}", "robot.yaml"]),
        (["robot.yaml", "--serve", "--json"], ["robot.yaml", f"--serve={DEFAULT_ADDRESS}", "--json"]),
        (["--serve", "9100"], ["--serve", "9100"]),
        (["--serve", "0.0.0.0:9100", "robot.yaml"], ["--serve", "0.0.0.0:9100", "robot.yaml"]),
        (["--serve", "10.0.0.7"], ["--serve", "10.0.0.7"]),
        (["--serve", "[fd00::1]:9100"], ["--serve", "[fd00::1]:9100"]),
        (["--serve", "./configs/robot:1"], [f"--serve={DEFAULT_ADDRESS}", "./configs/robot:1"]),
        (["--serve", "abc", "robot.yaml"], ["--serve", "abc", "robot.yaml"]),
        (["robot.yaml"], ["robot.yaml"]),
    ],
)
def test_the_address_may_be_left_out_also_before_a_file(typed: list[str], meant: list[str]) -> None:
    assert with_address(typed) == meant


@pytest.mark.parametrize(
    ("text", "address"),
    [
        (DEFAULT_ADDRESS, (EVERYWHERE, 9002)),
        ("9100", (EVERYWHERE, 9100)),
        ("10.0.0.7", ("10.0.0.7", 9002)),
        ("localhost", ("localhost", 9002)),
        ("rover.local:80", ("rover.local", 80)),
        ("[fd00::1]:9100", ("fd00::1", 9100)),
        ("[::]", ("::", 9002)),
    ],
)
def test_an_address_is_host_port_or_both(text: str, address: tuple[str, int]) -> None:
    assert address_of(text) == address


@pytest.mark.parametrize("text", ["", "0", "70000", "host:port", ":9002", "a b:9002", "http://x:1"])
def test_nonsense_is_refused_with_an_example(text: str) -> None:
    with pytest.raises(MosaicError, match="no HOST:PORT") as caught:
        address_of(text)
    assert DEFAULT_ADDRESS in caught.value.cure
    assert exit_code_of(caught.value) == 2


def test_options_that_belong_together_are_asked_for_together(tmp_path: Path) -> None:
    file = tmp_path / "x.pem"
    assert wish_of(None, "", None, None) is None
    assert wish_of("9100", "Rover", file, file) == LanWish(EVERYWHERE, 9100, None, "Rover", file, file)
    with pytest.raises(MosaicError, match="go together"):
        wish_of("9100", "", file, None)
    for name, certificate in (("Rover", None), ("", file)):
        with pytest.raises(MosaicError, match="need --serve"):
            wish_of(None, name, certificate, certificate)
    with pytest.raises(MosaicError, match="--no-widgets need --serve"):
        wish_of(None, "", None, None, widgets=False)


def test_the_widgets_of_plugins_can_be_left_out() -> None:
    both = [wish_of("9100", "", None, None, widgets=widgets) for widgets in (True, False)]
    assert [wish.serves_widgets for wish in both if wish is not None] == [True, False]


def test_without_a_server_distribution_it_says_what_to_install(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(lan_serving, "entry_points", lambda group: ())
    with pytest.raises(MosaicError) as caught:
        LanServing(LanWish(EVERYWHERE, 9002))
    assert "pip install" in caught.value.cure
    assert "mosaic-server" in caught.value.cure
    assert exit_code_of(caught.value) == 2


def test_a_broken_server_distribution_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    point = EntryPoint("own", "nowhere_at_all:Server", GROUP)
    monkeypatch.setattr(lan_serving, "entry_points", lambda group: (point,))
    with pytest.raises(PluginError, match="nowhere_at_all"):
        lan_server()


class Recorded:
    """An installed server that only takes notes."""

    def prepared(self, wish: LanWish) -> LanChild:
        auth = AuthConfig.model_validate({"type": "no-authorization", "robot_id": "0" * 32})
        return LanChild(("true",), ServerConfig(ws_url="ws://127.0.0.1:9", auth=auth))

    def shown(self, news: LanNews, height: int) -> str:
        return f"{news.urls[0]} on {height} lines"


@pytest.fixture
def recorded(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(lan_serving, "lan_server", Recorded)


@pytest.mark.usefixtures("recorded")
def test_news_reach_the_screen_and_the_operators_elsewhere() -> None:
    serving, near = LanServing(LanWish(EVERYWHERE, 9002, has_screen=True)), list[tuple[str, ...]]()
    serving.on_news(lambda urls: near.append(tuple(urls)))
    assert serving.shown(40) == ""
    serving._heard(LanNews(urls=("http://10.0.0.7:9002",), pin="12345678"))
    assert serving.shown(40) == "http://10.0.0.7:9002 on 32 lines"
    assert near == [("http://10.0.0.7:9002",)]


@pytest.mark.usefixtures("recorded")
def test_operators_elsewhere_are_not_sent_to_an_address_of_this_machine_alone(caplog: pytest.LogCaptureFixture) -> None:
    serving, near = LanServing(LanWish("127.0.0.1", 9002)), list[tuple[str, ...]]()
    serving.on_news(lambda urls: near.append(tuple(urls)))
    with caplog.at_level("INFO"):
        serving._heard(LanNews(urls=("http://127.0.0.1:9002",), only_here=True))
    assert near == [()]
    assert "on this machine alone: http://127.0.0.1:9002" in caplog.text
    assert "on this network" not in caplog.text


@pytest.mark.usefixtures("recorded")
def test_without_a_screen_addresses_are_logged_once_and_never_a_pin(caplog: pytest.LogCaptureFixture) -> None:
    serving = LanServing(LanWish(EVERYWHERE, 9002))
    with caplog.at_level("INFO"):
        for devices in range(3):
            serving._heard(LanNews(urls=("http://10.0.0.7:9002",), devices=devices, pin="12345678"))
    assert caplog.text.count("http://10.0.0.7:9002") == 1
    assert "mosaic lan pair" in caplog.text
    assert "12345678" not in caplog.text


def test_a_file_without_a_server_runs_with_serve_only(tmp_path: Path) -> None:
    file = tmp_path / "robot.yaml"
    file.write_text(YAML)
    done = subprocess.run([*MOSAIC, "run", str(file)], capture_output=True, text=True, timeout=60)
    assert done.returncode == 2
    assert "'server' is missing" in done.stderr
    assert "mosaic run --serve" in done.stderr
    done = subprocess.run([*MOSAIC, "validate", str(file)], capture_output=True, text=True, timeout=60)
    assert done.returncode == 0
    assert "mosaic run --serve" in done.stderr
