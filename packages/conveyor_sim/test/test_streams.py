"""Box files: every format users bring, and every way a row can be wrong."""

from __future__ import annotations

import json

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from conveyor_sim.streams import (
    BoxFileError,
    Stream,
    load_boxes,
    read_boxes,
    read_entries,
)
from pack_msgs_py.codes import Reason
from pack_msgs_py.values import UP_ANY, UP_POS_Z, Box, check_box

HEADER = 'id,length_mm,width_mm,height_mm,weight_kg\n'


@pytest.fixture
def write(tmp_path):
    def _write(content, name='boxes.csv'):
        path = tmp_path / name
        path.write_bytes(content if isinstance(content, bytes) else content.encode())
        return path

    return _write


def test_the_built_in_stream_suits_the_cell():
    boxes, rejected = load_boxes()
    assert rejected == []
    assert len(boxes) == len({box.id for box in boxes}) == 40
    for box in boxes:
        assert min(box.size_mm) >= 60
        assert max(box.size_mm) <= 600
        assert box.size_mm[2] <= 500
        assert 1 <= box.weight_kg <= 18
        assert dict(box.extra)['source']
    assert len({box.size_mm for box in boxes}) > 25


def test_only_sizes_are_required(write):
    boxes, rejected = load_boxes(write('height_mm,length_mm,width_mm\n100,300,200\n'))
    assert rejected == []
    assert boxes[0].size_mm == (300, 200, 100)
    assert boxes[0].id == 'row-2'
    assert boxes[0].weight_kg == pytest.approx(1.0), '6000 cm3 weigh 1 kg'


def test_optional_columns_are_read_and_others_kept(write):
    text = (
        'id,length_mm,width_mm,height_mm,weight_kg,max_top_load_n,allowed_up,destination,colour\n'
        'a,300,200,100,2.5,0,upright,Kassel,red\nb,300,200,100,,,,,\nc,300,200,100,1,9.5,48,,\n'
    )
    (a, b, c), rejected = load_boxes(write(text))
    assert rejected == []
    assert (a.max_top_load_n, a.allowed_up, a.destination) == (0, UP_POS_Z, 'Kassel')
    assert a.extra == (('colour', 'red'),)
    assert (b.max_top_load_n, b.allowed_up, b.destination) == (None, UP_ANY, '')
    assert (c.max_top_load_n, c.allowed_up) == (9.5, 48)


@pytest.mark.parametrize(
    'content',
    [
        '\ufeffid,length_mm,width_mm,height_mm,weight_kg\na,300,200,100,1.5\n'.encode(),
        b'id,length_mm,width_mm,height_mm,weight_kg\r\na,300,200,100,1.5\r\n\r\n',
        b'id;length_mm;width_mm;height_mm;weight_kg\na;300;200,0;100;1,5\n',
        b'ID\t Length_mm\twidth_mm\theight_mm\tweight_kg\na\t300\t200\t100\t1.5',
        b'id,length_mm,width_mm,height_mm,weight_kg\ra,300,200,100,1.5\r',
        'id,length_mm,width_mm,height_mm,weight_kg\na,300,200,100,1.5\n'.encode('utf-16'),
        b'"id","length/mm","width/mm","height/mm","weight/kg"\n"a","300","200","100","1.5"\n',
        b',,,\nid,length_mm,width_mm,height_mm,weight_kg,\na, 300 ,+200.,1e2,1.5,,,\n,,,,,\n',
        b'id,length_mm,width_mm,height_mm,weight_kg,n\xf6te\na,300,200,100,1.5,gr\xfcn\n',
    ],
    ids=['bom', 'crlf', 'semicolon', 'tab', 'cr', 'utf16', 'quoted', 'blank-lines', 'cp1252'],
)
def test_spreadsheet_dialects_mean_the_same(write, content):
    boxes, rejected = load_boxes(write(content))
    assert rejected == []
    assert [(b.id, b.size_mm, b.weight_kg) for b in boxes] == [('a', (300, 200, 100), 1.5)]


@pytest.mark.parametrize(
    ('row', 'column', 'value', 'words'),
    [
        ('x,abc,200,100,1', 'length_mm', 'abc', 'not a number'),
        ('x,300,nan,100,1', 'width_mm', 'nan', 'not finite'),
        ('x,300,200,-inf,1', 'height_mm', '-inf', 'not finite'),
        ('x,0,200,100,1', 'length_mm', '0', 'above 0'),
        ('x,300,-200,100,1', 'width_mm', '-200', 'above 0'),
        ('x,300,200,10001,1', 'height_mm', '10001', 'at most 10000'),
        ('x,300,200,1e999,1', 'height_mm', '1e999', 'too large'),
        ('x,300,,100,1', 'width_mm', '', 'missing'),
        ('x,300', 'width_mm', '', 'missing'),
        ('x,3_00,200,100,1', 'length_mm', '3_00', 'not a number'),
        ('x,0x10,200,100,1', 'length_mm', '0x10', 'not a number'),
        ('x,300,200,100,0', 'weight_kg', '0', 'above 0'),
        ('x,300,200,100,heavy', 'weight_kg', 'heavy', 'not a number'),
        ('x,300,200,100,NaN', 'weight_kg', 'NaN', 'not finite'),
        ('x\x07,300,200,100,1', 'id', 'x\x07', 'printable'),
        ('"x,300,200,100,1', '', '', 'cannot be read'),
        ('x,300,200,100,1,6', '', '', '6 fields'),
    ],
)
def test_a_bad_row_is_named_and_costs_no_other(write, row, column, value, words):
    boxes, rejected = load_boxes(write(HEADER + f'a,300,200,100,1\n{row}\nb,300,200,100,1\n'))
    assert [box.id for box in boxes] == ['a', 'b']
    (bad,) = rejected
    assert (bad.line, bad.column, bad.value) == (3, column, value)
    assert bad.reason is Reason.INVALID_DATA
    for part in ('boxes.csv', 'line 3', column, words):
        assert part in bad.text


@pytest.mark.parametrize(
    ('column', 'value'),
    [('allowed_up', '0'), ('allowed_up', '64'), ('allowed_up', 'down'), ('max_top_load_n', '-1')],
)
def test_bad_optional_values_are_rejected(write, column, value):
    text = f'length_mm,width_mm,height_mm,{column}\n300,200,100,{value}\n'
    boxes, (bad,) = load_boxes(write(text))
    assert boxes == []
    assert (bad.column, bad.value) == (column, value)


def test_boxes_of_one_id_are_numbered_and_their_id_is_kept_as_the_article(write):
    found = read_boxes(write(HEADER + 'a,300,200,100,1\na,30,x,10,1\na/1,1,1,1,1\na,2,2,2,\n'))
    names = [entry.id if isinstance(entry, Box) else entry.box_id for entry in found.entries]
    assert names == ['a/1_', 'a/2', 'a/1', 'a/3'], 'an event about one of them can mean no other'
    assert dict(found.entries[0].extra)['sku'] == 'a'
    assert any('1 name stands for more than one box' in note for note in found.notes)


def test_supermarket_columns_give_unique_ids(write):
    text = (
        'source,order_id,sequence,product_group,length_mm,width_mm,height_mm,weight_kg\n'
        'bed-bpp,001,1,fruit,380,300,170,5.7\nbed-bpp,001,2,fruit,380,300,170,5.7\n'
        'genpack,001,1,fruit,380,300,170,5.7\n'
    )
    boxes, rejected = load_boxes(write(text))
    assert rejected == []
    assert [box.id for box in boxes] == ['bed-bpp-001-1', 'bed-bpp-001-2', 'genpack-001-1']
    assert dict(boxes[0].extra)['product_group'] == 'fruit'


def bed_item(**changes):
    item = {
        'article': 'donut-17',
        'id': '17',
        'product_group': 'confectionery',
        'length/mm': 600,
        'width/mm': 400,
        'height/mm': 220,
        'weight/kg': 6.296,
        'sequence': 1,
    }
    return {**item, **changes}


def test_bed_bpp_orders_come_in_sequence_with_ids_of_their_own(write):
    items = {str(n): bed_item(sequence=n) for n in (10, 2, 1)}
    order = {'properties': {'target': 'euro-pallet'}, 'item_sequence': items}
    path = write(json.dumps({'A': order, 'B': order}), 'orders.json')
    boxes, rejected = load_boxes(path)
    assert rejected == []
    assert [box.id for box in boxes] == ['A-1', 'A-2', 'A-10', 'B-1', 'B-2', 'B-10']
    assert boxes[0].size_mm == (600, 400, 220)
    assert boxes[0].weight_kg == 6.296
    assert dict(boxes[0].extra)['sku'] == '17'


def test_a_bad_bed_bpp_item_names_its_order_and_place(write):
    items = {'1': bed_item(), '2': bed_item(**{'width/mm': float('nan')}), '3': 'box', '4': {}}
    data = {'A': {'item_sequence': items}, 'B': {'properties': {}}}
    boxes, rejected = load_boxes(write(json.dumps(data), 'orders.json'))
    assert [box.id for box in boxes] == ['A-1']
    assert [bad.box_id for bad in rejected] == ['A-2', 'A-3', 'A-4', 'B']
    assert "order 'A', item '2', column width/mm: 'nan' is not finite" in rejected[0].text


def test_a_list_of_flat_objects_is_read(write):
    data = [{'id': 'a', 'length_mm': 300, 'width_mm': 200, 'height_mm': True}]
    data.append({'id': 'b', 'length_mm': 300, 'width_mm': '200', 'height_mm': 100.5})
    (box,), (bad,) = load_boxes(write(json.dumps(data), 'list.json'))
    assert (box.id, box.size_mm) == ('b', (300, 200, 100.5))
    assert (bad.column, bad.value) == ('height_mm', 'True')


@pytest.mark.parametrize(
    ('content', 'name', 'words'),
    [
        (b'', 'a.csv', 'empty'),
        (b'\n \n', 'a.csv', 'empty'),
        (b'id,length_mm,width_mm\na,1,2\n', 'a.csv', 'no column height;'),
        (b'length_mm,width_mm,height_mm\n', 'a.csv', 'holds no boxes'),
        (b'length_mm,width_mm,height_mm,width_mm\n1,2,3,4\n', 'a.csv', 'twice'),
        (b'\x00\x01\x02', 'a.csv', 'not text'),
        (b'{"a": ', 'a.json', 'not JSON'),
        (b'[' * 100_000, 'a.json', 'not JSON'),
        (b'{}', 'a.json', 'no orders'),
        (b'{"a": {"b": 1}}', 'a.json', 'item_sequence'),
        (b'[1, 2]', 'a.json', 'length_mm'),
        (b'{"A": {"item_sequence": {"1": {}, "1": {}}}}', 'a.json', 'twice'),
    ],
)
def test_an_unusable_file_gives_one_clear_error(write, content, name, words):
    path = write(content, name)
    with pytest.raises(BoxFileError, match=words) as caught:
        load_boxes(path)
    assert name in str(caught.value)
    assert '\n' not in str(caught.value)


def test_a_file_that_is_not_there_or_not_a_file(tmp_path):
    with pytest.raises(BoxFileError, match='No such file'):
        load_boxes(tmp_path / 'nothing.csv')
    with pytest.raises(BoxFileError, match='folder'):
        load_boxes(tmp_path)
    with pytest.raises(BoxFileError, match='regular'):
        load_boxes('/dev/null')


@settings(max_examples=150, deadline=None)
@given(st.lists(st.text(st.characters(codec='utf-8'), max_size=40), max_size=6))
def test_any_rows_whatever_give_good_boxes_or_rejections(tmp_path_factory, rows):
    path = tmp_path_factory.mktemp('any') / 'any.csv'
    lines = [HEADER.strip(), 'first,300,200,100,1', *rows]
    path.write_text('\n'.join(lines), encoding='utf-8', newline='')
    try:
        entries = read_entries(path)
    except BoxFileError as error:
        assert 'not text' in str(error)
        return
    names = [check_box(e).id if isinstance(e, Box) else e.box_id for e in entries]
    assert names[0] == 'first'
    assert len(set(names)) == len(names)
    assert all(name.isprintable() for name in names)


ENTRIES = tuple(Box(name, (300, 200, 100)) for name in 'abc')


def test_a_stream_ends_after_its_count_and_repeats_when_there_are_few():
    assert [box.id for box in Stream(ENTRIES)] == ['a', 'b', 'c']
    assert [box.id for box in Stream(ENTRIES, count=2)] == ['a', 'b']
    repeated = [box.id for box in Stream(ENTRIES, count=8)]
    assert repeated == ['a', 'b', 'c', 'a#2', 'b#2', 'c#2', 'a#3', 'b#3']


def test_repetition_never_makes_an_id_that_the_file_has():
    entries = (*ENTRIES, Box('a#2', (300, 200, 100)))
    ids = [box.id for box in Stream(entries, count=12)]
    assert len(set(ids)) == 12


def test_a_seed_shuffles_every_round_the_same_way_each_time():
    entries = tuple(Box(str(n), (300, 200, 100)) for n in range(30))
    order = [box.id for box in Stream(entries, 60, seed=7)]
    assert order == [box.id for box in Stream(entries, 60, seed=7)]
    assert order != [box.id for box in Stream(entries, 60, seed=8)]
    assert sorted(order[:30]) == sorted(str(n) for n in range(30))
    assert [name.split('#')[0] for name in order[30:]] != order[:30]


def test_a_stream_knows_its_ids():
    stream = Stream(ENTRIES, count=5)
    for box in stream:
        assert box.id in stream
    assert 'a#3' not in stream
    assert 'z' not in stream
    assert 'a#x' not in stream


def test_the_fingerprint_tells_streams_apart_but_not_files(write):
    first = write(HEADER + 'a,300,200,100,1\n', 'one.csv')
    copy = write(HEADER + 'a,300,200,100,1\n', 'two.csv')
    other = write(HEADER + 'a,300,200,101,1\n', 'three.csv')
    base = Stream.open(first).fingerprint
    assert Stream.open(copy).fingerprint == base
    assert Stream.open(other).fingerprint != base
    assert Stream.open(first, count=2).fingerprint != base
    assert Stream.open(first, seed=1).fingerprint != base
