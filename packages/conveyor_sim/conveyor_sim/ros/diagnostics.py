"""The state of the conveyor for `/diagnostics` (REP 107)."""

from __future__ import annotations

from builtin_interfaces.msg import Time as TimeMsg
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue

from conveyor_sim.conveyor.conveyor import Conveyor

#: What the belt waits for, by its condition.
_WAITS_FOR = {
    'paused': 'an operator to resume',
    'jammed': 'the jam to be over and acknowledged',
    'standing with the arm': 'the arm',
    'inactive': 'to be activated',
    'draining': 'an operator to feed again',
}


def diagnostics_to_ros(name: str, conveyor: Conveyor, said: str, stamp: TimeMsg) -> DiagnosticArray:
    """What the belt does, where the boxes are, and what has been seen since the first start.

    ``said`` tells who has brought it into its state; empty when nobody has.
    """
    condition, seen = conveyor.condition, conveyor.statistics
    values = {
        'belt': condition,
        'waits_for': _WAITS_FOR.get(condition, ''),
        'supplied': str(conveyor.supplied),
        **{place.value: str(number) for place, number in conveyor.counts.items()},
        'longest_wait_s': f'{seen.longest_wait_s:.1f}',
        'longest_wait_box': seen.longest_wait_box,
        'most_laps': str(seen.most_laps),
        'missed_windows': str(seen.missed_windows),
        'late_picks': str(seen.late_picks),
        'jams': str(seen.jams),
    }
    runs = condition == 'running'
    msg = DiagnosticArray(
        status=[
            DiagnosticStatus(
                level=DiagnosticStatus.OK if runs else DiagnosticStatus.WARN,
                name=name.lstrip('/'),
                message=said or condition,
                values=[KeyValue(key=key, value=value) for key, value in values.items()],
            )
        ]
    )
    msg.header.stamp = stamp
    return msg
