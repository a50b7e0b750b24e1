"""The kit for plugin authors: no network, no sleeping, and but for ``joined`` no threads.

::

    handler = build(BatteryConfigurer, params={"period_s": 2})     # params checked as in the YAML file
    first, second = collect(handler, 2)                            # messages(), on a fake clock

    fed = feed(build(LampConfigurer), [{"on": True}, Silence(1.0), Leaves()])
    assert fed.made_safe == [MadeSafe(0.5, "safety.timeout")]

    pictures = take_frames(build(CameraConfigurer, params={…}), 3)    # take_sounds likewise

    asked = ask(build(FilesConfigurer), {"folder": "maps"}, cancel_after_s=2)     # a request, with progress and cancel

    async with joined(connector(BatteryConfigurer, label="battery")) as link:     # robot and operator, in memory
        message = await link.connection.receivable("battery").next_message()

    async with joined(connector(BatteryConfigurer), network=impaired_network("4g")) as link:    # real, bad WebRTC
        ...

    assert await missing_to_gold("acme-gauge") == []                # what `mosaic plugin check` says of the plugin

The pytest plugin adds the fixtures ``fake_clock``, ``impaired_network`` and ``install_distribution``. It lives in this
package and is loaded with every pytest run, so the names are imported when first used.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from mosaic_core.harness.asked_request import Answered, ask
    from mosaic_core.harness.building import build
    from mosaic_core.harness.collecting import collect, take_frames, take_sounds
    from mosaic_core.harness.fake_hosts import FakeClock, FakeHost, fake_host
    from mosaic_core.harness.feed_steps import (
        ANOTHER_OPERATOR,
        OPERATOR,
        Cleared,
        Fed,
        From,
        Leaves,
        LosesLease,
        MadeSafe,
        RefusedMessage,
        Silence,
        SlowedTo,
        Stopped,
    )
    from mosaic_core.harness.feeding import feed
    from mosaic_core.laboratory.joining import Joined, connector, joined, until
    from mosaic_core.laboratory.memory_ends import MemoryFrame
    from mosaic_core.laboratory.memory_network import MemoryNetwork
    from mosaic_core.laboratory.networks import Network, WebRtcNetwork
    from mosaic_core.ladder.missing import missing_to_gold
    from mosaic_core.machines.laboratory.impaired_link import LinkProfile

_NAMES_IN = {
    "harness.asked_request": "Answered ask",
    "harness.building": "build",
    "harness.collecting": "collect take_frames take_sounds",
    "harness.fake_hosts": "FakeClock FakeHost fake_host",
    "harness.feed_steps": "ANOTHER_OPERATOR OPERATOR Cleared Fed From Leaves LosesLease MadeSafe RefusedMessage Silence"
    " SlowedTo Stopped",
    "harness.feeding": "feed",
    "laboratory.joining": "Joined connector joined until",
    "laboratory.memory_ends": "MemoryFrame",
    "laboratory.memory_network": "MemoryNetwork",
    "laboratory.networks": "LinkProfile Network WebRtcNetwork",
    "ladder.missing": "missing_to_gold",
}
_HOME = {name: module for module, names in _NAMES_IN.items() for name in names.split()}


def __getattr__(name: str) -> Any:
    if name not in _HOME:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(f"mosaic_core.{_HOME[name]}"), name)


__all__ = [
    "ANOTHER_OPERATOR",
    "OPERATOR",
    "Answered",
    "Cleared",
    "FakeClock",
    "FakeHost",
    "Fed",
    "From",
    "Joined",
    "Leaves",
    "LinkProfile",
    "LosesLease",
    "MadeSafe",
    "MemoryFrame",
    "MemoryNetwork",
    "Network",
    "RefusedMessage",
    "Silence",
    "SlowedTo",
    "Stopped",
    "WebRtcNetwork",
    "ask",
    "build",
    "collect",
    "connector",
    "fake_host",
    "feed",
    "joined",
    "missing_to_gold",
    "take_frames",
    "take_sounds",
    "until",
]
