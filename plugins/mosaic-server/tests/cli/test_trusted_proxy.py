"""What `--trusted-proxy` and the bounds of one address take on the command line."""

from __future__ import annotations

from pathlib import Path

import pytest
from typer.testing import CliRunner

from mosaic_server.cli import app


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (["--trusted-proxy", "*"], "--trusted-proxy: '*' is no address: write for example 127.0.0.1 or 10.0.0.0/8"),
        (["--trusted-proxy", "10.1.2.3/8"], "is an address inside of a network: write 10.0.0.0/8"),
        (["--proxy-header", "x-real-ip"], "--proxy-header"),
        (["--connections-per-address", "1"], "--connections-per-address"),
        (["--requests-per-second", "0"], "--requests-per-second"),
    ],
)
def test_the_server_does_not_start_with_a_wrong_bound_and_says_why(tmp_path: Path, words: list[str], told: str) -> None:
    done = CliRunner().invoke(app, ["run", "--data-dir", str(tmp_path), *words], terminal_width=200)
    assert done.exit_code == 2
    assert told in " ".join(done.output.split())
