"""Commands, parameters and missions as pure machines: with an autopilot that is made up, over a link that loses."""

from __future__ import annotations

import random
from collections.abc import Callable
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st
from pymavlink.dialects.v20 import ardupilotmega as words

from mosaic_mavlink.fake.autopilot import FakeAutopilot
from mosaic_mavlink.link.codec import MavlinkCodec
from mosaic_mavlink.link.outgoing import OutgoingMessage
from mosaic_mavlink.requests.command_words import CommandConversation
from mosaic_mavlink.requests.conversation import (
    Concluded,
    Conversation,
    Effect,
    NotConcluded,
    SendMessage,
    ShowProgress,
)
from mosaic_mavlink.requests.mission_words import ClearMission, DownloadMission, MissionStep, UploadMission
from mosaic_mavlink.requests.parameter_words import (
    GetParameter,
    ListParameters,
    SetParameter,
    read_value,
    written_value,
)

ARM = (1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
Loses = Callable[[], bool]


class Talk:
    """Lets a conversation and an autopilot talk, in fake time."""

    def __init__(self, conversation: Conversation, autopilot: FakeAutopilot, loses: Loses = lambda: False) -> None:
        self.progress: list[ShowProgress] = []
        self.sent: list[OutgoingMessage] = []
        self.end: Concluded | NotConcluded | None = None
        self.now_s = 0.0
        self._conversation, self._autopilot, self._loses = conversation, autopilot, loses
        self._ours, self._its = MavlinkCodec("ardupilotmega", 255, 190), MavlinkCodec("ardupilotmega", 1, 1)
        self._waiting: list[Any] = []
        self._do(conversation.begin(0.0))
        while self.end is None and self.now_s < 120.0:
            self._step()

    def _step(self) -> None:
        if self._waiting:
            self._do(self._conversation.hear(self._waiting.pop(0), self.now_s))
        else:
            self.now_s += 0.1
            self._tell(list(self._autopilot.tick(self.now_s)))
        if self.end is None:
            self._do(self._conversation.time_passed(self.now_s))

    def _do(self, effects: list[Effect]) -> None:
        for effect in effects:
            if isinstance(effect, SendMessage):
                self._send(effect.message)
            elif isinstance(effect, ShowProgress):
                self.progress.append(effect)
            else:
                self.end = effect

    def _send(self, message: OutgoingMessage) -> None:
        self.sent.append(message)
        name, fields = message
        frame = self._ours.packed(name, {"target_system": 1, "target_component": 1, **fields})
        for heard in self._its.messages(frame, None, self.now_s):
            if not self._loses():
                self._tell(list(self._autopilot.hear(heard, self.now_s)))

    def _tell(self, messages: list[OutgoingMessage]) -> None:
        for name, fields in messages:
            is_named = name.startswith("mission_")
            to = {"target_system": 255, "target_component": 190} if is_named else {}
            for message in self._ours.messages(self._its.packed(name, {**to, **fields}), None, self.now_s):
                if message.get_type() in self._conversation.listens and not self._loses():
                    self._waiting.append(message)


def result(talk: Talk) -> Any:
    assert isinstance(talk.end, Concluded), talk.end
    return talk.end.result


def refusal(talk: Talk) -> NotConcluded:
    assert isinstance(talk.end, NotConcluded), talk.end
    return talk.end


def losing(seed: int, share: float) -> Loses:
    dice = random.Random(seed)
    return lambda: dice.random() < share


def arming() -> CommandConversation:
    return CommandConversation("arm", words.MAV_CMD_COMPONENT_ARM_DISARM, ARM)


def test_a_command_that_is_accepted_is_done() -> None:
    autopilot = FakeAutopilot()
    assert result(Talk(arming(), autopilot)) == []
    assert autopilot.armed


def test_why_it_does_not_arm_is_told_in_its_own_words() -> None:
    autopilot = FakeAutopilot()
    autopilot.is_ready = False
    told = refusal(Talk(arming(), autopilot))
    assert told.code == "mavlink.failed"
    assert told.message == (
        "arm: it could not do it: mend what it says, then ask again; it says: PreArm: GPS 1: Bad fix"
    )


@pytest.mark.parametrize(
    ("number", "code"),
    [
        (1, "mavlink.not_now"),
        (2, "mavlink.denied"),
        (3, "mavlink.unsupported"),
        (4, "mavlink.failed"),
        (8, "mavlink.failed"),
    ],
)
def test_each_result_has_its_words(number: int, code: str) -> None:
    conversation = arming()
    conversation.begin(0.0)
    ack = words.MAVLink(None).command_ack_encode(words.MAV_CMD_COMPONENT_ARM_DISARM, number)
    assert conversation.hear(ack, 0.1) == []
    (end,) = conversation.time_passed(1.0)
    assert isinstance(end, NotConcluded)
    assert end.code == code
    assert end.message.startswith("arm: ")


def test_a_command_in_progress_is_waited_for_and_tells_how_far_it_is() -> None:
    conversation, mav = arming(), words.MAVLink(None)
    conversation.begin(0.0)
    assert conversation.hear(mav.command_ack_encode(400, 5, progress=40), 0.5) == [
        ShowProgress(40, 100, "being carried out")
    ]
    assert conversation.time_passed(15.0) == []
    assert conversation.hear(mav.command_ack_encode(400, 0), 16.0) == [Concluded([])]


def test_an_answer_to_another_command_is_none() -> None:
    conversation = arming()
    conversation.begin(0.0)
    assert conversation.hear(words.MAVLink(None).command_ack_encode(511, 0), 0.1) == []


def test_a_command_is_said_again_with_its_count_and_given_up_in_the_end() -> None:
    talk = Talk(arming(), FakeAutopilot(), loses=lambda: True)
    assert [fields["confirmation"] for _, fields in talk.sent] == [0, 1, 2, 3]
    assert refusal(talk).code == "mavlink.no_answer"
    assert 3.9 < talk.now_s < 4.5


def test_parameters_are_got_set_and_listed() -> None:
    autopilot = FakeAutopilot()
    (one,) = result(Talk(GetParameter("WPNAV_SPEED", bytewise=False), autopilot))
    assert (one.name, one.value, one.is_whole) == ("WPNAV_SPEED", 500.0, False)
    (one,) = result(Talk(SetParameter("RTL_ALT", 3000.0, bytewise=False), autopilot))
    assert autopilot.parameters.values["RTL_ALT"][0] == one.value == 3000.0
    listed = Talk(ListParameters(bytewise=False), autopilot)
    assert [parameter.name for parameter in result(listed)] == list(autopilot.parameters.values)
    assert listed.progress[0] == ShowProgress(1, 5)


def test_px4_puts_the_bytes_of_whole_numbers_where_the_float_would_be() -> None:
    autopilot = FakeAutopilot("px4")
    (one,) = result(Talk(SetParameter("FENCE_ENABLE", 3.0, bytewise=True), autopilot))
    assert (one.value, one.is_whole) == (3.0, True)
    assert autopilot.parameters.values["FENCE_ENABLE"][0] == 3.0


def test_a_half_is_no_whole_number_and_what_is_kept_is_told() -> None:
    autopilot = FakeAutopilot()
    assert "no whole number" in refusal(Talk(SetParameter("RTL_ALT", 0.5, bytewise=False), autopilot)).message
    conversation = SetParameter("RTL_ALT", 7.0, bytewise=False)
    conversation.begin(0.0)
    kept = words.MAVLink(None).param_value_encode(b"RTL_ALT", 5.0, words.MAV_PARAM_TYPE_INT16, 5, 0)
    kept.param_id = "RTL_ALT"
    conversation.hear(kept, 0.1)
    (end,) = conversation.hear(kept, 0.2)
    assert end == NotConcluded("mavlink.not_set", "RTL_ALT stays 5: the vehicle did not take 7; see its log")


@pytest.mark.parametrize("value", [float("nan"), float("inf")])
def test_a_parameter_that_is_no_number_is_told_as_none_and_can_be_set(value: float) -> None:
    autopilot = FakeAutopilot()
    autopilot.parameters.values["BATT_LOW_VOLT"] = (value, words.MAV_PARAM_TYPE_REAL32)
    (one,) = result(Talk(GetParameter("BATT_LOW_VOLT", bytewise=False), autopilot))
    assert f"{one.value}" == f"{value}"
    (one,) = result(Talk(SetParameter("BATT_LOW_VOLT", 0.0, bytewise=False), autopilot))
    assert one.value == 0.0 == autopilot.parameters.values["BATT_LOW_VOLT"][0]


def test_an_unknown_parameter_is_asked_for_and_given_up() -> None:
    told = refusal(Talk(GetParameter("NO_SUCH", bytewise=False), FakeAutopilot()))
    assert told.code == "mavlink.no_answer"
    assert "is there a parameter of that name?" in told.message


def test_parameters_that_got_lost_are_asked_for_one_by_one() -> None:
    autopilot = FakeAutopilot()
    autopilot.parameters.to_lose = {1, 4}
    talk = Talk(ListParameters(bytewise=False), autopilot)
    assert len(result(talk)) == 5
    assert [fields["param_index"] for name, fields in talk.sent if name == "param_request_read"] == [1, 4]


@given(st.integers(-(2**31), 2**31 - 1))
def test_bytewise_there_and_back_is_the_number(value: int) -> None:
    number = words.MAV_PARAM_TYPE_INT32
    sent = written_value(float(value), number, bytewise=True)
    if sent == sent:  # some whole numbers are the bytes of a NaN, which Python does not keep bit by bit
        message = words.MAVLink(None).param_value_encode(b"X", sent, number, 1, 0)
        message.param_id = "X"
        assert read_value(message, bytewise=True).value == value


def steps(count: int) -> tuple[MissionStep, ...]:
    return tuple(
        MissionStep(16, 3, (float(at), 0.0, 0.0, 0.0), 47.1 + at, 8.2, 30.0, at % 2 == 0) for at in range(count)
    )


def test_a_mission_comes_down_as_it_went_up() -> None:
    autopilot = FakeAutopilot()
    up = Talk(UploadMission(steps(7)), autopilot)
    assert result(up) == 7
    assert up.progress[-1] == ShowProgress(7, 7)
    down = Talk(DownloadMission(), autopilot)
    assert tuple(result(down)) == steps(7)
    assert [one.done for one in down.progress] == [*range(1, 8)]
    assert down.sent[-1] == ("mission_ack", {"type": words.MAV_MISSION_ACCEPTED})
    assert result(Talk(ClearMission(), autopilot)) == 0
    assert result(Talk(DownloadMission(), autopilot)) == []


def test_a_vehicle_without_room_says_so() -> None:
    told = refusal(Talk(UploadMission(steps(300)), FakeAutopilot()))
    assert told == NotConcluded("mavlink.mission_refused", "the vehicle refuses the mission: no space")


def test_an_acknowledgement_of_an_earlier_exchange_ends_nothing() -> None:
    conversation, mav = UploadMission(steps(2)), words.MAVLink(None)
    conversation.begin(0.0)
    assert conversation.hear(mav.mission_ack_encode(255, 190, 0), 0.1) == []
    assert len(conversation.hear(mav.mission_request_encode(255, 190, 1), 0.2)) == 2
    assert conversation.hear(mav.mission_ack_encode(255, 190, 0), 0.3) == [Concluded(2)]


def test_a_request_for_an_item_that_there_is_not_breaks_it_off() -> None:
    conversation = UploadMission(steps(2))
    conversation.begin(0.0)
    first, end = conversation.hear(words.MAVLink(None).mission_request_int_encode(255, 190, 2), 0.1)
    assert isinstance(first, SendMessage)
    assert isinstance(end, NotConcluded)


def test_cancelling_tells_the_vehicle() -> None:
    for conversation in (UploadMission(steps(2)), DownloadMission()):
        (effect,) = conversation.cancel()
        assert isinstance(effect, SendMessage)
        assert effect.message[1]["type"] == words.MAV_MISSION_OPERATION_CANCELLED
    assert arming().cancel() == []


NONSENSE: list[Callable[[Any, int, int], Any]] = [
    lambda mav, a, b: mav.param_value_encode(b"X", float(a), b % 12, a % 65_536, b % 65_536),
    lambda mav, a, b: mav.mission_count_encode(255, 190, a % 65_536),
    lambda mav, a, b: mav.mission_request_int_encode(255, 190, a % 65_536),
    lambda mav, a, b: mav.mission_ack_encode(255, 190, a % 256),
    lambda mav, a, b: mav.mission_item_int_encode(255, 190, a % 9, b % 256, a % 65_536, 0, 1, 0, 0, 0, 0, b, a, 0.0),
    lambda mav, a, b: mav.command_ack_encode(400, a % 256, progress=b % 256),
    lambda mav, a, b: mav.statustext_encode(a % 256, b"\xff\x00nonsense"),
]


@pytest.mark.parametrize(
    "made",
    [
        lambda: GetParameter("X", bytewise=True),
        lambda: SetParameter("X", 3.0, bytewise=True),
        lambda: ListParameters(bytewise=True),
        lambda: UploadMission(steps(3)),
        DownloadMission,
        ClearMission,
        arming,
    ],
)
@given(said=st.lists(st.tuples(st.sampled_from(NONSENSE), st.integers(0, 2**31 - 1), st.integers(0, 2**31 - 1))))
def test_whatever_a_vehicle_answers_is_a_word_of_the_conversation_or_none(made: Any, said: Any) -> None:
    conversation, mav = made(), words.MAVLink(None)
    conversation.begin(0.0)
    for at_s, (says, a, b) in enumerate(said):
        message = says(mav, a, b)
        if message.get_type() in conversation.listens:
            effects = conversation.hear(message, float(at_s))
            assert all(isinstance(one, Effect) for one in effects)
            if any(isinstance(one, Concluded | NotConcluded) for one in effects):
                return


@pytest.mark.parametrize("seed", range(20))
def test_over_a_link_that_loses_a_tenth_everything_ends_one_way_or_the_other_and_is_true(seed: int) -> None:
    autopilot, loses = FakeAutopilot(), losing(seed, 0.1)
    up = Talk(UploadMission(steps(12)), autopilot, loses)
    if isinstance(up.end, Concluded):
        assert len(autopilot.mission.items) == 12
    down = Talk(DownloadMission(), autopilot, loses)
    if isinstance(down.end, Concluded):
        assert len(down.end.result) == len(autopilot.mission.items)
    listed = Talk(ListParameters(bytewise=False), autopilot, loses)
    assert up.end is not None
    assert down.end is not None
    if isinstance(listed.end, Concluded):
        assert [one.name for one in listed.end.result] == list(autopilot.parameters.values)


def test_over_such_a_link_nearly_everything_arrives() -> None:
    ends = [Talk(UploadMission(steps(12)), FakeAutopilot(), losing(seed, 0.1)).end for seed in range(20)]
    assert sum(isinstance(end, Concluded) for end in ends) >= 18
