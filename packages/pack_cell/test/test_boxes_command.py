"""`cell boxes`: what people are told of their list before anything runs."""

import pytest

from conveyor_sim.streams import read_boxes
from pack_cell.cli import main
from pack_cell.options.run_options import open_stream, parse_run_options
from pack_cell.running.node_parameters import check_cell, node_parameters
from pack_cell.running.run import unheeded
from pack_msgs_py.profiles import find_profile

LIST = (
    'SKU;Länge (cm);Breite (cm);Höhe (cm);Gewicht (g);Menge;Farbe;zerbrechlich\n'
    'glas[/];30;20;10,5;1.500;2;blau;ja\nanvil;30;20;10;28.000;1;;\nbeam;170;70;10;5.000;1;;\n'
    'torn;30;x;10;1.000;5;;\n'
)


@pytest.fixture
def boxes_file(tmp_path):
    path = tmp_path / 'list [1].csv'
    path.write_text(LIST, encoding='utf-8')
    return path


def test_all_that_is_understood_is_shown_and_written_in_our_own_format(
    boxes_file, tmp_path, capsys
):
    clean = tmp_path / 'clean.csv'
    code = main(['boxes', str(boxes_file), '--bin', 'LDC', '--bin', 'SYN', '-o', str(clean)])
    told = ' '.join(capsys.readouterr().out.split())
    assert code == 1, 'a row is rejected'
    for part in (
        f'{boxes_file}: 4 boxes, 1 rejected row',
        "length is 'Länge (cm)' in cm, decimal comma",
        'note: not used: Farbe',
        "rejected: list [1].csv, line 5, column Breite (cm): 'x' is not a number (5 boxes)",
        'glas[/]/1 300x200x105 1.5 carries 0 N, sku glas[/]',
        'above 1200 mm #',
        'LDC 3 of 4 upright',
        'SYN 3 of 4 upright',
        'cannot ride on the belt: 1: beam (size x is 1700 mm',
        'too heavy for ur20, which lifts 20 kg: 1: anvil (28 kg)',
        '2 boxes carry nothing on top',
        f'written: 4 boxes to {clean}, without 1 rejected row',
    ):
        assert part in told
    boxes = [entry for entry in read_boxes(boxes_file).entries if hasattr(entry, 'size_mm')]
    assert list(read_boxes(clean).entries) == boxes


def test_a_list_that_is_clear_ends_with_code_0_and_a_stream_by_name_is_shown_too(capsys):
    assert main(['boxes', 'cartons', '--rows', '1']) == 0
    assert 'cartons: 40 boxes, 0 rejected rows' in capsys.readouterr().out


@pytest.mark.parametrize(
    ('text', 'words'),
    [
        ('L,B,H\n3,2,1\n', 'say --units'),
        ('id;length_mm;width_mm;height_mm\na;1.100;2;3\n', 'may be 1.1 or 1100'),
        ('id,colour\n1,red\n', 'no column length, width, height'),
    ],
)
def test_what_is_not_clear_is_one_line_with_code_2_for_boxes_and_run(tmp_path, capsys, text, words):
    path = tmp_path / 'list.csv'
    path.write_text(text)
    assert main(['boxes', str(path)]) == 2
    assert words in capsys.readouterr().err
    try:
        assert main(['run', '--boxes', str(path), '--out', str(tmp_path / 'run')]) == 2
    except SystemExit as ended:
        assert ended.code == 2
    error = capsys.readouterr().err
    assert words in error
    assert len(error.splitlines()) == 1
    assert not (tmp_path / 'run').exists()


def test_options_of_a_run_say_what_the_list_does_not(tmp_path):
    path = tmp_path / 'list.csv'
    path.write_text('L;B;H;order\n1.100;20;10;7,1\n30;20;10;8\n')
    options = parse_run_options(
        ['--boxes', str(path), '--units', 'mm', '--decimal', 'comma', '--open-bins', '1']
    )
    check_cell(options)
    assert open_stream(options)[0].size_mm == (1100, 20, 10)
    parameters = node_parameters(tmp_path, options)['conveyor']
    assert (parameters['units'], parameters['decimal']) == ('mm', 'comma')


def test_bins_serve_the_orders_that_come_first(tmp_path):
    path = tmp_path / 'list.csv'
    header = 'order,length_mm,width_mm,height_mm\n'
    path.write_text(header + '7,30,20,10\n7,30,20,10\n8,30,20,10\n9,30,20,10\n')
    options = parse_run_options(['--boxes', str(path), '--order-by', 'order', '--open-bins', '2'])
    nodes = node_parameters(tmp_path, options)
    assert nodes['arm_executor']['destinations'] == '7,8'
    assert nodes['conveyor']['order_by'] == 'order'
    assert [box.destination for box in open_stream(options).first_round] == ['7', '7', '8', '9']
    path.write_text(header + '"7,1",30,20,10\n')
    with pytest.raises(ValueError, match='holds a comma'):
        check_cell(options)


def test_a_run_says_which_wishes_of_boxes_its_profile_does_not_heed(tmp_path):
    path = tmp_path / 'list.csv'
    path.write_text('length_mm,width_mm,height_mm,fragile\n30,20,10,yes\n30,20,10,no\n')
    stream = open_stream(parse_run_options(['--boxes', str(path)]))
    assert list(unheeded(stream, find_profile('cell'))) == []
    (note,) = unheeded(stream, find_profile('paper'))
    assert note.startswith('1 may carry little or nothing, which profile paper')
