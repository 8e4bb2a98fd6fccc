"""Where boxes come from: box files, the built-in stream, repetition and order."""

from conveyor_sim.streams.files import BUILT_IN, load_boxes, read_entries
from conveyor_sim.streams.rows import BoxFileError, Entry, RejectedRow
from conveyor_sim.streams.stream import Stream

__all__ = [
    'BUILT_IN',
    'BoxFileError',
    'Entry',
    'RejectedRow',
    'Stream',
    'load_boxes',
    'read_entries',
]
