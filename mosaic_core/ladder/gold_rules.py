"""Checks what people may rely on without having read the code: it shrugs off nonsense, leaves nothing behind, can be
tried at once and is explained."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import yaml

from mosaic_core.ladder.examinee import Examinee
from mosaic_core.ladder.fault import Fault, NotJudged
from mosaic_core.ladder.garbage import fed_with_garbage
from mosaic_core.ladder.lives import leftovers, lived
from mosaic_core.ladder.rule import ConnectorRule, ShipmentRule
from mosaic_core.ladder.shipment import Shipment
from mosaic_core.ladder.source_places import place_of_class
from mosaic_core.words.errors import CodeLine, ConfigError

_FENCE = re.compile(r"^```ya?ml[^\n]*\n(.*?)^```", re.DOTALL | re.MULTILINE)
_BODIES = {"messages", "frames", "sounds", "handle_data", "handle_sound"}
ARCHITECTURES = ("x86_64", "aarch64")
"""What robots and their developers have."""


async def refuses_garbage(one: Examinee) -> list[Fault]:
    return [
        Fault(f"it fails over {what}: {cause}", place_of_class(kind))
        for kind, what, cause in await fed_with_garbage(one)
    ]


async def leaves_nothing(one: Examinee) -> list[Fault]:
    found, restarts = await leftovers(one)
    return [Fault(f"after {restarts} there are {', '.join(found)}", one.place)] if found else []


async def runs_without_hardware(one: Examinee) -> list[Fault]:
    life = await lived(one)
    told = "its trial" if one.configurer.trial is not None else "its example"
    return [one.fault(error, f"with the params of {told} it ends with") for _, error in life.failures[:1]]


def is_explained(one: Examinee) -> Iterator[Fault]:
    pages = one.shipment.pages()
    if not pages:
        raise NotJudged("neither readme nor documentation is at hand")
    examples = [found for file, text in pages for found in _examples(file, text, one.connector_type)]
    if not examples:
        file = pages[0][0]
        yield Fault(f"no YAML block of {Path(file).name} or docs/ has `type: {one.connector_type}`", CodeLine(file))
    for place, entry in examples:
        params, safety = (entry.get(key) or {} for key in ("params", "safety"))
        try:
            one.configured(params if isinstance(params, dict) else {}, safety if isinstance(safety, dict) else {})
        except ConfigError as error:
            said = "; ".join(problem.message for problem in error.problems)
            yield Fault(f"the example is refused: {said}", place)


def _examples(file: str, text: str, connector_type: str) -> Iterator[tuple[CodeLine, dict[str, Any]]]:
    """The entries of this type in the YAML blocks of a page. What comes from the environment is any text."""
    for block in _FENCE.finditer(text):
        source = re.sub(r"\$\{[^}]*\}", "from-the-environment", block[1])
        try:
            tree = yaml.safe_load(source)
        except yaml.YAMLError:
            continue
        entries = tree.get("connectors", []) if isinstance(tree, dict) else tree
        for entry in entries if isinstance(entries, list) else []:
            if isinstance(entry, dict) and entry.get("type") == connector_type:
                at = block.start(1) + max(0, source.find(connector_type))
                yield CodeLine(file, text.count("\n", 0, at) + 1), entry


def counts_losses(one: Shipment) -> Iterator[Fault]:
    for file in one.code():
        try:
            tree = ast.parse(file.read_text("utf-8"))
        except (OSError, SyntaxError, ValueError):
            continue  # whoever imports it hears of it
        bodies = [node for node in ast.walk(tree) if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef)]
        for body in (node for node in bodies if node.name in _BODIES):
            for line in _silent_drops(body):
                yield Fault(f"{body.name} leaves something out and tells nobody", CodeLine(str(file), line))


def _silent_drops(body: ast.AST) -> Iterator[int]:
    """The lines of ``except …:`` inside a loop that do nothing but go on."""
    loops = (node for node in ast.walk(body) if isinstance(node, ast.For | ast.AsyncFor | ast.While))
    lines = {
        handler.lineno
        for loop in loops
        for handler in ast.walk(loop)
        if isinstance(handler, ast.ExceptHandler)
        and all(isinstance(statement, ast.Pass | ast.Continue) for statement in handler.body)
    }
    yield from sorted(lines)


def has_wheels(one: Shipment) -> Iterator[Fault]:
    built = sorted((one.tree / "dist").glob("*.whl")) if one.tree is not None else []
    if "Root-Is-Purelib: true" in one.wheel or any(file.name.endswith("-none-any.whl") for file in built):
        return
    if not built and one.tree is not None and not _may_be_compiled(one.tree):
        return
    if not built:
        raise NotJudged("it is installed for this machine alone: name its folder, with the wheels in dist/")
    for architecture in ARCHITECTURES:
        if not any(architecture in file.name for file in built):
            yield Fault(f"there is no wheel for {architecture}", CodeLine(str(one.tree)))


def _may_be_compiled(tree: Path) -> bool:
    """Whether its sources hold anything but Python."""
    return any(next(tree.glob(f"**/*{ending}"), None) for ending in (".c", ".cpp", ".pyx", ".rs"))


GOLD = (
    ConnectorRule(
        "refuses-garbage", "gold", "Garbage is refused and never restarts it.",
        "Anybody with a browser can send anything; a failure rests the receiver for everybody.",
        "Give the message a model; of text and bytes, raise Refused(code, message) for what makes no sense.",
        refuses_garbage,
    ),
    ConnectorRule(
        "leaves-nothing", "gold", "Restarts leave no thread, task or file open.",
        "A robot runs for months; one file for each reconnection is a crash in a week.",
        "Open devices in `with` blocks of the body, and join the threads that it starts.", leaves_nothing,
    ),
    ConnectorRule(
        "without-hardware", "gold", "It can be tried on any machine.",
        "Who looks at a plugin has not bought the device yet; tests and pages need it too.",
        'Ship a device that is made up, and name the params that take it: trial = {"port": "fake"}.',
        runs_without_hardware,
    ),
    ConnectorRule(
        "explained", "gold", "Readme or documentation has a YAML example of the type, and it is valid.",
        "It is what people paste first.",
        "Write a section for each type with a ```yaml block as it stands below `connectors:`.", is_explained,
    ),
    ShipmentRule(
        "counts-losses", "gold", "What a body leaves out it counts or tells.",
        "Otherwise nobody can tell a bad sensor from a quiet one.",
        'Call self.count_loss("refused") or "lost" where input is skipped: operators see the figure.', counts_losses,
    ),
    ShipmentRule(
        "wheels", "gold", "Its wheel is pure, or there is one for x86_64 and one for aarch64.",
        "Robots have small machines without compilers.",
        "Build wheels for both, such as with cibuildwheel.", has_wheels,
    ),
)  # fmt: skip
"""In the order in which they are asked and told."""
