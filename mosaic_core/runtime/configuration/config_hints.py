"""Hints about a valid configuration: what works, but perhaps not as its author thinks. Never an error."""

from __future__ import annotations

import logging
import re
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from urllib.parse import urlsplit

from mosaic_core.machines.peers.home_address import is_loopback_name
from mosaic_core.runtime.configuration.checked_config import CheckedConnector
from mosaic_core.runtime.configuration.request_problems import declared_requests
from mosaic_core.runtime.configuration.yaml_document import YamlDocument
from mosaic_core.words.config import RobotConfig
from mosaic_core.words.errors import Problem

logger = logging.getLogger(__name__)

_SNAKE = re.compile(r"[a-z0-9]+(_[a-z0-9]+)*")


def tell_hints(hints: Sequence[Problem], told: Sequence[Problem] = ()) -> None:
    """Log those that were not ``told`` yet, wherever they stood then."""
    known = {replace(one, line=None) for one in told}
    for hint in hints:
        if replace(hint, line=None) not in known:
            logger.warning("hint: %s", hint)


def hints_of(
    config: RobotConfig, connectors: Sequence[CheckedConnector], document: YamlDocument
) -> tuple[Problem, ...]:
    """Everything worth saying, in the order of the file."""
    found = [*_server_hints(config, document), *_journal_hints(config.control.journal_file, document)]
    for connector in connectors:
        found += _connector_hints(connector, config.control.legacy_peers)
    return tuple(found)


def _server_hints(config: RobotConfig, document: YamlDocument) -> Iterator[Problem]:
    if config.server is None:
        message = "no server is named: the robot can only be reached on its own network"
        yield document.problem((), message, cure="run it with `mosaic run --serve`, or add a server section")
        return
    url = urlsplit(config.server.ws_url)
    if url.scheme == "ws" and not is_loopback_name(url.hostname or ""):
        message = "the token and all signaling travel unencrypted"
        yield document.problem(("server", "ws_url"), message, cure="use wss:// outside a trusted network")
    for index, server in enumerate(config.server.webrtc.ice_servers):
        if any(one.startswith("turn") for one in server.urls) and not (server.username and server.credential):
            section = "webrtc" if ("server", "webrtc") in document.lines else "webrtc_config"
            place = ("server", section, "ice_servers", index)
            yield document.problem(place, "a TURN server without username and credential", cure="most refuse that")


def _journal_hints(journal_file: str | None, document: YamlDocument) -> Iterator[Problem]:
    if journal_file is not None and not Path(journal_file).parent.is_dir():
        message = f"the folder {str(Path(journal_file).parent)!r} isn't here: the robot would run without this journal"
        yield document.problem(("control", "journal_file"), message, cure="make it where the robot runs")


def _connector_hints(connector: CheckedConnector, legacy_peers: str) -> Iterator[Problem]:
    label = connector.config.label
    if not _SNAKE.fullmatch(label):
        suggestion = re.sub(r"[^a-z0-9]+", "_", label.lower()).strip("_")
        guess = f"'{suggestion}' would be the usual spelling"
        yield connector.problem(f"the label '{label}' is not snake_case", "label", guess=guess)
    timeout_s = connector.safety.timeout_s
    yield from _weak_points(connector)
    if declared_requests(connector.configurer) is not None:
        return  # its class bounds every request
    if timeout_s is None and connector.safety.requires_lease and legacy_peers == "allow":
        message = (
            "whether silence stops it depends on the connector: an original dashboard that hangs is only noticed when"
            " its lease expires"
        )
        yield connector.problem(message, "safety", cure="say how long with timeout_s, for example 0.3")


def _weak_points(connector: CheckedConnector) -> Iterator[Problem]:
    """What takes a guard away and looks harmless in the file."""
    safety = connector.safety
    if safety.on_timeout == "hold":
        until = "somebody says stop" if safety.requires_lease is False else "its lease ends or somebody says stop"
        message = f"silence stops nothing here: what was commanded last goes on until {until}"
        cure = "write `callback`, unless it must not stop by itself"
        yield connector.problem(message, "safety", "on_timeout", cure=cure)
    if safety.requires_lease is False and "requires_lease" in safety.model_fields_set:
        message = "whoever is connected may command it, several at a time"
        yield connector.problem(message, "safety", "requires_lease", cure="leave it out, unless nothing moves")
