"""The pages for authors of connectors are true: their files are written down as they say, and their tests pass."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
PAGES = ("test-your-connector", "numpy-camera", "event-driven", "async-bodies", "depth-cameras", "driven-device")
NAMED = re.compile(r"`(?:connectors/)?(\w+\.py)`[^`\n]*:\n\n```python\n(.*?)^```", re.MULTILINE | re.DOTALL)
CODE = re.compile(r"^```python\n(.*?)^```", re.MULTILINE | re.DOTALL)


def files_of(page: str) -> dict[str, str]:
    return dict(NAMED.findall((ROOT / "docs" / "howto" / f"{page}.md").read_text()))


@pytest.mark.parametrize("page", PAGES)
def test_every_block_is_a_named_file(page: str) -> None:
    blocks = CODE.findall((ROOT / "docs" / "howto" / f"{page}.md").read_text())
    assert sorted(blocks) == sorted(files_of(page).values())


@pytest.mark.webrtc
@pytest.mark.timeout(300)
def test_all_tests_of_the_pages_pass(tmp_path: Path) -> None:
    for page in PAGES:
        for name, text in files_of(page).items():
            assert not (tmp_path / name).exists() or (tmp_path / name).read_text() == text, f"two files {name}"
            (tmp_path / name).write_text(text)
    options = ["-q", "-p", "no:cacheprovider", "-o", "anyio_mode=auto", "-o", "pythonpath=.", "--rootdir", tmp_path]
    command = [sys.executable, "-m", "pytest", *map(str, options), str(tmp_path)]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, timeout=280)
    assert done.returncode == 0, done.stdout + done.stderr
    assert len(list(tmp_path.glob("test_*.py"))) >= 12
