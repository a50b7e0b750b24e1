"""The site is complete, and all that it shows and runs comes from itself."""

from __future__ import annotations

import ast
import importlib
import inspect
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from support.built_site import built_site
from support.page_blocks import blocks

ROOT = Path(__file__).parents[2]
PUBLIC = {
    "mosaic_core": "python-connectors",
    "mosaic_core.messages": "python-messages",
    "mosaic_core.operator": "python-operator",
    "mosaic_core.testing": "python-testing",
    "mosaic_core.contract.checks": "python-checks",
    "mosaic_core.words.finding": "python-checks",
    "mosaic_core.runtime.configuration.hook_calls": "python-checks",
    "mosaic_cmdvel": "python-plugins",
    "mosaic_depth": "python-plugins",
    "mosaic_sensors.laser_scan": "python-plugins",
    "mosaic_sensors.point_cloud": "python-plugins",
}
"""Modules that others import, and the page that describes each."""
OF_OURSELVES = {"mosaic_server.cli", "mosaic_server.switchboard"}
"""Packages that collect names for their own distribution."""
LOADED = re.compile(r'<(?:script|link|img|iframe)\b[^>]*?\b(?:src|href)="(https?:[^"]*)"')


def public_objects() -> Iterator[tuple[str, Any]]:
    for module in PUBLIC:
        for name in importlib.import_module(module).__all__:
            yield f"{module}.{name}", getattr(importlib.import_module(module), name)


def undocumented(name: str, value: Any) -> Iterator[str]:
    """What of a public class or function has no words: itself, or a method or property that it has of its own."""
    if not (inspect.isclass(value) or inspect.isfunction(value)):
        return
    if not value.__doc__:  # those of a base are none
        yield name
    for member, defined in vars(value).items() if inspect.isclass(value) else ():
        is_asked = not member.startswith("_") and (inspect.isroutine(defined) or isinstance(defined, property))
        if is_asked and not inspect.getdoc(getattr(value, member)):
            yield f"{name}.{member}"


def fields_without_words(value: type) -> Iterator[str]:
    """Annotated fields of a class that no string follows."""
    (definition,) = ast.parse(inspect.getsource(value)).body
    assert isinstance(definition, ast.ClassDef)
    for statement, follower in zip(definition.body, [*definition.body[1:], ast.Pass()], strict=True):
        if isinstance(statement, ast.AnnAssign) and isinstance(statement.target, ast.Name):
            has_words = isinstance(follower, ast.Expr) and isinstance(follower.value, ast.Constant)
            if not has_words and not statement.target.id.startswith("_"):
                yield f"{value.__name__}.{statement.target.id}"


@pytest.fixture(scope="module")
def site() -> Path:
    return built_site()


def test_every_package_of_a_plugin_that_lists_its_names_is_public() -> None:
    """Or it is said here that it is not."""
    packages = {
        ".".join(file.parent.relative_to(plugin).parts)
        for plugin in ROOT.glob("plugins/mosaic-*")
        for file in plugin.glob("mosaic_*/**/__init__.py")
        if "\n__all__ = " in file.read_text()
    }
    assert packages == {name for name in PUBLIC if not name.startswith("mosaic_core")} | OF_OURSELVES


def test_every_public_name_has_words() -> None:
    assert [missing for name, value in public_objects() for missing in undocumented(name, value)] == []


def test_every_field_of_the_kit_has_words() -> None:
    kit = importlib.import_module("mosaic_core.testing")
    classes = [value for name in kit.__all__ if inspect.isclass(value := getattr(kit, name))]
    assert [field for value in classes for field in fields_without_words(value)] == []


def test_what_has_no_words_is_found() -> None:
    class Bare:
        def method(self) -> None: ...

    assert list(undocumented("Bare", Bare)) == ["Bare", "Bare.method"]


def test_every_public_name_is_on_its_page(site: Path) -> None:
    for module, page in PUBLIC.items():
        text = (site / "reference" / page / "index.html").read_text()
        headings = set(re.findall(r'id="([\w.]+)"', text))
        assert {f"{module}.{name}" for name in importlib.import_module(module).__all__} <= headings


@pytest.mark.parametrize("page", sorted({one.page for one in blocks("python")}))
def test_what_a_page_imports_from_us_is_in_the_reference(page: str) -> None:
    assert [name for one in blocks("python") if one.page == page for name in not_public(one.text)] == []


def test_an_import_of_what_is_not_in_the_reference_is_found() -> None:
    text = "import mosaic_core.words.limits\nfrom mosaic_core.contract.checks import Check, CHECKS_GROUP\n"
    assert list(not_public(text)) == ["mosaic_core.words.limits", "mosaic_core.contract.checks.CHECKS_GROUP"]


def not_public(text: str) -> Iterator[str]:
    """What of ours a block imports, and no page of the reference describes."""
    pages = "".join(path.read_text() for path in (ROOT / "docs/reference").glob("*.md"))
    described = set(re.findall(r"^::: (\S+)$", pages, re.MULTILINE))
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, ast.Import):
            yield from (one.name for one in node.names if is_ours(one.name) and one.name not in described)
        elif isinstance(node, ast.ImportFrom) and is_ours(node.module or ""):
            names = [one.name for one in node.names]
            module = importlib.import_module(node.module or "") if node.module in described else None
            public = getattr(module, "__all__", vars(module) if module else ())
            yield from (f"{node.module}.{name}" for name in names if name not in public)


def is_ours(module: str) -> bool:
    return module.startswith("mosaic_core")


def test_a_page_that_a_clone_can_not_show_names_the_command_that_builds_it() -> None:
    pages = [path for path in (ROOT / "docs").rglob("*.md") if "\n::: " in path.read_text()]
    assert len(pages) >= len(set(PUBLIC.values()))
    for path in (*pages, ROOT / "README.md"):
        assert "`.venv/bin/nox -s docs`" in path.read_text(), path


def test_every_page_is_on_the_menu() -> None:
    menu = set(re.findall(r'= "([\w/-]+\.md)"', (ROOT / "zensical.toml").read_text())) | {"index.md"}
    assert {str(path.relative_to(ROOT / "docs")) for path in (ROOT / "docs").rglob("*.md")} == menu


def test_every_picture_is_on_a_page(site: Path) -> None:
    told = "".join(path.read_text() for path in (ROOT / "docs").rglob("*.md"))
    assert {path.name for path in (ROOT / "docs/images").iterdir() if path.name not in told} == set()


def test_the_site_has_pages_and_what_they_load_and_no_script_that_makes_them(site: Path) -> None:
    loaded = {".css", ".inv", ".js", ".json", ".png", ".svg", ".webp", ".xml"}
    files = [path for path in site.rglob("*") if path.is_file() and path.name != "LICENSE"]
    assert [str(path.relative_to(site)) for path in files if path.suffix not in loaded | {".html"}] == []


def test_pages_with_diagrams_bring_the_script_that_draws_them_and_no_page_loads_from_others(site: Path) -> None:
    pages = {path: path.read_text() for path in site.rglob("*.html")}
    drawn = [text for text in pages.values() if 'class="mermaid"' in text]
    assert len(drawn) >= 2
    assert all("assets/javascripts/mermaid.js" in text for text in drawn)
    assert {str(path): found for path, text in pages.items() if (found := LOADED.findall(text))} == {}
    assert (site / "assets/javascripts/mermaid.js").stat().st_size > 100_000


def test_the_first_page_shows_the_product_and_leads_three_kinds_of_people_on(site: Path) -> None:
    text = (site / "index.html").read_text()
    for picture in ("demo-light", "demo-dark", "phone-light", "phone-dark"):
        assert f'src="images/{picture}.webp#only-' in text
        assert (site / "images" / f"{picture}.webp").stat().st_size < 100_000
    assert "./dev demo" in re.sub("<[^>]*>", "", text)
    assert text.count('href="tutorial/') >= 4
    assert {"You try it", "You have a robot", "You extend it"} <= set(re.findall(r"<h2[^>]*>([^<]+)", text))
