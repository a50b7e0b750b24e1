"""The whole safety drill on one connector that really acts, as `mosaic safety drill --live` does it."""

from __future__ import annotations

import contextlib
from unittest.mock import patch

from mosaic_core.contract.handler import DataChannelReceivable
from mosaic_core.drill import findings
from mosaic_core.drill.drill import drill
from mosaic_core.drill.findings import DrillFinding
from mosaic_core.laboratory.joining import ConnectorEntry, configured_with
from mosaic_core.runtime.configuration.auto_configurer import Configured

TOLERANCE_S = 10.0
"""How late a busy machine is must not decide."""
TIMEOUT_S = 0.5
"""What happens after a time-out does not depend on how long it was."""
ENDS_IN_SAFETY = ("silence", "disconnect", "leaves", "stop", "stop-on-control", "let-go", "take-over", "not-a-number")
"""Exercises that whatever moves has to pass; none may be skipped."""


async def live_drill(configured: Configured, *, live: bool = True) -> list[DrillFinding]:
    """``configured`` is used up."""
    for connector in configured.connectors:
        for handler in connector.handlers:
            if isinstance(handler, DataChannelReceivable) and handler.timeout_s is not None:
                with contextlib.suppress(AttributeError):  # a property of its class: the drill waits
                    handler.timeout_s = min(handler.timeout_s, TIMEOUT_S)
    with patch.object(findings, "TOLERANCE_S", TOLERANCE_S):
        return [finding async for finding in drill(configured, live=live)]


async def drilled(entry: ConnectorEntry) -> list[DrillFinding]:
    """The findings on a robot with this connector alone."""
    return await live_drill(configured_with([entry]))


def assert_safe(found: list[DrillFinding]) -> None:
    """Nothing failed, and nothing that must be exercised was left out."""
    failed = [
        f"{one.exercise}: {one.measured} instead of {one.limit}; {one.why}" for one in found if one.verdict == "failed"
    ]
    assert not failed, "\n".join(failed)
    passed = {one.exercise for one in found if one.verdict == "passed"}
    assert set(ENDS_IN_SAFETY) <= passed, [one for one in found if one.exercise in ENDS_IN_SAFETY]
