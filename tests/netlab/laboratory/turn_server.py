"""A real coturn in the public network, run with the configuration that the documentation recommends."""

from __future__ import annotations

import re
from collections.abc import Callable
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path

from laboratory.nats import OPERATOR_WAN, NatLab, command
from laboratory.processes import started

GUIDE = Path(__file__).parents[3] / "docs" / "howto" / "turn.md"
SECRET = "north-of-the-wall"  # noqa: S105 - of nobody
TURN_IP = f"{OPERATOR_WAN}.1"
DEAD = f"turn:{OPERATOR_WAN}.200:3478"
URLS = {
    "udp": f"turn:{TURN_IP}:3478",
    "tcp": f"turn:{TURN_IP}:3478?transport=tcp",
    "tls": f"turns:{TURN_IP}:5349",
}


@dataclass(frozen=True)
class Coturn:
    """``log`` is its own; ``certificate`` signs itself."""

    log: Path
    certificate: Path


def recommended() -> str:
    """The configuration in the guide, as it stands."""
    found = re.search(r"```ini\n(.*?)```", GUIDE.read_text(), re.DOTALL)
    assert found is not None
    return found[1]


def _certificate(folder: Path) -> tuple[Path, Path]:
    cert, key = folder / "cert.pem", folder / "key.pem"
    words = f"openssl req -x509 -newkey ec -pkeyopt ec_paramgen_curve:P-256 -nodes -days 2 -subj /CN={TURN_IP}"
    command(*words.split(), "-addext", f"subjectAltName=IP:{TURN_IP}", "-out", str(cert), "-keyout", str(key))
    return cert, key


def run_coturn(lab: NatLab, folder: Path, stack: ExitStack, wait_for: Callable[..., float]) -> Coturn:
    """Until the stack closes."""
    cert, key = _certificate(folder)
    text = recommended().replace("REPLACE-ME", SECRET)
    text = text.replace("/etc/coturn/cert.pem", str(cert)).replace("/etc/coturn/key.pem", str(key))
    config, log = folder / "turnserver.conf", folder / "log"
    config.write_text(text)
    own = ["--listening-ip", TURN_IP, "--relay-ip", TURN_IP, "--userdb", str(folder / "db")]
    files = ["--pidfile", str(folder / "pid"), "--log-file", str(log), "--simple-log", "--verbose"]
    words = [*lab.prefix("public"), "turnserver", "-c", str(config), *own, *files]
    process = started(stack, words, folder / "output")
    sockets = [*lab.prefix("public"), "ss", "-Hlntu"]
    wait_for(
        lambda: len(re.findall(rf"{re.escape(TURN_IP)}:(?:3478|5349)\b", command(*sockets))) >= 4,
        "coturn listens",
        alive=process,
        log=[],
    )
    return Coturn(log, cert)
