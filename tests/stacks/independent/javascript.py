"""The peers of `peers.js` as Python calls them: in a page of Chromium, or in Node over libdatachannel."""

from __future__ import annotations

import itertools
import json
import subprocess
from pathlib import Path
from typing import Any

HERE = Path(__file__).parent


class NodeHost:
    """A Node process; several peers may live in it."""

    def __init__(self, node: str, packages: Path) -> None:
        words = [node, "--experimental-websocket", "--no-warnings", str(HERE / "node_peer.mjs"), str(packages)]
        pipe = subprocess.PIPE
        self._process = subprocess.Popen(words, stdin=pipe, stdout=pipe, text=True, bufsize=1)
        self._ids = itertools.count()
        self._names = itertools.count()

    def make(self, kind: str, url: str) -> JavaScriptPeer:
        peer = JavaScriptPeer(self, f"peer{next(self._names)}")
        self.call(peer.name, "new", kind, url)
        return peer

    def call(self, name: str, method: str, *args: Any) -> Any:
        assert self._process.stdin is not None
        assert self._process.stdout is not None
        wanted = next(self._ids)
        self._process.stdin.write(json.dumps([wanted, name, method, args]) + "\n")
        for line in self._process.stdout:
            if not line.startswith("["):
                continue
            found, error, result = json.loads(line)
            if found == wanted:
                assert error is None, error
                return result
        raise AssertionError(f"node ended with {self._process.poll()}")

    def close(self) -> None:
        assert self._process.stdin is not None
        self._process.stdin.close()
        assert self._process.stdout is not None
        self._process.stdout.close()
        try:
            self._process.wait(timeout=5)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait(timeout=5)


class ChromiumHost:
    """A page of Chromium whose address is the server's own, with nothing in it but `peers.js`."""

    def __init__(self, page: Any, url: str) -> None:
        self._page = page
        self._names = itertools.count()
        html = "<!doctype html><title>raw</title><script type=module>import * as m from './peers.js'; window.made = m"
        page.route("**/raw/", lambda route: route.fulfill(body=html + "</script>", content_type="text/html"))
        page.route("**/raw/peers.js", lambda route: route.fulfill(path=HERE / "peers.js"))
        page.goto(f"{url}/raw/")
        page.wait_for_function("() => window.made")

    def make(self, kind: str, url: str) -> JavaScriptPeer:
        peer = JavaScriptPeer(self, f"peer{next(self._names)}")
        self._page.evaluate("([name, kind, url]) => { window[name] = new made[kind](url) }", [peer.name, kind, url])
        return peer

    def call(self, name: str, method: str, *args: Any) -> Any:
        return self._page.evaluate("([name, method, args]) => window[name][method](...args)", [name, method, args])


class JavaScriptPeer:
    """`peer("call", robot_id, ["pose"])`: a method of the page or robot over there."""

    def __init__(self, host: NodeHost | ChromiumHost, name: str) -> None:
        self._host, self.name = host, name

    def __call__(self, method: str, *args: Any) -> Any:
        return self._host.call(self.name, method, *args)
