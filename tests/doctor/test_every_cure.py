"""Every finding that failed or warned says what to do: whatever code it has, whoever found it."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from pathlib import Path

from mosaic_core.words.codes import REASONS
from mosaic_core.words.finding import LAST_CURE, OK, SKIPPED, failed, warned

ROOT = Path(__file__).parents[2]
FOUND_BY_CHECKS = ("config.", "auth.", "signal.", "sdp.", "ice.", "dtls.", "check.")
"""What checks find, and what the errors carry that they pass on."""


def test_no_finding_is_without_a_cure() -> None:
    for code in REASONS:
        for made in (failed, warned):
            assert made("x.y", code).cure, code
            assert made("x.y", code, "What was found.", "").cure, code


def test_what_checks_find_has_a_cure_of_its_own() -> None:
    without = {code for code in REASONS if failed("x.y", code).cure == LAST_CURE}
    assert {code for code in without if code.startswith(FOUND_BY_CHECKS)} == {OK, SKIPPED}
    assert "peer.closed" in without, "no mistake by itself: a connection that a person ends has that code too"


def codes_of_findings() -> Iterator[str]:
    """Every code that is written out in a call of ``failed`` or ``warned``, and in the dashboard's checks."""
    for path in [*ROOT.glob("mosaic_core/**/*.py"), *ROOT.glob("plugins/*/mosaic_*/**/*.py")]:
        for node in ast.walk(ast.parse(path.read_text())):
            if isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id in ("failed", "warned"):
                yield from (str(one.value) for one in node.args[1:2] if isinstance(one, ast.Constant))
    for path in ROOT.glob("dashboard/packages/client/src/diagnosis/*.ts"):
        yield from (code for code in re.findall(r"'([a-z]+\.[a-z0-9_]+)'", path.read_text()) if code in REASONS)


def test_every_code_that_a_check_names_has_a_cure_of_its_own() -> None:
    named = set(codes_of_findings()) - {OK, SKIPPED}
    assert {"ice.turn_silent", "check.slow_path", "check.far_server", "plugin.no_permission"} <= named
    assert not {code for code in named if not REASONS[code].cure}
