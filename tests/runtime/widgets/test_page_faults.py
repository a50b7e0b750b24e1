"""What keeps the page from loading a widget's module: told with its line, without a browser."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from mosaic_core.runtime.widgets import page_faults as judge
from mosaic_core.runtime.widgets.page_faults import SHARED, WIDGET_API_VERSION, PageFault, page_faults
from mosaic_core.runtime.widgets.shared_exports import SHARED_EXPORTS

CONTRACT = Path(__file__).parents[3] / "dashboard/packages/app/src/plugins/exportedWidget.ts"
GOOD = "import { createElement } from 'react'\nexport const apiVersion = 1\nexport function ArmPanel() {}\n"


def told(text: str, export: str = "ArmPanel") -> list[tuple[int | None, str]]:
    return [(fault.line, fault.message) for fault in page_faults(text, export)]


@pytest.mark.parametrize(
    "text",
    [
        GOOD,
        "const a=1;function b(){}export{a as apiVersion,b as ArmPanel};",
        "export const apiVersion = 1, ArmPanel = () => null",
        "const all = {}\nexport const { apiVersion, ArmPanel } = all",
        "export const apiVersion = 1\nexport class ArmPanel {}",
    ],
)
def test_a_module_that_the_page_loads_has_no_fault(text: str) -> None:
    assert told(text) == []


@pytest.mark.parametrize(
    "line",
    [
        "import { line } from 'd3'",
        'import*as d3 from"d3"',
        "import 'd3'",
        "export { a } from 'd3'",
        "import{jsx}from'react';import{line}from'd3';const a='x'",
        "import {\n  line,\n} from 'd3'",
    ],
)
def test_a_module_that_the_page_does_not_have_is_told_with_its_line(line: str) -> None:
    fault = (2 + line.count("\n"), "imports 'd3', which the page does not have: build it into the file")
    assert told(f"\n{line}\n{GOOD}") == [fault]


def test_what_only_looks_like_an_import_is_none() -> None:
    lazy = "const later = () => import('d3')\nexport const name = 'd3'\nimport('d3')"
    assert told(f"{lazy}\n// import x from 'd3'\nconst text = `\nsays import x from 'd3'`\n{GOOD}") == []


def test_the_shared_modules_are_those_of_the_dashboard() -> None:
    shared = (CONTRACT.parents[2] / "sharedModules.ts").read_text()
    (listed,) = re.findall(r"SHARED = \[(.*?)\]", shared)
    assert tuple(re.findall(r"'([^']+)'", listed)) == SHARED


def test_the_version_is_that_of_the_dashboard() -> None:
    (version,) = re.findall(r"WIDGET_API_VERSION = (\d+)", CONTRACT.read_text())
    assert int(version) == WIDGET_API_VERSION


def test_a_component_that_is_not_exported_is_told_with_the_one_that_is() -> None:
    text = GOOD.replace("export function ArmPanel() {}", "function ArmPanel() {}\nexport function ArmPannel() {}")
    assert told(text) == [(None, "exports no 'ArmPanel'; did you mean 'ArmPannel'?")]


def test_a_module_without_a_version_is_told_how_to_say_it() -> None:
    assert told("export function ArmPanel() {}") == [(None, "must say `export const apiVersion = 1`")]


@pytest.mark.parametrize(
    ("text", "line"),
    [
        (GOOD.replace("= 1", "= 9"), 2),
        ("function b(){}\nvar ab=9,b2=1;export{ab as apiVersion,b as ArmPanel};", 2),
    ],
)
def test_another_version_is_told_with_its_line(text: str, line: int) -> None:
    assert told(text) == [(line, "is for apiVersion 9, and the dashboard knows 1")]


def test_a_mistake_of_syntax_is_told_with_its_line_and_nothing_else_is() -> None:
    ((line, message),) = told("export const apiVersion = 9\nexport function ArmPannel({ entry ) {}\n")
    assert (line, message) == (2, "has a SyntaxError: Unexpected token ')'")


def test_without_node_the_rest_is_found_all_the_same(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(judge, "_node", lambda: None)
    assert told(GOOD + "}") == []
    assert list(page_faults("export const apiVersion = 2\nexport class ArmPanel {}", "ArmPanel")) == [
        PageFault(1, "is for apiVersion 2, and the dashboard knows 1")
    ]


def test_a_version_that_is_a_text_is_told() -> None:
    text = GOOD.replace("apiVersion = 1", "apiVersion = '1'")
    assert told(text) == [(None, "says its apiVersion as a text: write `export const apiVersion = 1`")]


@pytest.mark.parametrize("name", sorted(SHARED_EXPORTS))
def test_the_names_of_the_pages_libraries_are_those_of_their_sources(name: str) -> None:
    source = CONTRACT.parents[3] / name.removeprefix("@mosaic/") / "src/index.ts"
    text = source.read_text()
    listed = [
        part.strip() for group in re.findall(r"^export \{([^}]*)\}", text, re.MULTILINE) for part in group.split(",")
    ]
    assert {part.split()[-1] for part in listed if part and not part.startswith("type ")} == SHARED_EXPORTS[name]
    assert not re.search(r"^export (?!type\b|\{)", text, re.MULTILINE), "names that no list shows"


@pytest.mark.parametrize(
    ("line", "at", "message"),
    [
        (
            "import { useSibling } from '@mosaic/widgets'",
            2,
            "imports 'useSibling' from '@mosaic/widgets', which has none; did you mean 'useSiblings'?",
        ),
        (
            'import{useSiblings as a,\n  zebra as b}from"@mosaic/widgets"',
            3,
            "imports 'zebra' from '@mosaic/widgets', which has none",
        ),
        ("export { nothing } from '@mosaic/client'", 2, "imports 'nothing' from '@mosaic/client', which has none"),
    ],
)
def test_a_name_that_the_pages_library_does_not_have_is_told_with_its_line(line: str, at: int, message: str) -> None:
    assert told(f"\n{line}\n{GOOD}") == [(at, message)]


def test_a_name_of_the_pages_library_is_no_fault() -> None:
    assert told(f"import x, {{ useSiblings, useLatest as latest, }} from '@mosaic/widgets'\n{GOOD}") == []
    assert told(f"import {{ whatever }} from '@mosaic/protocols'\n{GOOD}")[0][1].startswith("imports '@mosaic/protoc")


@pytest.mark.parametrize("value", ["5", "-0.5", "'panel'", "[Arm]", "true", "null"])
def test_an_export_that_can_be_no_component_is_told(value: str) -> None:
    text = f"export const apiVersion = 1\nexport const ArmPanel = {value}\n"
    assert told(text) == [(None, "exports 'ArmPanel' as a plain value, which is no component")]
