"""The pages of the documentation and of `examples/own-page`, made of the packed packages alone, in Chromium against a
real server and robot."""

from __future__ import annotations

import json
import os
import re
import shutil
import subprocess
import sys
import tarfile
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest
from playwright.sync_api import Browser, Page, expect
from support.accessibility import LOOKS, Examination
from support.people import photographed
from support.processes import free_port, is_listening
from support.waiting import wait_for

pytestmark = [pytest.mark.e2e, pytest.mark.timeout(600)]

ROOT = Path(__file__).parents[3]
DASHBOARD = ROOT / "dashboard"
EXAMPLE = ROOT / "examples" / "own-page"
TITLED = re.compile(r'^```\w+ title="([^"]+)"\n(.*?)^```', re.MULTILINE | re.DOTALL)
OURS = ("protocol", "client", "react", "widgets")
THIRD_PARTY = ("react", "react-dom", "@mantine/core", "@mantine/hooks", "vite", "@vitejs/plugin-react", "typescript")
TYPES = ("@types/react", "@types/react-dom", "@types/node")
ENTRY = (
    '<!doctype html><html><body><div id="root"></div><script type="module" src="/src/main.tsx"></script></body></html>'
)
STRICT: dict[str, Any] = {
    "target": "ES2022",
    "lib": ["ESNext", "DOM", "DOM.Iterable"],
    "module": "ESNext",
    "moduleResolution": "bundler",
    "jsx": "react-jsx",
    "types": ["vite/client"],
    "strict": True,
    "noUncheckedIndexedAccess": True,
    "noUnusedLocals": True,
    "noUnusedParameters": True,
    "noImplicitOverride": True,
    "verbatimModuleSyntax": True,
    "skipLibCheck": False,
    "noEmit": True,
}
"""What a page of the strictest kind asks: also the types inside the packages are looked at."""
FOR_NODE = STRICT | {"types": ["node"], "skipLibCheck": True}
VITE = ["node", "node_modules/vite/bin/vite.js"]
BUILD_S = 300.0


@pytest.fixture(scope="module")
def page_url(tmp_path_factory: pytest.TempPathFactory, server: Any, seed: Any) -> Iterator[str]:
    """The page is built, and served the way a developer looks at it."""
    folder = tmp_path_factory.mktemp("my-page")
    _write_page(folder)
    with _served(folder, ["tsconfig.json", "tsconfig.node.json"], server) as url:
        yield url


@pytest.fixture(scope="module")
def example_url(tmp_path_factory: pytest.TempPathFactory, server: Any) -> Iterator[str]:
    """The example, as it stands."""
    folder = tmp_path_factory.mktemp("example") / "own-page"
    shutil.copytree(EXAMPLE, folder, ignore=shutil.ignore_patterns("node_modules", "dist"))
    with _served(folder, ["tsconfig.json"], server) as url:
        yield url


@contextmanager
def _served(folder: Path, projects: list[str], server: Any) -> Iterator[str]:
    """Installs, checks, builds and serves it; its address."""
    _install(folder)
    _check_and_build(folder, projects)
    port = free_port()
    words = [*VITE, "preview", "--host", "127.0.0.1", "--strictPort", "--port", str(port)]
    node = subprocess.Popen(words, cwd=folder, env=_environment(MOSAIC_SERVER=server.url), start_new_session=True)
    try:
        wait_for(lambda: is_listening(port), "the page is served", alive=node)
        yield f"http://127.0.0.1:{port}"
    finally:
        os.killpg(node.pid, 15)
        node.wait(timeout=10)


@pytest.fixture
def page(browser: Browser) -> Iterator[Page]:
    context = browser.new_context(viewport={"width": 1000, "height": 1400})
    yield context.new_page()
    context.close()


def test_the_documented_page_signs_in_connects_and_shows_a_value_and_a_picture(
    page: Page, page_url: str, seed: Any, robot: Any
) -> None:
    problems: list[str] = []
    page.on("pageerror", lambda error: problems.append(str(error)))
    page.goto(page_url)
    page.get_by_placeholder("Email").fill(seed.email)
    page.get_by_placeholder("Password").fill("wrong")
    page.get_by_role("button", name="Sign in").click()
    expect(page.get_by_role("alert")).not_to_be_empty()
    page.get_by_placeholder("Email").fill(seed.email)
    page.get_by_placeholder("Password").fill(seed.password)
    page.get_by_role("button", name="Sign in").click()
    page.get_by_role("button", name="Test robot").click()
    expect(page.get_by_role("status").first).to_have_text(re.compile("^connected"), timeout=20_000)
    expect(page.get_by_test_id("battery")).to_have_text(re.compile(r"Battery: \d+ %"), timeout=10_000)
    page.wait_for_function("() => (document.querySelector('main > video')?.videoWidth ?? 0) > 0")
    expect(page.get_by_test_id("link")).to_have_text(re.compile(r"Connected 1 times, [\d.]+ ms"), timeout=10_000)
    expect(page).to_have_title("battery connected")  # the own store class
    card = page.get_by_role("region", name=re.compile("^battery:"))
    expect(card).to_have_css("border-top-left-radius", "8px")  # the style sheet came along
    expect(card.get_by_text(re.compile(r"\d+ ?%")).first).to_be_visible()
    photographed(page, "own-page-python")
    assert problems == []


def test_the_documented_page_takes_control_drives_and_stops(
    page: Page, page_url: str, seed: Any, robot: Any, observer: Any
) -> None:
    page.goto(page_url)
    page.get_by_placeholder("Email").fill(seed.email)
    page.get_by_placeholder("Password").fill(seed.password)
    page.get_by_role("button", name="Sign in").click()
    page.get_by_role("button", name="Test robot").click()
    expect(page.get_by_role("status").first).to_have_text(re.compile("^connected"), timeout=20_000)
    page.get_by_role("button", name="Take control").first.click()
    page.get_by_role("button", name="Give back").first.wait_for()
    start_s = observer.now[0]
    page.get_by_role("button", name="Forward").first.hover()
    page.mouse.down()
    wait_for(lambda: observer.way_m(start_s) > 0.05, "the robot moves while the button is held")
    page.mouse.up()
    wait_for(observer.rests, "the robot rests")
    page.get_by_role("button", name="Stop", exact=True).first.click()
    page.get_by_role("button", name="Go on").click()
    page.get_by_role("button", name="Stop", exact=True).first.wait_for()


def test_the_example_of_thirty_lines_signs_in_and_shows_a_picture_and_a_battery(
    page: Page, example_url: str, seed: Any, robot: Any
) -> None:
    problems: list[str] = []
    page.on("pageerror", lambda error: problems.append(str(error)))
    examination = Examination(page)
    page.goto(example_url)
    page.get_by_label("Email").fill(seed.email)
    page.get_by_role("textbox", name="Password").fill("wrong")
    page.get_by_role("button", name="Sign in").click()
    expect(page.get_by_role("alert")).to_contain_text("Check the email and the password")
    examination.look("sign-in")
    photograph(page, "own-page-sign-in")
    page.get_by_role("textbox", name="Password").fill(seed.password)
    page.get_by_role("button", name="Sign in").click()
    page.get_by_label("Robot", exact=True).select_option("Test robot")
    page.wait_for_function("() => (document.querySelector('video')?.videoWidth ?? 0) > 0")
    expect(page.get_by_role("region")).to_have_count(2)
    expect(page.get_by_role("region", name=re.compile("^battery:")).get_by_text("Voltage")).to_be_visible()
    expect(page.get_by_role("status").get_by_text("connected")).to_be_visible()
    expect(page.get_by_role("button", name=re.compile("^Stop"))).to_be_visible()
    examination.look("a robot")
    photograph(page, "own-page")
    examination.expect_nothing()
    page.reload()
    page.get_by_label("Robot", exact=True).select_option("Test robot")
    page.wait_for_function("() => (document.querySelector('video')?.videoWidth ?? 0) > 0")  # still signed in
    assert problems == []


def photograph(page: Page, name: str) -> None:
    """For whoever wants to see it: in both colours, and on a phone."""
    for scheme, (look, size) in enumerate(LOOKS):
        page.set_viewport_size(size)
        page.emulate_media(color_scheme=look)
        photographed(page, f"{name}-{scheme}-{look}")


def test_the_example_is_no_longer_than_it_says() -> None:
    assert len((EXAMPLE / "src" / "main.tsx").read_text().splitlines()) <= 30


def test_the_example_names_what_it_needs_and_no_more() -> None:
    says = json.loads((EXAMPLE / "package.json").read_text())
    ours = json.loads((DASHBOARD / "packages" / "app" / "package.json").read_text())
    for name, version in (says["dependencies"] | says["devDependencies"]).items():
        if name.startswith("@mosaic/"):
            assert version == f"file:../../dist/{name[1:].replace('/', '-')}-{says['version']}.tgz"
        elif name in ours["dependencies"]:
            assert version.lstrip("^") == ours["dependencies"][name].lstrip("^")
    imported = set(re.findall(r"from '([^'./][^']*)'", (EXAMPLE / "src" / "main.tsx").read_text()))
    assert {name.removesuffix("/client") if name == "react-dom/client" else name for name in imported} <= set(
        says["dependencies"]
    )


def _packed() -> dict[str, Path]:
    """The tarballs by package, of the sources as they are now: those of `nox -s dashboard` where nothing is newer."""
    if _packed_s() < _changed_s():
        _run(["npm", "run", "--silent", "packages"], DASHBOARD)
    return {f"@mosaic/{name}": next((DASHBOARD / "dist").glob(f"mosaic-{name}-*.tgz")) for name in OURS}


def _packed_s() -> float:
    """When the oldest tarball was made; 0 where one is missing."""
    times_s = [max(map(_modified_s, (DASHBOARD / "dist").glob(f"mosaic-{name}-*.tgz")), default=0.0) for name in OURS]
    return min(times_s)


def _changed_s() -> float:
    """When something that tarballs are made of was changed last."""
    made_of = [DASHBOARD / "package-lock.json", DASHBOARD / "tsconfig.json", *(DASHBOARD / "scripts").iterdir()]
    for name in OURS:
        home = DASHBOARD / "packages" / name
        made_of += [path for path in home.iterdir() if path.is_file() and path.name != "LICENSE"]
        made_of += (home / "src").rglob("*")
    return max(map(_modified_s, made_of))


def _modified_s(path: Path) -> float:
    return path.stat().st_mtime


def _write_page(folder: Path) -> None:
    """The files of the documentation, and what `npm create vite` puts beside them."""
    text = (ROOT / "docs" / "howto" / "own-page.md").read_text()
    files = dict(TITLED.findall(text))
    assert "src/main.tsx" in files
    files |= {
        "index.html": ENTRY,
        "tsconfig.json": json.dumps({"compilerOptions": STRICT, "include": ["src"]}),
        "tsconfig.node.json": json.dumps({"compilerOptions": FOR_NODE, "include": ["vite.config.ts"]}),
    }
    for name, content in files.items():
        path = folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(content)


def _install(folder: Path) -> None:
    """Our tarballs, unpacked, and beside them what they and the page say that they need, of the dashboard's packages;
    what somebody needs and does not say is not found."""
    wanted = {*THIRD_PARTY, *TYPES}
    for name, tarball in _packed().items():
        home = folder / "node_modules" / name
        _unpack(tarball, home)
        says = json.loads((home / "package.json").read_text())
        wanted |= {*says.get("dependencies", ()), *says.get("peerDependencies", ())}
    for name in sorted(one for one in wanted if not one.startswith("@mosaic/")):
        link = folder / "node_modules" / name
        link.parent.mkdir(exist_ok=True)
        link.symlink_to(_in_the_dashboard(name))
    (folder / "package.json").write_text(json.dumps({"name": "my-page", "private": True, "type": "module"}))
    said = subprocess.run(["npm", "ls", "--all"], cwd=folder, env=_environment(), capture_output=True, text=True)
    told = (said.stdout + said.stderr).splitlines()
    assert [line for line in told if "from node_modules/@mosaic/" in line or "required by @mosaic/" in line] == []


def _unpack(tarball: Path, home: Path) -> None:
    with tarfile.open(tarball) as packed:
        packed.extractall(home.parent, filter="data")
    (home.parent / "package").rename(home)


def _in_the_dashboard(name: str) -> Path:
    """Of all workspaces, or of the one that needs it."""
    places = (DASHBOARD / "node_modules", *(DASHBOARD / "packages").glob("*/node_modules"))
    found = next((place / name for place in places if (place / name).exists()), None)
    assert found is not None, f"the dashboard has no {name}: run ./dev setup"
    return found


def _check_and_build(folder: Path, projects: list[str]) -> None:
    shutil.copy(Path(__file__).parent / "check_page.mjs", folder)
    check = ["node", "check_page.mjs", *projects]
    with ThreadPoolExecutor() as side_by_side:
        list(side_by_side.map(lambda words: _run(words, folder), (check, [*VITE, "build"])))


def _environment(**more: str) -> dict[str, str]:
    """Node of `.venv` where the machine has none."""
    path = os.pathsep.join([str(Path(sys.executable).parent), os.environ.get("PATH", "")])
    return {**os.environ, "PATH": path, **more}


def _run(words: list[str], folder: Path) -> None:
    done = subprocess.run(words, cwd=folder, env=_environment(), capture_output=True, text=True, timeout=BUILD_S)
    assert done.returncode == 0, f"{' '.join(words)}\n{done.stdout}\n{done.stderr}"
