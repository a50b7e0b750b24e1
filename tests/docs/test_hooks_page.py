"""The plugin of hooks on its page works, and so does its test."""

from __future__ import annotations

import re
import sys
import threading
import types
from pathlib import Path

import pytest

from mosaic_core.machines.timing.backoff import BackoffPolicy
from mosaic_core.machines.timing.failure_course import ABSENCE_POLICY, ERROR_POLICY
from mosaic_core.runtime.configuration.mistakes.hook_slips import HOOKS

DOCS = Path(__file__).parents[2] / "docs"
PAGE = DOCS / "howto" / "hooks.md"


async def test_the_plugin_of_the_page_passes_the_test_of_the_page(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    plugin, test = re.findall(r"^```python\n(.*?)^```", PAGE.read_text(), re.MULTILINE | re.DOTALL)
    modules = types.ModuleType("acme_diary"), types.ModuleType("test_acme_diary")
    for module, text in zip(modules, (plugin, test), strict=True):
        monkeypatch.setitem(sys.modules, module.__name__, module)
        exec(compile(text, PAGE.name, "exec", dont_inherit=True), module.__dict__)  # noqa: S102 - our own documentation
    await modules[1].test_the_diary_tells_who_came_and_what_failed(tmp_path)
    assert not any(one.name == "acme-diary" for one in threading.enumerate())


def test_every_hook_says_what_it_is_called_for() -> None:
    assert HOOKS
    assert [name for name, hook in HOOKS.items() if not (hook.__doc__ or "").strip()] == []


@pytest.mark.parametrize(("policy", "row"), [(ABSENCE_POLICY, "`DeviceGone`"), (ERROR_POLICY, "any other exception")])
def test_the_pauses_on_the_page_are_those_of_the_code(policy: BackoffPolicy, row: str) -> None:
    text = (DOCS / "topics" / "back-off.md").read_text()
    line = next(line for line in text.splitlines() if line.startswith(f"| {row}"))
    assert f"| {policy.first_s:g} s | {policy.max_s:g} s |" in line
    assert f"ran for {policy.stable_s:g} s" in text
    assert f"up to {policy.jitter:.0%}".replace("%", " %") in text
