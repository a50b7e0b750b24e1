"""``${NAME}``, ``${file:/run/secrets/x}``, ``${credential:x}`` and ``$${`` in the values of a configuration file.

The YAML is read first and values are filled in afterwards, so that a token never has to be valid YAML. Because
``{ token: ${NAME} }`` is no YAML either, the braces are masked, character by character, while it is read: lines and
columns stay what they are.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path

_REFERENCE = re.compile(r"\$\$\{|\$\{([^{}\n]*)\}|\$\{")
_MASKED = re.compile(r"\$?\$\{[^{}\n]*\}")
_NAME = re.compile(r"[A-Za-z_][A-Za-z0-9_]*")
_CREDENTIAL = re.compile(r"[A-Za-z0-9_][A-Za-z0-9_.-]{0,127}")
"""Names a file in one folder and never one elsewhere."""
CREDENTIALS_FOLDER = "CREDENTIALS_DIRECTORY"
"""The variable by which systemd tells a service where its credentials are (systemd.exec, ``LoadCredential=``)."""
_SPECIAL = "{}[],:#&*!|>'\"%@` "
_FIRST_MASK = 0xE700
"""Where in Unicode's private use area the masked characters live while the YAML is read."""
_MASK = {ord(char): _FIRST_MASK + index for index, char in enumerate(_SPECIAL)}
_UNMASK = {masked: char for char, masked in _MASK.items()}
MASK_CHARACTERS = re.compile(f"[{chr(_FIRST_MASK)}-{chr(_FIRST_MASK + len(_SPECIAL) - 1)}]")

MAX_SECRET_BYTES = 64 * 1024
"""A token or key is far smaller; whoever names a device file by mistake gets an error instead of a hang."""


def masked(text: str) -> str:
    """``text`` of equal length in which no ``${…}`` holds a character that YAML gives a meaning."""
    return _MASKED.sub(lambda match: match[0].translate(_MASK), text)


def unmasked(text: str) -> str:
    """The inverse of :func:`masked`."""
    return text.translate(_UNMASK)


@dataclass(frozen=True, slots=True)
class Filled:
    """A value with its references filled in, and what could not be."""

    text: str
    is_filled: bool = False
    missing: tuple[str, ...] = ()
    """References whose environment variable or file does not exist here; ``--allow-missing-env`` forgives them."""
    mistakes: tuple[str, ...] = ()
    """References that mean nothing anywhere."""


def filled(text: str, environ: Mapping[str, str]) -> Filled:
    """Fill in every reference of one value. Reads files for ``${file:…}``; changes nothing else."""
    if "${" not in text:
        return Filled(text)
    missing: list[str] = []
    mistakes: list[str] = []

    def value_of(match: re.Match[str]) -> str:
        if match[0] == "$${":
            return "${"
        try:
            return _looked_up(match[1], environ)
        except LookupError as error:
            missing.append(str(error.args[0]))
        except ValueError as error:
            mistakes.append(str(error))
        return match[0]

    return Filled(_REFERENCE.sub(value_of, text), True, tuple(missing), tuple(mistakes))


@dataclass(frozen=True, slots=True)
class References:
    """What some values refer to: variables of the environment, credentials of the service, and files, by name."""

    variables: tuple[str, ...]
    credentials: tuple[str, ...]
    files: tuple[str, ...]


def references_in(texts: Iterable[str]) -> References:
    """All that ``texts``, as they are written, refer to, each once and in order."""
    names = list(dict.fromkeys(match[1] for text in texts for match in _REFERENCE.finditer(text) if match[1]))
    return References(
        tuple(name for name in names if _NAME.fullmatch(name)),
        tuple(name.removeprefix("credential:") for name in names if name.startswith("credential:")),
        tuple(name.removeprefix("file:") for name in names if name.startswith("file:")),
    )


def _looked_up(name: str | None, environ: Mapping[str, str]) -> str:
    if name is None:
        raise ValueError("'${' without '}'; write $${ for the characters themselves")
    if name.startswith("file:"):
        return _file_content(name.removeprefix("file:"))
    if name.startswith("credential:"):
        return _credential(name.removeprefix("credential:"), environ)
    if not _NAME.fullmatch(name):
        raise ValueError(
            f"'${{{name}}}' names no variable; write ${{NAME}}, ${{file:/path}}, ${{credential:name}}, or $${{ for a "
            "literal ${"
        )
    if name not in environ:
        raise LookupError(f"the environment variable {name} is not set")
    return environ[name]


def _credential(name: str, environ: Mapping[str, str]) -> str:
    if not _CREDENTIAL.fullmatch(name):
        raise ValueError(f"'{name}' names no credential; letters, digits, '_', '-' and '.' do")
    folder = environ.get(CREDENTIALS_FOLDER)
    if not folder:
        raise LookupError(f"the credential {name} is given to services alone (LoadCredential= of systemd)")
    return _file_content(str(Path(folder) / name))


def _file_content(path: str) -> str:
    """The file without its final newline, which editors add and nobody means."""
    try:
        with Path(path).open("rb") as file:
            content = file.read(MAX_SECRET_BYTES + 1)
    except (OSError, ValueError) as error:
        cause = error.strerror if isinstance(error, OSError) else str(error)
        raise LookupError(f"the file {path} can't be read: {cause}") from error
    if len(content) > MAX_SECRET_BYTES:
        raise ValueError(f"the file {path} is larger than {MAX_SECRET_BYTES} bytes")
    try:
        return content.decode().removesuffix("\n").removesuffix("\r")
    except UnicodeDecodeError as error:
        raise ValueError(f"the file {path} is not UTF-8 text") from error
