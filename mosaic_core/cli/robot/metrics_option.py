"""Reads the address of ``mosaic run --metrics``: one of this machine; one that others reach has to be insisted on."""

from __future__ import annotations

from dataclasses import dataclass

from mosaic_core.machines.peers.home_address import is_loopback
from mosaic_core.words.errors import MosaicError

DEFAULT_PORT = 9464
"""The usual port of OpenTelemetry's Prometheus exporter."""


@dataclass(frozen=True, slots=True)
class MetricsAddress:
    """The address at which to serve the metrics."""

    host: str
    port: int


def metrics_address(text: str, *, is_public: bool) -> MetricsAddress:
    """``9464``, ``127.0.0.1:9464``, ``[::1]:9464``, or a host; raises :class:`MosaicError` (``config.metrics``)."""
    host, port_text = _split(text.strip())
    if not port_text.isdecimal() or int(port_text) > 65535:
        message = f"--metrics {text!r}: expected HOST:PORT such as 127.0.0.1:{DEFAULT_PORT}"
        raise MosaicError(message, code="config.metrics", cure="the port is a number up to 65535")
    if not is_loopback(host) and not is_public:
        if host == text.strip() and "." not in host and ":" not in host:
            message = f"--metrics {text!r}: expected HOST:PORT such as 127.0.0.1:{DEFAULT_PORT}"
            raise MosaicError(message, code="config.metrics", cure="a port alone will do: it is served on 127.0.0.1")
        message = f"--metrics {text!r}: everybody who reaches {host} could read labels, rates and who is connected"
        cure = "serve them on 127.0.0.1, or insist with --metrics-public"
        raise MosaicError(message, code="config.metrics", cure=cure)
    return MetricsAddress(host, int(port_text))


def _split(text: str) -> tuple[str, str]:
    if text.isdecimal():
        return "127.0.0.1", text
    if text.startswith("["):
        host, _, rest = text[1:].partition("]")
        return host, rest.removeprefix(":") or str(DEFAULT_PORT)
    host, _, port = text.rpartition(":") if ":" in text else (text, "", str(DEFAULT_PORT))
    return host, port
