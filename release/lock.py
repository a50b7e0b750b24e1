"""Writes the lock files of `locks/`: exact versions and hashes of all that `./dev`, a release and its tools install.

`nox -s lock` changes what must change, `-- --upgrade` takes the newest of everything, `-- --upgrade-package NAME` of
one. A file that git left with conflicts is a good beginning: whatever it still says is kept where it can be.
"""

from __future__ import annotations

import re
import subprocess
import sys
import tempfile
from pathlib import Path

from release.requirements import LOCKS, ROOT, SETS, wanted
from release.wheels import BUILT, missing_wheels

BOUNDED_BY = {"runtime": "", **{lock: "runtime" if lock == "dev" else "dev" for lock in SETS if lock != "runtime"}}
"""By which lock each is bounded, so that both can be installed together."""
LOWEST_PYTHON = "3.11"
HEADER = """\
# Written by `nox -s lock` from the pyprojects, which are what to edit. After a merge conflict: run it again.
--only-binary :all:
"""
NOT_A_PIN = re.compile(r"^(<{7}|={7}|>{7}|\|{7}|--|#).*\n?", re.MULTILINE)
"""What git leaves of a conflict, and our own options."""
COMPILE = (
    sys.executable, "-m", "uv", "pip", "compile", "--quiet", "--no-config", "--universal",
    "--python-version", LOWEST_PYTHON, "--no-header", "--no-annotate", "--only-binary", ":all:",
    *(word for name in BUILT for word in ("--no-binary", name)),
)  # fmt: skip


def locked(lock: str, before: str, constraints: str, options: list[str]) -> str:
    """The text of one lock file, near to what it was ``before``; raises SystemExit with uv's words if nothing fits.

    :param constraints: another lock file's text, whose versions hold here too
    """
    with tempfile.TemporaryDirectory() as folder:
        asked, bounds, answer = (Path(folder, name) for name in ("asked.in", "bounds.txt", "answer.txt"))
        asked.write_text("\n".join(wanted(lock)) + "\n")
        bounds.write_text(NOT_A_PIN.sub("", constraints))
        answer.write_text(NOT_A_PIN.sub("", before))
        words = [*COMPILE, "--generate-hashes", "--no-emit-index-url", "--no-emit-find-links"]
        _must([*words, "--constraints", str(bounds), *options, str(asked), "--output-file", str(answer)], lock)
        pins = answer.read_text()
        exceptions = "".join(f"--no-binary {name}\n" for name in BUILT if f"\n{name}==" in f"\n{pins}")
        return HEADER + exceptions + pins


def wheels_listed(lock: Path) -> str:
    """The files of each package of ``lock`` as a `pylock.toml`, which names places as well and is not kept for that."""
    with tempfile.TemporaryDirectory() as folder:
        answer = Path(folder, "pylock.toml")
        _must([*COMPILE, "--no-deps", "--format", "pylock.toml", str(lock), "--output-file", str(answer)], lock.stem)
        return answer.read_text()


def main(options: list[str]) -> int:
    LOCKS.mkdir(exist_ok=True)
    lacking: list[str] = []
    texts: dict[str, str] = {}
    for lock in SETS:
        path = LOCKS / f"{lock}.txt"
        before = path.read_text() if path.exists() else ""
        texts[lock] = after = locked(lock, before, texts.get(BOUNDED_BY[lock], ""), options)
        path.write_text(after)
        lacking += [f"{path.relative_to(ROOT)}: {line}" for line in missing_wheels(wheels_listed(path))]
        print(f"{path.relative_to(ROOT)}: {'as it was' if after == before else 'renewed'}")
    if lacking:
        print("No wheel, so that ./dev can't install it there:", *sorted(set(lacking)), sep="\n  ", file=sys.stderr)
        print(
            "Give it a marker in its pyproject, or a place with its reason among BUILT in release/wheels.py.",
            file=sys.stderr,
        )
    return int(bool(lacking))


def _must(words: list[str], lock: str) -> None:
    done = subprocess.run(words, cwd=ROOT, capture_output=True, text=True, check=False)
    if done.returncode != 0:
        sys.exit(f"locks/{lock}.txt can't be made:\n{done.stderr}")


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
