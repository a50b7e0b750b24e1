"""The log of a handler that fails: a device that is gone is one quiet line, an error names the plugin's own line."""

from __future__ import annotations

import json
import logging
from collections.abc import Callable
from pathlib import Path

import pytest

from mosaic_core import DataChannelSendable, DeviceGone, Params
from mosaic_core.machines.timing.backoff import BackoffPolicy
from mosaic_core.machines.timing.failure_course import FailureCourse
from mosaic_core.runtime.threads.code_places import explained_error
from mosaic_core.runtime.threads.failures import Failures
from mosaic_core.runtime.threads.stacks import PluginCode

SURE = BackoffPolicy(first_s=8.0, max_s=8.0, jitter=0.0)


class Gauge(DataChannelSendable[str]):
    def reads(self) -> None:
        json.loads("{")


def raised(action: Callable[[], object]) -> Exception:
    try:
        action()
    except Exception as error:  # noqa: BLE001 - just that is wanted
        return error
    raise AssertionError("nothing was raised")


@pytest.fixture
def failures(caplog: pytest.LogCaptureFixture) -> Failures:
    caplog.set_level(logging.INFO, "mosaic_core")
    return Failures("gauge", lambda *failure: None, FailureCourse(SURE, SURE), PluginCode((Gauge("gauge"),)))


class Speechless(DeviceGone):
    def __str__(self) -> str:
        raise KeyError("words")


def test_an_error_that_cannot_say_what_happened_is_told_and_tried_again(failures: Failures) -> None:
    said = "it can't say what happened, for its __str__ raises KeyError"
    assert failures.failed(Speechless("gone"), 0.0) == 8.0
    assert failures.last_error == said
    odd = type("Odd", (ValueError,), {"__str__": Speechless.__str__})
    assert failures.failed(odd(), 0.0) == 8.0
    assert failures.last_error == f"Odd: {said}"
    assert explained_error(odd()) == f"Odd: {said}"


def test_a_device_that_is_gone_is_one_line_until_its_reason_changes_or_it_is_back(
    failures: Failures, caplog: pytest.LogCaptureFixture
) -> None:
    for words in ("no gauge at /dev/x", "no gauge at /dev/x", "it is busy"):
        failures.failed(DeviceGone(words), 0.0)
    failures.alive()
    failures.failed(DeviceGone("it is busy"), 0.0)
    assert [(record.levelname, record.message, record.exc_info) for record in caplog.records] == [
        ("WARNING", "connector 'gauge': no gauge at /dev/x (plugin.no_device); tries again in 8.0 s", None),
        ("WARNING", "connector 'gauge': it is busy (plugin.no_device); tries again in 8.0 s", None),
        ("WARNING", "connector 'gauge' is back", None),
        ("WARNING", "connector 'gauge': it is busy (plugin.no_device); tries again in 8.0 s", None),
    ]


def test_an_error_of_the_system_names_what_is_quiet(failures: Failures, caplog: pytest.LogCaptureFixture) -> None:
    failures.failed(raised(Path("/nowhere/at/all").read_text), 0.0)
    assert "No such file or directory: '/nowhere/at/all'; if its device may be away, raise DeviceGone" in caplog.text
    assert "DeviceGone" not in failures.last_error


def test_what_the_framework_raises_with_the_authors_line_has_no_traceback(
    failures: Failures, caplog: pytest.LogCaptureFixture
) -> None:
    failures.failed(raised(lambda: Gauge("gauge").send(5)), 0.0)
    (record,) = caplog.records
    assert f"Gauge ({__file__}:" in record.message
    assert record.exc_info is None


def test_an_error_is_logged_once_with_the_plugins_own_line_and_its_traceback(
    failures: Failures, caplog: pytest.LogCaptureFixture
) -> None:
    for _ in range(3):
        failures.failed(raised(Gauge("gauge").reads), 0.0)
    (record,) = caplog.records
    line = Gauge.reads.__code__.co_firstlineno + 1
    assert (record.levelname, record.exc_info is not None) == ("ERROR", True)
    assert record.message.startswith(f"connector 'gauge' failed at {__file__}:{line} in Gauge.reads: JSONDecodeError: ")


def test_an_error_without_a_line_of_anybody_elses_is_told_without_one(
    failures: Failures, caplog: pytest.LogCaptureFixture
) -> None:
    failures.failed(ValueError("so"), 0.0)
    assert caplog.records[0].message == "connector 'gauge' failed: ValueError: so (plugin.failed); tries again in 8.0 s"


def test_when_it_tries_again_is_known_until_it_works(failures: Failures) -> None:
    assert failures.tries_again_in_s is None
    failures.failed(DeviceGone("no gauge", "plug it in"), 0.0)
    assert failures.tries_again_in_s == pytest.approx(8.0, abs=1.0)
    assert (failures.last_code, failures.last_error) == ("plugin.no_device", "no gauge; plug it in")
    failures.alive()
    assert failures.tries_again_in_s is None


class Reading(Params):
    period_s: float = 1.0


class Misspelt(DataChannelSendable[str]):
    params = Reading()

    def of_itself(self) -> None:
        self.parms  # type: ignore[attr-defined]  # noqa: B018

    def of_waiting(self) -> None:
        self.evry(0.1)  # type: ignore[attr-defined]

    def of_params(self) -> None:
        self.params.perod_s  # type: ignore[attr-defined]  # noqa: B018

    def like_nothing(self) -> None:
        self.zzz  # type: ignore[attr-defined]  # noqa: B018


@pytest.mark.parametrize(
    ("method", "ending"),
    [
        ("of_itself", "'parms'; did you mean 'params'?"),
        ("of_waiting", "'evry'; did you mean 'every'?"),
        ("of_params", "'perod_s'; did you mean 'period_s'?"),
        ("like_nothing", "'zzz'"),
    ],
)
def test_a_misspelt_attribute_is_told_with_the_name_that_there_is(
    failures: Failures, caplog: pytest.LogCaptureFixture, method: str, ending: str
) -> None:
    error = raised(getattr(Misspelt("it"), method))
    failures.failed(error, 0.0)
    assert f"{ending} (plugin.failed)" in caplog.records[0].message
    assert failures.last_error.endswith(ending)
    assert f"{ending} ({__file__}:" in explained_error(error)


def test_a_device_that_comes_and_goes_is_told_twice_and_that_it_stays_once(
    failures: Failures, caplog: pytest.LogCaptureFixture, monkeypatch: pytest.MonkeyPatch
) -> None:
    now_s = [100.0]
    monkeypatch.setattr("mosaic_core.runtime.threads.failures.time.monotonic", lambda: now_s[0])
    for _ in range(5):
        failures.failed(DeviceGone("no gauge"), 0.1)
        failures.alive()
    for passed_s in (0.1, 20.0, 0.1):
        now_s[0] += passed_s
        failures.alive()
    gone = "connector 'gauge': no gauge (plugin.no_device); tries again in 8.0 s"
    back = "connector 'gauge' is back"
    told = [record.message for record in caplog.records if record.levelname != "DEBUG"]
    assert told == [gone, back, gone, back]


def test_a_kept_device_is_told_each_time(failures: Failures, caplog: pytest.LogCaptureFixture) -> None:
    for _ in range(3):
        failures.away(DeviceGone("no gauge"), 0.5)
        failures.is_back()
    gone, back = "connector 'gauge': no gauge (plugin.no_device); tries again in 0.5 s", "connector 'gauge' is back"
    assert [record.message for record in caplog.records] == [gone, back] * 3
