"""The drift of a temperature: asked as a function, and by an operator."""

from __future__ import annotations

from pathlib import Path

import pytest
from acme_workbench.drift import Drift, DriftConfigurer, Watch

from mosaic_core import Refused, Request
from mosaic_core.testing import build, connector, joined


class Warming(Request):
    """A request during which the file gets a degree warmer with every look."""

    def __init__(self, file: Path) -> None:
        super().__init__()
        self.file = file

    def pause(self, seconds: float) -> bool:
        self.file.write_text(str(int(self.file.read_text()) + 1000))
        return self.is_cancelled


@pytest.fixture
def file(tmp_path: Path) -> Path:
    path = tmp_path / "temp"
    path.write_text("40000")
    return path


def test_it_answers_the_lowest_and_the_highest(file: Path) -> None:
    watcher = build(DriftConfigurer, params={"path": str(file)})
    assert watcher.answer(Watch(seconds=30), Warming(file)) == Drift(lowest_c=40, highest_c=50)


def test_a_request_that_is_taken_back_ends_at_once(file: Path) -> None:
    request = Warming(file)
    request.cancel()
    watcher = build(DriftConfigurer, params={"path": str(file)})
    assert watcher.answer(Watch(seconds=30), request) == Drift(lowest_c=40, highest_c=40)


def test_a_thermometer_that_is_gone_is_a_refusal_in_words(tmp_path: Path) -> None:
    with pytest.raises(Refused, match="not there now"):
        build(DriftConfigurer, params={"path": str(tmp_path / "none")}).answer(Watch(seconds=1), Request())


def test_a_thermometer_that_is_made_up_answers_too() -> None:
    drift = build(DriftConfigurer, params={"path": "made-up"}).answer(Watch(seconds=0.01), Request())
    assert 20 <= drift.lowest_c <= drift.highest_c < 25


async def test_an_operator_asks_and_hears_how_far_it_is(file: Path) -> None:
    told: list[dict[str, float]] = []
    async with joined(connector(DriftConfigurer, params={"path": str(file)})) as link:
        answer = await link.connection.request("under_test", {"seconds": 0.5}, on_progress=told.append)
    assert answer == {"lowest_c": 40.0, "highest_c": 40.0}
    assert told[-1]["now_c"] == 40.0
