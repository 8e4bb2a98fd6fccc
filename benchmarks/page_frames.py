"""What the scene of the live page costs a browser, with many boxes in the bins.

    ./cell python benchmarks/page_frames.py --boxes 20 100 300

Serves the page of a cell that is made up, with three open bins, an arm that moves at 20 Hz and ten
boxes on the belt, and opens it in headless Chromium. Prints for each number of boxes: meshes in the
scene, draw calls and triangles of a frame, bytes that a browser gets to begin with and each second,
time until banner and buttons are there and until the first frame with boxes, frames a second, and
processor time of Chromium for each.

Chromium draws in software here (SwiftShader), on the processors: that says little of a browser with
a graphics card; draw calls and triangles say what such a card has to do. What the page itself does
for a frame is measured in a second visit in which draw calls are counted but not done: frames a
second, and processor time of the thread that takes messages, moves what has moved and asks for the
drawing, all messages of that time included.
"""

from __future__ import annotations

import argparse
import math
import sys
import threading
import time
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
sys.path += [str(ROOT / 'tests'), str(ROOT / 'packages' / 'pack_cell' / 'test')]

from page_client import Browser, SocketClient  # noqa: E402
from view_cases import box, decision_for, new_view, scan_of  # noqa: E402

from pack_cell.view.cell_view import CellView  # noqa: E402
from pack_cell.view.page import CellPage, PageAddress  # noqa: E402
from pack_msgs_py.cell_values import BinSnapshot  # noqa: E402
from pack_msgs_py.values import Bin, Box, PlacedBox, parse_bin  # noqa: E402

#: Counts what is drawn, frame by frame; runs before the page's own code.
COUNTER = """
window.frames_ = {frames: 0, calls: 0, triangles: 0};
for (const [name, vertices, instances] of [
  ['drawElements', 1, -1], ['drawArrays', 2, -1], ['drawElementsInstanced', 1, 4],
  ['drawArraysInstanced', 2, 3],
]) {
  const draw = WebGL2RenderingContext.prototype[name];
  WebGL2RenderingContext.prototype[name] = function (...given) {
    frames_.calls += 1;
    const copies = instances < 0 ? 1 : given[instances];
    if (given[0] === this.TRIANGLES) frames_.triangles += given[vertices] / 3 * copies;
    return draw.apply(this, given);
  };
}
const count = () => { frames_.frames += 1; requestAnimationFrame(count); };
requestAnimationFrame(count);
"""
#: The same, but nothing is drawn.
BLIND = COUNTER.replace('return draw.apply(this, given);', '')
#: JavaScript that is true once a button can be pressed.
BUTTONS = "[...document.querySelectorAll('button')].some(b => b.innerText == 'Pause')"
EDGE = (200, 130, 100)


def filled_bin(serial: int, station: str, boxes: int) -> Bin:
    """A bin with so many boxes in rows and layers."""
    kind = parse_bin('LDC')
    across = [kind.size_mm[axis] // EDGE[axis] for axis in range(2)]
    placed = []
    for number in range(boxes):
        layer, place = divmod(number, across[0] * across[1])
        y, x = divmod(place, across[0])
        corner = (x * EDGE[0], y * EDGE[1], layer * EDGE[2])
        made = Box(f'{station}-{number}', tuple(map(float, EDGE)), 2.0)
        placed.append(PlacedBox(made, corner, EDGE))
    return Bin(f'LDC-{serial}', serial, kind, tuple(placed), station)


def view_with(boxes: int) -> CellView:
    """A cell with three open bins that hold ``boxes`` together."""
    view = new_view()
    bins = tuple(
        filled_bin(serial, station, boxes // 3 + (boxes % 3 >= serial))
        for serial, station in enumerate('ABC', start=1)
    )
    view.on_bins(BinSnapshot(1, 1.0, bins))
    waiting = [box(number) for number in range(10)]
    view.on_scan(scan_of(*waiting))
    view.on_decision(decision_for(waiting[0]))
    return view


class MovingPage:
    """The page in a thread, refreshed as the node does it."""

    def __init__(self, view: CellView) -> None:
        self._view, self._stop = view, threading.Event()
        self.page = CellPage(view, PageAddress('127.0.0.1', 0), lambda *order: None)
        self._thread = threading.Thread(target=self._refresh)
        self._thread.start()

    def _refresh(self) -> None:
        names = [joint.name for joint in self._view.robot.joints if joint.kind == 'revolute']
        while not self._stop.wait(0.05):
            now_s = time.monotonic()
            self._view.on_joints({name: math.sin(now_s + k) for k, name in enumerate(names)})
            self.page.refresh_state()
            self.page.refresh_text()
            self.page.refresh_scene()

    def close(self) -> None:
        """Stop refreshing and serving."""
        self._stop.set()
        self._thread.join()
        self.page.close()


def bytes_sent(url: str, seconds: float) -> tuple[int, float, int]:
    """Bytes of the scene to begin with, bytes a second after that, and meshes and lines."""
    client = SocketClient(url)
    client.wait_for(lambda message: message.get('name') == '/ghosts/boxes', 'the scene')
    end_s = time.monotonic() + 2
    while time.monotonic() < end_s:
        client.hear()
    first = client.received
    end_s = time.monotonic() + seconds
    while time.monotonic() < end_s:
        client.hear()
    drawn = {
        message['name']
        for message in client.messages
        if message['type'].endswith('Message')
        and any(kind in message['type'] for kind in ('Mesh', 'Box', 'Cylinder', 'sphere', 'Line'))
        and 'name' in message
    }
    client.close()
    return first, (client.received - first) / seconds, len(drawn)


@dataclass(frozen=True)
class Look:
    """What a visit showed: times since the page was asked for, the rest by frame."""

    banner_s: float
    buttons_s: float
    boxes_s: float
    calls: float
    triangles: float
    rate: float
    spent_s: float
    own_s: float


def own_s(browser: Browser) -> float:
    """Processor time of the page's main thread until now."""
    metrics = browser.call('Performance.getMetrics')['metrics']
    return float(next(each['value'] for each in metrics if each['name'] == 'TaskDuration'))


def look(url: str, seconds: float, before: str) -> Look:
    """Open the page, and look at it for so long."""
    with Browser(url, before=before) as browser:
        browser.call('Performance.enable', timeDomain='threadTicks')
        times = []
        for shown in (
            "document.querySelector('#cell-banner .name')?.innerText == 'RUN'",
            BUTTONS,
            'frames_.triangles > 12000 || frames_.frames > 600',
        ):
            browser.wait_for(shown, 120)
            times.append(time.monotonic() - browser.opened_s)
        time.sleep(3)
        browser.evaluate('frames_.frames = frames_.calls = frames_.triangles = 0')
        since_s, before_s, own_before_s = time.monotonic(), browser.processor_s, own_s(browser)
        time.sleep(seconds)
        seen = browser.evaluate('({...frames_})')
        lasted_s = time.monotonic() - since_s
        spent_s, spent_own_s = browser.processor_s - before_s, own_s(browser) - own_before_s
    frames = max(1, seen['frames'])
    return Look(
        *times,
        seen['calls'] / frames,
        seen['triangles'] / frames,
        seen['frames'] / lasted_s,
        spent_s / frames,
        spent_own_s / frames,
    )


def row(boxes: int, seconds: float) -> str:
    """A row of the table."""
    moving = MovingPage(view_with(boxes))
    url = f'http://127.0.0.1:{moving.page.port}/'
    try:
        first, rate, meshes = bytes_sent(url, seconds)
        seen, blind = look(url, seconds, COUNTER), look(url, seconds, BLIND)
    finally:
        moving.close()
    return (
        f'| {boxes} | {meshes} | {seen.calls:.0f} | {seen.triangles:.0f} | '
        f'{first / 1e3:.0f} kB | {rate / 1e3:.1f} kB | '
        f'{seen.banner_s:.1f} / {seen.buttons_s:.1f} / {seen.boxes_s:.1f} s | '
        f'{seen.rate:.1f} | {seen.spent_s:.2f} s | {blind.rate:.0f} | {1e3 * blind.own_s:.1f} ms |'
    )


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument('--boxes', type=int, nargs='+', default=[20, 100, 300])
    parser.add_argument('--seconds', type=float, default=10.0)
    options = parser.parse_args()
    print('| boxes in bins | meshes | draw calls a frame | triangles a frame | to begin with '
          '| each second | banner / buttons / boxes after | frames/s in software '
          "| processor time of a frame | frames/s, nothing drawn | of that the page's own work |"
    )  # fmt: skip
    print('|---|---|---|---|---|---|---|---|---|---|---|')
    for boxes in options.boxes:
        print(row(boxes, options.seconds), flush=True)


if __name__ == '__main__':
    main()
