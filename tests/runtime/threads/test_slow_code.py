"""Code that hangs before anything runs is named with its line."""

from __future__ import annotations

import logging
import runpy
import threading
from pathlib import Path
from typing import Any

import pytest

from mosaic_core.runtime.threads import slow_code
from mosaic_core.runtime.threads.code_places import explained_error, raised_at

HANGS = """
import threading
def wait(done):
    threading.Event.wait(done)
"""


def loaded(file: Path, text: str) -> dict[str, Any]:
    file.write_text(text)
    return runpy.run_path(str(file))


def test_what_hangs_is_named_with_the_line_of_its_author(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    done = threading.Event()
    monkeypatch.setattr(slow_code, "PATIENCE_S", 0.01)
    caplog.set_level(logging.WARNING, slow_code.__name__)

    def warned(*words: object) -> None:
        logging.getLogger().warning(*words)
        done.set()

    monkeypatch.setattr(slow_code.logger, "warning", warned)
    with slow_code.told_when_slow("the import of 'x'"):
        loaded(tmp_path / "slow.py", HANGS)["wait"](done)
    (told,) = [one.getMessage() for one in caplog.records]
    assert told.startswith("the import of 'x' goes on for 0.01 s already, at ")
    assert f"{tmp_path / 'slow.py'}:4" in told


def test_what_is_quick_is_not_told(monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture) -> None:
    before = threading.active_count()
    with slow_code.told_when_slow("nothing"):
        pass
    for thread in threading.enumerate():
        if isinstance(thread, threading.Timer):
            thread.join()
    assert (caplog.records, threading.active_count()) == ([], before)


def test_a_place_is_the_authors_line_not_that_of_a_library(tmp_path: Path) -> None:
    file = tmp_path / "parse.py"
    names = loaded(file, 'import json\ndef parse():\n    json.loads("{")\n')
    with pytest.raises(ValueError, match="Expecting") as caught:
        names["parse"]()
    assert raised_at(caught.value) == (str(file), 3)
    assert explained_error(caught.value).endswith(f"({file}:3)")


def test_an_error_that_wraps_another_one_is_placed_by_it(tmp_path: Path) -> None:
    file = tmp_path / "stop.py"
    names = loaded(file, "def stop():\n    raise StopIteration\n")
    error = KeyError("x")  # as the framework raises one: none of its lines is the author's
    with pytest.raises(StopIteration) as caught:
        names["stop"]()
    error.__cause__ = caught.value
    assert raised_at(error) == (str(file), 2)


def test_who_wants_to_tell_it_otherwise_does(monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture) -> None:
    done, told = threading.Event(), list[str]()
    monkeypatch.setattr(slow_code, "PATIENCE_S", 0.01)

    def tell(text: str) -> None:
        told.append(text)
        done.set()

    with slow_code.told_when_slow("the import of 'x'", tell):
        done.wait()
    assert (told[0].startswith("the import of 'x' goes on for 0.01 s already"), caplog.records) == (True, [])
