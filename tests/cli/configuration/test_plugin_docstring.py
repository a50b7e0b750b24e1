"""What a connector says of itself is read from its source: the class alone, or the module where that is not enough."""

from __future__ import annotations

from importlib.metadata import EntryPoint
from pathlib import Path

import pytest

from mosaic_core.cli.configuration.connectors_commands import first_docstring_line

BROKEN_BEFORE = "def broken(:\n\n\n"


@pytest.mark.parametrize(
    ("source", "told"),
    [
        ('class One(Base):\n    """First.\n\n    Second."""\n\n\nx = 1\n', "First."),
        ('@final\nclass One(\n    Base,\n):\n    """Of a long head."""\n', "Of a long head."),
        ('class One(Base):\n    """Begins here\nand goes on at the edge."""\n', "Begins here"),
        ('class OneMore:\n    """Another."""\n\n\nclass One:\n    """This."""', "This."),
        (BROKEN_BEFORE + 'class One:\n    """All else is broken."""\n', "All else is broken."),
        ("class One:\n    pass\n", ""),
        ('class Other:\n    """Another."""\n', ""),
        (BROKEN_BEFORE, ""),
    ],
)
def test_the_first_line_of_the_class(source: str, told: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "acme_docstrings.py").write_text(source)
    monkeypatch.syspath_prepend(tmp_path)
    assert first_docstring_line(EntryPoint("one", "acme_docstrings:One", "mosaic.connectors")) == told
