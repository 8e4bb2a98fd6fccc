"""The page of a recorded run: the cell in 3D at any moment, decision by decision."""

from __future__ import annotations

from collections.abc import Sequence

from arm_executor.model.layout import Layout
from pack_cell.pages.rendering import render
from pack_cell.recording.heard import Heard
from pack_cell.replay.timeline import timeline
from pack_msgs_py.wording import how_many

#: How many times as fast as real time the page plays.
SPEEDS = (0.1, 0.25, 0.5, 1, 2, 5, 10, 30, 100)


def replay_page(name: str, heard: Sequence[Heard]) -> str:
    """One self-contained page of what was ``heard`` in the run called ``name``."""
    run = timeline(heard).data()
    belt = Layout().conveyor
    # No message tells how broad and long the belt is.
    run['belt_size'] = [belt.width, belt.length]
    begun_s = run['decisions'][0]['t'] if run['decisions'] else 0.0
    minutes, seconds = divmod(round(run['end'] - begun_s), 60)
    subtitle = (
        f'{how_many(len(run["boxes"]), "box")}, {how_many(len(run["decisions"]), "decision")}, '
        f'{minutes}:{seconds:02d} min robot time'
    )
    return render(
        'replay/replay.html', title=f'Replay: {name}', subtitle=subtitle, run=run, speeds=SPEEDS
    )
