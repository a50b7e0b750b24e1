"""What aiortc and aioice keep to themselves is used in one package alone, and each such name has its contract test.

Which object an attribute belongs to can't be told from the text. So the rule is simpler and stricter: outside that
package nothing reads a private name of anything but itself. Whoever has a good reason stands in ``ALLOWED``.
"""

from __future__ import annotations

import ast
import importlib
import inspect
import re
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
PRIVATE = ROOT / "mosaic_core" / "adapters" / "aiortc_private"
CONTRACTS = ROOT / "tests" / "adapters"
PRODUCT = [
    path
    for pattern in ("mosaic_core/**/*.py", "plugins/*/mosaic_*/**/*.py", "examples/**/*.py")
    for path in sorted(ROOT.glob(pattern))
    if PRIVATE not in path.parents
]
ALLOWED = {
    ("mosaic_core/cli/robot/run_command.py", "os._exit"),  # Python's documented way out while threads hang
    ("mosaic_core/cli/robot/end_signals.py", "os._exit"),
    ("mosaic_core/cli/terminal/threads_left.py", "os._exit"),
    ("mosaic_core/cli/configuration/broken_types.py", "os._exit"),
    ("mosaic_core/contract/every.py", "sys._getframe"),  # Python's documented ways to look at a stack
    ("mosaic_core/runtime/handlers/handler_host.py", "sys._getframe"),
    ("mosaic_core/runtime/threads/stacks.py", "sys._current_frames"),
    ("mosaic_core/runtime/threads/slow_code.py", "sys._current_frames"),
    ("mosaic_core/ladder/lives.py", "sys._current_frames"),
    ("mosaic_core/runtime/handlers/task_runner.py", "asyncio._unregister_task"),  # documented for makers of tasks
    ("plugins/mosaic-audio/mosaic_audio/devices.py", "sounds._initialize"),  # PortAudio looks for devices anew only so
    ("plugins/mosaic-audio/mosaic_audio/devices.py", "sounds._terminate"),
    ("mosaic_core/harness/fake_hosts.py", "handler._host"),  # our own handler, looked into by its test kit
}

LIBRARIES = ("aiortc", "aioice")
NAME = re.compile(r"_[A-Za-z]\w*(?<!__)")
READERS = {"getattr", "setattr", "hasattr", "delattr", "attrgetter", "methodcaller"}


def private_uses(tree: ast.AST) -> Iterator[tuple[str, str]]:
    """``(name, text)`` of every private name of something else."""
    for node in ast.walk(tree):
        match node:
            case ast.Attribute(value=ast.Name(id="self" | "cls") | ast.Call(func=ast.Name(id="super"))):
                pass  # its own, or its base's: see inherited_uses
            case ast.Attribute(attr=name) if NAME.fullmatch(name):
                yield name, ast.unparse(node)
            case ast.Call(func=ast.Name(id=reader) | ast.Attribute(attr=reader)) if reader in READERS:
                yield from ((name, ast.unparse(node)) for name in _texts(node.args))
            case ast.Subscript(value=ast.Call(func=ast.Name(id="vars")) | ast.Attribute(attr="__dict__"), slice=key):
                yield from ((name, ast.unparse(node)) for name in _texts([key]))
            case ast.ImportFrom(module=str(module), names=names) if module.split(".")[0] in LIBRARIES:
                parts = [*module.split("."), *(one.name for one in names)]
                yield from ((name, ast.unparse(node)) for name in parts if NAME.fullmatch(name))
            case ast.Constant(value=str(text)) if text.startswith("_RTC"):
                yield text, text


def _texts(nodes: list[ast.expr]) -> Iterator[str]:
    for node in nodes:
        if isinstance(node, ast.Constant) and isinstance(node.value, str) and NAME.fullmatch(node.value):
            yield node.value


def inherited_uses(tree: ast.AST) -> Iterator[str]:
    """Private names that a class takes from a base of aiortc or aioice: ``self._y`` that its base has."""
    origins = {
        one.asname or one.name: (node.module, one.name)
        for node in ast.walk(tree)
        if isinstance(node, ast.ImportFrom) and node.module and node.module.split(".")[0] in LIBRARIES
        for one in node.names
    }
    for node in ast.walk(tree):
        if not isinstance(node, ast.ClassDef):
            continue
        for base in node.bases:
            if isinstance(base, ast.Name) and base.id in origins:
                module, name = origins[base.id]
                theirs = _private_names(getattr(importlib.import_module(module), name))
                yield from (f"{node.name}.{one}" for one in _own_names(node) & theirs)


def _private_names(base: type) -> set[str]:
    sources = [inspect.getsource(one) for one in base.__mro__ if one.__module__.split(".")[0] in LIBRARIES]
    names = re.findall(r"(?:self\.|def )(_\w+)", "".join(sources))
    return {name for name in names if NAME.fullmatch(name)}


def _own_names(node: ast.ClassDef) -> set[str]:
    inner = list(ast.walk(node))
    used = {one.attr for one in inner if isinstance(one, ast.Attribute)}
    return used | {one.name for one in inner if isinstance(one, ast.FunctionDef | ast.AsyncFunctionDef)}


def parsed(path: Path) -> ast.AST:
    return ast.parse(path.read_text())


def test_outside_of_its_package_no_private_name_of_something_else_is_used() -> None:
    found = {
        (str(path.relative_to(ROOT)), text)
        for path in PRODUCT
        for tree in [parsed(path)]
        for text in [*(text for _, text in private_uses(tree)), *inherited_uses(tree)]
    }
    assert found == ALLOWED, "aiortc's own names belong to mosaic_core/adapters/aiortc_private"


def names_in_use() -> list[str]:
    trees = [parsed(path) for path in PRIVATE.rglob("*.py")]
    return sorted({name for tree in trees for name in (*(name for name, _ in private_uses(tree)), *super_uses(tree))})


def super_uses(tree: ast.AST) -> Iterator[str]:
    for node in ast.walk(tree):
        match node:
            case ast.Attribute(value=ast.Call(func=ast.Name(id="super")), attr=name) if NAME.fullmatch(name):
                yield name


@pytest.fixture(scope="module")
def contracts() -> str:
    return "\n".join(path.read_text() for path in sorted(CONTRACTS.rglob("*.py")))


@pytest.mark.parametrize("name", names_in_use())
def test_a_private_name_has_its_contract_test(name: str, contracts: str) -> None:
    # A name-mangled one may be written without its class there.
    short = re.sub(r"^_RTC\w+?__", "", name)
    assert re.search(rf"(?<![A-Za-z0-9]){name}\b|\b{short}\b", contracts), f"tests/adapters must hold aiortc to {name}"


BREACHES = {
    "transport._connection": "_connection",
    "self.transport._connection": "_connection",
    "pc.getTransceivers()[0]._codecs = []": "_codecs",
    "receiver._RTCRtpReceiver__jitter_buffer": "_RTCRtpReceiver__jitter_buffer",
    "getattr(sender, '_ssrc', 0)": "_ssrc",
    "operator.attrgetter('_ssrc')(sender)": "_ssrc",
    "vars(sender)['_ssrc']": "_ssrc",
    "sender.__dict__['_ssrc']": "_ssrc",
    "from aioice.ice import _private": "_private",
    "from aiortc._hidden import thing": "_hidden",
    "names = '_RTCRtpSender__lsr'": "_RTCRtpSender__lsr",
}


@pytest.mark.parametrize(("text", "name"), BREACHES.items())
def test_a_breach_is_found_however_it_is_written(text: str, name: str) -> None:
    assert name in {found for found, _ in private_uses(ast.parse(text))}


@pytest.mark.parametrize(
    "text", ["self._own = 1", "cls._own()", "super()._own()", "thing.__class__", "_own = 1", "getattr(x, 'open')"]
)
def test_what_is_ones_own_is_no_breach(text: str) -> None:
    assert not list(private_uses(ast.parse(text)))


def test_a_subclass_that_uses_what_its_base_keeps_to_itself_is_found() -> None:
    text = (
        "from aiortc import RTCRtpSender\nclass Mine(RTCRtpSender):\n    def id(self): return self._ssrc + self._mine"
    )
    assert list(inherited_uses(ast.parse(text))) == ["Mine._ssrc"]
