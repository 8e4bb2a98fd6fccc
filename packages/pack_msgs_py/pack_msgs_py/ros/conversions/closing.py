"""Why a bin was closed, as a standard message: a text for people, and counts as keys and values."""

from __future__ import annotations

from diagnostic_msgs.msg import DiagnosticStatus, KeyValue

from pack_msgs_py.checks import InvalidValue, check_count, check_name, check_seconds
from pack_msgs_py.closing import Cause, ClosingReason
from pack_msgs_py.codes import ErrorCode

_BOXES, _REFUSED, _ASKED, _DEADLINE = 'boxes.', 'refused.', 'asked', 'deadline'


def closing_to_ros(reason: ClosingReason) -> DiagnosticStatus:
    """A reason as diagnostic_msgs/DiagnosticStatus: name the bin, message for people, counts."""
    values: dict[str, object] = {
        **{f'{_BOXES}{cause.value}': number for cause, number in reason.causes.items()},
        _ASKED: reason.asked,
        **{f'{_REFUSED}{code.name}': number for code, number in reason.refused.items()},
        _DEADLINE: reason.deadline_s,
    }
    return DiagnosticStatus(
        level=DiagnosticStatus.OK,
        name=reason.bin_id,
        message=reason.text,
        values=[KeyValue(key=key, value=str(value)) for key, value in values.items()],
    )


def closing_from_ros(msg: DiagnosticStatus) -> ClosingReason:
    """diagnostic_msgs/DiagnosticStatus as a checked value; keys that nobody knows are left out."""
    if not msg.name:
        text = 'a reason for closing names no bin'
        raise InvalidValue(text)
    check_name('name', msg.name)
    values = {pair.key: pair.value for pair in msg.values}

    def count(key: str) -> int:
        return check_count(key, int(values.get(key, '0')))

    try:
        return ClosingReason(
            msg.name,
            {
                Cause(key.removeprefix(_BOXES)): count(key)
                for key in values
                if key.startswith(_BOXES)
            },
            count(_ASKED),
            {
                ErrorCode[key.removeprefix(_REFUSED)]: count(key)
                for key in values
                if key.startswith(_REFUSED)
            },
            check_seconds(_DEADLINE, float(values.get(_DEADLINE, '0'))),
        )
    except (ValueError, KeyError) as error:
        text = f'the reason for closing {msg.name!r} has a count that is none: {error}'
        raise InvalidValue(text) from None
