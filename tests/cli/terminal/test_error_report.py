"""A line of somebody's file that is shown with its mistake tells no secret, and where a secret comes from."""

from __future__ import annotations

from pathlib import Path

import pytest
import yaml
from hypothesis import given
from hypothesis import strategies as st

from mosaic_core.cli.terminal.error_report import _line_of
from mosaic_core.words.errors import Problem


def shown(folder: Path, line: str) -> str | None:
    file = folder / "mosaic_config.yaml"
    file.write_text(line)
    return _line_of(Problem("wrong", file=str(file), line=1))


@pytest.mark.parametrize(
    ("line", "said"),
    [
        ("  token: abc def # mine", "  token: ***"),
        ("  password: a,b}c", "  password: ***"),
        ("{ token: abc, password: \"x y\", z: 1 }", "{ token: ***, password: ***, z: 1 }"),
        ("{ token: 'it s', b: 2 }", "{ token: ***, b: 2 }"),
        ("{ token: ${A}b, c: 1 }", "{ token: ***, c: 1 }"),
        ("{token: \"unterminated", "{token: ***"),
        ("[{api_key: abc}]", "[{api_key: ***}]"),
    ],
)  # fmt: skip
def test_a_secret_is_hidden_and_what_stands_beside_it_is_not(tmp_path: Path, line: str, said: str) -> None:
    assert shown(tmp_path, line) == said


@pytest.mark.parametrize(
    "line", ['params: { token: "${MOSAIC_TOKEN}" }', "  token: ${T}", "  token:", "  secret: {a: 1}", "  tokens: 5"]
)
def test_what_is_no_secret_is_shown(tmp_path: Path, line: str) -> None:
    assert shown(tmp_path, line) == line


@given(secret=st.text(st.characters(min_codepoint=33, max_codepoint=126), min_size=6), as_flow=st.booleans())
def test_nothing_of_a_secret_is_shown_however_it_is_written(
    secret: str, as_flow: bool, tmp_path_factory: pytest.TempPathFactory
) -> None:
    tree = {"token": f"{secret} {secret}"}
    line = yaml.safe_dump([tree] if as_flow else tree, default_flow_style=as_flow, width=10_000).strip()
    text = shown(tmp_path_factory.mktemp("secret"), line)
    assert text is not None
    assert text.replace("***", "").strip("[]{} ") in ("token:", "")
