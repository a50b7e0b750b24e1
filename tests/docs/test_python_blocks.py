"""Blocks of Python run, and use what the packages have also in functions that wait for a connection or a device.

What they do is the affair of `test_docs.py`, `test_connector_howtos.py` and the tests of what a page is about.
"""

from __future__ import annotations

import re
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from textwrap import indent
from types import ModuleType

import pytest
from support.page_blocks import ROOT, Block, blocks

CACHE = ROOT / ".mypy_cache" / "pages"
SETTINGS = """\
[mypy]
plugins = pydantic.mypy
ignore_missing_imports = True
check_untyped_defs = True
disable_error_code = no-redef, func-returns-value
[mypy-docs_howto_from_aiortc]
disable_error_code = arg-type
"""
"""Pages show several classes of one name, one after the other; the program by aiortc alone is not ours."""
HEAD = "from typing import Any\nfrom mosaic_core.operator import MosaicOperator, RobotConnection, RobotSummary\n"
OF_THE_READER = {
    "README.md": (
        "from collections.abc import Iterator\n"
        "from mosaic_core import DataChannelSendable\n"
        "from mosaic_core.messages import BatteryState\n"
        "open_gauge: Any\n"
    ),
    "docs/howto/requests.md": "operator: MosaicOperator\nrobot: RobotSummary\n",
    "docs/howto/several-handlers.md": "connection: RobotConnection\n",
    "docs/tutorial/drive-safely.md": "connection: RobotConnection\n",
    "plugins/mosaic-camera/README.md": "import numpy as np\nimage = np.zeros((48, 64, 3), np.uint8)\n",
    "plugins/mosaic-cmdvel/README.md": "sdk: Any\nconnect: Any\n",
}
"""What fragments take for granted."""
NOT_RUN = {
    "docs/howto/from-aiortc.md": "needs aiohttp: its connectors are run by test_coming_from_others.py",
    "docs/howto/from-rosbridge.md": "needs ROS 2: test_coming_from_others.py has one that is made up",
    "docs/howto/hooks.md": "is a module and its test: test_hooks_page.py",
    "docs/howto/test-on-bad-networks.md": "tests a connector of the reader's",
}
TEST = re.compile(r"`test_\w+\.py`[^`\n]*:\n\n```python\n$")
ALL = sorted({one.page for one in blocks("python")})


@pytest.mark.parametrize("page", [page for page in ALL if page not in NOT_RUN])
def test_blocks_run_in_their_order(page: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    module = ModuleType("page")
    monkeypatch.setitem(sys.modules, "page", module)  # where dataclasses look for their own
    exec(compile(program_of(page), page, "exec", dont_inherit=True), module.__dict__)  # noqa: S102 - our own documentation


def test_pages_use_what_the_packages_have(tmp_path: Path) -> None:
    """One run of the type checker, with a module for each page."""
    (tmp_path / "mypy.ini").write_text(SETTINGS)
    for page in ALL:
        name = re.sub(r"[^a-z0-9]", "_", page.removesuffix(".md").lower())
        (tmp_path / f"{name}.py").write_text(program_of(page))
    words = ["-m", "mypy", "--config-file", "mypy.ini", "--cache-dir", str(CACHE), "."]
    done = subprocess.run([sys.executable, *words], cwd=tmp_path, capture_output=True, text=True, timeout=110)
    assert done.returncode == 0, done.stdout + done.stderr


def program_of(page: str) -> str:
    return HEAD + OF_THE_READER.get(page, "") + "\n".join(statements_of(page))


def statements_of(page: str) -> Iterator[str]:
    """Its blocks but for files of tests, which other tests run; inside a function where they await outside of one."""
    lines = (ROOT / page).read_text().splitlines(keepends=True)
    for block in (one for one in blocks("python") if one.page == page):
        if not TEST.search("".join(lines[: block.line - 1])):
            is_bare = not awaits(block)
            yield block.text if is_bare else f"async def line_{block.line}() -> None:\n{indent(block.text, '    ')}"


def awaits(block: Block) -> bool:
    """Whether it is none of Python's modules as it stands, but a part of a coroutine."""
    try:
        compile(block.text, block.place, "exec")
    except SyntaxError:
        return True
    return False
