"""Box lists in sheets and JSON as people have them: what is header, what is boxes, and in what."""

import json

import pytest
from box_list_rig import notes, sizes, workbook
from openpyxl import load_workbook

from conveyor_sim.streams import BoxFileError, RejectedRow, UnclearBoxFile, read_boxes

HEADER = 'id,length_mm,width_mm,height_mm,weight_kg'


# header and footer


@pytest.mark.parametrize(
    'lines',
    [
        'SKU;Dimensions (mm);;;Weight (kg)\n;L;W;H;\nX;300;200;100;2\n',
        'SKU;Karton (mm);;;Gewicht\n;L;B;H;kg\nX;300;200;100;2\n',
        'SKU;length;width;height;weight\n;[cm];[cm];[cm];[kg]\nX;30;20;10;2\n',
        'List of Monday;;;;\nSKU;length;width;height;weight\n-;mm;mm;mm;g\nX;300;200;100;2000\n',
    ],
)
def test_a_header_may_have_two_lines(read, lines):
    (box,) = read(lines).entries
    assert (box.id, box.size_mm, box.weight_kg) == ('X', (300, 200, 100), 2)


def test_a_line_over_the_header_that_names_all_columns_is_none_of_it(read):
    found = read(f'Customer,ACME,,,\n{HEADER}\na,300,200,100,2\n')
    assert sizes(found) == [(300, 200, 100)]
    assert 'line 1 is above the header' in notes(found)


def test_one_number_is_not_three_edges(read):
    (bad,) = read('SKU,Dimensions (mm),kg\nX,300,2\n').entries
    assert isinstance(bad, RejectedRow)
    assert "'300' is not three edges" in bad.text


@pytest.mark.parametrize(
    ('line', 'words'),
    [
        ('Total,,,,5', 'line 4 adds up'), ('Summe:,600,400,200,5', 'line 4 adds up'),
        (HEADER, 'line 4 is the header again'), ('\nmade by hand', 'line 5 is a remark'),
        ('Grand total,,,,4\n\nmade by hand', 'line 6 is a remark'),
    ],
)  # fmt: skip
def test_lines_that_are_no_boxes_are_left_out_and_told(read, line, words):
    found = read(f'{HEADER}\na,300,200,100,2\nb,300,200,100,2\n{line}\n')
    assert [box.id for box in found.entries] == ['a', 'b']
    assert words in notes(found)


@pytest.mark.parametrize('line', ['Total,30,200,100,2\nb,300,200,100,2', 'b,,,,', 'b'])
def test_lines_that_may_be_boxes_stay(read, line):
    assert len(read(f'{HEADER}\na,300,200,100,2\n{line}\n').entries) == 1 + len(line.split())


# words and numbers


@pytest.mark.parametrize(
    'header', ['pieces per carton', 'Stk/Karton', 'Case Qty', 'Min. Menge', 'qty in stock']
)
def test_what_counts_no_boxes_repeats_none_and_is_told(read, header):
    found = read(f'{HEADER},{header}\na,300,200,100,2,24\n')
    assert len(found.entries) == 1
    assert f'column {header} is not taken for a number of boxes' in notes(found)


@pytest.mark.parametrize(
    'header', ['Order Qty', 'Bestellmenge', 'No. of cartons', 'Anzahl Kartons', 'Boxes']
)
def test_numbers_of_boxes_have_many_names_and_words_behind_them(read, header):
    assert len(read(f'{HEADER},{header}\na,300,200,100,2,3 Stk\n').entries) == 3


@pytest.mark.parametrize(
    'header', ['total weight kg', 'line weight (kg)', 'Gewicht (Pfund)', 'Lademasse, Gewicht']
)
def test_a_weight_of_who_knows_what_is_refused_and_never_a_default(read, header):
    with pytest.raises(UnclearBoxFile, match='may be a weight'):
        read(f'id,length_mm,width_mm,height_mm,"{header}"\na,300,200,100,28\n')


def test_of_gross_and_net_weight_the_gross_one_counts(read):
    text = 'length_mm,width_mm,height_mm,Nettogewicht kg,Bruttogewicht kg\n300,200,100,2,3\n'
    assert read(text).entries[0].weight_kg == 3
    net = read(text.replace('Bruttogewicht kg', 'note'))
    assert net.entries[0].weight_kg == 2
    assert 'without packaging' in notes(net)


@pytest.mark.parametrize('header', ['do not stack', 'non-stackable', 'nicht stapelbar'])
def test_nothing_stands_on_what_is_not_to_be_stacked(read, header):
    assert read(f'{HEADER},{header}\na,300,200,100,2,yes\n').entries[0].max_top_load_n == 0


def test_a_separator_that_makes_a_box_thinner_than_paper_is_refused(read):
    text = 'id;length_mm;width_mm;height_mm;weight_kg\na;1.100;240;150;2.5\n'
    with pytest.raises(UnclearBoxFile, match=r"'1\.100' is 1\.1 mm .* and may be 1100 mm"):
        read(text)


def test_boxes_of_more_than_gold_are_noted(read):
    assert '1 row is heavier than gold' in notes(read(f'{HEADER}\na,30,20,10,2\n'))


def test_digits_of_other_keyboards_count(read):
    assert sizes(read(f'{HEADER}\na,３００,２00．5,100,2\n')) == [(300, 200.5, 100)]


def test_ids_are_as_a_spreadsheet_shows_them_and_shortened_ones_noted(read):
    found = read(f'{HEADER}\n="007",300,200,100,2\n4.01E+12,300,200,100,2\n')
    assert [box.id for box in found.entries] == ['007', '4.01E+12']
    assert 'shortened ids such as 4.01E+12' in notes(found)


@pytest.mark.parametrize(
    ('coding', 'name', 'header'),
    [
        ('cp1252', 'Windows-1252', 'Artikel;Länge (cm);Breite (cm);Höhe (cm)'),
        ('cp1250', 'Windows-1250', 'towar;długość (cm);szerokość (cm);wysokość (cm)'),
        ('cp1251', 'Windows-1251', 'артикул;длина, см;ширина, см;высота, см'),
        ('cp932', 'Shift JIS', '商品コード;長さ(cm);幅(cm);高さ(cm)'),
        ('mac_roman', 'Mac Roman', 'Artikel;Länge (cm);Breite (cm);Höhe (cm)'),
    ],
)
def test_older_codings_are_told_by_the_header(read, coding, name, header):
    found = read(f'{header}\nx;30,5;20;10\n'.encode(coding))
    assert sizes(found) == [(305, 200, 100)]
    assert f'not in UTF-8: read as {name}' in notes(found)


# JSON


def test_an_item_sequence_may_be_a_list_and_properties_are_named(read):
    item = {'length/mm': 300, 'width/mm': 200, 'height/mm': 100, 'weight/kg': 2, 'id': '17'}
    order = {'properties': {'target': 'euro-pallet'}, 'item_sequence': [item, item]}
    found = read(json.dumps({'7': order}), 'orders.json', order_by='order_id')
    assert [(box.id, box.destination) for box in found.entries] == [('7-1', '7'), ('7-2', '7')]
    assert dict(found.entries[0].extra) == {'sku': '17', 'order_id': '7'}
    assert 'property target of the orders: euro-pallet (1 order); --bin says which' in notes(found)


@pytest.mark.parametrize('name', ['list.json', 'list.jsonl', 'list.txt'])
def test_objects_in_lines_are_a_list(read, name):
    lines = [{'id': n, 'length_cm': 30, 'width_cm': 20, 'height_cm': 10.5} for n in 'ab']
    found = read('\n'.join(map(json.dumps, lines)) + '\n{"id": \n', name)
    assert [box.size_mm for box in found.entries[:2]] == [(300, 200, 105)] * 2
    assert 'line 3 is not JSON' in found.entries[2].text


def test_a_list_may_lie_in_an_object_and_sizes_in_another(read):
    box = {'sku': 'a', 'dimensions': {'length': 30, 'width': 20, 'height': 10}, 'weight_kg': 1}
    found = read(json.dumps({'warehouse': 'N', 'items': [box]}), 'list.json', units='cm')
    assert sizes(found) == [(300, 200, 100)]
    assert "not used: 'warehouse' beside 'items'" in notes(found)


def test_units_beside_numbers_and_lists_of_edges_count(read):
    nested = {
        'dimensions': {'length': 30.5, 'width': 20, 'height': 10, 'unit': 'cm'},
        'weight': {'value': 500, 'unit': 'g'},
    }
    found = read(json.dumps([nested]), 'a.json')
    assert sizes(found) == [(305, 200, 100)]
    assert found.entries[0].weight_kg == 0.5
    assert sizes(read(json.dumps([{'size_mm': [300, 200.125, 100]}]), 'b.json')) == [
        (300, 200.125, 100)
    ]


# workbooks


def test_the_sheet_with_sizes_of_a_workbook_is_read_and_the_others_named(tmp_path):
    lines = [
        ['Stock of Monday'], [],
        ['Article', 'Length (mm)', 'Width (mm)', 'Height (mm)', 'kg', None],
        ['tin', 1150, 240.5, 150, 2, 'left'], ['box', '300', 200, '=150+1', 1.5, None],
    ]  # fmt: skip
    path = workbook(tmp_path / 'list.xlsx', {'About': [['by hand']], 'Boxes': lines})
    found = read_boxes(path)
    tin, bad = found.entries
    assert (tin.id, tin.size_mm, tin.weight_kg) == ('tin', (1150, 240.5, 150), 2.0)
    assert dict(tin.extra)['column 6'] == 'left'
    assert "line 5, column Height (mm): '' is missing" in bad.text, 'a formula without its value'
    for note in ('sheet About is not read', 'line 1 is above the header', 'not used: column 6'):
        assert note in notes(found)


def test_text_in_a_workbook_is_as_ambiguous_as_elsewhere(tmp_path):
    header = ['length_mm', 'width_mm', 'height_mm']
    path = workbook(tmp_path / 'list.xlsx', {'A': [header, ['1.100', 240, 150]]})
    with pytest.raises(UnclearBoxFile, match=r"'1\.100' may be 1\.1 or 1100"):
        read_boxes(path)


@pytest.mark.parametrize(
    ('content', 'words'),
    [(b'PK\x03\x04 broken', 'as a workbook'), (b'\xd0\xcf\x11\xe0 old', 'before 2007')],
)
def test_a_workbook_that_cannot_be_read_is_refused(read, content, words):
    with pytest.raises(BoxFileError, match=words):
        read(content, 'list.xlsx')


def test_a_workbook_without_sizes_shows_what_it_has(tmp_path):
    path = workbook(tmp_path / 'list.xlsx', {'A': [['id', 'colour'], ['a', 'red']], 'B': []})
    with pytest.raises(BoxFileError, match='found A: id, colour'):
        read_boxes(path)


def test_merged_and_hidden_cells_of_a_workbook_say_what_they_show(tmp_path):
    lines = [
        ['SKU', 'Dimensions (mm)', None, None, 'Weight'], [None, 'L', 'W', 'H', 'kg'],
        ['X', 300, 200, 100, 2], [None, None, 250, 100, 3],
    ]  # fmt: skip
    path = workbook(tmp_path / 'list.xlsx', {'A': lines}, merged=('B1:D1', 'A3:A4', 'B3:B4'))
    book = load_workbook(path)
    book['A'].row_dimensions[4].hidden = True
    book.save(path)
    found = read_boxes(path)
    assert sizes(found) == [(300, 200, 100), (300, 250, 100)]
    assert [box.id for box in found.entries] == ['X/1', 'X/2']
    assert '1 line is hidden in sheet A' in notes(found)


def test_numbers_shown_with_leading_zeros_are_ids_with_them(tmp_path):
    path = workbook(tmp_path / 'list.xlsx', {'A': [HEADER.split(','), [7, 300, 200, 100, 2]]})
    book = load_workbook(path)
    book['A']['A2'].number_format = '00000'
    book.save(path)
    assert read_boxes(path).entries[0].id == '00007'
