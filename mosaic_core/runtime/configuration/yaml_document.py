"""A YAML file as plain values that remember their lines.

Safe YAML only, and less than all of it: one document, string keys, no duplicate keys, no custom tags, bounded size,
depth and alias expansion. What is wrong is collected in :attr:`YamlDocument.problems`.
"""

from __future__ import annotations

import re
from collections.abc import Collection, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, TypeAlias

import yaml

from mosaic_core.runtime.configuration.config_env import MASK_CHARACTERS, filled, masked, unmasked
from mosaic_core.words.errors import NOWHERE, CodeLine, ConfigError, Problem, guess, without_place

Place: TypeAlias = tuple[str | int, ...]
"""Where a value stands: ``("connectors", 2, "params", "fps")``."""

MAX_FILE_BYTES = 256 * 1024
"""A robot with 100 connectors needs 20 KB; the parser takes about a second for this much."""
MAX_VALUES = 20_000
"""Values after aliases are expanded: nine lines of anchors can mean 10^9 ("billion laughs")."""
MAX_DEPTH = 50
_AS_TEXT = "name the robot's own YAML file, and save it as UTF-8"
_MANY_FILES = 5
"""More are no help in an error."""
_LEAST_SECRET = 4
"""Characters. What is shorter is hidden in quotes only: it may be any word or number of a sentence."""

_TAG = "tag:yaml.org,2002:"


def spelled(place: Place) -> str:
    """``connectors[2].params.fps``."""
    text = ""
    for part in place:
        text += f"[{part}]" if isinstance(part, int) else f".{part}" if text else part
    return text


@dataclass(slots=True)
class YamlDocument:
    """Plain values, and by their place what the file knew about them."""

    tree: Any
    file: str = ""
    lines: dict[Place, int] = field(default_factory=dict)
    """Counted from 1; that of the key where there is one."""
    texts: dict[Place, str] = field(default_factory=dict)
    """Each scalar as it was written (references filled in): what a string means where YAML 1.1 saw a number."""
    unknown: set[Place] = field(default_factory=set)
    """Values with a missing environment variable or file."""
    secret: dict[Place, str] = field(default_factory=dict)
    """Values that came from the environment or a file, as they were written: never quoted in a message otherwise."""
    problems: list[Problem] = field(default_factory=list)

    def has(self, place: Place) -> bool:
        """Whether a value stands at ``place``."""
        value: Any = self.tree
        for part in place:
            is_item = isinstance(value, list | tuple) and isinstance(part, int) and -1 < part < len(value)
            if not is_item and not (isinstance(value, dict) and part in value):
                return False
            value = value[part]
        return True

    def problem(
        self,
        place: Place,
        message: str,
        *,
        code: str = "config.invalid",
        cure: str = "",
        guess: str = "",
        at: CodeLine = NOWHERE,
    ) -> Problem:
        """A problem at ``place``, or with the line of the nearest thing around it that the file has. ``guess``: a
        better cure made of the value there, told only if nothing of it came from the environment or a file. ``at``: the
        code whose mistake it is, where it is none of the file."""
        if guess and not any(one[: len(place)] == place for one in self.secret):
            cure = guess
        around = place
        while around and around not in self.lines:
            around = around[:-1]
        file, line = at if at.file else (self.file, self.lines.get(around))
        said = self._without_secrets(without_place(message, at))
        return Problem(said, code, file, line, spelled(place), self._without_secrets(cure))

    def _without_secrets(self, sentence: str) -> str:
        for place, written in self.secret.items():
            text = self.texts[place]
            sentence = sentence.replace(f"'{text}'", f"'{written}'")
            if len(text) >= _LEAST_SECRET and text != written:
                word = rf"(?<!\w){re.escape(text)}(?!\w)"
                sentence = re.sub(word, written.replace("\\", r"\\"), sentence, flags=re.IGNORECASE)
        return sentence


def read_yaml(path: Path, environ: Mapping[str, str]) -> YamlDocument:
    """Read ``path``. Raises :class:`ConfigError` where nothing can be made of the file; smaller mistakes are in
    the document's ``problems``."""
    return parse_yaml(_text_of(path), str(path), environ)


def _text_of(path: Path) -> str:
    file = str(path)
    try:
        with path.open("rb") as stream:
            content = stream.read(MAX_FILE_BYTES + 1)
    except (OSError, ValueError) as error:
        cause = (error.strerror if isinstance(error, OSError) else str(error)) or type(error).__name__
        problem = Problem(f"can't be read: {cause}", "config.unreadable", file, cure=_readable(path, error))
        raise ConfigError([problem]) from error
    if len(content) > MAX_FILE_BYTES:
        large = f"larger than {MAX_FILE_BYTES // 1024} KiB"
        raise ConfigError([Problem(large, "config.unreadable", file, cure="name the robot's own YAML file")])
    try:
        return content.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = content.count(b"\n", 0, error.start) + 1
        raise ConfigError([Problem("is not UTF-8 text", "config.syntax", file, line, cure=_AS_TEXT)]) from error


def _readable(path: Path, error: Exception) -> str:
    """What to do about a file that can't be opened: the one that is probably meant."""
    if isinstance(error, FileNotFoundError):
        beside = guess(path.name, [one.name for one in _yaml_files(path.parent)])
        return f"{beside} Else `mosaic config init` writes one" if beside else "`mosaic config init` writes one"
    if isinstance(error, IsADirectoryError):
        inside = [str(one) for one in _yaml_files(path)[:_MANY_FILES]]
        return f"name a file in it: {', '.join(inside)}" if inside else "name a YAML file; there is none in this folder"
    if isinstance(error, PermissionError):
        return "let this account read it, or be the account that it belongs to"
    return ""


def _yaml_files(folder: Path) -> list[Path]:
    try:
        return sorted(one for one in folder.iterdir() if one.suffix in (".yaml", ".yml"))
    except OSError:
        return []


def parse_yaml(text: str, file: str, environ: Mapping[str, str]) -> YamlDocument:
    """The same for text that is already read."""
    stray = MASK_CHARACTERS.search(text)
    if stray:
        line = text.count("\n", 0, stray.start()) + 1
        raise ConfigError([Problem(f"character U+{ord(stray[0]):04X} is not allowed", "config.syntax", file, line)])
    try:
        loader = _BoundedLoader(masked(text))
        node = loader.get_single_node()
    except _TooDeepError as error:
        raise ConfigError([Problem("nested too deeply", "config.syntax", file, error.line)]) from error
    except yaml.YAMLError as error:
        raise ConfigError([_syntax_problem(error, file, text)]) from error
    document = YamlDocument(None, file)
    if node is None:
        problem = Problem("is empty", "config.syntax", file, cure="`mosaic config init` writes a file to start from")
        raise ConfigError([problem])
    if not isinstance(node, yaml.MappingNode):
        cure = "write `server:` and `connectors:`"
        raise ConfigError([Problem("must be a mapping of keys to values", "config.syntax", file, 1, cure=cure)])
    _Builder(loader, document, environ).build_root(node)
    return document


class _TooDeepError(Exception):
    """Says in which line a document goes deeper than is read."""

    def __init__(self, line: int) -> None:
        super().__init__(line)
        self.line = line


class _BoundedLoader(yaml.SafeLoader):
    """Reads YAML to a bounded depth: each level costs the library's scanner more than the one before it."""

    def __init__(self, text: str) -> None:
        super().__init__(text)
        self._depth = 0

    def compose_node(self, parent: yaml.Node | None, index: int) -> yaml.Node | None:
        if parent is not None and self._depth > MAX_DEPTH:
            raise _TooDeepError(parent.start_mark.line + 1)
        self._depth += 1
        node = super().compose_node(parent, index)
        self._depth -= 1
        return node


def _syntax_problem(error: yaml.YAMLError, file: str, text: str) -> Problem:
    mark = getattr(error, "problem_mark", None)
    if isinstance(error, yaml.reader.ReaderError):
        line = text.count("\n", 0, error.position) + 1
        message = f"character U+{int(error.character):04X} is not allowed"
        return Problem(message, "config.syntax", file, line, cure="is this a text file?")
    message = unmasked(getattr(error, "problem", None) or str(error))
    cure = "indent with spaces, never with tabs" if "'\\t'" in message else ""
    if "expected a single document" in (getattr(error, "context", None) or ""):
        message, cure = "holds more than one document", "remove the '---' in the middle"
    return Problem(f"not valid YAML: {message}", "config.syntax", file, mark.line + 1 if mark else None, cure=cure)


class _Builder:
    """Turns YAML nodes into plain values."""

    def __init__(self, loader: yaml.SafeLoader, document: YamlDocument, environ: Mapping[str, str]) -> None:
        self._loader = loader
        self._document = document
        self._environ = environ
        self._values = 0
        self._open: list[yaml.MappingNode] = []
        """The mappings around the value that is being built, those that are merged in included."""

    def build_root(self, node: yaml.Node) -> None:
        self._document.tree = self._build(node, ())

    def _build(self, node: yaml.Node, place: Place) -> Any:
        self._count(1, place)
        self._document.lines.setdefault(place, node.start_mark.line + 1)
        if isinstance(node, yaml.MappingNode):
            return self._mapping(node, place)
        if isinstance(node, yaml.SequenceNode):
            self._refuse_tag(node, place, "seq")
            return [self._build(item, (*place, index)) for index, item in enumerate(node.value)]
        assert isinstance(node, yaml.ScalarNode)
        return self._scalar(node, place)

    def _count(self, values: int, place: Place) -> None:
        self._values += values
        if self._values > MAX_VALUES or max(len(place), len(self._open)) > MAX_DEPTH:
            message = f"more than {MAX_VALUES} values" if self._values > MAX_VALUES else "nested too deeply"
            problem = self._document.problem(place, message, code="config.syntax", cure="do aliases (*name) multiply?")
            raise ConfigError([problem])

    def _mapping(self, node: yaml.MappingNode, place: Place, written: Collection[str] = ()) -> dict[str, Any]:
        """Without the keys in ``written``."""
        self._refuse_tag(node, place, "map")
        self._open.append(node)
        result: dict[str, Any] = {}
        merged: list[yaml.Node] = []
        for key_node, value_node in node.value:
            if key_node.tag == f"{_TAG}merge":
                merged += value_node.value if isinstance(value_node, yaml.SequenceNode) else [value_node]
                continue
            key = self._key(key_node, place)
            if key is None or key in written:
                continue
            where, line = (*place, key), key_node.start_mark.line + 1
            if key in result:
                self._refuse_twin(key, where, line)
                continue
            self._document.lines[where] = line
            result[key] = self._build(value_node, where)
        taken = set(written).union(result) if merged else set()  # no copy for each of many mappings that merge none
        for source in merged:
            added = self._merged(source, place, taken)
            result |= added
            taken |= added.keys()
        self._open.pop()
        return result

    def _key(self, node: yaml.Node, place: Place) -> str | None:
        if isinstance(node, yaml.ScalarNode):
            return unmasked(node.value)
        problem = self._document.problem(place, "keys must be plain words", code="config.syntax")
        self._document.problems.append(problem)
        return None

    def _refuse_twin(self, key: str, where: Place, line: int) -> None:
        """The line is that of the second one; :meth:`YamlDocument.problem` would name the first."""
        document = self._document
        message = f"'{key}' stands here twice, first in line {document.lines[where]}"
        problem = Problem(message, "config.syntax", document.file, line, spelled(where), "remove one")
        document.problems.append(problem)

    def _merged(self, source: yaml.Node, place: Place, written: Collection[str]) -> dict[str, Any]:
        """``<<: *base``: keys that are written out win. What is looked at counts, also where it adds nothing."""
        document = self._document
        if isinstance(source, yaml.MappingNode) and source not in self._open:
            self._count(1 + len(source.value), place)
            return self._mapping(source, place, written)
        message = "merges a mapping into itself" if source in self._open else "takes mappings"
        document.problems.append(document.problem(place, f"'<<' {message}", code="config.syntax"))
        return {}

    def _scalar(self, node: yaml.ScalarNode, place: Place) -> Any:
        document = self._document
        text = unmasked(node.value)
        value = filled(text, self._environ)
        document.texts[place] = value.text
        if value.is_filled:
            document.secret[place] = text
            document.problems += [document.problem(place, message) for message in value.mistakes]
            if value.missing:
                document.unknown.add(place)
                code = "config.missing_env"
                document.problems += [document.problem(place, message, code=code) for message in value.missing]
            return value.text
        return self._typed(node, text, place)

    def _typed(self, node: yaml.ScalarNode, text: str, place: Place) -> Any:
        kind = node.tag.removeprefix(_TAG)
        if kind in ("str", "timestamp"):
            return text
        if kind == "null":
            return None
        try:
            if kind == "int":
                return self._loader.construct_yaml_int(node)
            if kind == "float":
                return self._loader.construct_yaml_float(node)
            if kind == "bool":
                return self._loader.construct_yaml_bool(node)
        except (ValueError, KeyError, IndexError):
            return text
        self._refuse_tag(node, place, "str")
        return text

    def _refuse_tag(self, node: yaml.Node, place: Place, expected: str) -> None:
        if node.tag != f"{_TAG}{expected}":
            problem = self._document.problem(place, f"the tag {node.tag} is not supported", code="config.syntax")
            self._document.problems.append(problem)
