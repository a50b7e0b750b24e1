"""What `./dev` installs is locked: each version with its hashes, for every Python and machine, nothing of strangers."""

from __future__ import annotations

import itertools
import re
from collections.abc import Iterator

import pytest
from packaging.requirements import Requirement

from release.lock import BOUNDED_BY, NOT_A_PIN
from release.requirements import LOCKS, SETS, name_of, own_names, wanted
from release.wheels import BUILT, MACHINES, PYTHONS, missing_wheels

PIN = re.compile(r"^([\w.-]+)==(\S+?)(?: ; (.+?))? \\\n((?: {4}--hash=sha256:[0-9a-f]{64}(?: \\)?\n)+)", re.MULTILINE)
KINDS = list(itertools.product(PYTHONS, MACHINES))
MEND = "`.venv/bin/nox -s lock` renews the lock files"


def text_of(lock: str) -> str:
    return (LOCKS / f"{lock}.txt").read_text()


def pins(lock: str) -> Iterator[tuple[str, Requirement]]:
    """Each pin by the name of its package, with its marker."""
    for name, version, marker, _ in PIN.findall(text_of(lock)):
        yield name, Requirement(f"{name}=={version}" + (f" ; {marker}" if marker else ""))


@pytest.mark.parametrize("lock", SETS)
def test_a_lock_file_has_nothing_but_pins_with_hashes(lock: str) -> None:
    rest = PIN.sub("", text_of(lock))
    options = [line for line in rest.splitlines() if line and not line.startswith("#")]
    assert options[0] == "--only-binary :all:"
    assert set(options[1:]) <= {f"--no-binary {name}" for name in BUILT}, MEND


@pytest.mark.parametrize("lock", SETS)
def test_a_lock_file_names_no_place_to_fetch_from(lock: str) -> None:
    assert not re.search(r"://|index-url|find-links|@ ", text_of(lock))


@pytest.mark.parametrize("lock", SETS)
def test_nothing_of_our_own_is_looked_up(lock: str) -> None:
    assert not {name for name, _ in pins(lock)} & own_names()
    assert not {name_of(line) for line in wanted(lock)} & own_names()


@pytest.mark.parametrize("lock", SETS)
def test_the_lock_files_have_what_the_pyprojects_ask_for(lock: str) -> None:
    locked, missing = list(pins(lock)), set()
    for line, (python, machine) in itertools.product(wanted(lock), KINDS):
        asked, environment = Requirement(line), machine.environment(python)
        if asked.marker and not asked.marker.evaluate(environment):
            continue
        here = [
            pin
            for name, pin in locked
            if name == name_of(line) and (not pin.marker or pin.marker.evaluate(environment))
        ]
        versions = [next(iter(pin.specifier)).version for pin in here]
        if len(versions) != 1 or versions[0] not in asked.specifier:
            missing.add(f"{line}: locks/{lock}.txt has {versions or 'nothing'}")
    assert not missing, MEND


@pytest.mark.parametrize("lock", [lock for lock, bound in BOUNDED_BY.items() if bound])
def test_what_is_in_two_lock_files_has_one_version(lock: str) -> None:
    bound = {(name, str(pin.marker or "")): str(pin.specifier) for name, pin in pins(BOUNDED_BY[lock])}
    both = {key: str(pin.specifier) for name, pin in pins(lock) if (key := (name, str(pin.marker or ""))) in bound}
    assert both == {key: bound[key] for key in both}, MEND


def test_what_git_leaves_of_a_conflict_is_read_as_pins() -> None:
    ours, theirs = "a==1 \\\n    --hash=sha256:0\n", "a==2 \\\n    --hash=sha256:1\n"
    torn = f"# Written\n--only-binary :all:\n<<<<<<< HEAD\n{ours}=======\n{theirs}>>>>>>> theirs\n"
    assert NOT_A_PIN.sub("", torn) == ours + theirs


def pylock(*wheels: str, marker: str = "") -> str:
    files = ", ".join(f'{{ url = "place/{wheel}", hashes = {{}} }}' for wheel in wheels)
    line = f'marker = "{marker}"\n' if marker else ""
    return f'[[packages]]\nname = "one"\nversion = "1"\n{line}wheels = [{files}]\n'


def test_a_pure_wheel_is_there_for_everybody() -> None:
    assert list(missing_wheels(pylock("one-1-py3-none-any.whl"))) == []


def test_a_missing_wheel_is_told_with_its_python_and_machine() -> None:
    wheels = ["one-1-cp311-abi3-manylinux_2_28_x86_64.whl", "one-1-cp311-abi3-manylinux2014_aarch64.whl"]
    found = list(missing_wheels(pylock(*wheels)))
    assert found == [f"one 1 on Python 3.{minor}, Darwin arm64" for minor in (11, 12, 13, 14)]


def test_a_wheel_of_one_python_is_none_for_the_next() -> None:
    wheels = [
        f"one-1-cp311-cp311-{kind}.whl" for kind in ("manylinux1_x86_64", "manylinux_2_17_aarch64", "macosx_11_0_arm64")
    ]
    assert {line.split(",")[0] for line in missing_wheels(pylock(*wheels))} == {
        f"one 1 on Python 3.{minor}" for minor in (12, 13, 14)
    }


def test_a_marker_spares_where_it_does_not_hold() -> None:
    marker = "platform_machine == 'aarch64' and python_version < '3.12'"
    assert list(missing_wheels(pylock(marker=marker))) == ["one 1 on Python 3.11, Linux aarch64"]
