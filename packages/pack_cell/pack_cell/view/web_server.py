"""A viser server for this machine alone, with the banner on its page.

viser serves its page and the websocket behind it on one port. Three things are added where it hands
its handler to `websockets`: our head of the page; the state as JSON; and a look at where a request
comes from, since any web site that somebody has open could otherwise open a websocket to this
machine and press the buttons.
"""

from __future__ import annotations

import contextlib
import functools
import gzip
import http
import io
import json
import socket
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

import viser
import websockets.asyncio.server
from websockets.asyncio.server import ServerConnection
from websockets.datastructures import Headers
from websockets.http11 import Request, Response

from pack_cell.pages.rendering import source

_Handler = Callable[[ServerConnection, Request], Response | None]


class PageTaken(ValueError):
    """The port cannot be had; the message says what to do."""


def start_server(host: str, port: int, state: Callable[[], dict[str, Any]]) -> viser.ViserServer:
    """Serve on ``host`` and ``port`` (0: any free one); ``state`` may be called in any thread.

    Raises
    ------
    PageTaken
        Somebody else has the port, or the host is none of this machine.
    """
    _check_free(host, port)
    with _added_to_viser(state), contextlib.redirect_stdout(io.StringIO()):
        server = viser.ViserServer(host=host, port=port, verbose=False)
    if port and server.get_port() != port:
        stop_server(server)
        raise PageTaken(_taken(host, port, 'somebody else has just taken it'))
    return server


def stop_server(server: viser.ViserServer) -> None:
    """Stop serving, without a word."""
    with contextlib.redirect_stdout(io.StringIO()):
        server.stop()


def _check_free(host: str, port: int) -> None:
    """viser itself would go on to the next port, and the reader would look at the wrong one."""
    try:
        family, kind, protocol, _, address = socket.getaddrinfo(
            host, port, type=socket.SOCK_STREAM, flags=socket.AI_PASSIVE
        )[0]
        with socket.socket(family, kind, protocol) as probe:
            probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            probe.bind(address)
    except OSError as error:
        raise PageTaken(_taken(host, port, error.strerror or str(error))) from None


def _taken(host: str, port: int, why: str) -> str:
    return (
        f'the page cannot be served on {host} port {port}: {why}; take another one with '
        '--port (0: any free one)'
    )


@contextlib.contextmanager
def _added_to_viser(state: Callable[[], dict[str, Any]]) -> Iterator[None]:
    """While a viser server starts, put :func:`_answer` before its own handler of requests."""
    serve = websockets.asyncio.server.serve

    def serve_guarded(*arguments: Any, process_request: _Handler, **options: Any) -> Any:  # noqa: ANN401
        handler = functools.partial(_answer, process_request, state)
        return serve(*arguments, process_request=handler, **options)

    setattr(websockets.asyncio.server, 'serve', serve_guarded)  # noqa: B010 - mypy knows a class
    try:
        yield
    finally:
        setattr(websockets.asyncio.server, 'serve', serve)  # noqa: B010


def _answer(
    others: _Handler,
    state: Callable[[], dict[str, Any]],
    connection: ServerConnection,
    request: Request,
) -> Response | None:
    """Answer what is ours, refuse what comes from other pages, leave the rest to viser."""
    if not is_own_page(request.headers.get('Origin'), request.headers.get('Host')):
        text = b'This page can only be used from its own address.\n'
        return _response(text, 'text/plain', http.HTTPStatus.FORBIDDEN)
    path = request.path.partition('?')[0]
    if path == '/state.json':
        return _response(json.dumps(state()).encode(), 'application/json')
    if path in ('/', '/index.html') and request.headers.get('Upgrade') is None:
        packed = 'gzip' in request.headers.get('Accept-Encoding', '')
        return _response(_index(packed=packed), 'text/html; charset=utf-8', packed=packed)
    return others(connection, request)


def is_own_page(origin: str | None, host: str | None) -> bool:
    """Whether a request with these headers is not from a page of somebody else.

    >>> is_own_page('http://localhost:8080', 'localhost:8080')
    True
    >>> is_own_page('https://elsewhere.example', 'localhost:8080')
    False
    """
    return origin is None or urlsplit(origin).netloc == (host or '')


@functools.cache
def _index(*, packed: bool) -> bytes:
    """viser's page with our head."""
    page = (Path(viser.__file__).parent / 'client' / 'build' / 'index.html').read_text()
    head = f'<style>{source("view/page.css")}</style><script>{source("view/page.js")}</script>'
    page = page.replace('<title>Viser</title>', f'<title>Packing cell</title>{head}', 1)
    return gzip.compress(page.encode()) if packed else page.encode()


def _response(
    body: bytes, kind: str, status: http.HTTPStatus = http.HTTPStatus.OK, *, packed: bool = False
) -> Response:
    headers = {
        'Content-Type': kind,
        'Content-Length': str(len(body)),
        'Content-Encoding': 'gzip' if packed else 'identity',
        'Cache-Control': 'no-store',
        'Connection': 'close',
    }
    return Response(status.value, status.phrase, Headers(**headers), body)
