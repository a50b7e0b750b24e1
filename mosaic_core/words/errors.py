"""The exceptions of MOSAIC.

::

    MosaicError                 carries a reason code of ``words.codes``
    ├── ConfigError             every mistake of a configuration, with file and line
    ├── PluginError             a distribution's entry point can't be used
    ├── AuthError               credentials refused
    ├── SignalingError          the server can't be reached, or said no
    ├── ConnectionFailed        a peer connection could not be made or was lost
    └── WireError               bytes from the other side that make no sense
    Refused                     one message that is not carried out; no error
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from difflib import get_close_matches
from typing import NamedTuple

from mosaic_core.words.codes import reason


def hint_at(name: str, known: Iterable[str]) -> str:
    """The end of an error's first sentence: the most similar name that there is, if any is similar."""
    nearest = get_close_matches(name, [str(one) for one in known], 1, 0.5)
    return f"; did you mean {nearest[0]!r}?" if nearest else "."


def whole_sentence(text: str) -> str:
    """``text`` with a full stop where it has no end of its own, so that another sentence may follow."""
    return text if text.endswith((".", "?", "!", ":", "…")) else f"{text}."


def nearest(word: str, known: Iterable[str]) -> str | None:
    """The known name that ``word`` was probably meant to be."""
    by_lower = {name.lower(): name for name in sorted(known, reverse=True)}
    match = get_close_matches(word.lower(), by_lower, n=1, cutoff=0.6)
    return by_lower[match[0]] if match else None


def slip_of(word: str, known: Iterable[str]) -> str | None:
    """The known word that ``word`` was meant to be, if it is so much like one that another meaning is unlikely: what is
    less alike may well be a name of somebody's own."""
    return next(iter(get_close_matches(word, list(known), 1, 0.8)), None)


def guess(word: str, known: Iterable[str], otherwise: str = "") -> str:
    """The cure for a word that nobody knows: the name that was probably meant, else ``otherwise``."""
    match = nearest(word, known)
    return f"did you mean '{match}'?" if match else otherwise


class CodeLine(NamedTuple):
    """File and line of somebody's code; an empty name where nobody knows it."""

    file: str = ""
    line: int | None = None

    def __str__(self) -> str:
        """``FILE:LINE``, as far as it is known."""
        return ":".join(str(part) for part in self if part)

    @property
    def heading(self) -> str:
        """``FILE:LINE: ``, which begins a sentence; empty where nobody knows it."""
        return f"{self}: " if self.file else ""

    @property
    def in_brackets(self) -> str:
        """`` (FILE:LINE)``, which follows what stands there; empty where nobody knows it."""
        return f" ({self})" if self.file else ""


NOWHERE = CodeLine()


def without_place(message: str, at: CodeLine) -> str:
    """``message`` without the ``FILE:LINE`` that it names, for whoever shows the place by itself."""
    return message.replace(at.heading, "", 1).replace(at.in_brackets, "", 1) if at.file else message


class MosaicError(Exception):
    """The base of all errors that MOSAIC raises on purpose.

    ``code`` is a key of :data:`mosaic_core.words.codes.REASONS`; ``cure`` says what to do, if anything is known; ``at``
    is the code that it speaks of, where that is somebody's mistake.
    """

    def __init__(self, message: str, *, code: str, cure: str | None = None, at: CodeLine = NOWHERE) -> None:
        super().__init__(message)
        self.at = at
        self.message = message
        self.code = code
        self.cure = reason(code).cure if cure is None else cure


@dataclass(frozen=True, slots=True)
class Problem:
    """One mistake in a configuration.

    ``line`` counts from 1, or is ``None`` where no line can be named; ``path`` is the place in the document
    (``connectors[2].params.fps``). ``file`` and ``line`` of a mistake in a connector's code are those of the code.
    """

    message: str
    code: str = "config.invalid"
    file: str = ""
    line: int | None = None
    path: str = ""
    cure: str = ""

    def __str__(self) -> str:
        at = f"{self.path}: " if self.path else ""
        cure = f" ({self.cure})" if self.cure else ""
        return f"{CodeLine(self.file, self.line).heading}{at}{self.message}{cure}"


_INDEX = re.compile(r"connectors\[(\d+)\]")


def by_line(problems: Iterable[Problem]) -> tuple[Problem, ...]:
    """In the order of the file; what is wrong with code comes after what is wrong with a configuration, in the order of
    the connectors."""
    return tuple(sorted(problems, key=_order))


def _order(problem: Problem) -> tuple[bool, int, int]:
    is_code, index = problem.file.endswith(".py"), _INDEX.match(problem.path)
    return is_code, int(index[1]) if is_code and index is not None else 0, problem.line or 0


def untold(problems: Iterable[Problem], told: Sequence[Problem]) -> tuple[Problem, ...]:
    """Those of ``problems`` whose line is neither that of one that is ``told``, nor named in its cure."""
    places, cures = {CodeLine(one.file, one.line) for one in told}, " ".join(one.cure for one in told)
    lines = ((one, CodeLine(one.file, one.line)) for one in problems)
    return tuple(one for one, line in lines if line not in places and f"{line}: " not in cures)


class ConfigError(MosaicError):
    """A configuration that can't be used: *all* its mistakes at once, in :attr:`problems`."""

    def __init__(self, problems: Sequence[Problem]) -> None:
        self.problems = tuple(problems)
        super().__init__("\n".join(str(problem) for problem in self.problems), code="config.invalid", cure="")


class PluginError(MosaicError):
    """An entry point that can't be used; ``distribution`` names who ships it, e.g. ``mosaic-camera 0.1.0``."""

    def __init__(
        self,
        message: str,
        *,
        distribution: str,
        code: str = "config.broken_plugin",
        cure: str | None = None,
        at: CodeLine = NOWHERE,
    ) -> None:
        super().__init__(message, code=code, cure=cure, at=at)
        self.distribution = distribution


class AuthError(MosaicError):
    """The server refused who we say we are."""

    def __init__(self, message: str, *, code: str = "auth.failed", cure: str | None = None) -> None:
        super().__init__(message, code=code, cure=cure)


class SignalingError(MosaicError):
    """The server can't be reached, or it refused a request."""


class ConnectionFailed(MosaicError):
    """A peer connection could not be made, or was lost; the code names the phase."""


class DeviceGone(MosaicError):
    """The device of a connector isn't there: a plugin raises it where it opens or uses one. ``message`` says which,
    ``cure`` what to do. It is no mistake of the code: one line in the log, and every few seconds another try."""

    def __init__(self, message: str, cure: str = "") -> None:
        super().__init__(f"{message}; {cure}" if cure else message, code="plugin.no_device", cure=cure or None)


class WireError(MosaicError):
    """Bytes from the other side that make no sense; the message is safe to show and quotes no secret."""

    def __init__(self, message: str, *, code: str = "signal.bad_message") -> None:
        super().__init__(message, code=code)


class Refused(Exception):
    """The refusal of one message, raised by ``handle_data``; ``code``, such as ``arm.in_the_way``, and text reach the
    sender. Raises :class:`ValueError` for a code that is a sentence."""

    def __init__(self, code: str, message: str = "") -> None:
        if not code or any(map(str.isspace, code)):
            raise ValueError(f"Refused takes a code and then a text: Refused('acme.why', {code!r})")
        message = message.encode(errors="backslashreplace").decode()  # a file's name may have half a character
        super().__init__(message or code)
        self.code = code
        self.message = message
