"""`mosaic operator tail` says why nothing comes, and how old a kept message is."""

from __future__ import annotations

from collections.abc import AsyncIterator
from types import SimpleNamespace
from typing import Any

import pytest

from mosaic_core.cli.operator.operator_tail import Tail, failures_told
from mosaic_core.operator.delivery.delivery_watcher import DeliveryWatcher
from mosaic_core.words.control import DeliveryReport, DeliveryRow


@pytest.fixture
def watcher() -> DeliveryWatcher:
    return DeliveryWatcher(lambda message: None)


def says(watcher: DeliveryWatcher, code: str | None, again_s: float | None = None) -> None:
    row = DeliveryRow(label="gauge", failure_code=code, tries_again_in_s=again_s)
    watcher.reported(DeliveryReport(connectors=(DeliveryRow(label="other", failure_code="plugin.failed"), row)))


def test_what_fails_is_told_when_it_begins_when_its_reason_changes_and_when_it_is_over(
    watcher: DeliveryWatcher, capsys: pytest.CaptureFixture[str]
) -> None:
    with failures_told(watcher, "gauge"):
        says(watcher, None)
        assert capsys.readouterr().err == ""
        says(watcher, "plugin.no_device", 3.6)
        says(watcher, "plugin.no_device", 2.6)
        told = capsys.readouterr().err
        assert told.startswith("'gauge' has failed: The connector's device isn't available")
        assert "(plugin.no_device); tried again in 4 s. See that it is there" in told
        assert told.count("\n") == 1
        says(watcher, "plugin.failed")
        assert "(plugin.failed). " in capsys.readouterr().err
        says(watcher, None)
        assert capsys.readouterr().err == "'gauge' is back\n"
    says(watcher, "plugin.failed")
    assert capsys.readouterr().err == ""


class Kept:
    """A store whose robot has kept its last message."""

    async def messages(self) -> AsyncIterator[Any]:
        for age_s, is_latched in ((444.2, True), (0.1, False)):
            info = SimpleNamespace(age_s=age_s, is_latched=is_latched)
            yield SimpleNamespace(info=info, data=b'{"x": 1}')


async def test_a_message_that_the_robot_has_kept_is_marked_with_its_age(capsys: pytest.CaptureFixture[str]) -> None:
    await Tail("robot", "gauge", 2, as_json=False)._listen(Kept())  # type: ignore[arg-type]
    told = capsys.readouterr()
    assert told.err == "the robot has kept this one for 444 s:\n"
    assert told.out == '{"x": 1}\n{"x": 1}\n'
