"""Why a bin was closed, as a standard message: a text for people, and counts as keys and values."""

from __future__ import annotations

from diagnostic_msgs.msg import DiagnosticStatus, KeyValue

from pack_msgs_py.checks import InvalidValue
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
    values = {pair.key: pair.value for pair in msg.values}
    try:
        return ClosingReason(
            msg.name,
            {
                Cause(key.removeprefix(_BOXES)): int(value)
                for key, value in values.items()
                if key.startswith(_BOXES)
            },
            int(values.get(_ASKED, '0')),
            {
                ErrorCode[key.removeprefix(_REFUSED)]: int(value)
                for key, value in values.items()
                if key.startswith(_REFUSED)
            },
            float(values.get(_DEADLINE, '0')),
        )
    except (ValueError, KeyError) as error:
        text = f'the reason for closing {msg.name!r} has a count that is none: {error}'
        raise InvalidValue(text) from None
