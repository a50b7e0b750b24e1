"""Somebody else's distribution, from its own wheel in a fresh environment: listed, validated, run."""

from __future__ import annotations

import json
import os
import shutil
import signal
import subprocess
import sys
import sysconfig
import venv
from collections.abc import Callable
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[3]
EXAMPLE = ROOT / "examples" / "third-party-connector"
ENVIRONMENT = {"MOSAIC_ROBOT_ID": "7d1c2f6e-0b52-4c1e-9a53-2f6f1f0c9b11", "MOSAIC_TOKEN": "none"}
STEP_S = 120.0


def build_wheel(source: Path, folder: Path) -> Path:
    """Build without isolation: the build backend is installed here, so that nothing is downloaded."""
    words = [sys.executable, "-m", "hatchling", "build", "-t", "wheel", "-d", str(folder)]
    subprocess.run(words, cwd=source, check=True, capture_output=True, text=True, timeout=STEP_S)
    return max(folder.glob("*.whl"), key=lambda wheel: wheel.stat().st_mtime_ns)


@pytest.fixture(scope="module")
def python(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The Python of a fresh environment with both wheels.

    Libraries come from this environment by a ``.pth`` file. It names a folder of links to them without whatever is
    installed from this checkout, so that only the wheels' own code can be found.
    """
    folder = tmp_path_factory.mktemp("fresh")
    source = folder / "example"
    shutil.copytree(EXAMPLE, source, ignore=shutil.ignore_patterns("__pycache__"))
    wheels = [build_wheel(ROOT, folder), build_wheel(source, folder)]
    environment = folder / "venv"
    venv.create(environment, with_pip=False)
    (site_packages,) = environment.glob("lib/python*/site-packages")
    libraries = folder / "libraries"
    libraries.mkdir()
    for entry in Path(sysconfig.get_path("purelib")).iterdir():
        if "mosaic" not in entry.name and entry.suffix != ".pth":
            (libraries / entry.name).symlink_to(entry)
    (site_packages / "libraries.pth").write_text(f"{libraries}\n")
    python = environment / "bin" / "python"
    install = [
        sys.executable,
        "-m",
        "pip",
        f"--python={python}",
        "install",
        "--no-deps",
        "--no-index",
        *map(str, wheels),
    ]
    subprocess.run(install, check=True, capture_output=True, text=True, timeout=STEP_S)
    return python


@pytest.fixture
def mosaic(python: Path) -> Callable[..., subprocess.CompletedProcess[str]]:
    def run(*words: str) -> subprocess.CompletedProcess[str]:
        command = [str(python.parent / "mosaic"), *words]
        return subprocess.run(
            command, cwd=python.parent, env={**_clean(), **ENVIRONMENT}, capture_output=True, text=True, timeout=STEP_S
        )

    return run


def _clean() -> dict[str, str]:
    return {key: value for key, value in os.environ.items() if not key.startswith(("PYTHON", "MOSAIC"))}


def test_its_types_are_listed_with_distribution_and_version(
    mosaic: Callable[..., subprocess.CompletedProcess[str]],
) -> None:
    listed = json.loads(mosaic("connectors", "list", "--json").stdout)
    workbench = {"drift", "lamp", "newest-picture", "power-meter", "stereo-microscope", "thermometer"}
    assert {one["type"] for one in listed} == {"connection-check"} | workbench
    assert {
        "type": "thermometer",
        "description": "A temperature of this machine.",
        "distribution": "acme-workbench",
        "version": "1.2.0",
    } in listed


def test_its_params_are_shown(mosaic: Callable[..., subprocess.CompletedProcess[str]]) -> None:
    shown = mosaic("connectors", "show", "lamp").stdout
    assert "Folder of the LED: /sys/class/leds/NAME." in shown
    assert "  - type: lamp\n    label: lamp\n    params:\n      led: /sys/class/leds/NAME\n" in shown


def test_its_configuration_validates(mosaic: Callable[..., subprocess.CompletedProcess[str]]) -> None:
    done = mosaic("validate", str(EXAMPLE / "mosaic_config.yaml"))
    assert (done.returncode, done.stderr) == (0, "")


def test_it_runs(python: Path, tmp_path: Path) -> None:
    temperature = tmp_path / "temp"
    temperature.write_text("42500\n")
    config = tmp_path / "mosaic_config.yaml"
    text = (EXAMPLE / "mosaic_config.yaml").read_text()
    config.write_text(text.replace("label: cpu", f"label: cpu, params: {{ path: {temperature}, period_s: 0.1 }}"))
    process = subprocess.Popen(
        [str(python.parent / "mosaic"), "run", str(config), "--json"],
        env={**_clean(), **ENVIRONMENT}, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True,
    )  # fmt: skip
    assert process.stdout is not None
    try:
        for line in process.stdout:
            rows = {row["label"]: row for row in json.loads(line)["connectors"]}
            if rows and rows["cpu"]["messages"] > 0:
                break
        else:
            pytest.fail(f"the robot ended with {process.wait(timeout=5)}")
        assert rows["desk"]["type"] == "lamp"
        process.send_signal(signal.SIGTERM)
        assert process.wait(timeout=10) == 0
    finally:
        process.kill()
        process.wait(timeout=5)
        process.stdout.close()


def test_the_wheel_has_the_templates_of_new_plugins(mosaic: Callable[..., subprocess.CompletedProcess[str]]) -> None:
    done = mosaic("plugin", "new", "acme-eye", "--camera")
    assert done.stdout.startswith("wrote acme-eye/"), done.stderr
    assert {".gitignore", ".github", "README.md", "acme_eye", "tests"} <= {
        path.name for path in (Path(done.args[0]).parent / "acme-eye").iterdir()
    }
