"""Blocks of TypeScript are types that the packages have, and those of data and settings can be read.

Python's are run by `test_python_blocks.py`, those of shells by `test_shell_blocks.py`.
"""

from __future__ import annotations

import json
import re
import shutil
import subprocess
import tomllib
from collections import Counter
from configparser import ConfigParser
from pathlib import Path

import pytest
from support.page_blocks import ROOT, Block, blocks

DASHBOARD = ROOT / "dashboard"
GENERATED = ("docs/reference/library.md", "docs/reference/library-protocol.md")
"""Declarations that were drawn from the packages themselves."""
OF_THE_READER = """\
declare const robotId: string
declare const video: HTMLVideoElement
declare function show(value: unknown): void
"""
"""What fragments take for granted."""
PATHS = json.loads((DASHBOARD / "tsconfig.json").read_text())["compilerOptions"]["paths"]
OF_THE_APP = {"@vitejs/plugin-react": ["./packages/app/node_modules/@vitejs/plugin-react/dist/index.d.ts"]}
"""What no other package has."""
TSCONFIG = {
    "extends": str(DASHBOARD / "tsconfig.json"),
    "compilerOptions": {
        "allowJs": True,
        "checkJs": False,
        "noUnusedLocals": False,
        "paths": {name: [str(DASHBOARD / path) for path in paths] for name, paths in (PATHS | OF_THE_APP).items()},
    },
    "include": ["**/*"],
}
LANGUAGES = {"bash", "console", "python", "yaml", "ts", "tsx", "js", "json", "toml", "ini", "mermaid"}
NOT_READ = {"text": "is for people", "cpp": "needs the C++ library: docs/howto/from-mosaic-cpp.md puts it beside ours"}
GROUPS = re.compile(r"\"(mosaic\.\w+)\"")
UNIT = "[Unit]\nDescription=robot\n[Service]\nExecStart=/bin/true\n"


def test_every_language_is_looked_at_or_it_is_said_why_not() -> None:
    assert {one.language for one in blocks()} == LANGUAGES | NOT_READ.keys()


@pytest.mark.timeout(300)
def test_the_packages_have_what_pages_use_of_them(tmp_path: Path) -> None:
    """One run of the compiler: titled blocks are the files of one page, others stand for themselves."""
    (tmp_path / "node_modules").symlink_to(DASHBOARD / "node_modules")
    (tmp_path / "tsconfig.json").write_text(json.dumps(TSCONFIG))
    (tmp_path / "reader.d.ts").write_text(OF_THE_READER)
    written = Counter(_write(one, tmp_path) for one in blocks("ts", "tsx", "js") if one.page not in GENERATED)
    assert max(written.values()) == 1, written
    words = ["node", str(DASHBOARD / "node_modules" / "typescript" / "bin" / "tsc"), "--noEmit", "--project", "."]
    done = subprocess.run(words, cwd=tmp_path, capture_output=True, text=True, timeout=280)
    assert done.returncode == 0, done.stdout + done.stderr


def _write(block: Block, folder: Path) -> str:
    """As a file of its page, or with the number of its line for a name; where."""
    is_file = re.fullmatch(r"[\w./-]+\.\w+", block.title) is not None
    name = block.title if is_file else f"line{block.line}.{block.language}"
    path = folder / block.page.removesuffix(".md") / name
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(block.text)
    return str(path)


@pytest.mark.parametrize("block", blocks("json"), ids=lambda block: block.place)
def test_json_can_be_read(block: Block) -> None:
    json.loads(block.text)


@pytest.mark.parametrize("block", blocks("toml"), ids=lambda block: block.place)
def test_toml_can_be_read_and_entry_points_are_of_groups_that_are_looked_at(block: Block) -> None:
    table = tomllib.loads(block.text)
    ours = [
        tomllib.loads(path.read_text()) for path in (ROOT / "pyproject.toml", *ROOT.glob("plugins/*/pyproject.toml"))
    ]
    known = {group for one in ours for group in one["project"].get("entry-points", {})} | _named_in_the_core()
    assert table.get("project", {}).get("entry-points", {}).keys() <= known


def _named_in_the_core() -> set[str]:
    """Groups for which the core looks."""
    return {name for path in (ROOT / "mosaic_core").rglob("*.py") for name in GROUPS.findall(path.read_text())}


@pytest.mark.parametrize("block", blocks("ini"), ids=lambda block: block.place)
def test_settings_can_be_read_and_systemd_has_nothing_against_its_own(block: Block, tmp_path: Path) -> None:
    if "[Service]" not in block.text:
        ConfigParser(strict=False, allow_no_value=True, interpolation=None).read_string(f"[all]\n{block.text}")
        return
    if shutil.which("systemd-analyze") is None:
        pytest.skip("needs systemd-analyze")
    unit = tmp_path / "robot.service"
    unit.write_text(block.text if "ExecStart=" in block.text else UNIT + block.text)
    done = subprocess.run(["systemd-analyze", "verify", str(unit)], capture_output=True, text=True, timeout=20)
    assert (done.returncode, done.stderr.strip()) == (0, "")
