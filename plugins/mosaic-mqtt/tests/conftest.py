"""A real mosquitto on loopback, which tests start and end."""

from __future__ import annotations

import os
import shutil
import subprocess
from collections.abc import Iterator
from pathlib import Path

import pytest
from paho.mqtt import publish
from support.processes import free_port

PROGRAM = shutil.which("mosquitto") or shutil.which("mosquitto", path="/usr/sbin")


class Mosquitto:
    """A broker on a port of its own; ``lines`` are added to its configuration."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.port = free_port()
        self._process: subprocess.Popen[str] | None = None

    @property
    def url(self) -> str:
        return f"mqtt://127.0.0.1:{self.port}"

    def start(self, *lines: str) -> None:
        """Returns when it listens, which its log tells."""
        assert PROGRAM is not None
        config = self.folder / "mosquitto.conf"
        fixed = [f"listener {self.port} 127.0.0.1", "log_dest stderr", "user root", "max_queued_messages 5000"]
        config.write_text("\n".join([*fixed, *(lines or ("allow_anonymous true",)), ""]))
        self._process = subprocess.Popen([PROGRAM, "-c", str(config)], stderr=subprocess.PIPE, text=True)
        assert self._process.stderr is not None
        told = []
        for line in self._process.stderr:
            told.append(line)
            if line.rstrip().endswith("running"):
                return
        raise AssertionError("".join(told))

    def stop(self) -> None:
        if self._process is not None:
            self._process.kill()
            self._process.communicate()
            self._process = None

    def knows(self, name: str, password: str) -> str:
        """The line by which it lets in whoever has this name and password."""
        passwords = self.folder / "passwords"
        passwords.touch(mode=0o600)
        subprocess.run(["mosquitto_passwd", "-b", str(passwords), name, password], check=True)
        return f"password_file {passwords}"

    def certified(self) -> tuple[str, str]:
        """The lines by which it speaks TLS, with a certificate that is ``cert.pem`` in its folder."""
        certificate, key = self.folder / "cert.pem", self.folder / "key.pem"
        subprocess.run(
            ["openssl", "req", "-x509", "-newkey", "ec", "-pkeyopt", "ec_paramgen_curve:P-256", "-nodes", "-days", "2",
             "-subj", "/CN=localhost", "-addext", "subjectAltName=IP:127.0.0.1", "-keyout", str(key),
             "-out", str(certificate)], check=True, capture_output=True,
        )  # fmt: skip
        return f"certfile {certificate}", f"keyfile {key}"

    def keep(self, *messages: tuple[str, bytes | str]) -> None:
        """Publish them as retained ones: whoever subscribes later gets them."""
        publish.multiple(
            [{"topic": topic, "payload": payload, "qos": 1, "retain": True} for topic, payload in messages],
            hostname="127.0.0.1",
            port=self.port,
        )


@pytest.fixture
def stopped_broker(tmp_path: Path) -> Iterator[Mosquitto]:
    if PROGRAM is None:
        if os.environ.get("CI"):
            pytest.fail("mosquitto is missing: apt install mosquitto")
        pytest.skip("needs mosquitto: apt install mosquitto")
    broker = Mosquitto(tmp_path)
    yield broker
    broker.stop()


@pytest.fixture
def broker(stopped_broker: Mosquitto) -> Mosquitto:
    stopped_broker.start()
    return stopped_broker
