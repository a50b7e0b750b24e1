"""Whose code a module is, who imports it, and how it is imported anew."""

from __future__ import annotations

import importlib
import os
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from mosaic_core.runtime.reload.own_modules import ForgottenModules, imported_by, own_modules, touched_by
from mosaic_core.runtime.reload.source_watch import SourceWatch

FILES = {
    "acme_own/__init__.py": "",
    "acme_own/top.py": "from . import middle\nfrom .other import x\nimport json, numpy\n",
    "acme_own/middle.py": "import acme_own.bottom\nVALUE = acme_own.bottom.VALUE\n",
    "acme_own/bottom.py": "VALUE = 1\n",
    "acme_own/other.py": "x = 2\n",
}  # fmt: skip


@pytest.fixture
def package(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    for name, text in FILES.items():
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).write_text(text)
    monkeypatch.syspath_prepend(str(tmp_path))
    importlib.import_module("acme_own.top")
    yield tmp_path / "acme_own"
    for name in [name for name in sys.modules if name.partition(".")[0] == "acme_own"]:
        del sys.modules[name]


def test_own_modules_are_what_a_connector_is_made_of_and_no_library(package: Path) -> None:
    found = own_modules(["acme_own.top"])
    assert {name: file.name for name, file in found.items()} == {
        "acme_own": "__init__.py", "acme_own.top": "top.py", "acme_own.middle": "middle.py",
        "acme_own.bottom": "bottom.py", "acme_own.other": "other.py",
    }  # fmt: skip
    assert imported_by("acme_own.top", found) == {"acme_own", "acme_own.middle", "acme_own.other"}


def test_a_change_touches_who_imports_it(package: Path) -> None:
    modules = own_modules(["acme_own.top"])
    assert touched_by({package / "bottom.py"}, modules) == {"acme_own.bottom", "acme_own.middle", "acme_own.top"}
    assert touched_by({package / "other.py"}, modules) == {"acme_own.other", "acme_own.top"}
    assert touched_by({package / "__init__.py"}, modules) == modules.keys()
    assert touched_by({package / "elsewhere.py"}, modules) == frozenset()


def test_a_forgotten_module_is_read_anew_though_it_was_saved_in_the_same_second(package: Path) -> None:
    file = package / "bottom.py"
    before = file.stat()
    file.write_text("VALUE = 9\n")
    os.utime(file, ns=(before.st_atime_ns, before.st_mtime_ns))
    old = sys.modules["acme_own.middle"]
    forgotten = ForgottenModules(touched_by({file}, own_modules(["acme_own.top"])))
    importlib.import_module("acme_own.top")
    assert sys.modules["acme_own.middle"].VALUE == 9
    forgotten.restore()
    assert sys.modules["acme_own.middle"] is old
    assert sys.modules["acme_own"].middle is old


def test_a_watch_tells_what_is_new_other_or_gone(tmp_path: Path) -> None:
    kept, gone, new = (tmp_path / name for name in ("kept", "gone", "new"))
    for path in (kept, gone):
        path.write_text("1")
    watch = SourceWatch(lambda: tmp_path.iterdir())
    assert watch.changed() == frozenset()
    kept.write_text("22")
    gone.unlink()
    new.write_text("3")
    assert watch.changed() == {kept, gone, new}
    (tmp_path / "another").write_text("4")
    watch.learn()
    assert watch.changed() == frozenset()


def test_what_is_only_written_again_has_not_changed(tmp_path: Path) -> None:
    kept = tmp_path / "kept"
    kept.write_text("1")
    watch = SourceWatch(lambda: tmp_path.iterdir())
    os.utime(kept, (1, 1))
    assert watch.changed() == frozenset()
    kept.write_text("2")
    os.utime(kept, (2, 2))
    assert watch.changed() == {kept}
