"""The drill's eyes: which commands came after a robot had been made safe."""

from __future__ import annotations

from mosaic_core.drill.recorder import ActRecorder


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
