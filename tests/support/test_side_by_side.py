"""The suite's own processes: who gets which tests, and what becomes of those of a process that ends."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

pytestmark = pytest.mark.netlab

SUPPORT = Path(__file__).parent
CONFTEST = f"""
import os, sys
sys.path.insert(0, {str(SUPPORT.parent)!r})
import pytest
from support.side_by_side import SideBySide

def pytest_configure(config):
    config.pluginmanager.register(SideBySide(2))

def noted(name):
    with open(os.environ["NOTES"], "a") as notes:
        notes.write(f"{{name}} {{os.getpid()}}\\n")

@pytest.fixture(scope="module", params=["a"])
def shared(request):
    yield
    noted(f"ended {{request.module.__name__}}")

@pytest.fixture(autouse=True)
def note(request, shared):
    noted(request.node.name)
"""
WAITS_FOR_THE_OTHER = """
import os, time
from pathlib import Path

def test_{name}_first(tmp_path):
    print("said by {name}")
    Path(os.environ["NOTES"]).with_name("{name}").touch()
    while not Path(os.environ["NOTES"]).with_name("{other}").exists():
        time.sleep(0.01)
    (tmp_path / "mine").touch()

def test_{name}_second():
    pass
"""


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "conftest.py").write_text(CONFTEST)
    (tmp_path / "pytest.ini").write_text("[pytest]\n")
    return tmp_path


def told(folder: Path, *words: str) -> tuple[int, str]:
    """Exit code of pytest on the modules there, and what it said."""
    command = [sys.executable, "-m", "pytest", "-p", "no:cacheprovider", *words, str(folder)]
    environment = os.environ | {"PYTEST_DISABLE_PLUGIN_AUTOLOAD": "1", "NOTES": str(folder / "notes")}
    done = subprocess.run(command, env=environment, capture_output=True, text=True, timeout=60)
    return done.returncode, done.stdout + done.stderr


def notes(folder: Path) -> dict[str, str]:
    """Each thing that happened, and in which process."""
    return dict(line.rsplit(" ", 1) for line in (folder / "notes").read_text().splitlines())


def test_two_modules_run_at_the_same_time_and_each_ends_its_fixtures_in_its_own_process(folder: Path) -> None:
    for name, other in ("one", "two"), ("two", "one"):
        (folder / f"test_{name}.py").write_text(WAITS_FOR_THE_OTHER.format(name=name, other=other))
    code, said = told(folder)
    assert code == 0, said
    assert "4 passed" in said
    seen = notes(folder)
    for name in ("one", "two"):
        process = seen[f"test_{name}_first[a]"]
        assert seen[f"test_{name}_second[a]"] == seen[f"ended test_{name}"] == process
    assert seen["ended test_one"] != seen["ended test_two"]


def test_modules_are_imported_in_such_a_network_too_and_each_process_has_one_of_its_own(folder: Path) -> None:
    look = "from pathlib import Path\nfrom conftest import noted\nHERE = Path('/proc/self/ns/net').readlink()\n"
    body = "    noted(f'imported {HERE}')\n    noted(f\"ran {Path('/proc/self/ns/net').readlink()}\")\n"
    (folder / "test_one.py").write_text(f"{look}def test_one():\n{body}")
    code, said = told(folder)
    assert code == 0, said
    (imported,) = {name.split()[1] for name in notes(folder) if name.startswith("imported")}
    (ran,) = {name.split()[1] for name in notes(folder) if name.startswith("ran")}
    assert len({str(Path("/proc/self/ns/net").readlink()), imported, ran}) == 3


def test_a_failure_is_told_with_what_its_test_printed_and_no_other(folder: Path) -> None:
    (folder / "test_good.py").write_text("def test_good():\n    print('of the good one')\n")
    (folder / "test_bad.py").write_text("def test_bad():\n    print('of the bad one')\n    assert 1 == 2\n")
    code, said = told(folder)
    assert code == 1, said
    assert "1 failed, 1 passed" in said
    assert "assert 1 == 2" in said
    assert "of the bad one" in said
    assert "of the good one" not in said


def test_the_test_of_a_process_that_dies_fails_and_another_process_takes_what_it_leaves(folder: Path) -> None:
    dies = "import os\ndef test_before(): pass\ndef test_dies(): os._exit(7)\ndef test_after(): pass\n"
    (folder / "test_dies.py").write_text(dies)
    code, said = told(folder)
    assert code == 1, said
    assert "1 failed, 2 passed" in said
    assert "the process of this test ended with 7" in said
    seen = notes(folder)
    assert seen["test_after[a]"] != seen["test_before[a]"] == seen["test_dies[a]"]


def test_after_so_many_failures_nothing_more_is_handed_out(folder: Path) -> None:
    for number in range(6):
        (folder / f"test_{number}.py").write_text("def test_it(): assert False\n")
    code, said = told(folder, "--maxfail=1")
    assert code == 1, said
    assert "stopping after" in said
    assert len([name for name in notes(folder) if name.startswith("test_it")]) < 6


def test_a_module_that_can_not_be_imported_is_told_and_nothing_runs(folder: Path) -> None:
    (folder / "test_broken.py").write_text("import nothing_of_this_name\n")
    (folder / "test_good.py").write_text("def test_good(): pass\n")
    code, said = told(folder)
    assert code == 2, said
    assert "nothing_of_this_name" in said
    assert not (folder / "notes").exists()
