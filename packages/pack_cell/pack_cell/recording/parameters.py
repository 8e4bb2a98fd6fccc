"""Parameters of the node `topic_recorder`."""

from __future__ import annotations

from dataclasses import dataclass

from pack_msgs_py.parameter_fields import parameter


@dataclass(frozen=True)
class RecorderParameters:
    """See the description of each field."""

    file: str = parameter(
        '', 'the recording, an MCAP file that is written anew; empty for none', read_only=True
    )
    state_dir: str = parameter(
        '',
        'folder of the journals, beside which the last seconds before a fault are kept; empty: '
        'they are not',
        read_only=True,
    )
    keep_s: float = parameter(
        30.0,
        'how much of what was said before a fault is kept',
        unit='s',
        low=1.0,
        high=600.0,
        read_only=True,
    )
    chunk_s: float = parameter(
        30.0,
        'what is said in so long is compressed together; a crash loses at most that',
        unit='s',
        low=0.1,
        high=600.0,
        read_only=True,
    )
