"""The documentation is true: its files validate, its code runs, and the reference is current."""

from __future__ import annotations

import os
import re
import subprocess
import sys
import tty
import types
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from support.page_blocks import PAGES, ROOT, blocks
from typer.testing import CliRunner

from mosaic_core import Configurer, DataChannelReceivable, DeviceGone, MosaicError, Shared
from mosaic_core.cli.main import app
from mosaic_core.contract.media_tap import TappedImage
from mosaic_core.runtime.configuration.catalogue_entry import catalogue_entries
from mosaic_core.testing import build, collect, fake_host, take_frames

LOCAL_FILE = re.compile(
    r"^(?:`(?P<said>connectors/\w+\.py)`:\n\n```python|```python title=\"(?P<title>connectors/\w+\.py)\")\n"
    r"(?P<text>.*?)^```",
    re.MULTILINE | re.DOTALL,
)
"""A connector beside the YAML files of its page."""


def texts(language: str) -> list[tuple[str, str]]:
    """Pages and blocks, but for files of the C++ library, at which `test_coming_from_others.py` looks."""
    return [(one.page, one.text) for one in blocks(language) if not one.title.endswith(", C++")]


def test_the_reference_is_current() -> None:
    words = [sys.executable, str(ROOT / "docs" / "generate_reference.py"), "--check"]
    done = subprocess.run(words, capture_output=True, text=True)
    assert done.returncode == 0, done.stdout + done.stderr


def robot_files() -> Iterator[tuple[str, dict[str, Any]]]:
    """Whole files as they are; a bare list of connectors as the file's `connectors`. Other YAML is not a robot's, and
    an example's has connectors that are not installed: its own test does it."""
    for page, text in texts("yaml"):
        document = yaml.safe_load(text)
        if isinstance(document, list):
            document = {"connectors": document}
        if ("connectors" in document or "server" in document) and not page.startswith("examples/"):
            yield page, document


@pytest.mark.parametrize(("page", "document"), list(robot_files()))
@pytest.mark.usefixtures("ros")
def test_every_yaml_block_is_valid(page: str, document: dict[str, Any], tmp_path: Path) -> None:
    auth = {"type": "no-authorization", "robot_id": "7d1c2f6e-0b52-4c1e-9a53-2f6f1f0c9b11"}
    document.setdefault("server", {"ws_url": "ws://127.0.0.1:9001", "auth": auth})
    config = tmp_path / "mosaic_config.yaml"
    config.write_text(yaml.safe_dump(document, sort_keys=False))
    for found in LOCAL_FILE.finditer((ROOT / page).read_text()):
        path = tmp_path / (found["said"] or found["title"])
        path.parent.mkdir(exist_ok=True)
        path.write_text(found["text"])
    done = CliRunner().invoke(app, ["validate", str(config), "--allow-missing-env", "--local-connectors"])
    assert done.exit_code == 0, f"{page}: {done.output}"


def test_the_code_of_the_connector_tutorial_runs() -> None:
    namespace = types.ModuleType("tutorial").__dict__
    found = [text for page, text in texts("python") if page == "docs/tutorial/first-connector.md"]
    assert len(found) >= 2
    for text in found:
        exec(compile(text, "first-connector.md", "exec", dont_inherit=True), namespace)  # noqa: S102 - our own documentation
    configurer = namespace["ThermometerConfigurer"]
    assert issubclass(configurer, Configurer)
    assert configurer("cpu", configurer.params_model()).configure().label == "cpu"
    assert issubclass(namespace["LampReceiver"], DataChannelReceivable)

    meter = build(namespace["LightMeterConfigurer"], params={"camera": "front"})
    host = fake_host(meter)
    host.tapped_images["front"] = [TappedImage(np.full((4, 6, 3), 80, np.uint8), 0.0)]
    assert collect(meter, count=1) == [namespace["Brightness"](mean=80.0)]


def run_blocks(page: str) -> dict[str, Any]:
    """What the Python blocks of a page define; those that need a connection are type-checked, elsewhere."""
    namespace = types.ModuleType("howto").__dict__
    for text in (text for found, text in texts("python") if found == page and "await " not in text):
        exec(compile(text, page, "exec", dont_inherit=True), namespace)  # noqa: S102 - our own documentation
    return namespace


def test_the_arm_of_the_howto_keeps_its_limits() -> None:
    """Its last block asserts it."""
    assert run_blocks("docs/howto/arm-safety.md")["fed"].accepted


def test_the_handlers_of_the_howto_are_three_channels() -> None:
    made = build(run_blocks("docs/howto/several-handlers.md")["PickerConfigurer"], label="picker")
    entries = catalogue_entries("picker", "picker", made)
    assert [one.label for one in entries] == ["picker", "picker_joints", "picker_grip"]


def test_the_head_of_the_howto_has_two_eyes() -> None:
    left, right, _ = build(run_blocks("docs/howto/several-handlers.md")["HeadConfigurer"], label="head")
    assert [int(take_frames(eye, 1)[0].mean()) for eye in (left, right)] == [60, 200]


def test_the_shared_board_of_the_howto_is_opened_anew_after_it_vanished(tmp_path: Path) -> None:
    configurer, port, shared = (
        run_blocks("docs/howto/several-handlers.md")["BoardConfigurer"],
        tmp_path / "port",
        Shared(),
    )
    made = build(configurer, label="board", params={"port": str(port)}, shared=shared)
    button, lamp = made
    assert button.board is lamp.board
    with shared.entered():
        for answer in (b"1\n", b"0\n"):
            with pytest.raises(DeviceGone, match="no board on"):
                button.board.ask("button?")
            board, line = os.openpty()
            tty.setraw(line)
            port.symlink_to(os.ttyname(line))
            os.write(board, answer)
            assert next(button.messages()).is_pressed == (answer == b"1\n")
            os.close(line)
            os.close(board)  # it is pulled out
            port.unlink()


def test_two_connectors_that_differ_about_the_board_of_the_howto_are_told_as_the_page_says() -> None:
    configurer, shared = run_blocks("docs/howto/several-handlers.md")["BoardConfigurer"], Shared()
    build(configurer, label="board", shared=shared)
    with pytest.raises(MosaicError) as caught:
        build(configurer, label="spare", params={"resets": True}, shared=shared)
    assert f"```text\n{caught.value}\n```" in (ROOT / "docs/howto/several-handlers.md").read_text()


@pytest.mark.parametrize("page", [*PAGES, ROOT / "CONTRIBUTING.md"], ids=lambda page: str(page.relative_to(ROOT)))
def test_every_link_to_a_file_leads_somewhere(page: Path) -> None:
    """Inside `docs/` the build of the site looks at the places on pages, too; it takes a dead one for a mistake."""
    for target, place in re.findall(r"(?:\]\(|src(?:set)?=\")([^)#\"\s]*)(?:#([^)\"\s]*))?[)\"]", page.read_text()):
        if ":" in target:
            continue
        file = page.parent / target if target else page
        assert file.exists(), f"{page.name} links to {target}"
        if place and file.suffix == ".md" and page.parent == ROOT:
            assert place in headings(file), f"{page.name} links to {target}#{place}"


def headings(page: Path) -> set[str]:
    """As anchors."""
    found = re.findall(r"^#+ (.+)$", page.read_text(), re.MULTILINE)
    return {re.sub(r"[^\w -]", "", heading).strip().lower().replace(" ", "-") for heading in found}


def test_the_page_on_own_pages_shows_the_example_as_it_is() -> None:
    page = (ROOT / "docs" / "howto" / "own-page.md").read_text()
    assert f"```tsx\n{(ROOT / 'examples/own-page/src/main.tsx').read_text()}```" in page
