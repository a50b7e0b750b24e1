"""What can be set or installed is on a page: variables of the environment, distributions, connector types, widgets."""

from __future__ import annotations

import ast
import re
import tomllib
from collections.abc import Iterator
from pathlib import Path
from types import ModuleType

import pytest

import mosaic_core
import mosaic_core.operator
import mosaic_core.testing
from mosaic_core.messages import STANDARD_MESSAGES

ROOT = Path(__file__).parents[2]
VARIABLE = re.compile(r"(?:\$\{)?(MOSAIC_[A-Z][A-Z0-9_]*)\}?")
PRODUCT = (ROOT / "mosaic_core", *ROOT.glob("plugins/*/mosaic_*/"))
TOOLS = (ROOT / "tests", ROOT / "docs", ROOT / "noxfile.py", ROOT / "conftest.py", ROOT / "dev", ROOT / "bench")
BETWEEN_OURSELVES = {
    "MOSAIC_CHECK_PASSWORD": "told by the demo to its own child",
    "MOSAIC_API_VERSION": "a name in a module, and the page says so",
}
GUIDES = ("howto", "tutorial", "topics")
PLUGINS = sorted(path.parent for path in ROOT.glob("plugins/*/pyproject.toml"))


def variables(*places: Path) -> set[str]:
    """Names of variables that Python code has as whole texts, alone or as `${NAME}` in a file that it writes."""
    return {name for place in places for file in _modules(place) for name in _named(file)}


def _modules(place: Path) -> Iterator[Path]:
    yield from [place] if place.is_file() else sorted(place.rglob("*.py"))


def _named(file: Path) -> Iterator[str]:
    for node in ast.walk(ast.parse(file.read_text())):
        if isinstance(node, ast.Constant) and isinstance(node.value, str):
            whole = VARIABLE.fullmatch(node.value)
            yield from [whole[1]] if whole else re.findall(r"\$\{(MOSAIC_[A-Z_]+)\}", node.value)


def of_distribution(folder: Path) -> dict[str, str]:
    """Its connector types, from what it says of itself."""
    project = tomllib.loads((folder / "pyproject.toml").read_text())["project"]
    types: dict[str, str] = project.get("entry-points", {}).get("mosaic.connectors", {})
    return types


def meanings(page: str) -> Iterator[tuple[str, str]]:
    """What the rows of its tables explain, and how, where a column is for that."""
    column = None
    for line in page.splitlines():
        cells = [cell.strip() for cell in re.split(r"(?<!\\)\|", line)[1:-1]]
        if not cells or "meaning" in cells:
            column = cells.index("meaning") if cells else None
        elif column is not None and set(line) - set("|- "):
            yield cells[0], cells[column]


@pytest.mark.parametrize("page", ["command-line", "configuration", "connectors"])
def test_every_option_and_every_key_is_explained(page: str) -> None:
    told = [*meanings((ROOT / "docs/reference" / f"{page}.md").read_text())]
    assert len(told) > 40
    assert [name for name, meaning in told if not meaning] == []


def test_every_variable_of_the_environment_is_on_its_page_and_no_other() -> None:
    page = (ROOT / "docs/reference/environment.md").read_text()
    assert variables(*PRODUCT) - BETWEEN_OURSELVES.keys() == set(VARIABLE.findall(page)) - BETWEEN_OURSELVES.keys()


def test_every_variable_of_tests_and_tools_is_told_to_who_works_on_it() -> None:
    told = (ROOT / "CONTRIBUTING.md").read_text()
    read = {
        name
        for place in TOOLS
        for file in _modules(place)
        for name in re.findall(r"environ(?:\.get\(|\[)\"(MOSAIC_[A-Z0-9_]+)", file.read_text())
    }
    assert {name for name in read - variables(*PRODUCT) if f"`{name}" not in told} == set()


@pytest.mark.parametrize("folder", PLUGINS, ids=lambda folder: folder.name)
def test_a_distribution_is_told_in_the_readme_and_its_dependencies_where_they_are_explained(folder: Path) -> None:
    assert f"| `{folder.name}` |" in (ROOT / "README.md").read_text()
    assert f"| {folder.name} | " in (ROOT / "CONTRIBUTING.md").read_text()


@pytest.mark.parametrize("folder", [ROOT, *PLUGINS], ids=lambda folder: folder.name)
def test_a_connector_type_is_in_the_reference(folder: Path) -> None:
    page = (ROOT / "docs/reference/connectors.md").read_text()
    assert {name for name in of_distribution(folder) if f"## `{name}`" not in page} == set()


@pytest.mark.parametrize("folder", PLUGINS, ids=lambda folder: folder.name)
def test_a_connector_type_is_on_a_page_that_tells_how_to_use_it(folder: Path) -> None:
    if folder.name == "mosaic-sim":
        return  # its connectors are those of the demo, which writes the file itself
    pages = "".join(page.read_text() for kind in GUIDES for page in (ROOT / "docs" / kind).glob("*.md"))
    assert {name for name in of_distribution(folder) if not re.search(rf"(?<![\w-]){name}(?![\w-])", pages)} == set()


def test_every_widget_is_on_the_page_that_tells_how_one_is_chosen() -> None:
    names = (ROOT / "docs/topics/widget-choice.md").read_text().split("The names, and what each shows")[1]
    known = re.findall(r"^    id: '([\w-]+)',\n    title: '([^']+)'", _widgets(), re.MULTILINE)
    told = re.findall(r"^\| `([\w-]+)`[^|]*\| ([^|]+) \|", names, re.MULTILINE)
    assert told == known


def test_the_reasons_of_a_choice_are_in_the_order_of_the_page() -> None:
    chosen = (ROOT / "dashboard/packages/widgets/src/registry/chooseWidget.ts").read_text()
    (fits,) = re.findall(r"FITS = \[([^\]]*)\]", chosen)
    page = (ROOT / "docs/topics/widget-choice.md").read_text().split("| reason |")[1].split("\n\n")[0]
    assert ["possible", *reversed(re.findall(r"^\| `(\w+)`", page, re.MULTILINE))] == re.findall(r"\w+", fits)


def test_as_many_standard_messages_are_told_as_there_are() -> None:
    told = [
        (page.name, int(number))
        for page in sorted(ROOT.glob("docs/**/*.md"))
        for number in re.findall(r"\[(\d+) of them\]\([^)]*messages\.md\)", page.read_text())
    ]
    assert told == [("comparison.md", len(STANDARD_MESSAGES)), ("first-connector.md", len(STANDARD_MESSAGES))]


def _widgets() -> str:
    return (ROOT / "dashboard/packages/widgets/src/widgets.ts").read_text()


@pytest.mark.parametrize(
    ("page", "module", "members"),
    [
        ("python-signatures", mosaic_core, {"DataChannelSendable": ("send_json", "messages"), "Keeper": ("absence",)}),
        (
            "python-operator-signatures",
            mosaic_core.operator,
            {
                "RobotConnection": ("receivable", "await request", "control", "state"),
                "SendableStore": ("send_json", "await wait_arrived"),
            },
        ),
        ("python-testing-signatures", mosaic_core.testing, {"Joined": ("connection", "await another_operator")}),
    ],
)
def test_all_names_are_on_a_page_of_signatures(
    page: str, module: ModuleType, members: dict[str, tuple[str, ...]]
) -> None:
    text = (ROOT / "docs" / "reference" / f"{page}.md").read_text()
    sections = dict(re.findall(r"^## `(\w+)`\n(.*?)(?=^## |\Z)", text, re.MULTILINE | re.DOTALL))
    things = {name: getattr(module, name) for name in module.__all__}
    assert sections.keys() == {name for name, thing in things.items() if getattr(thing, "__name__", "") == name}
    for name, wanted in members.items():
        assert [one for one in wanted if not re.search(rf"^\| `{one}\b", sections[name], re.MULTILINE)] == []
