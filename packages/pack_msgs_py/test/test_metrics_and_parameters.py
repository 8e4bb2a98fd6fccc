"""Fill metrics, time summaries, and parameters as data."""

from dataclasses import dataclass, fields

import pytest

from pack_msgs_py.metrics import fill_metrics, quantile, time_summary
from pack_msgs_py.parameter_fields import check_value, parameter, parameter_table
from pack_msgs_py.values import Bin, Box, PlacedBox, parse_bin


def half_full(serial, share):
    """An EQ bin whose boxes take ``share`` of it."""
    if not share:
        return Bin(f'EQ-{serial}', serial, parse_bin('EQ'))
    height = 800 * share
    placed = PlacedBox(Box(f'b{serial}', (800, 800, height)), (0, 0, 0), (800, 800, int(height)))
    return Bin(f'EQ-{serial}', serial, parse_bin('EQ'), (placed,))


def test_the_three_fill_rates():
    closed = [half_full(1, 0.5), half_full(2, 0.75)]
    still_open = [half_full(3, 0.25), half_full(4, 0)]
    assert fill_metrics(closed, still_open) == {
        'fill_closed': pytest.approx(62.5),
        'fill_all': pytest.approx(50.0),
        'fill_first_failure': pytest.approx(50.0),
    }


def test_without_a_closed_bin_there_is_no_closed_fill():
    assert fill_metrics([], [half_full(1, 0.5)])['fill_closed'] is None


def test_quantiles_are_values_that_occurred():
    assert quantile([3.0, 1.0, 2.0], 0.5) == 2.0
    assert quantile([1.0, 2.0], 0.99) == 2.0
    assert time_summary([1.0, 3.0])['mean'] == 2.0
    assert time_summary([])['max'] is None


@dataclass(frozen=True)
class Wanted:
    """Parameters of a node that does not exist."""

    speed: float = parameter(1.0, 'belt speed', unit='m/s', low=0.1, high=3.0)
    count: int = parameter(5, 'boxes', low=1)
    mode: str = parameter('fast', 'how', choices=('fast', 'slow'))


@pytest.mark.parametrize(
    ('name', 'value', 'text'),
    [
        ('speed', float('nan'), 'finite'),
        ('speed', 0.0, 'at least 0.1 m/s'),
        ('speed', 4.0, 'at most 3 m/s'),
        ('speed', 'fast', 'of type float'),
        ('count', True, 'of type int'),
        ('count', 0, 'at least 1'),
        ('mode', 'medium', 'one of fast, slow'),
    ],
)
def test_a_wrong_parameter_is_named_with_its_value(name, value, text):
    spec = next(field for field in fields(Wanted) if field.name == name)
    with pytest.raises(ValueError, match=f'parameter {name} is .*{text}'):
        check_value(spec, value)


def test_a_whole_number_is_accepted_for_a_real_one():
    assert check_value(fields(Wanted)[0], 2) == 2.0


def test_the_table_has_a_row_per_parameter():
    table = parameter_table(Wanted)
    assert '| `speed` | `1.0` | 0.1 to 3 m/s | belt speed |' in table
    assert '| `mode` | `fast` | `fast`, `slow` | how |' in table
