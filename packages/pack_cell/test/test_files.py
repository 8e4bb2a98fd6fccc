"""A file that cannot be written is named, with what is kept and how to go on."""

from __future__ import annotations

import os
import shutil
from pathlib import Path

import pytest

from pack_cell.files import error_text, full_disk, naming
from pack_cell.options.run_options import parse_run_options
from pack_cell.report.archive import Archive
from pack_cell.report.ended_run import execution_profile
from pack_cell.running.kept_run import KeptRun
from pack_cell.running.run import what_is_kept

FULL = Path('/dev/full')
NO_DEV_FULL = not FULL.exists()


@pytest.mark.skipif(NO_DEV_FULL, reason='this system has no /dev/full')
def test_an_error_of_writing_names_the_file_and_says_why():
    with (
        pytest.raises(OSError, match='No space left') as caught,
        naming(FULL),
        FULL.open('w') as file,
    ):
        file.write('x')
    assert error_text(caught.value) == f'/dev/full: {os.strerror(28)}'


@pytest.mark.skipif(NO_DEV_FULL, reason='this system has no /dev/full')
def test_the_rows_of_boxes_name_their_file(tmp_path):
    archive = Archive(tmp_path / 'placements.jsonl', execution_profile(parse_run_options([])))
    archive.path = FULL
    with pytest.raises(OSError, match='No space left') as caught:
        archive.write([{'box_id': 'a'}])
    assert '/dev/full' in error_text(caught.value)


def test_a_full_file_system_is_told_with_what_is_left(tmp_path, monkeypatch):
    assert full_disk(tmp_path) == ''
    nearly = type(shutil.disk_usage('/'))(10**9, 10**9 - 10, 10)
    monkeypatch.setattr(shutil, 'disk_usage', lambda path: nearly)
    assert full_disk(tmp_path) == f'the file system of {tmp_path} is full: 10 bytes are free'


def test_what_to_do_depends_on_whether_the_run_was_begun(tmp_path):
    folder = tmp_path / 'run'
    folder.mkdir()
    assert what_is_kept(folder).startswith('nothing was begun')
    KeptRun(folder, parse_run_options([]), ('cell', 'run')).write()
    assert what_is_kept(folder).endswith(f'go on by cell run --resume {folder}')
