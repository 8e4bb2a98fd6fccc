"""Box lists as people have them: columns, units, separators, quantities; nothing is dropped."""

import csv

import pytest
from box_list_rig import notes, sizes
from hypothesis import given, settings
from hypothesis import strategies as st

from conveyor_sim.streams import (
    BoxFileError,
    Reading,
    RejectedRow,
    UnclearBoxFile,
    open_source,
    read_boxes,
    write_boxes,
)
from conveyor_sim.streams.column_names import MEANINGS, read_header
from conveyor_sim.streams.number_columns import COMMA, POINT, AmbiguousColumn, decimal_marks, number
from pack_msgs_py.values import UP_ANY, UP_POS_Z, Box

# columns


@pytest.mark.parametrize(
    ('header', 'meaning', 'unit'),
    [
        ('Length (cm)', 'length', 'cm'), ('Länge', 'length', ''), ('Laenge in mm', 'length', 'mm'),
        ('L [cm]', 'length', 'cm'), ('lengths', 'length', ''), ('Longueur (m)', 'length', 'm'),
        ('Outer length, inches', 'length', 'in'), ('length_in', 'length', 'in'),
        ('packageWidthMm', 'width', 'mm'), ('Breite', 'width', ''), ('szerokość', 'width', ''),
        ('Höhe außen (mm)', 'height', 'mm'), ('høyde', 'height', ''), ('ширина, мм', 'width', 'mm'),
        ('depth', 'depth', ''), ('Tiefe/cm', 'depth', 'cm'), ('Maße (cm)', 'size', 'cm'),
        ('Masse (kg)', 'weight', 'kg'), ('Weight', 'weight', ''), ('weight_g', 'weight', 'g'),
        ('Gewicht (brutto) in kg', 'weight', 'kg'), ('lbs', 'weight', 'lb'),
        ('Qty', 'quantity', ''), ('Menge', 'quantity', ''), ('Stück', 'quantity', ''),
        ('COPIES', 'quantity', ''), ('SKU', 'sku', ''), ('Artikel-Nr.', 'sku', ''),
        ('orderId', 'order', ''), ('Bestell-Nr.', 'order', ''), ('this_side_up', 'upright', ''),
        ('max load on top (kg)', 'max_top_load', 'kg'), ('zerbrechlich', 'fragile', ''),
        ('net weight', 'weight', ''), ('Made in Germany', '', ''), ('Total weight', '', ''),
    ],
)  # fmt: skip
def test_headers_of_many_languages_are_known(header, meaning, unit):
    said = read_header(header)
    assert (said.meaning, said.unit) == (meaning, unit)


@pytest.mark.parametrize(
    'text',
    [
        'id,length_mm,width_mm,height_mm,weight_kg\na,300,200,100,1.5\n',
        'SKU,Name,Weight (kg),Length (cm),Width (cm),Height (cm)\na,Tin,1.5,30,20,10\n',
        'Nr;Artikel;L [cm];B;H;Gewicht (g)\n1;a;30;20;10;1500\n',
        'sep=;\nid;length_m;width_m;height_m;weight_kg\na;0,3;0,2;0,1;1,5\n',
        'id|length_mm|width_mm|height_mm|weight\na|300|200|100|1.5\n',
        'id\tdepth (mm)\twidth (mm)\theight (mm)\tkg\na\t200\t300\t100\t1.5\n',
        'Karton,Maße (cm),Gewicht kg\na,30x20x10,1.5\n',
        'id,size,weight\na,300 × 200 × 100 mm,1.5 kg\n',
        'id,dimensions (LxWxH cm),weight kg\na,30x20x10,1.5\n',
        '商品コード,長さ(mm),幅(mm),高さ(mm),重さ(kg)\na,300,200,100,1.5\n',
        'Ürün;Uzunluk (cm);Genişlik (cm);Yükseklik (cm);Ağırlık (kg)\na;30;20;10;1,5\n',
        'Codice|Lunghezza mm|Larghezza mm|Altezza mm|Peso kg\na|300|200|100|1,5\n',
        'Nr;Długość [cm];Szerokość [cm];Wysokość [cm];Waga [kg]\na;30;20;10;1,5\n',
        'id,length,width,height,weight\na,300 mm,20 cm,0.1 m,1500 g\n',
        'Packing list of Monday\n\nid,length_mm,width_mm,height_mm,weight_kg\na,300,200,100,1.5\n',
        'id,note,length_mm,width_mm,height_mm,weight_kg\na,"two\nlines",300,200,100,1.5\n',
    ],
)
def test_one_box_in_many_dialects(read, text):
    (box,) = read(text).entries
    assert (box.id, box.size_mm, box.weight_kg) == ('a', (300, 200, 100), 1.5)


def test_inches_and_pounds(read):
    (box,) = read('id,length (in),width (in),height (in),weight (lb)\na,10,4,2.5,2\n').entries
    assert box.size_mm == (254.0, 101.6, 63.5)
    assert box.weight_kg == pytest.approx(0.90718474)


def test_columns_that_mean_nothing_here_are_named_once_and_kept(read):
    found = read('id,length_mm,width_mm,height_mm,Name,,colour\na,3,2,9,Tin,x,red\nb,3,2,9,,,\n')
    assert [note for note in found.notes if 'not used' in note] == [
        'not used: Name, column 6, colour'
    ]
    assert found.entries[0].extra == (('Name', 'Tin'), ('column 6', 'x'), ('colour', 'red'))


def test_what_stands_above_the_header_is_told(read):
    found = read('Lager Nord;;;\nLänge mm;Breite mm;Höhe mm\n300;200;100\n')
    assert sizes(found) == [(300, 200, 100)]
    assert 'line 1 is above the header: Lager Nord' in notes(found)


@pytest.mark.parametrize(
    ('text', 'words'),
    [
        ('L,B,H\n30,20,10\n', '30 x 20 x 10 may be millimetres, centimetres or inches'),
        ('X,Y,Z,COPIES\n30,20,10,2\n', 'say --units mm, cm or in'),
        (
            'length_mm,width_mm,height_mm,weight\n300,200,100,1200\n',
            '1200 may be kilograms or',
        ),
        ('length_in,width_in,height_in,weight\n9,9,9,7\n', '7 may be kilograms or pounds'),
        ('id;length_mm;width_mm;height_mm\na;1.100;240;150\n', "'1.100' may be 1.1 or 1100"),
        ('id\tlength_mm\twidth_mm\theight_mm\na\t1,150\t240\t150\n', "'1,150' may be 1150 or 1.15"),
        ('id,length_mm,width_mm,height_mm\na,"1,150",240,150\n', "'1,150' may be 1150 or 1.15"),
        (
            'id;length_mm;width_mm;height_mm\na;1,5;2;3\nb;1.5;2;3\n',
            "both '1.5' with a decimal point and '1,5'",
        ),
        (
            'length_mm;width_mm;height_mm;weight_kg\n1.100;2;3;4,5\n1;2;3,5;4.5\n',
            "column weight_kg has both '4.5'",
        ),
    ],
)
def test_what_can_be_read_in_two_ways_is_refused_with_both(read, text, words):
    with pytest.raises(UnclearBoxFile) as caught:
        read(text)
    assert words in str(caught.value)
    assert 'box file list.csv' in str(caught.value)


@pytest.mark.parametrize(
    ('text', 'words'),
    [
        ('length_mm,Length (cm),width_mm,height_mm\n1,1,1,1\n', 'may both be the length'),
        ('length_mm,width_mm,height_mm,qty,Menge\n1,1,1,1,1\n', 'may both be the quantity'),
        ('length_mm,width_mm\n1,1\n', 'no column height; found length_mm, width_mm'),
        ('length_mm,width_mm,height_mm,max load\n1,1,1,1\n', ''),
        ('30,20,10\n30,20,11\n', 'found 30, 20, 10; the first line has to name the columns'),
        (
            'length_mm,width_mm,height_mm,max top load\n1,1,1,1\n',
            'call it max_top_load_n',
        ),
        ('length_mm,width_mm,height_mm,qty\n1,1,1,900000\n1,1,1,900000\n', 'more than 1000000'),
    ],
)
def test_columns_that_contradict_each_other_are_refused(read, text, words):
    if not words:
        assert 'not used: max load' in notes(read(text))
        return
    with pytest.raises(BoxFileError, match=words):
        read(text)


def test_units_and_decimal_mark_can_be_said(read):
    found = read('L,B,H,weight\n30,20,10,1500\n', units='cm,g')
    assert (sizes(found), found.entries[0].weight_kg) == ([(300, 200, 100)], 1.5)
    text = 'id;length_mm;width_mm;height_mm\na;1.100;240;150\n'
    assert sizes(read(text, decimal='comma')) == [(1100, 240, 150)]
    assert sizes(read(text, decimal='point')) == [(1.1, 240, 150)]
    assert 'edge below 2 mm' in notes(read(text, decimal='point'))
    with pytest.raises(BoxFileError, match="unit 'ells' is unknown"):
        Reading(units='ells')
    with pytest.raises(BoxFileError, match="decimal 'dot' is unknown"):
        Reading(decimal='dot')


def test_a_file_beside_the_list_says_what_the_list_does_not(read, tmp_path):
    text = 'Ware,Maß 1,Maß 2,Maß 3,Zahl\nTin,30,20,10,3\n'
    beside = tmp_path / 'list.csv.yaml'
    beside.write_text(
        'units: cm\ncolumns: {id: Ware, length: Maß 1, width: Maß 2, height: Maß 3, '
        'quantity: Zahl}\n'
    )
    found = read(text)
    assert [(box.id, box.size_mm) for box in found.entries] == [
        (f'Tin/{n}', (300, 200, 100)) for n in (1, 2, 3)
    ]
    assert sizes(read(text, units='mm'))[0] == (30, 20, 10), 'what is said has priority'
    for wrong, words in (
        ('units: ells', "unit 'ells'"),
        ('colums: {}', 'must be a mapping'),
        ('[1', 'cannot be read'),
        ('columns: {size: Gr}', "there is no column 'Gr' for size"),
        ('columns: {weigth: Maß 1}', 'mean nothing here'),
    ):
        beside.write_text(wrong)
        with pytest.raises(BoxFileError, match=words):
            read(text)


# numbers


@pytest.mark.parametrize(
    ('columns', 'marks'),
    [
        ({'a': ['1.100', '380'], 'b': ['250,5']}, {'a': COMMA, 'b': COMMA}),
        ({'a': ['1,150', '380'], 'b': ['2.5']}, {'a': POINT, 'b': POINT}),
        ({'a': ['1.234.567']}, {'a': COMMA}),
        ({'a': ['1.234,5', '7']}, {'a': COMMA}),
        ({'a': ['0.950', '1.100']}, {'a': POINT}),
        ({'a': ["1'100.5"], 'b': ['1 100']}, {'a': POINT, 'b': POINT}),
        ({'a': ['12', 'abc', '']}, {'a': POINT}),
        ({'a': ['1,5', '2,5', '3.5']}, {'a': COMMA}),
    ],
)
def test_the_decimal_mark_of_whole_columns(columns, marks):
    assert decimal_marks(columns) == marks


def written(value, mark, grouped):
    text = f'{value:,.3f}' if grouped else f'{value:.3f}'
    return text.translate(str.maketrans(',.', '.,')) if mark == COMMA else text


@settings(max_examples=150, deadline=None)
@given(
    st.lists(st.integers(1, 9_999_999), min_size=1, max_size=6),
    st.sampled_from([POINT, COMMA]),
    st.booleans(),
)
def test_numbers_are_read_as_they_were_written_or_not_at_all(thousandths, mark, grouped):
    values = [thousandth / 1000 for thousandth in thousandths]
    texts = [written(value, mark, grouped) for value in values]
    try:
        found = decimal_marks({'a': texts})['a']
    except AmbiguousColumn as error:
        assert 'may be' in str(error)
        return
    assert [number(text, found)[0] for text in texts] == values


# quantity, names, orders


def test_a_quantity_repeats_its_row_under_numbered_names(read):
    found = read(
        'id,length_mm,width_mm,height_mm,quantity\ncrate,3,2,9,3\ntray,3,2,8,1\no,3,2,7,0\n'
    )
    assert [box.id for box in found.entries] == ['crate/1', 'crate/2', 'crate/3', 'tray']
    assert dict(found.entries[0].extra)['sku'] == 'crate'
    assert '1 row asks for no box' in notes(found)
    assert 'crate/1 to crate/3' in notes(found)


@pytest.mark.parametrize('quantity', ['-1', '1.5', 'many'])
def test_a_quantity_that_is_none_rejects_its_row(read, quantity):
    found = read(f'id,length_mm,width_mm,height_mm,qty\na,3,2,9,{quantity}\nb,3,2,8,\n')
    bad, good = found.entries
    assert isinstance(bad, RejectedRow) and bad.column == 'qty'
    assert good.id == 'b'


def test_a_rejected_row_tells_how_many_boxes_it_costs(read):
    (bad,) = read('id,length_mm,width_mm,height_mm,qty\na,x,2,9,12\n').entries
    assert "column length_mm: 'x' is not a number (12 boxes)" in bad.text


def test_order_and_article_stay_apart_from_the_id(read):
    text = 'order;SKU;length_mm;width_mm;height_mm\n7001;S;3;2;9\n7002;S;3;2;9\n7002;T;3;2;9\n'
    found = read(text)
    assert [box.id for box in found.entries] == ['S/1', 'S/2', 'T']
    assert [dict(box.extra) for box in found.entries] == [
        {'sku': 'S', 'order_id': '7001'}, {'sku': 'S', 'order_id': '7002'},
        {'sku': 'T', 'order_id': '7002'},
    ]  # fmt: skip
    assert {box.destination for box in found.entries} == {''}


@pytest.mark.parametrize('column', ['order', 'Order', 'order no.'])
def test_orders_keep_apart_when_asked(read, column):
    header = 'order no.' if column == 'order no.' else 'Order'
    text = f'{header},destination,length_mm,width_mm,height_mm\n1,N,3,2,9\n2,N,3,2,9\n,N,3,2,9\n'
    first, second, bad = read(text, order_by=column).entries
    assert (first.destination, second.destination) == ('1', '2')
    assert dict(first.extra)['destination'] == 'N'
    assert isinstance(bad, RejectedRow) and 'of no order' in bad.text


def test_an_order_column_that_is_not_there_is_refused_with_those_that_are(read):
    with pytest.raises(BoxFileError, match="no column 'tour' to keep orders apart by; found id"):
        read('id,length_mm,width_mm,height_mm\na,3,2,9\n', order_by='tour')
    with pytest.raises(BoxFileError, match='for box files alone'):
        open_source('mpv:class=5', reading=Reading(order_by='order'))


# what boxes bear


@pytest.mark.parametrize(
    ('columns', 'cells', 'up', 'load'),
    [
        ('fragile', 'yes', UP_ANY, 0.0), ('fragile', 'no', UP_ANY, None),
        ('zerbrechlich', 'Ja', UP_ANY, 0.0), ('stackable', 'no', UP_ANY, 0.0),
        ('stapelbar', 'nein', UP_ANY, 0.0), ('stackable', 'TRUE', UP_ANY, None),
        ('this_side_up', '1', UP_POS_Z, None), ('kippbar', 'nein', UP_POS_Z, None),
        ('upright', 'x', UP_POS_Z, None), ('max_top_load_kg', '2', UP_ANY, 19.6133),
        ('fragile,max_top_load_n', 'no,50', UP_ANY, 50.0),
        ('fragile,max_top_load_n', 'yes,50', UP_ANY, 0.0),
    ],
)  # fmt: skip
def test_what_a_box_bears_is_honoured(read, columns, cells, up, load):
    (box,) = read(f'length_mm,width_mm,height_mm,{columns}\n3,2,9,{cells}\n').entries
    assert box.allowed_up == up
    assert box.max_top_load_n == (load if load is None else pytest.approx(load))


@pytest.mark.parametrize('column', ['fragile', 'stackable', 'this side up'])
def test_a_word_that_is_neither_yes_nor_no_rejects_its_row(read, column):
    (bad,) = read(f'length_mm,width_mm,height_mm,{column}\n3,2,9,perhaps\n').entries
    assert bad.column == column
    assert 'neither yes nor no' in bad.text


def test_boxes_without_a_weight_are_told(read):
    assert 'no column of weights' in notes(read('length_mm,width_mm,height_mm\n3,2,9\n'))
    text = 'length_mm,width_mm,height_mm,weight_kg\n3,2,9,\n3,2,9,1\n'
    assert '1 row has no weight' in notes(read(text))


# our own format


TEXTS = st.text(
    st.characters(codec='utf-8', categories=['L', 'N', 'P', 'S']), min_size=1, max_size=9
)
NAMES = st.one_of(TEXTS, st.sampled_from(['=1+1', '+4', '-3', '@x', "'=1", "''@", '"q"', 'a;b|c']))


@settings(max_examples=60, deadline=None)
@given(
    st.lists(
        st.tuples(NAMES, NAMES, st.floats(0.1, 9999), st.floats(0.001, 99), st.integers(1, UP_ANY)),
        min_size=1, max_size=4, unique_by=lambda row: row[0],
    )
)  # fmt: skip
def test_our_own_format_reads_back_the_same_and_holds_no_formula(tmp_path_factory, rows):
    path = tmp_path_factory.getbasetemp() / 'clean.csv'
    boxes = tuple(
        Box(name, (edge, 20.5, 10), weight, allowed_up=up, max_top_load_n=edge,
            destination=to, extra=(('sku', to), ('Name', name)))
        for name, to, edge, weight, up in rows
    )  # fmt: skip
    write_boxes(path, boxes)
    found = read_boxes(path).entries
    assert found == boxes
    assert [box.extra for box in found] == [box.extra for box in boxes]
    with path.open(newline='') as lines:
        cells = [cell for row in list(csv.reader(lines))[1:] for cell in row if cell]
    assert not any(cell[0] in '=+-@' for cell in cells)


def test_every_meaning_has_names_that_lead_to_it():
    assert {read_header(meaning).meaning for meaning in MEANINGS} == set(MEANINGS)
