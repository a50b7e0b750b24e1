"""A person with Chromium in one of the networks. What the page's peer connections find is kept in ``iceSeen``."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any, Protocol

from laboratory.fleet import Fleet
from playwright.sync_api import Page, sync_playwright
from support.people import wait_connected

QUIET = ["--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run", "--disable-background-networking"]
REAL_ADDRESSES = "--disable-features=WebRtcHideLocalIpsWithMdns"
OBSERVER = """
const Plain = window.RTCPeerConnection
window.iceSeen = { candidates: [], pair: null }
window.RTCPeerConnection = class extends Plain {
  constructor(...options) {
    super(...options)
    this.addEventListener('icecandidate', ({ candidate }) => {
      if (candidate?.candidate) window.iceSeen.candidates.push(candidate.candidate)
    })
    this.addEventListener('connectionstatechange', async () => {
      if (this.connectionState !== 'connected') return
      const stats = [...(await this.getStats()).values()]
      const one = (id) => stats.find((entry) => entry.id === id)
      const pair = one(stats.find((entry) => entry.type === 'transport')?.selectedCandidatePairId)
      const types = [one(pair?.localCandidateId)?.candidateType, one(pair?.remoteCandidateId)?.candidateType]
      window.iceSeen.pair ??= types.join(' ')
    })
  }
}
const seen = (window.firsts = {})
const mark = (name) => { seen[name] ??= performance.now() }
document.addEventListener('click', (event) => { seen.click ??= event.timeStamp }, { capture: true })
new MutationObserver(() => {
  for (const video of document.querySelectorAll('video:not([data-observed])')) {
    video.dataset.observed = ''
    video.requestVideoFrameCallback(() => mark('frame'))
  }
  if (document.querySelector('[data-testid=trail-text]')?.textContent) mark('data')
}).observe(document, { childList: true, characterData: true, subtree: true })
"""


@dataclass(frozen=True)
class Visit:
    """``candidates``: what the page found; ``pair``: the types of both ends of the path it uses."""

    data_s: float
    frame_s: float
    candidates: list[str]
    pair: str


class Place(Protocol):
    """A server with its dashboard, and an account with a robot."""

    @property
    def url(self) -> str: ...
    @property
    def account(self) -> Mapping[str, str]: ...


def sign_in(page: Page, place: Place) -> None:
    """To the list of robots."""
    page.goto(place.url)
    page.get_by_label("Email").fill(place.account["email"])
    page.locator("input[type=password]").fill(place.account["password"])
    page.keyboard.press("Enter")
    page.get_by_role("heading", name="Robots").wait_for()


def open_robot(page: Page, place: Place) -> None:
    """Sign in, and go to the robot's page, until it is connected."""
    sign_in(page, place)
    page.goto(f"{place.url}/robots/{place.account['robotId']}")
    wait_connected(page)


@contextmanager
def signed_in(fleet: Fleet, chromium: str, *flags: str) -> Iterator[Page]:
    """The list of robots; call it inside the operator's network."""
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=chromium, args=[*QUIET, *flags])
        page = browser.new_page(viewport={"width": 1280, "height": 900})
        page.set_default_timeout(30_000)
        page.add_init_script(OBSERVER)
        sign_in(page, fleet)
        yield page
        browser.close()


def visit(fleet: Fleet, page: Page) -> Visit:
    """Click on the robot, and wait for the first value and the first picture."""
    page.goto(fleet.url)
    robot = page.get_by_role("link").filter(has_text="Lab robot")
    robot.get_by_text("Online", exact=True).wait_for()
    robot.click()
    page.wait_for_function("() => window.firsts.frame && window.firsts.data && window.iceSeen.pair", polling=100)
    found: dict[str, Any] = page.evaluate("() => ({ ...window.firsts, ...window.iceSeen })")
    click = found["click"]
    times = ((found[name] - click) / 1000 for name in ("data", "frame"))
    return Visit(*times, candidates=found["candidates"], pair=found["pair"])
