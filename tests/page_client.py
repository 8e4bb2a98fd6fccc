"""Who looks at the live page in a test: a browser, or a plain client of its websocket."""

from __future__ import annotations

import base64
import json
import os
import shutil
import subprocess
import tempfile
import time
import urllib.request
from collections.abc import Callable, Iterator
from pathlib import Path
from types import TracebackType
from typing import Any

import msgspec.msgpack
import viser
import zstandard
from websockets.sync.client import connect

TIMEOUT_S = 30.0
CHROMIUM = next(
    filter(None, map(shutil.which, ('chromium', 'chromium-browser', 'google-chrome'))), ''
)


def page_state(url: str) -> dict[str, Any]:
    """What the banner is told."""
    with urllib.request.urlopen(url + 'state.json', timeout=TIMEOUT_S) as answer:
        state: dict[str, Any] = json.load(answer)
    return state


def wait_until(condition: Callable[[], Any], what: str, seconds: float = TIMEOUT_S) -> Any:
    """What ``condition`` returns once it is true."""
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        if found := condition():
            return found
        time.sleep(0.05)
    raise AssertionError(f'not within {seconds:g} s: {what}')


class SocketClient:
    """Speaks to the page over its websocket, as the browser would."""

    def __init__(self, url: str, origin: str | None = None) -> None:
        address = url.replace('http://', 'ws://')
        self._socket = connect(
            address,
            subprotocols=[f'viser-v{viser.__version__}'],  # type: ignore[list-item]
            origin=origin or url.rstrip('/'),  # type: ignore[arg-type]
            compression=None,
            max_size=None,
        )
        self.messages: list[dict[str, Any]] = []
        self.received = 0
        self._send(
            type='ViewerCameraMessage', wxyz=[1.0, 0.0, 0.0, 0.0], position=[0.0, 0.0, 1.0],
            fov=1.0, near=0.1, far=100.0, image_height=600, image_width=800,
            look_at=[0.0, 0.0, 0.0], up_direction=[0.0, 0.0, 1.0],
        )  # fmt: skip

    def _send(self, **message: Any) -> None:
        self._socket.send(msgspec.msgpack.encode(message))

    def hear(self) -> None:
        """Take what has come, and wait a little when nothing has."""
        try:
            raw = self._socket.recv(timeout=0.1)
        except TimeoutError:
            return
        assert isinstance(raw, bytes)
        self.received += len(raw)
        packed = int.from_bytes(raw[8:16], 'little')
        inner = zstandard.ZstdDecompressor().decompress(raw[16 : 16 + packed])
        self.messages += msgspec.msgpack.decode(inner)['messages']

    def wait_for(self, condition: Callable[[dict[str, Any]], bool], what: str) -> dict[str, Any]:
        """The first message, past or to come, that meets ``condition``."""

        def look() -> dict[str, Any] | None:
            self.hear()
            return next(filter(condition, self.messages), None)

        found: dict[str, Any] = wait_until(look, what)
        return found

    def press(self, label: str) -> None:
        """Press the button with this label."""
        button = self.wait_for(
            lambda message: (
                message['type'] == 'GuiButtonMessage' and message['props']['label'] == label
            ),
            f'button {label}',
        )
        self._send(type='GuiUpdateMessage', uuid=button['uuid'], updates={'value': True})

    def close(self) -> None:
        """Go away."""
        self._socket.close()


def _family(pid: int) -> Iterator[int]:
    yield pid
    for task in Path(f'/proc/{pid}/task').glob('*/children'):
        for child in task.read_text().split():
            yield from _family(int(child))


def _processor_s(pid: int) -> float:
    fields = Path(f'/proc/{pid}/stat').read_text().rpartition(')')[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf('SC_CLK_TCK')


class Browser:
    """Headless Chromium on one page, by its own debugging protocol.

    ``before`` is JavaScript that runs before that of the page.
    """

    def __init__(self, url: str, *, width: int = 1280, height: int = 800, before: str = '') -> None:
        self._profile = tempfile.mkdtemp(prefix='page-test-')
        self._process = subprocess.Popen(
            [
                CHROMIUM, '--headless=new', '--no-sandbox', '--use-angle=swiftshader',
                '--enable-unsafe-swiftshader', '--no-first-run', '--disable-dev-shm-usage',
                '--remote-debugging-port=0', f'--user-data-dir={self._profile}', 'about:blank',
            ],
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
        )  # fmt: skip
        port_file = Path(self._profile, 'DevToolsActivePort')
        port = wait_until(
            lambda: port_file.exists() and port_file.read_text().splitlines()[:1], 'Chromium'
        )[0]
        with urllib.request.urlopen(f'http://127.0.0.1:{port}/json', timeout=TIMEOUT_S) as answer:
            pages = [tab for tab in json.load(answer) if tab['type'] == 'page']
        self._socket = connect(pages[0]['webSocketDebuggerUrl'], max_size=None)
        self._count = 0
        self.errors: list[str] = []
        for method in ('Runtime.enable', 'Log.enable', 'Page.enable'):
            self.call(method)
        self.call(
            'Emulation.setDeviceMetricsOverride',
            width=width, height=height, deviceScaleFactor=1, mobile=width < 600,
        )  # fmt: skip
        if before:
            self.call('Page.addScriptToEvaluateOnNewDocument', source=before)
        self.opened_s = time.monotonic()
        self.call('Page.navigate', url=url)

    def __enter__(self) -> Browser:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self._socket.close()
        self._process.kill()
        self._process.wait()
        shutil.rmtree(self._profile, ignore_errors=True)

    @property
    def processor_s(self) -> float:
        """Processor time of the browser until now, all its processes."""
        return sum(_processor_s(pid) for pid in _family(self._process.pid))

    def call(self, method: str, **parameters: Any) -> dict[str, Any]:
        """Call a method of the debugging protocol; note errors that the page logs meanwhile."""
        self._count += 1
        self._socket.send(json.dumps({'id': self._count, 'method': method, 'params': parameters}))
        while True:
            answer = json.loads(self._socket.recv(timeout=TIMEOUT_S))
            if answer.get('id') == self._count:
                result: dict[str, Any] = answer.get('result', {})
                return result
            self._note(answer.get('method', ''), answer.get('params', {}))

    def _note(self, method: str, parameters: dict[str, Any]) -> None:
        wrong = (
            method == 'Runtime.exceptionThrown'
            or (method == 'Runtime.consoleAPICalled' and parameters['type'] == 'error')
            or (method == 'Log.entryAdded' and parameters['entry']['level'] == 'error')
        )
        if wrong:
            self.errors.append(json.dumps(parameters)[:600])

    def evaluate(self, expression: str) -> Any:
        """The value of a JavaScript ``expression``."""
        answer = self.call('Runtime.evaluate', expression=expression, returnByValue=True)
        return answer.get('result', {}).get('value')

    def wait_for(self, expression: str, seconds: float = TIMEOUT_S) -> Any:
        """The value of ``expression`` once it is true."""
        return wait_until(lambda: self.evaluate(expression), expression, seconds)

    def press(self, label: str) -> None:
        """Press the button with this label."""
        found = f"[...document.querySelectorAll('button')].find(b => b.innerText == '{label}')"
        self.wait_for(f'!!{found}')
        self.evaluate(f'{found}.click()')

    def picture(self, path: Path) -> None:
        """Write what is seen as PNG."""
        shot = self.call('Page.captureScreenshot', format='png')
        path.write_bytes(base64.b64decode(shot['data']))
