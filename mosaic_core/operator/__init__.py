"""The headless operator: what tests, the command line and programs without a browser use.

::

    async with await MosaicOperator.login("https://mosaic.example.org", "me@example.org", password) as operator:
        robot = (await operator.robots())[0]
        connection = await operator.connect(robot.id)
        connection.receivable("battery").subscribe(lambda data: print(data.decode()))
        image = await connection.media("front").next_image()

Importing it loads no WebRTC; the first :meth:`MosaicOperator.connect` does.
"""

from mosaic_core.machines.control.operator_control import LeaseView
from mosaic_core.machines.control.stop_call import StopReport
from mosaic_core.operator.control.control_desk import ControlDesk
from mosaic_core.operator.control.lease import Lease, LeaseDenied, LeaseLost
from mosaic_core.operator.control.original_drives import ZerosReport
from mosaic_core.operator.delivery.data_port import MessageInfo, Received
from mosaic_core.operator.mosaic_operator import MosaicOperator
from mosaic_core.operator.robot_connection import RobotConnection
from mosaic_core.operator.signaling.rest_api import RobotSummary
from mosaic_core.operator.stores.channel_plan import UnknownLabel
from mosaic_core.operator.stores.connection_checking_store import ConnectionCheckingStore
from mosaic_core.operator.stores.media_store import MediaStreamStore, Shown, SoundStore, VoiceStore
from mosaic_core.operator.stores.mosaic_store import MosaicStore, StoreState
from mosaic_core.operator.stores.request_caller import RequestFailed, RequestRefused
from mosaic_core.operator.stores.robot_connector import RobotConnector
from mosaic_core.operator.stores.store_manager import StoreManager
from mosaic_core.operator.stores.stores import BidirectionalStore, ReceivableStore, SendableStore
from mosaic_core.words.described import DescribedConnector

__all__ = [
    "BidirectionalStore",
    "ConnectionCheckingStore",
    "ControlDesk",
    "DescribedConnector",
    "Lease",
    "LeaseDenied",
    "LeaseLost",
    "LeaseView",
    "MediaStreamStore",
    "MessageInfo",
    "MosaicOperator",
    "MosaicStore",
    "ReceivableStore",
    "Received",
    "RequestFailed",
    "RequestRefused",
    "RobotConnection",
    "RobotConnector",
    "RobotSummary",
    "SendableStore",
    "Shown",
    "SoundStore",
    "StopReport",
    "StoreManager",
    "StoreState",
    "UnknownLabel",
    "VoiceStore",
    "ZerosReport",
]
