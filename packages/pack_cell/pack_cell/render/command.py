"""``cell render``: a picture or a film of a recorded run."""

from __future__ import annotations

import argparse
import re
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

from pack_cell.options.parsers import BadValue, NumberRange

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from pack_cell.render.pictures import Filming

EXIT_OK, EXIT_USAGE = 0, 2
#: More frames than this are hardly meant.
_MOST_FRAMES = 20_000
_MOMENT = NumberRange(0, 1e6, 's')


def picture_size(text: str) -> tuple[int, int]:
    """Read a size such as `960x640`; even numbers, which films need."""
    match = re.fullmatch(r'(\d{2,4})x(\d{2,4})', text)
    if match is None:
        msg = f'{text!r} is no size such as 960x640'
        raise BadValue(msg)
    width, height = (int(number) for number in match.groups())
    if width % 2 or height % 2 or max(width, height) > 4096:
        msg = f'{text}: width and height must be even, and at most 4096'
        raise BadValue(msg)
    return width, height


def add_render(verbs: Any) -> None:  # noqa: ANN401 - argparse does not name its subparsers
    """Add ``cell render`` to the command line."""
    parser = verbs.add_parser(
        'render',
        help='a picture or a film of a recorded run',
        description='Draws a run of which run.mcap was recorded, without a screen or a graphics '
        'card: a PNG of a moment, or a GIF or MP4 of a while. Times are robot time since the start '
        'of the recording, seconds, as cell replay shows them.',
    )
    parser.add_argument('run', type=Path, metavar='RUN', help='folder of a run, or an MCAP file')
    parser.add_argument(
        '--out', type=Path, metavar='FILE', help='.png, .gif or .mp4 (default: cell.png in RUN)'
    )
    parser.add_argument(
        '--from',
        type=_MOMENT,
        dest='from_s',
        metavar='S',
        help='first moment (default: the first decision; PNG: the end)',
    )
    parser.add_argument(
        '--to', type=_MOMENT, dest='to_s', metavar='S', help='last moment (default: 20 s later)'
    )
    parser.add_argument(
        '--speed', type=NumberRange(0.01, 1000), default=2.0, metavar='X',
        help='robot time against that of the film (default 2)',
    )  # fmt: skip
    parser.add_argument(
        '--fps', type=NumberRange(1, 60), default=12.0, metavar='N',
        help='frames a second (default 12)',
    )  # fmt: skip
    parser.add_argument(
        '--size', type=picture_size, default=(640, 420), metavar='WxH',
        help='pixels (default 640x420)',
    )  # fmt: skip


def run_render(options: argparse.Namespace) -> int:
    """Do what ``options`` say; return the exit code."""
    # ROS, physics and images take a moment to load.
    from pack_cell.recording.reading import NoRecording, find_recordings
    from pack_cell.render.files import check_kind, write_film
    from pack_cell.render.pictures import Filming
    from pack_cell.replay.timeline import timeline
    from pack_cell.ros.recorded_values import recorded_values

    try:
        folder = options.run if options.run.is_dir() else options.run.parent
        out = options.out or folder / 'cell.png'
        check_kind(out)
        run = timeline(recorded_values(find_recordings(options.run)))
        first_s = min((told['t'] for told in run.decisions), default=0.0)
        moments = _moments(options, first_s, run.end_s, one=out.suffix == '.png')
        filming = Filming(run)
        try:
            write_film(out, _frames(filming, moments, options.size), options.fps)
        finally:
            filming.close()
    except (NoRecording, ValueError, OSError) as error:
        print(f'cell render: {error}', file=sys.stderr)
        return EXIT_USAGE
    print(f'wrote {out} ({out.stat().st_size / 1e6:.2f} MB)')
    return EXIT_OK


def _moments(
    options: argparse.Namespace, begin_s: float, end_s: float, *, one: bool
) -> list[float]:
    """The moments to be drawn, seconds of robot time; from ``begin_s`` where nothing is said."""
    if one:
        return [end_s if options.from_s is None else min(options.from_s, end_s)]
    first_s = begin_s if options.from_s is None else options.from_s
    last_s = min(end_s, first_s + 20.0 if options.to_s is None else options.to_s)
    if last_s < first_s:
        msg = f'nothing lies between {first_s:g} s and {last_s:g} s: the run ends at {end_s:g} s'
        raise ValueError(msg)
    count = int((last_s - first_s) * options.fps / options.speed) + 1
    if count > _MOST_FRAMES:
        msg = f'{count} frames are more than {_MOST_FRAMES}: a higher --speed, or less of the run'
        raise ValueError(msg)
    return [first_s + n * options.speed / options.fps for n in range(count)]


def _frames(
    filming: Filming, moments: list[float], size: tuple[int, int]
) -> Iterator[NDArray[np.uint8]]:
    from arm_executor.arms.physics.render import Camera

    camera = Camera()
    for now_s in moments:
        yield filming.picture(now_s, *size, camera)
