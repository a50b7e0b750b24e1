"""The operator's half of the doctor in a real browser, and how a connection came up, in details and in a failure."""

from __future__ import annotations

import json
from typing import Any

import pytest
from playwright.sync_api import Page, expect
from support.people import Driver, photographed, wait_connected

pytestmark = [pytest.mark.e2e, pytest.mark.timeout(120)]


GATHERING_MS = 6_000
LINKING_MS = 15_000
"""The page's patience with ICE servers and with a path to the robot; its clock is set forward by as much."""
KEEP_SETTLED = """(() => {
  const method = '%s'
  const plain = RTCPeerConnection.prototype[method]
  window.settled = []
  RTCPeerConnection.prototype[method] = function (...words) {
    return plain.apply(this, words).finally(() => window.settled.push(this))
  }
})()"""

BOTH_HAVE_ADDRESSES = """() => window.settled.length === 2
  && window.settled.every(({ localDescription }) => localDescription.sdp.includes(' typ host'))"""


@pytest.fixture
def page(browser: Any) -> Any:
    context = browser.new_context(
        viewport={"width": 1280, "height": 900}, permissions=["clipboard-read", "clipboard-write"]
    )
    page = context.new_page()
    page.set_default_timeout(20_000)
    yield page
    context.close()


def test_the_check_page_looks_at_browser_server_and_ice_without_a_robot(page: Page, server: Any, seed: Any) -> None:
    Driver(page, server.url, seed).sign_in()
    page.get_by_role("link", name="Check connection").click()
    check = page.get_by_test_id("check")
    expect(check).to_have_attribute("aria-busy", "false", timeout=20_000)
    for group in ("This browser", "Network", "Server", "STUN, TURN, NAT"):
        expect(page.get_by_role("region", name=group)).to_be_visible()
    expect(check).to_contain_text("This browser has WebRTC.")
    expect(check).to_contain_text("The clocks of this machine and of the server agree")
    expect(check).to_contain_text("ice.no_servers")
    photographed(page, "check")
    page.get_by_role("button", name="Copy as JSON").click()
    copied = json.loads(page.evaluate("() => navigator.clipboard.readText()"))
    assert copied["version"] == 1
    assert {"browser.webrtc", "server.http", "network.addresses"} <= {one["check"] for one in copied["findings"]}


def test_ice_servers_that_help_nobody_are_named_and_hinder_nobody(
    page: Page, server: Any, seed: Any, robot: Any, sign_in: Any
) -> None:
    dead, useless = "stun:192.0.2.77:3478", "turn:192.0.2.77:3478"  # TEST-NET-1 (RFC 5737): nobody is there
    page.route("**/webrtc/ice-servers", lambda route: route.fulfill(json=[{"urls": [dead]}, {"urls": [useless]}]))
    page.clock.install()
    page.add_init_script(KEEP_SETTLED % "setLocalDescription")
    sign_in(page)
    page.goto(server.url)
    page.get_by_role("link", name="Check connection").click()
    check = page.get_by_test_id("check")
    page.wait_for_function(BOTH_HAVE_ADDRESSES)
    page.clock.fast_forward(GATHERING_MS)
    expect(check).to_have_attribute("aria-busy", "false")
    expect(check).to_contain_text(f"What to do first: {useless} is left out")
    silent = check.get_by_role("listitem").filter(has_text=dead)
    expect(silent).to_contain_text("no answer within the time")
    expect(silent).to_have_attribute("data-status", "warn")
    photographed(page, "check-ice")
    page.goto(f"{server.url}/robots/{seed.robot_id}")
    wait_connected(page)


def test_a_connected_robot_shows_how_the_connection_came_up(
    page: Page, server: Any, seed: Any, robot: Any, sign_in: Any
) -> None:
    sign_in(page)
    page.goto(f"{server.url}/robots/{seed.robot_id}")
    wait_connected(page)
    page.wait_for_function("() => (document.querySelector('video')?.videoWidth ?? 0) > 0")
    page.get_by_role("button", name="Connection details").click()
    timeline = page.get_by_test_id("timeline")
    for title in ("Path found (ICE)", "Encrypted (DTLS)", "Control channel open", "First value", "First picture"):
        expect(timeline).to_contain_text(title)
    expect(timeline).to_contain_text("over UDP")
    photographed(page, "details")
    page.get_by_role("button", name="Copy as JSON").click()
    copied = json.loads(page.evaluate("() => navigator.clipboard.readText()"))
    assert {"asked", "ice", "frame"} <= {mark["moment"] for mark in copied["marks"]}


def test_a_connection_that_fails_shows_how_far_it_got(
    page: Page, server: Any, seed: Any, robot: Any, sign_in: Any
) -> None:
    page.add_init_script("RTCPeerConnection.prototype.addIceCandidate = async () => {}")
    page.add_init_script("""
      const accept = RTCPeerConnection.prototype.setRemoteDescription
      RTCPeerConnection.prototype.setRemoteDescription = function (description) {
        return accept.call(this, { type: description.type, sdp: description.sdp.replace(/a=candidate.*\\r\\n/g, '') })
      }
      Object.defineProperty(RTCPeerConnection.prototype, 'onicecandidate', { set() {}, get: () => null })
    """)
    page.add_init_script(KEEP_SETTLED % "setRemoteDescription")
    page.clock.install()
    sign_in(page)
    page.goto(f"{server.url}/robots/{seed.robot_id}")
    page.wait_for_function("() => window.settled.length === 1")
    page.clock.fast_forward(LINKING_MS)
    notice = page.get_by_role("alert").filter(has_text="ice.")
    notice.wait_for()
    notice.get_by_text("How far it got").click()
    expect(notice.get_by_test_id("timeline")).to_contain_text("Answer received")
    expect(notice.get_by_test_id("timeline")).to_contain_text("Ended")
    photographed(page, "failed")
