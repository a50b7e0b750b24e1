"""Lists what the page's own libraries export, for widgets that import it: `tests/runtime/widgets` holds it against
their sources."""

from __future__ import annotations

from collections.abc import Mapping

SHARED_EXPORTS: Mapping[str, frozenset[str]] = {
    "@mosaic/client": frozenset({
        "BidirectionalStore", "ConnectionCheckingStore", "ControlDesk", "DATA_TYPES", "DeliveryWatch",
        "FIRST_FRAME_TIMEOUT_MS", "MOMENT_TITLES", "MediaStreamStore", "MosaicClient", "MosaicError", "MosaicStore",
        "ORIGINAL_TYPES", "ReceivableStore", "RequestCaller", "RobotConnection", "RobotStatus", "SendableStore",
        "StoreCounters", "StoreManager", "TalkStore", "Value", "WIDGET_HINTS", "answerPatienceMs",
        "browserPlatform",
        "connectorsInTabs", "describedCatalogue", "describedEntry", "driveOf", "entryFor", "firstFrameCode",
        "guessOf", "messages", "nearestName", "nowMs", "pageTicks", "parallelNumOf", "plainText", "randomId",
        "readConnectorConfig", "reasonOf", "resourceOf", "siblingsOf", "timelineJson", "timerTicks", "typeOf",
        "writeConnectorConfig",
    }),
    "@mosaic/react": frozenset({
        "MosaicProvider", "useConnectedRobot", "useControl", "useControlEvents", "useLease", "useLimits",
        "useMosaicClient", "useMosaicStore", "useReadable", "useRequest", "useRobotConnection", "useRobots",
        "useStop",
    }),
    "@mosaic/widgets": frozenset({
        "AgeBadge", "ConnectorCard", "ControlFrame", "ControlNews", "FailureAlert", "HoldButton", "LeaseButton",
        "LeaseButtons", "LeaseRequests", "Mismatch", "MosaicPage", "Notice", "Presence", "RobotChoice",
        "SignInForm", "StopButton", "StoppedBanner", "WidgetCard", "chooseWidget", "cssVariables", "download",
        "failureOf", "fileName", "fitOf", "lazyDialog", "signInFailureOf", "theme", "useConnectorStore",
        "useEntries", "useEveryJson", "useEveryMessage", "useLatest", "useLatestJson", "useSiblings",
        "useStopRobot", "widgets", "widgetsFor",
    }),
}  # fmt: skip
"""By the name of the module; types, which are gone when a browser reads a widget, are left out."""
