"""Reads the blocks of code of all pages: the documentation, and the READMEs of plugins, packages and examples."""

from __future__ import annotations

import re
import shlex
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from textwrap import dedent

ROOT = Path(__file__).parents[2]
PAGES = sorted(
    [
        ROOT / "README.md",
        *(ROOT / "docs").rglob("*.md"),
        *ROOT.glob("plugins/*/README.md"),
        *ROOT.glob("examples/*/README.md"),
        *ROOT.glob("dashboard/packages/*/README.md"),
    ]
)
_FENCE = re.compile(r"^( *)```(\w+)([^\n]*)\n(.*?)^\1```", re.MULTILINE | re.DOTALL)
_IN_PROSE = re.compile(r"`(mosaic [^`]+)`")
_TITLE = re.compile(r'title="([^"]*)"')
_ENDS = frozenset({"&&", "||", "|", ";", "&", "(", ")", ";;", "|&"})
_REDIRECTS = frozenset({">", ">>", "<", "2>", ">&", "<<<"})
_ASSIGNMENT = re.compile(r"\w+=")


@dataclass(frozen=True)
class Block:
    """A fenced block: ``page`` and ``line`` say where it begins, ``title`` is what its fence says of it."""

    page: str
    line: int
    language: str
    title: str
    text: str

    @property
    def place(self) -> str:
        return f"{self.page}:{self.line}"


@dataclass(frozen=True)
class Command:
    """One command of a block of shell: its program and words, and the line it stands on."""

    block: Block
    words: tuple[str, ...]

    @property
    def program(self) -> str:
        """Without the folder it is in."""
        return self.words[0].rpartition("/")[2] or self.words[0]

    @property
    def text(self) -> str:
        return " ".join([self.program, *self.words[1:]])

    def __str__(self) -> str:
        return f"{self.block.place} {self.text}"


def blocks(*languages: str) -> list[Block]:
    """Those of these languages, or all, in the order of the pages."""
    return [one for page in PAGES for one in blocks_of(page) if not languages or one.language in languages]


def blocks_of(page: Path) -> Iterator[Block]:
    text = page.read_text()
    for found in _FENCE.finditer(text):
        title = _TITLE.search(found[3])
        line = text.count("\n", 0, found.start()) + 2
        yield Block(str(page.relative_to(ROOT)), line, found[2], title[1] if title else "", dedent(found[4]))


def commands(block: Block) -> Iterator[Command]:
    """What a reader would type: in a block with prompts only what follows one, else every line."""
    for line in _typed(block.text):
        words: list[str] = []
        for word in [*_words(line), ";"]:
            if word not in _ENDS:
                words.append(word)
            elif words := _without_surroundings(words):
                yield Command(block, tuple(words))
                words = []


def named_in_prose() -> dict[str, str]:
    """Our commands that sentences name, often without the words that belong to them, each with a page that does."""
    texts = {str(page.relative_to(ROOT)): _FENCE.sub("", page.read_text()) for page in PAGES}
    return {" ".join(named.split()): page for page, text in texts.items() for named in _IN_PROSE.findall(text)}


def _typed(text: str) -> Iterator[str]:
    """Whole lines: a backslash, or quotes that are open, have the next one belong to them."""
    has_prompts = any(line.startswith("$ ") for line in text.splitlines())
    whole = ""
    for line in text.splitlines():
        if has_prompts and not whole and not line.startswith("$ "):
            continue
        whole += line if whole else line.removeprefix("$ ")
        if whole.endswith("\\"):
            whole = whole[:-1]
        elif _is_closed(whole):
            yield whole
            whole = ""
    assert not whole, f"quotes are never closed: {whole}"


def _is_closed(line: str) -> bool:
    try:
        _words(line)
    except ValueError:
        return False
    return True


def _words(line: str) -> list[str]:
    lexer = shlex.shlex(line, posix=True, punctuation_chars=True)
    lexer.whitespace_split = True
    return list(lexer)


def _without_surroundings(words: list[str]) -> list[str]:
    """Without variables that are set before it and files that it reads or writes."""
    kept: list[str] = []
    for place, word in enumerate(words):
        is_file = place > 0 and words[place - 1] in _REDIRECTS
        is_assignment = not kept and _ASSIGNMENT.match(word)
        if not (word in _REDIRECTS or is_file or is_assignment):
            kept.append(word)
    return kept
