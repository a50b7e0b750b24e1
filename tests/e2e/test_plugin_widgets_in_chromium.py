"""Widgets that plugins ship, in a real Chromium: with the page's own React, in a card of their own when they fail, and
never loaded where the server does not have them."""

from __future__ import annotations

import json
import os
import tomllib
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest
from playwright.sync_api import Browser, Page, expect
from support.people import photographed, wait_connected
from support.processes import free_port, mosaic_here
from support.robot_process import RobotProcess, write_config

from mosaic_core.testing.distributions import write_distribution

pytestmark = [pytest.mark.e2e, pytest.mark.timeout(180)]

EXAMPLE = Path(__file__).parents[2] / "examples" / "third-party-connector"
CONNECTORS = """
from mosaic_core import DataChannelConfigurer, DataChannelSendable, Message, NoParams

class Mood(Message):
    mood: str

class Fickle(DataChannelSendable[Mood]):
    widget = "acme-trouble/Fickle"

    async def messages(self):
        async for _ in self.every(0.1):
            yield Mood(mood="fickle")

class Ahead(Fickle):
    widget = "acme-ahead/Panel"

class FickleConfigurer(DataChannelConfigurer[NoParams]):
    connector_type = "fickle"

    def configure(self) -> Fickle:
        return Fickle(self.label)

class AheadConfigurer(DataChannelConfigurer[NoParams]):
    connector_type = "ahead"

    def configure(self) -> Ahead:
        return Ahead(self.label)
"""
FICKLE = """
import { createElement, useEffect, useState } from 'react'
import { useMosaicClient } from '@mosaic/react'
import { useLatestJson } from '@mosaic/widgets'

export const apiVersion = 1

export function Fickle({ robotId, entry, store }) {
  const [plan, setPlan] = useState('live')
  const client = useMosaicClient()
  const latest = useLatestJson(store)
  useEffect(() => {
    if (plan === 'effect') throw new Error('thrown in an effect')
  }, [plan])
  if (plan === 'render') throw new Error('thrown while drawing')
  const knows = client.connection(robotId).catalogue.get().entries.some((one) => one.label === entry.label)
  const button = (name) => createElement('button', { onClick: () => setPlan(name) }, `Fail in ${name}`)
  const words = `I am ${latest?.mood}, the client knows me: ${knows}`
  return createElement('div', null, words, button('render'), button('effect'))
}
"""
YAML = """\
  - {{ type: thermometer, label: cpu, params: {{ path: {temperature}, period_s: 0.1 }} }}
  - {{ type: fickle, label: fickle }}
  - {{ type: ahead, label: ahead }}
"""


@dataclass
class Site:
    """A robot with plugins that serves its own network, and reports to a fleet's server that has none of them."""

    robot: RobotProcess
    temperature: Path

    def page_of_its_own(self) -> str:
        offer: dict[str, Any] = json.loads(mosaic_here("lan", "pair", "--no-wait", "--json", **self.robot.environment))
        page: str = offer["page"]
        return page


@pytest.fixture(scope="module")
def plugins(tmp_path_factory: pytest.TempPathFactory) -> str:
    """The PYTHONPATH with the example, and with plugins that make trouble."""
    folder = tmp_path_factory.mktemp("plugins")
    project = tomllib.loads((EXAMPLE / "pyproject.toml").read_text())["project"]
    write_distribution(folder, project["name"], version=project["version"], entry_points=project["entry-points"])
    write_distribution(
        folder,
        "acme-trouble",
        version="3.1.4",
        modules={"acme_trouble.__init__": "", "acme_trouble.connectors": CONNECTORS},
        entry_points={
            "mosaic.connectors": {
                "fickle": "acme_trouble.connectors:FickleConfigurer",
                "ahead": "acme_trouble.connectors:AheadConfigurer",
            },
            "mosaic.widgets": {"acme-trouble": "acme_trouble.widgets", "acme-ahead": "acme_trouble.widgets"},
        },
    )
    (folder / "acme_trouble" / "widgets").mkdir()
    (folder / "acme_trouble" / "widgets" / "acme-trouble.js").write_text(FICKLE)
    (folder / "acme_trouble" / "widgets" / "acme-ahead.js").write_text(
        "export const apiVersion = 2\nexport const Panel = () => null\n"
    )
    return os.pathsep.join([str(folder), str(EXAMPLE)])


@pytest.fixture(scope="module")
def site(server: Any, seed: Any, plugins: str, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Site]:
    folder = tmp_path_factory.mktemp("robot")
    temperature = folder / "temp"
    temperature.write_text("42500\n")
    config = write_config(folder, f"ws://127.0.0.1:{server.port}", seed, YAML.format(temperature=temperature))
    robot = RobotProcess(config, "--serve", f"127.0.0.1:{free_port()}", "--name", "Rover")
    robot.environment = {"MOSAIC_DATA_DIR": str(folder), "PYTHONPATH": plugins}
    robot.start()
    robot.wait_until_ready(60)
    robot.expect(lambda: any("on this machine alone" in line for line in robot.log), "its own server listens", 60)
    yield Site(robot, temperature)
    assert robot.stop() == 0


@pytest.fixture
def page(browser: Browser) -> Iterator[Page]:
    """A page whose scripts are refused nothing that they want."""
    context = browser.new_context(viewport={"width": 1280, "height": 900})
    page = context.new_page()
    page.set_default_timeout(20_000)
    refused: list[str] = []
    page.on("console", lambda message: refused.append(message.text) if "Security Policy" in message.text else None)
    yield page
    context.close()
    assert refused == []


def test_a_plugins_widget_lives_in_the_page_and_fails_in_its_card(site: Site, page: Page) -> None:
    asked: list[str] = []
    page.on("request", lambda request: asked.append(request.url))
    page.goto(site.page_of_its_own())
    page.get_by_role("heading", name="Robots").wait_for()
    assert not [url for url in asked if "/shared/" in url or "/widgets/" in url], "nobody needs them yet"
    page.get_by_text("Rover").first.click()
    wait_connected(page)

    thermometer = page.locator("[data-label=cpu]")
    expect(thermometer.get_by_text("42.5 °C")).to_be_visible()
    thermometer.get_by_role("button", name="in °F").click()
    expect(thermometer.get_by_text("108.5 °F")).to_be_visible()

    fickle = page.locator("[data-label=fickle]")
    expect(fickle.get_by_text("I am fickle, the client knows me: true")).to_be_visible()
    for where, words in (("render", "thrown while drawing"), ("effect", "thrown in an effect")):
        fickle.get_by_role("button", name=f"Fail in {where}").click()
        failure = fickle.get_by_role("status")
        expect(failure).to_contain_text("Fickle (acme-trouble 3.1.4) failed")
        expect(failure).to_contain_text(words)
        photographed(page, f"plugin-widget-failed-in-{where}")
        fickle.get_by_role("button", name="Try again").click()
        expect(fickle.get_by_text("I am fickle")).to_be_visible()

    site.temperature.write_text("50000\n")
    expect(thermometer.get_by_text("122.0 °F")).to_be_visible()
    ahead = page.locator("[data-label=ahead]")
    expect(ahead).to_contain_text("Panel of acme-trouble 3.1.4 can’t be shown. It is written for version 2")
    expect(ahead).to_contain_text("fickle")  # the stock widget, in its place


def test_a_server_without_the_plugin_says_so_and_shows_the_stock_widget(
    site: Site, server: Any, seed: Any, sign_in: Any, page: Page
) -> None:
    asked: list[str] = []
    page.on("request", lambda request: asked.append(request.url))
    sign_in(page)
    page.goto(f"{server.url}/robots/{seed.robot_id}")
    wait_connected(page)
    thermometer = page.locator("[data-label=cpu]")
    expect(thermometer).to_contain_text("ThermometerPanel of acme-workbench 1.2.0 can’t be shown")
    expect(thermometer).to_contain_text("The server does not have this plugin")
    expect(thermometer.get_by_role("definition")).to_contain_text("°C")  # the stock widget, in its place
    photographed(page, "plugin-widget-not-installed")
    assert not [url for url in asked if "/widgets/" in url]
