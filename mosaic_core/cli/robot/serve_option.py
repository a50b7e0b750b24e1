"""``--serve [HOST:PORT]``: an option whose value may be left out, also right before the path of a file."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

from typer.core import TyperCommand

from mosaic_core.words.errors import MosaicError
from mosaic_core.words.lan import DEFAULT_ADDRESS, DEFAULT_PORT, LanWish

OPTION = "--serve"
_ADDRESS = re.compile(r"\d+|\[[0-9A-Fa-f:.%\w]+\](:\d+)?|[^\s/\\:]+:\d+|\d+(\.\d+){3}|localhost")


class CommandWithServe(TyperCommand):
    """Puts the default where no address follows, so that the parser sees an option like any other."""

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        return super().parse_args(ctx, with_address(args))


def with_address(arguments: list[str]) -> list[str]:
    """``--serve`` without a value becomes ``--serve=<default>``."""
    whole: list[str] = []
    for index, one in enumerate(arguments):
        following = arguments[index + 1] if index + 1 < len(arguments) else ""
        is_bare = one == OPTION and not _ADDRESS.fullmatch(following)
        whole.append(f"{OPTION}={DEFAULT_ADDRESS}" if is_bare else one)
    return whole


def wish_of(serve: str | None, name: str, certificate: Path | None, key: Path | None) -> LanWish | None:
    """What the options together ask for. Raises :class:`MosaicError` (``config.lan``)."""
    if (certificate is None) != (key is None):
        raise MosaicError("--tls-cert and --tls-key go together", code="config.lan", cure="give both, or neither")
    if serve is None:
        if certificate is not None or name:
            raise MosaicError("--name, --tls-cert and --tls-key need --serve", code="config.lan", cure="add --serve")
        return None
    host, port = address_of(serve)
    return LanWish(host, port, name=name, tls_certificate=certificate, tls_key=key)


def address_of(text: str) -> tuple[str, int]:
    """``HOST``, ``PORT``, ``HOST:PORT`` or ``[IPv6]:PORT``. Raises :class:`MosaicError` (``config.lan``)."""
    host, separator, port = text.rpartition(":")
    if text.isdecimal():
        host, port = DEFAULT_ADDRESS.rpartition(":")[0], text
    elif not separator or text.endswith("]"):
        host, port = text, str(DEFAULT_PORT)
    if not host or not _ADDRESS.fullmatch(f"{host}:{port}") or not 0 < int(port) <= 65535:
        cure = f"write for example {DEFAULT_ADDRESS}"
        raise MosaicError(f"--serve: {text!r} is no HOST:PORT", code="config.lan", cure=cure)
    return host.strip("[]"), int(port)
