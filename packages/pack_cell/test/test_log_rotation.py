"""Logs of a long run are put aside while the node goes on writing."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from pack_cell.running.log_rotation import rotate


def test_a_writer_goes_on_in_the_same_file_and_the_last_parts_are_kept(tmp_path):
    log = tmp_path / 'arm.log'
    with log.open('ab', buffering=0) as writer:
        for number in range(5):
            writer.write(f'part {number}\n'.encode() * 20)
            assert rotate(log, most_bytes=100, kept=3)
            assert log.read_bytes() == b''
        writer.write(b'now\n')
    assert not rotate(log, most_bytes=100, kept=3)
    assert log.read_text() == 'now\n'
    aside = [tmp_path / f'arm.log.{number}' for number in (1, 2, 3)]
    assert [path.read_text().splitlines()[0] for path in aside] == ['part 4', 'part 3', 'part 2']
    assert sorted(tmp_path.iterdir()) == sorted([log, *aside])


@given(parts=st.lists(st.binary(max_size=50), max_size=30))
def test_nothing_that_is_written_between_is_lost_while_it_is_kept(tmp_path_factory, parts):
    log = tmp_path_factory.mktemp('logs') / 'arm.log'
    with log.open('ab', buffering=0) as writer:
        for part in parts:
            writer.write(part)
            rotate(log, most_bytes=100, kept=100)
    aside = sorted(log.parent.glob('arm.log.*'), key=lambda path: -int(path.suffix[1:]))
    assert b''.join(path.read_bytes() for path in (*aside, log)) == b''.join(parts)
    assert log.stat().st_size < 100


def test_a_log_that_is_not_there_is_left(tmp_path):
    assert not rotate(tmp_path / 'arm.log')
