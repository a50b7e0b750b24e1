"""Changes the candidates of a peer connection so that its packets go through a laboratory in user space."""

from __future__ import annotations

import re
from collections.abc import Callable
from typing import Any, Protocol, TypeVar, cast

from mosaic_core.laboratory.impaired_path import ImpairedPath
from mosaic_core.laboratory.natted_path import Household, NattedPath
from mosaic_core.words.signaling import IceCandidate

AnyListener = TypeVar("AnyListener")

_LINE = re.compile(r"a=(candidate:[^\r\n]+)\r?\n")
_END = re.compile(r"a=end-of-candidates\r?\n")
_CANDIDATE = re.compile(r"^(candidate:\S+ \d+ udp \d+) (\S+) (\d+) (typ (\w+).*)$", re.IGNORECASE)

Change = Callable[[str], str | None]
"""From a candidate to the one that is told instead; ``None``: it is kept back."""


class Detour(Protocol):
    """Changes the candidates of one peer connection."""

    def of_robot(self, candidate: str) -> str | None:
        """What the operator is told instead; ``None``: nothing."""

    def of_operator(self, candidate: str) -> str | None:
        """What the robot is told instead; ``None``: nothing."""

    def offer(self, sdp: str) -> str:
        """The operator's description as the robot gets it."""


class PathDetour:
    """The relay stands in front of the robot; the robot learns no operator's address and meets them there."""

    def __init__(self, path: ImpairedPath) -> None:
        self._path = path
        self._known: dict[tuple[str, int], tuple[str, int]] = {}

    def of_robot(self, candidate: str) -> str | None:
        match = _CANDIDATE.match(candidate)
        if match is None or match[5] != "host":
            return None
        address = (match[2], int(match[3]))
        if address not in self._known:
            self._known[address] = self._path.relayed(*address)
        host, port = self._known[address]
        return f"{match[1]} {host} {port} {match[4]}"

    def of_operator(self, candidate: str) -> str | None:
        return None

    def offer(self, sdp: str) -> str:
        """With the end of the candidates too: an operator who has no path at all is given up."""
        return _END.sub("", changed(sdp, self.of_operator))


class NatDetour:
    """Puts robot and operator behind a NAT: only what the public network knows is told, as the door that leads
    there."""

    def __init__(self, path: NattedPath) -> None:
        self._path = path

    def of_robot(self, candidate: str) -> str | None:
        return self._through(self._path.operator, candidate)

    def of_operator(self, candidate: str) -> str | None:
        return self._through(self._path.robot, candidate)

    def offer(self, sdp: str) -> str:
        return changed(sdp, self.of_operator)

    def _through(self, home: Household, candidate: str) -> str | None:
        match = _CANDIDATE.match(candidate)
        if match is None or not self._path.is_public(match[2]):
            return None
        host, port = home.door((match[2], int(match[3])))
        return f"{match[1]} {host} {port} {match[4]}"


def detour(path: ImpairedPath) -> Detour:
    """For one more peer connection over this path."""
    return NatDetour(path) if isinstance(path, NattedPath) else PathDetour(path)


def changed(sdp: str, change: Change) -> str:
    """A description with its candidates changed."""

    def line(match: re.Match[str]) -> str:
        candidate = change(match[1])
        return "" if candidate is None else f"a={candidate}\r\n"

    return _LINE.sub(line, sdp)


def changed_candidate(candidate: IceCandidate, change: Change) -> IceCandidate | None:
    """The one that is told instead; ``None``: it is kept back. An empty one says that there are no more."""
    if not candidate.candidate:
        return candidate
    text = change(candidate.candidate)
    return None if text is None else candidate.model_copy(update={"candidate": text})


class PassingOn:
    """Does as another object does, but for what a subclass does in another way."""

    def __init__(self, inner: Any) -> None:
        self._inner = inner

    def __getattr__(self, name: str) -> Any:
        return getattr(self._inner, name)


def detoured(listener: AnyListener, change: Change) -> AnyListener:
    """``listener`` of a peer connection, which hears of its candidates only as they are told to the other side."""
    return cast("AnyListener", _DetouredListener(listener, change))


class LocalListener(PassingOn):
    """The listener of a peer connection with somebody on this machine: every door of the laboratory lies on its
    loopback."""

    is_local = True


class _DetouredListener(LocalListener):
    def __init__(self, listener: Any, change: Change) -> None:
        super().__init__(listener)
        self._change = change

    def candidate_found(self, candidate: IceCandidate) -> None:
        told = changed_candidate(candidate, self._change)
        if told is not None:
            self._inner.candidate_found(told)
