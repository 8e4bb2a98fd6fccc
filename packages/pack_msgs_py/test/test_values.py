"""Boxes and bins refuse what cannot be, and say which value is wrong."""

import math

import pytest

from pack_msgs_py.values import (
    BIN_KINDS,
    BIN_TYPES,
    Bin,
    BinSpec,
    Box,
    PlacedBox,
    Walls,
    bin_called,
    check_box,
    parse_bin,
)


@pytest.mark.parametrize(
    ('name', 'size', 'walls'),
    [
        ('LDC', (1200, 800, 800), Walls.CLOSED),
        ('RC', (1200, 700, 1600), Walls.OPEN_FRONT),
        ('PAL', (2200, 1200, 800), Walls.NONE),
        ('EQ', (800, 800, 800), Walls.CLOSED),
        ('SYN', (800, 450, 450), Walls.CLOSED),
    ],
)
def test_the_papers_bins_have_the_papers_sizes_and_their_walls(name, size, walls):
    assert parse_bin(name) == BinSpec(name, size, walls)


def test_a_bin_can_be_given_in_centimetres():
    assert parse_bin('100x60.5x60').size_mm == (1000, 605, 600)


def test_bin_names_ignore_case():
    assert parse_bin('ldc').name == 'LDC'


@pytest.mark.parametrize(
    ('text', 'name', 'walls'),
    [
        ('120x80x150', '120x80x150', Walls.CLOSED),
        ('120x80x150:box', '120x80x150', Walls.CLOSED),
        (' 120X80X150:Pallet ', '120x80x150:pallet', Walls.NONE),
        ('120x80x150:cage', '120x80x150:cage', Walls.OPEN_FRONT),
        ('pal:pallet', 'PAL', Walls.NONE),
        ('rc:box', 'RC:box', Walls.CLOSED),
        ('LDC:cage', 'LDC:cage', Walls.OPEN_FRONT),
    ],
)
def test_walls_may_follow_a_kind_of_bin_and_are_named_where_they_are_not_its_own(text, name, walls):
    spec = parse_bin(text)
    assert (spec.name, spec.walls) == (name, walls)
    assert spec.size_mm == parse_bin(text.partition(':')[0]).size_mm
    assert parse_bin(spec.name) == bin_called(spec.name, spec.size_mm) == spec


@pytest.mark.parametrize('text', ['120x80x150:fence', 'RC:', 'LDC:box:box'])
def test_unknown_walls_are_refused_with_those_that_are_known(text):
    with pytest.raises(ValueError, match='unknown walls') as caught:
        parse_bin(text)
    kind = text.partition(':')[0]
    assert repr(text) in str(caught.value)
    assert f'use one of {kind}:box, {kind}:cage, {kind}:pallet' in str(caught.value)


def test_a_bin_that_others_named_is_a_closed_box_and_a_known_one_must_have_its_size():
    assert bin_called('tote 7:x', (600, 400, 300)) == BinSpec('tote 7:x', (600, 400, 300))
    for name in ('RC', 'RC:pallet'):
        with pytest.raises(ValueError, match='RC is a bin of'):
            bin_called(name, (1200, 700, 800))


@pytest.mark.parametrize('kind', BIN_TYPES)
def test_every_kind_of_bin_is_in_the_help(kind):
    assert kind in BIN_KINDS
    assert all(f':{walls.value}' in BIN_KINDS for walls in Walls)


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
    bin_ = Bin('EQ-1', 1, parse_bin('EQ'), (placed,))
    assert bin_.fill_rate == pytest.approx((395 / 800) ** 3)
