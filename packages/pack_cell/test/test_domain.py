"""Cells on one machine keep out of each other's ROS domain."""

import pytest

from pack_cell.running.ros_domain import DomainTaken, hold_domain, loopback_trouble


def test_two_cells_get_two_domains(monkeypatch):
    monkeypatch.delenv('ROS_DOMAIN_ID', raising=False)
    first, second = hold_domain(), hold_domain()
    try:
        assert first.number != second.number
    finally:
        first.release()
        second.release()


def test_a_domain_that_was_given_back_can_be_had_again(monkeypatch):
    monkeypatch.setenv('ROS_DOMAIN_ID', '231')
    hold_domain().release()
    hold_domain().release()


def test_a_chosen_domain_with_a_cell_in_it_is_refused(monkeypatch):
    monkeypatch.setenv('ROS_DOMAIN_ID', '230')
    lock = hold_domain()
    try:
        with pytest.raises(DomainTaken, match='domain 230'):
            hold_domain()
    finally:
        lock.release()


@pytest.mark.parametrize('text', ['-1', 'x', '233', '1.5'])
def test_a_wrong_domain_is_refused_with_its_text(monkeypatch, text):
    monkeypatch.setenv('ROS_DOMAIN_ID', text)
    with pytest.raises(ValueError, match='ROS_DOMAIN_ID'):
        hold_domain()


@pytest.mark.parametrize(('flags', 'words'), [('0x8\n', 'ip link set lo up'), ('0x9\n', '')])
def test_a_loopback_interface_that_is_down_is_named(tmp_path, flags, words):
    path = tmp_path / 'flags'
    path.write_text(flags)
    assert words in loopback_trouble(path)
    assert bool(loopback_trouble(path)) == bool(words)
    assert loopback_trouble(tmp_path / 'none') == ''
