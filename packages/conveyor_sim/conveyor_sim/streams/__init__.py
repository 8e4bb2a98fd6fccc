"""Where boxes come from: files, recipes, earlier runs; repetition, order and destinations."""

from conveyor_sim.streams.box_records import BoxFileError, Entry, RejectedRow
from conveyor_sim.streams.by_name import SYNTAX, load_boxes, open_source, resolved
from conveyor_sim.streams.files import BUILT_IN, read_entries
from conveyor_sim.streams.run_folder import BOXES_FILE, write_boxes
from conveyor_sim.streams.stream import Stream, destination_names

__all__ = [
    'BOXES_FILE',
    'BUILT_IN',
    'SYNTAX',
    'BoxFileError',
    'Entry',
    'RejectedRow',
    'Stream',
    'destination_names',
    'load_boxes',
    'open_source',
    'read_entries',
    'resolved',
    'write_boxes',
]
