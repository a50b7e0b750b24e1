"""One session per wish. All run in the environment that `./dev` made, so that nothing is installed twice.

nox -s lint | checks (types | docs | dashboard | ros) | tests | e2e | screenshots | bench | mutants | demo
nox -s lock | audit | changelog | build
"""

from __future__ import annotations

import os
import platform
import re
import shutil
import subprocess
import sys
import tomllib
from collections.abc import Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor, as_completed
from contextlib import contextmanager, nullcontext
from pathlib import Path
from tempfile import TemporaryFile

import nox

nox.options.default_venv_backend = "none"
nox.options.sessions = ["lint", "checks", "tests", "e2e"]
nox.options.stop_on_first_error = True

os.environ.pop("PYTHONDONTWRITEBYTECODE", None)
"""Where it is set, as in many containers, each of some hundred processes would compile everything anew."""
ROOT = Path(__file__).parent
VENV_PYTHON = ROOT / ".venv" / "bin" / "python"
PYTHON = str(VENV_PYTHON) if VENV_PYTHON.exists() else sys.executable
REAL_PEERS = "webrtc or netlab"
"""Tests of real connections."""
TEST_FILES = sorted(path for place in ("tests", "plugins", "examples") for path in (ROOT / place).rglob("test_*.py"))
CORES = os.cpu_count() or 1
WORKERS = 3 * CORES
"""More processes than processors, as most of these tests wait for somebody's patience to end."""
BROWSERS = min(CORES, 4)
"""A browser, its robot and its server keep two processors busy now and then, and one on the whole."""
COMPUTING = ("architecture", "contract", "distributions", "docs", "machines", "messages", "words")
"""Folders of tests that wait for nobody, but for those of real peers there: they may get what others leave."""
IS_WHOLE = {"tests", "e2e"} <= set(sys.argv)
"""Whether both are asked for in one run, as `./dev test` does: then the latter has time for those of the former."""
CHECKS = ("dashboard", "types", "docs", "ros")
"""The longest first."""
ROS = ROOT / ".nox" / "ros"
ROS_MACHINE = ("linux", "x86_64")
"""For which there are wheels of ROS."""
BUILT: set[str] = set()
"""What sessions of this run have built."""
PLUGINS = sorted(path.parent for path in (ROOT / "plugins").glob("*/pyproject.toml"))
EXAMPLE = "examples/third-party-connector/acme_workbench"
TYPED = [
    "mosaic_core", "release", EXAMPLE, *(str(next(plugin.glob("mosaic_*/")).relative_to(ROOT)) for plugin in PLUGINS)
]  # fmt: skip


@nox.session
def tests(session: nox.Session) -> None:
    """Everything in Python but the browser, side by side, each process in a network of its own: while real peers wait,
    others compute. Without root, where such networks can't be made, real peers follow one after the other."""
    left = [f"--ignore={name}" for name in _computing()] if IS_WHOLE else []
    if session.posargs:
        session.run(PYTHON, "-m", "pytest", "-m", "not e2e", *session.posargs, external=True)
        return
    ros(session)
    if _may_make_networks():
        _test(session, "not e2e", *_side_by_side(WORKERS), *left, "--own-networks")
    else:
        _test(session, f"not e2e and not ({REAL_PEERS})", *_side_by_side(WORKERS), *left)
        _test(session, f"not e2e and ({REAL_PEERS})", files=_with_mark("webrtc", "netlab"))


@nox.session
def e2e(session: nox.Session) -> None:
    """A real Chromium against the real server and simulated robots, :data:`BROWSERS` of each side by side. In a run
    with `tests` too, tests that only compute take what they leave."""
    _build_dashboard(session)
    if session.posargs:
        session.run(PYTHON, "-m", "pytest", "-m", "e2e", *session.posargs, external=True)
        return
    with _beside(session, _computing_tests()) if IS_WHOLE else nullcontext():
        _test(session, "e2e", *_side_by_side(BROWSERS), "--tb=native", files=_with_mark("e2e"))


@nox.session
def checks(session: nox.Session) -> None:
    """All that runs no test of Python, side by side: TypeScript and mypy keep a processor busy for long, each one. So
    the tests are read once meanwhile, which compiles them for the processes of `tests`.

    What one of them says is printed where it fails; the others go on to their end."""
    words = {name: [sys.executable, "-m", "nox", "-s", name] for name in CHECKS}
    words["reading the tests"] = [PYTHON, "-m", "pytest", "--collect-only", "-qq"]
    failed = []
    with ThreadPoolExecutor(len(words)) as side_by_side:
        runs = {side_by_side.submit(_told, one): name for name, one in words.items()}
        for run in as_completed(runs):
            if run.result().returncode != 0:
                print(run.result().stdout)
                failed.append(runs[run])
            print("FAILED" if runs[run] in failed else "ok    ", runs[run], flush=True)
    if failed:
        session.error(f"failed: {', '.join(sorted(failed))}")
    BUILT.add("dashboard")


@nox.session
def lint(session: nox.Session) -> None:
    session.run(PYTHON, "-m", "ruff", "check", ".", external=True)
    session.run(PYTHON, "-m", "ruff", "format", "--check", ".", external=True)


@nox.session
def types(session: nox.Session) -> None:
    session.run(PYTHON, "-m", "mypy", *TYPED, external=True)


@nox.session
def dashboard(session: nox.Session) -> None:
    """Types, lint, tests and build of the TypeScript packages; those that are published are packed and judged.

    All at once: what each of them says is printed where it fails."""
    _npm(session, "check")
    BUILT.add("dashboard")


@nox.session
def docs(session: nox.Session) -> None:
    """Generate the reference and build the site into `site/`; warnings are errors."""
    session.run(
        PYTHON, "docs/generate_reference.py", *(["--check"] if "--check" in session.posargs else []), external=True
    )
    session.run(PYTHON, "docs/build_site.py", external=True)


@nox.session
def ros(session: nox.Session) -> None:
    """A Python with nodes of ROS itself in `.nox/ros`, beside which tests run connectors; again only when its lock or
    the version of Python changed."""
    stamp, wanted = ROS / ".mosaic-installed", sys.version + (ROOT / "locks" / "ros.txt").read_text()
    if (sys.platform, platform.machine()) != ROS_MACHINE or (stamp.exists() and stamp.read_text() == wanted):
        return
    session.run(PYTHON, "-m", "venv", "--clear", "--without-pip", str(ROS), external=True)
    _locked(session, "ros", "--python", str(ROS / "bin" / "python"))
    stamp.write_text(wanted)


@nox.session
def screenshots(session: nox.Session) -> None:
    """The pictures of the pages, by Chromium, of the demo as it is now; `-- stopped` takes one of them anew."""
    _build_dashboard(session)
    session.run(PYTHON, "docs/make_screenshots.py", *session.posargs, external=True)


@nox.session
def bench(session: nox.Session) -> None:
    """All benchmarks, as tables; `nox -s bench -- data --rounds 1` runs one with its options."""
    name, *options = session.posargs or ["*"]
    scripts = sorted((ROOT / "bench").glob(f"{name.removesuffix('.py')}.py"))
    if not scripts:
        session.error(f"bench/ has no {name}.py")
    for script in scripts:
        session.run(PYTHON, str(script), *options, external=True)


@nox.session
def mutants(session: nox.Session) -> None:
    """Change one thing after the other and see whether tests notice: `nox -s mutants -- lease stop`, or
    `-- --sample 60 --seed 1`. Takes a second for each of some thousand changes, so it is run on request."""
    _locked(session, "mutants")
    session.run(PYTHON, "tests/mutants/run.py", *session.posargs, external=True)


@nox.session
def build(session: nox.Session) -> None:
    """Wheels and source distributions of all distributions, and the dashboard's packages, into `dist/`, with what they
    consist of and the locked set for whoever installs them. Each is judged, weighed, installed alone and used: a wheel
    is made of its source distribution, so that both are."""
    _locked(session, "release")
    _build_dashboard(session)
    _npm(session, "packages", "--", "--check")
    shutil.rmtree(ROOT / "dist", ignore_errors=True)
    shutil.copytree(ROOT / "dashboard" / "dist", ROOT / "dist")
    for project in (ROOT, *PLUGINS):
        session.run(PYTHON, "-m", "build", "--no-isolation", "--outdir", "dist", str(project), external=True)
    for script in ("sizes", "bill_of_materials", "licences", "checksums"):
        session.run(PYTHON, "-m", f"release.{script}", "dist", external=True)
    session.run(PYTHON, "tests/distributions/install_alone.py", "dist", external=True)


@nox.session
def audit(session: nox.Session) -> None:
    """Known holes in what is locked, and what others could misuse in the workflows; `-- --must-answer` fails where the
    registries' advisories can't be reached."""
    _locked(session, "release")
    session.run(
        str(Path(PYTHON).with_name("zizmor")), "--offline", "--no-progress", "--quiet", ".github", external=True
    )
    session.run(PYTHON, "-m", "release.audit", *session.posargs, external=True)


@nox.session
def changelog(session: nox.Session) -> None:
    """Show what `changes/` will become; `-- --write` moves it into CHANGELOG.md, for a release."""
    _locked(session, "release")
    version = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]["version"]
    how = ["--yes"] if "--write" in session.posargs else ["--draft"]
    session.run(PYTHON, "-m", "towncrier", "build", *how, "--version", version, external=True)


@nox.session
def lock(session: nox.Session) -> None:
    """Renew `locks/` after a pyproject changed, or after a merge left conflicts in it; `-- --upgrade` takes the newest
    of everything, `-- --upgrade-package NAME` of one."""
    _locked(session, "lock")
    session.run(PYTHON, "-m", "release.lock", *session.posargs, external=True)


@nox.session
def demo(session: nox.Session) -> None:
    _build_dashboard(session)
    session.run(PYTHON, "-m", "mosaic_core.cli.main", "demo", *session.posargs, external=True)


def _told(words: list[str]) -> subprocess.CompletedProcess[str]:
    """What it says on both streams, as one text."""
    return subprocess.run(words, cwd=ROOT, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)


def _locked(session: nox.Session, lock: str, *options: str) -> None:
    """What of `locks/` only few sessions need, installed by the first of them."""
    words = ["-m", "pip", *options, "install", "--quiet", "--disable-pip-version-check", "--require-hashes"]
    session.run(PYTHON, *words, "--requirement", f"locks/{lock}.txt", external=True)


def _with_mark(*marks: str) -> list[str]:
    """The files in which a test has one of ``marks``: no process of pytest reads those that are not for it."""
    wanted = re.compile(rf"mark\.({'|'.join(marks)})\b")
    return [str(path.relative_to(ROOT)) for path in TEST_FILES if wanted.search(path.read_text())]


def _computing() -> list[str]:
    """The files with tests that only compute."""
    others = _with_mark("e2e", "webrtc", "netlab", "postgresql")
    files = [str(path.relative_to(ROOT)) for path in TEST_FILES if path.parts[len(ROOT.parts)] == "tests"]
    return [name for name in files if name.split("/")[1] in COMPUTING and name not in others]


def _computing_tests() -> list[str]:
    """What runs them at the lowest priority, with patience."""
    words = ["nice", "-n", "19", PYTHON, "-m", "pytest", "--timeout=600", "-n", str(CORES), "--dist", "loadscope"]
    return [*words, *_computing()]


def _side_by_side(workers: int) -> tuple[str, ...]:
    return "-n", str(workers), "--dist", "loadscope", "--no-loadscope-reorder"


def _test(session: nox.Session, marks: str, *options: str, files: Sequence[str] = ()) -> None:
    session.run(PYTHON, "-m", "pytest", "--pairs", "-m", marks, *files, *options, external=True)


@contextmanager
def _beside(session: nox.Session, words: Sequence[str]) -> Iterator[None]:
    """Runs it meanwhile, and shows what it says when both have ended."""
    with TemporaryFile("w+") as said, subprocess.Popen(words, cwd=ROOT, stdout=said, stderr=said) as running:
        try:
            yield
            code = running.wait()
        finally:
            running.terminate()
        said.seek(0)
        print(said.read(), flush=True)
    if code != 0:
        session.error(f"failed with exit code {code}: {' '.join(words)}")


def _may_make_networks() -> bool:
    """Tries it: root in a container may be less than root."""
    words = ["unshare", "--net", "ip", "link", "add", "lan0", "type", "veth", "peer", "name", "lan1"]
    is_there = shutil.which("unshare") is not None and shutil.which("ip") is not None
    return is_there and subprocess.run(words, capture_output=True).returncode == 0


def _build_dashboard(session: nox.Session) -> None:
    """Unless a session before has."""
    if "dashboard" not in BUILT:
        _npm(session, "build")
        BUILT.add("dashboard")


def _npm(session: nox.Session, wish: str, *words: str) -> None:
    """Node of `.venv` first: it is there where the machine's own is absent or too old."""
    path = os.pathsep.join([str(VENV_PYTHON.parent), os.environ.get("PATH", "")])
    with session.chdir("dashboard"):
        session.run("npm", "run", "--silent", wish, *words, env={"PATH": path}, external=True)
