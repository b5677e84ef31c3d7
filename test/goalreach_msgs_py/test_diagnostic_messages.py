"""What travels as diagnostics to messages and back, and messages that cannot be used."""

from collections.abc import Callable
from dataclasses import replace

from diagnostic_msgs.msg import DiagnosticArray
from hypothesis import given, settings
from hypothesis import strategies as st
import numpy as np
import pytest
from rclpy.serialization import serialize_message
from std_msgs.msg import Float64MultiArray, String

from goalreach_msgs_py.cdr import MessageError
from goalreach_msgs_py.diagnostic_messages import (
    WARN,
    Status,
    learner_from_raw,
    learner_to_raw,
    q_table_from_raw,
    q_table_to_raw,
    state_from_raw,
    state_to_raw,
    statuses_from_raw,
    statuses_to_raw,
    transition_from_raw,
    transition_to_raw,
)
from goalreach_msgs_py.values import Confidence, PathOutcome, Pose2, RegionState, Transition
from ros_objects import as_object, by_others, changed

STAMP = 1_234_567_890_123
METRES = st.floats(-100.0, 100.0)
MEMBERSHIPS = st.tuples(*[st.floats(0.0, 1.0)] * 3)
STATES = st.builds(
    RegionState,
    region=st.tuples(st.integers(0, 2), st.integers(0, 2)),
    mu_x=MEMBERSHIPS,
    mu_y=MEMBERSHIPS,
    pose=st.builds(Pose2, x_m=METRES, y_m=METRES, heading_rad=st.floats(-3.14, 3.14)),
    goal_probability=st.floats(0.0, 1.0),
    confidence=st.sampled_from(Confidence),
)
STATE = RegionState(
    region=(1, 0),
    mu_x=(0.1, 0.9, 0.0),
    mu_y=(1.0, 0.0, 0.0),
    pose=Pose2(x_m=1.5, y_m=0.5, heading_rad=0.75),
    goal_probability=0.5,
    confidence=Confidence.UNCERTAIN,
)
RAW_STATE = state_to_raw(STATE, STAMP)
TRANSITION = Transition(
    state=(0, 1),
    action=7,
    reward=-1.0,
    next_state=(1, 1),
    temperature=0.25,
    trial=3,
    path=70,
    outcome=None,
)
Q = np.arange(72, dtype=np.float64).reshape(3, 3, 8)


def test_statuses_survive() -> None:
    status = Status(
        level=WARN, name='a', message='b c', hardware_id='d', values={'e': 'ü', '': ''}
    )
    raw = statuses_to_raw([status], STAMP)
    for each in by_others(raw, DiagnosticArray):
        assert statuses_from_raw(each) == [status]
    message = as_object(raw, DiagnosticArray)
    message.status *= 2
    assert statuses_from_raw(serialize_message(message)) == [status, status]


@settings(deadline=None)  # the first message of a type generates its codecs
@given(STATES)
def test_state_survives_to_the_last_digit(state: RegionState) -> None:
    for raw in by_others(state_to_raw(state, STAMP), DiagnosticArray):
        assert state_from_raw(raw) == state


def test_state_speaks_the_names_of_the_paper() -> None:
    message = as_object(RAW_STATE, DiagnosticArray)
    (status,) = message.status
    assert message.header.frame_id == 'map'
    assert (status.name, status.message, status.level) == ('region_state', 'FRONT/NEAR', b'\x01')
    assert {pair.key: pair.value for pair in status.values}['mu_x.LEFT-SIDE'] == '0.1'


def test_state_with_values_in_another_order_among_other_statuses_is_read() -> None:
    message = as_object(RAW_STATE, DiagnosticArray)
    message.status[0].values = message.status[0].values[::-1]
    other = as_object(transition_to_raw(TRANSITION, STAMP), DiagnosticArray).status[0]
    message.status = [other, message.status[0]]
    assert state_from_raw(serialize_message(message)) == STATE


@pytest.mark.parametrize(
    ('key', 'value'), [('mu_x.FRONT', 'x'), ('x_m', 'nan'), ('x_m', '1e999'), ('y_m', None)]
)
def test_state_with_a_bad_value_is_refused_by_name(key: str, value: str | None) -> None:
    message = as_object(RAW_STATE, DiagnosticArray)
    pairs = message.status[0].values
    if value is None:
        message.status[0].values = [pair for pair in pairs if pair.key != key]
    else:
        next(pair for pair in pairs if pair.key == key).value = value
    with pytest.raises(MessageError, match=key):
        state_from_raw(serialize_message(message))


@pytest.mark.parametrize(
    ('field', 'value', 'reason'),
    [
        ('message', 'FRONT/HERE', 'FRONT/HERE'),
        ('level', b'\x02', 'level = 2'),
        ('name', 'other', 'without the name region_state'),
    ],
)
def test_state_of_another_kind_is_refused(field: str, value: object, reason: str) -> None:
    message = as_object(RAW_STATE, DiagnosticArray)
    setattr(message.status[0], field, value)
    with pytest.raises(MessageError, match=reason):
        state_from_raw(serialize_message(message))


@pytest.mark.parametrize('outcome', [None, *PathOutcome])
def test_transition(outcome: PathOutcome | None) -> None:
    transition = replace(TRANSITION, outcome=outcome)
    raw = transition_to_raw(transition, STAMP)
    assert as_object(raw, DiagnosticArray).status[0].message == 'LEFT-SIDE/MEDIUM -> FRONT/MEDIUM'
    for each in by_others(raw, DiagnosticArray):
        assert transition_from_raw(each) == transition


def _spoilt(key: str, value: str) -> bytes:
    (status,) = statuses_from_raw(transition_to_raw(TRANSITION, STAMP))
    values = {**status.values, key: value} if value else {'action': '1', 'state': 'FRONT/NEAR'}
    return statuses_to_raw([replace(status, values=values)], STAMP)


@pytest.mark.parametrize(
    ('key', 'value', 'reason'),
    [
        ('action', 'x', 'values: .*x'),
        ('reward', 'inf', 'reward = inf'),
        ('temperature', 'hot', "temperature = 'hot'"),
        ('state', 'HERE', 'HERE'),
        ('outcome', 'lost', 'lost'),
        ('', '', 'values without reward'),
    ],
)
def test_transition_with_a_bad_value_is_refused(key: str, value: str, reason: str) -> None:
    with pytest.raises(MessageError, match=reason):
        transition_from_raw(_spoilt(key, value))


def test_q_table_is_labelled() -> None:
    raw = q_table_to_raw(Q)
    message = as_object(raw, Float64MultiArray)
    layout = [(d.label, d.size, d.stride) for d in message.layout.dim]
    assert layout == [('x', 3, 72), ('y', 3, 24), ('action', 8, 8)]
    assert message.data.tolist() == Q.ravel().tolist()
    for each in by_others(raw, Float64MultiArray):
        assert (q_table_from_raw(each) == Q).all()


def test_q_table_in_another_order_of_memory_is_the_same() -> None:
    assert q_table_to_raw(np.asfortranarray(Q)) == q_table_to_raw(Q)


def test_q_table_of_another_shape_is_refused() -> None:
    short = as_object(q_table_to_raw(Q), Float64MultiArray).data[:-1]
    with pytest.raises(MessageError, match='layout'):
        q_table_from_raw(changed(q_table_to_raw(Q), Float64MultiArray, data=short))


def test_q_table_with_a_bad_value_is_refused() -> None:
    q = Q.copy()
    q[1, 1, 1] = np.inf
    with pytest.raises(MessageError, match='not finite'):
        q_table_from_raw(q_table_to_raw(q))


@pytest.mark.parametrize(
    ('reader', 'raw'),
    [
        (state_from_raw, RAW_STATE),
        (transition_from_raw, transition_to_raw(TRANSITION, STAMP)),
        (q_table_from_raw, q_table_to_raw(Q)),
    ],
)
def test_what_is_cut_off_is_refused(reader: Callable[[bytes], object], raw: bytes) -> None:
    for size in range(0, len(raw), 7):
        with pytest.raises(MessageError):
            reader(raw[:size])


def test_a_learner_travels_as_a_text_that_others_read() -> None:
    learner = {'name': 'planner', 'state': {'walls': [[1, 0, 3.3]]}}
    raw = learner_to_raw(learner)
    assert learner_from_raw(raw) == learner
    text = String(data='{"name": "mine", "state": {}}')
    assert serialize_message(String(data=as_object(raw, String).data)) == raw
    assert learner_from_raw(serialize_message(text)) == {'name': 'mine', 'state': {}}


@pytest.mark.parametrize(
    'data',
    [
        *('', '[]', '{"name": "mine"}', '{"name": 1, "state": 2}', '{'),
        *(
            f'{{"name": "mine", "state": {{"a": [{one}]}}}}'
            for one in ('NaN', '-Infinity', '1e999')
        ),
    ],
)
def test_what_is_no_learner_is_refused(data: str) -> None:
    with pytest.raises(MessageError):
        learner_from_raw(serialize_message(String(data=data)))
