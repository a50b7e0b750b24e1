"""A person in Chromium hears the robot's microphone and talks through its loudspeaker."""

from __future__ import annotations

import re
import wave
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from playwright.sync_api import Browser, Page, Playwright, expect
from support.people import wait_connected

pytestmark = [pytest.mark.e2e, pytest.mark.timeout(180)]

TONE_HZ = 1000
FLAGS = [
    "--headless=new",
    "--no-sandbox",
    "--disable-gpu",
    "--use-fake-device-for-media-stream",
    "--use-fake-ui-for-media-stream",
]
"""Chromium's own fake microphone beeps; its fake dialogue says yes."""
PITCH_HZ = """
  async () => {
    const context = new AudioContext()
    const analyser = context.createAnalyser()
    analyser.fftSize = 8192
    context.createMediaStreamSource(document.querySelector('audio').srcObject).connect(analyser)
    await context.resume()
    await new Promise((resolve) => setTimeout(resolve, 500))
    const bins = new Float32Array(analyser.frequencyBinCount)
    analyser.getFloatFrequencyData(bins)
    const hz = bins.indexOf(Math.max(...bins)) * context.sampleRate / analyser.fftSize
    await context.close()
    return hz
  }
"""


@pytest.fixture(scope="module")
def said(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """What came out of the robot's loudspeaker."""
    return tmp_path_factory.mktemp("said") / "said.wav"


@pytest.fixture(scope="module")
def robot(start_robot: Any, said: Path) -> Any:
    return start_robot(
        f"""\
  - {{ type: microphone, label: cabin, params: {{ source: "tone:{TONE_HZ}" }} }}
  - {{ type: speaker, label: horn, params: {{ output: "{said}" }} }}
  - {{ type: test-pattern, label: front, params: {{ width: 160, height: 120, fps: 5 }} }}
""",
        wait=False,
    )


@pytest.fixture(scope="module")
def ears(playwright: Playwright, chromium: str) -> Iterator[Browser]:
    running = playwright.chromium.launch(executable_path=chromium, args=FLAGS)
    yield running
    running.close()


@pytest.fixture
def page(ears: Browser, server: Any, seed: Any, robot: Any, sign_in: Callable[[Page], None]) -> Iterator[Page]:
    """Signed in, connected to the robot, its picture shown beside the sound."""
    context = ears.new_context(viewport={"width": 1280, "height": 900})
    shown = context.new_page()
    sign_in(shown)
    shown.goto(f"{server.url}/robots/{seed.robot_id}")
    wait_connected(shown)
    yield shown
    context.close()


def listeners(robot: Any, label: str) -> Callable[[int], bool]:
    def are(count: int) -> bool:
        rows = robot.snapshots[-1]["connectors"]
        return any(row["label"] == label and row["peers"] == count for row in rows)

    return are


def test_the_robots_microphone_is_heard_beside_its_picture(page: Page, robot: Any, wait_for: Any) -> None:
    hears = listeners(robot, "cabin")
    wait_for(lambda: hears(0), "the robot captures nothing yet")
    page.get_by_role("button", name="Listen").click()
    expect(page.get_by_role("meter", name="Level in dB")).to_have_attribute(
        "aria-valuenow", re.compile(r"^-(1\d|2\d)$"), timeout=15_000
    )
    assert page.evaluate(PITCH_HZ) == pytest.approx(TONE_HZ, abs=15)
    page.wait_for_function("() => (document.querySelector('video')?.videoWidth ?? 0) > 0")
    wait_for(lambda: hears(1), "the robot says that somebody listens")
    page.get_by_role("button", name="Stop listening").click()
    wait_for(lambda: hears(0), "the robot captures nothing any more")


def test_the_voice_comes_out_of_the_robots_loudspeaker_while_the_button_is_held(
    page: Page, said: Path, wait_for: Any
) -> None:
    talk = page.get_by_test_id("push-to-talk")
    button = talk.get_by_role("button")
    expect(button).to_be_enabled(timeout=15_000)
    button.hover()
    page.mouse.down()
    expect(talk.get_by_role("status")).to_have_text("You are heard", timeout=15_000)
    wait_for(lambda: peak(said) > 1000, "the loudspeaker has said it")
    page.mouse.up()
    expect(talk.get_by_role("status")).to_have_text("Nobody is talking", timeout=5_000)
    expect(talk).to_have_attribute("data-phase", "silent")


def test_the_space_bar_talks_too_and_a_lost_focus_ends_it(page: Page) -> None:
    talk = page.get_by_test_id("push-to-talk")
    button = talk.get_by_role("button")
    expect(button).to_be_enabled(timeout=15_000)
    button.focus()
    page.keyboard.down(" ")
    expect(talk).to_have_attribute("data-phase", "talking", timeout=15_000)
    button.blur()
    expect(talk).to_have_attribute("data-phase", "silent")
    page.keyboard.up(" ")


def peak(path: Path) -> int:
    if not path.exists():
        return 0
    with wave.open(str(path), "rb") as file:
        return int(np.abs(np.frombuffer(file.readframes(file.getnframes()), np.int16).astype(int)).max(initial=0))
