"""Boxes and bins refuse what cannot be, and say which value is wrong."""

import math

import pytest

from pack_msgs_py.values import Bin, BinSpec, Box, PlacedBox, check_box, parse_bin


@pytest.mark.parametrize(
    ('name', 'size'),
    [
        ('LDC', (1200, 800, 800)),
        ('RC', (1200, 700, 1600)),
        ('PAL', (2200, 1200, 800)),
        ('EQ', (800, 800, 800)),
        ('SYN', (800, 450, 450)),
    ],
)
def test_the_papers_bins_have_the_papers_sizes(name, size):
    assert parse_bin(name) == BinSpec(name, size)


def test_a_bin_can_be_given_in_centimetres():
    assert parse_bin('100x60.5x60').size_mm == (1000, 605, 600)


def test_bin_names_ignore_case():
    assert parse_bin('ldc').name == 'LDC'


@pytest.mark.parametrize('text', ['', 'LDX', '10x20', '0x10x10', '2000x10x10', 'nanx1x1', '-1x2x3'])
def test_a_wrong_bin_is_refused_with_its_text(text):
    with pytest.raises(ValueError, match='bin') as caught:
        parse_bin(text)
    assert repr(text) in str(caught.value)


@pytest.mark.parametrize('edge', [0.0, -1.0, math.nan, math.inf, 20_000.0])
def test_a_box_edge_must_be_a_length(edge):
    with pytest.raises(ValueError, match=r"box 'b': size y is"):
        check_box(Box('b', (100, edge, 100)))


@pytest.mark.parametrize('weight', [0.0, -1.0, math.nan, math.inf])
def test_a_box_weight_must_be_positive(weight):
    with pytest.raises(ValueError, match=r"box 'b': weight is"):
        check_box(Box('b', (100, 100, 100), weight))


@pytest.mark.parametrize('box_id', ['', 'a\nb', 'x' * 201])
def test_a_box_id_must_be_printable_and_short(box_id):
    with pytest.raises(ValueError, match='box id'):
        check_box(Box(box_id, (100, 100, 100)))


def test_the_centre_of_mass_lies_inside_the_box():
    with pytest.raises(ValueError, match='centre of mass'):
        check_box(Box('b', (100, 100, 100), com_offset_mm=(51, 0, 0)))


def test_fill_rate_counts_true_volumes():
    box = Box('b', (395.0, 395.0, 395.0))
    placed = PlacedBox(box, (0, 0, 0), (400, 400, 400))
    one = Bin('EQ-1', 1, parse_bin('EQ'), (placed,))
    assert one.fill_rate == pytest.approx((395 / 800) ** 3)
