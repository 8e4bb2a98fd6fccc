"""Where boxes come from: files, recipes, earlier runs; repetition, order and destinations."""

from conveyor_sim.streams.box_list import BoxList
from conveyor_sim.streams.box_records import BoxFileError, Entry, RejectedRow, UnclearBoxFile
from conveyor_sim.streams.by_name import SYNTAX, load_boxes, open_source, resolved, with_path
from conveyor_sim.streams.files import BUILT_IN, read_boxes, read_entries
from conveyor_sim.streams.own_format import as_text, write_boxes
from conveyor_sim.streams.reading import Reading
from conveyor_sim.streams.run_folder import BOXES_FILE
from conveyor_sim.streams.stream import Stream, destination_names

__all__ = [
    'BOXES_FILE',
    'BUILT_IN',
    'SYNTAX',
    'BoxFileError',
    'BoxList',
    'Entry',
    'Reading',
    'RejectedRow',
    'Stream',
    'UnclearBoxFile',
    'as_text',
    'destination_names',
    'load_boxes',
    'open_source',
    'read_boxes',
    'read_entries',
    'resolved',
    'with_path',
    'write_boxes',
]
