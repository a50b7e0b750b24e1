"""The drill's eyes: which commands came after a robot had been made safe."""

from __future__ import annotations

import time

import pytest

from mosaic_core.contract.handler import Refused
from mosaic_core.drill.recorder import ActRecorder, is_refusal


def test_a_command_that_a_safe_action_overtook_is_none_that_came_after_it() -> None:
    recorder = ActRecorder()
    recorder.add("command", 1)
    recorder.add("safe", cause="safety.stop")
    recorder.add("command", 2)
    assert [act.value for act in recorder.commands_after_safe("safety.stop")] == [2]
    recorder.add("safe", cause="safety.stop")
    assert recorder.commands_after_safe("safety.stop") == []
    recorder.add("command", 3)
    recorder.add("safe", cause="safety.timeout")
    assert [act.value for act in recorder.commands_after_safe("safety.stop")] == [3]


def test_it_is_calm_when_no_command_is_carried_out_or_has_begun_lately(monkeypatch: pytest.MonkeyPatch) -> None:
    now_s = 100.0
    monkeypatch.setattr(time, "monotonic", lambda: now_s)
    watched = ActRecorder()
    with watched.acting("command"):
        now_s = 101.0
        assert not watched.is_calm(0.5)
        with watched.acting("safe"):
            """A safe action overtakes it."""
        assert watched.is_acting
    assert watched.is_calm(0.5)
    assert not watched.is_calm(1.5)
    with pytest.raises(OSError, match="gone"), watched.acting("command"):
        raise OSError("gone")
    assert not watched.is_acting


def test_what_a_plugin_raises_is_told_with_its_line_and_a_refusal_as_it_is() -> None:
    watched = ActRecorder(lambda error: "lift.py:7 in Lift.make_safe")
    for error in (OSError("gone"), Refused("lift.top", "no higher")):
        with pytest.raises(type(error)), watched.acting("safe"):
            raise error
    broken, refused = (act.cause for act in watched.acts)
    assert broken == "OSError: gone (lift.py:7 in Lift.make_safe)"
    assert is_refusal(refused)
    assert "lift.py" not in refused
