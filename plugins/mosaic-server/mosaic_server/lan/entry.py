"""Prepares the server of a robot for the core's entry point group ``mosaic.lan_server``, and draws its box.

Imported by the robot's process, so nothing here may import a web server or a database.
"""

from __future__ import annotations

import errno
import socket
import sys
from pathlib import Path

from mosaic_core.machines.lan.robot_url import url_of
from mosaic_core.words.config import AuthConfig, ServerConfig
from mosaic_core.words.errors import MosaicError
from mosaic_core.words.lan import LanChild, LanNews
from mosaic_core.words.lan_wish import LanWish
from mosaic_server.lan.addresses import ANY_IPV4, ANY_IPV6
from mosaic_server.lan.home import LanHome
from mosaic_server.lan.screen import pairing_box
from mosaic_server.tls_files import tls_mistake


class RobotsOwnServer:
    """Prepares and shows the server of one robot; a ``mosaic_core.words.lan.LanServer``."""

    def __init__(self, home: LanHome | None = None) -> None:
        self._home = home or LanHome()

    def prepared(self, wish: LanWish) -> LanChild:
        """Raises :class:`MosaicError` (``config.lan``) for a directory, port or certificate that can't be used."""
        home = self._home
        try:
            home.make()
            robot_id, token = wish.robot_id or home.robot_id(), home.robot_token()
        except OSError as error:
            raise _refused(f"{home.directory} can't be used: {error.strerror}", "set MOSAIC_DATA_DIR") from error
        if home.is_served:
            cure = "stop it, or give this robot a directory of its own with MOSAIC_DATA_DIR"
            raise _refused(f"another robot is served from {home.directory} already", cure)
        _check_certificate(wish.tls_certificate, wish.tls_key)
        _check_port(wish.host, wish.port)
        auth = AuthConfig.model_validate({"type": "simple-token", "robot_id": robot_id, "params": {"token": token}})
        own_url = url_of("ws" if wish.tls_certificate is None else "wss", _own_address(wish.host), wish.port)
        server = ServerConfig(ws_url=own_url, auth=auth)
        return LanChild(tuple(_command(home, wish, robot_id)), server, wish.tls_certificate)

    def shown(self, news: LanNews, height: int) -> str:
        return pairing_box(news, height)


def _command(home: LanHome, wish: LanWish, robot_id: str) -> list[str]:
    """The token stands in the home's file, never on a command line."""
    command = [
        sys.executable, "-m", "mosaic_server.lan", "--home", str(home.directory), "--host", wish.host,
        "--port", str(wish.port), "--robot-id", robot_id, "--name", wish.name or socket.gethostname(),
    ]  # fmt: skip
    if wish.tls_certificate is not None and wish.tls_key is not None:
        command += ["--tls-cert", str(wish.tls_certificate), "--tls-key", str(wish.tls_key)]
    if not wish.serves_widgets:
        command += ["--no-widgets"]
    return [*command, "--offer-pins"] if wish.has_screen else command


def _own_address(host: str) -> str:
    """How the robot itself reaches a server that is bound to ``host``."""
    return {ANY_IPV4: "127.0.0.1", ANY_IPV6: "::1"}.get(host, host)


def _check_port(host: str, port: int) -> None:
    family = socket.AF_INET6 if ":" in host else socket.AF_INET
    with socket.socket(family, socket.SOCK_STREAM) as probe:
        probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            probe.bind((host, port))
        except socket.gaierror as error:
            raise _refused(f"{host!r} is no address of this machine", f"write for example 0.0.0.0:{port}") from error
        except OSError as error:
            what = (
                "is taken by another program" if error.errno == errno.EADDRINUSE else f"can't be used: {error.strerror}"
            )
            cure = f"choose another one: `--serve {host}:{port + 1 if port < 65535 else port - 1}`"
            raise _refused(f"port {port} of {host} {what}", cure) from error


def _check_certificate(certificate: Path | None, key: Path | None) -> None:
    if certificate is None or key is None:
        return
    mistake = tls_mistake(certificate, key)
    if mistake:
        raise _refused(mistake, "give PEM files that belong together")


def _refused(message: str, cure: str) -> MosaicError:
    return MosaicError(f"--serve: {message}", code="config.lan", cure=cure)
