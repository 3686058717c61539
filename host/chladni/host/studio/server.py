"""The server: its page's files, a connection for each page, and its own address."""

from __future__ import annotations

import contextlib
import errno
import socket
import sys
import threading
from collections.abc import Callable, Sequence
from pathlib import Path

import uvicorn
from starlette.applications import Starlette
from starlette.routing import Mount, WebSocketRoute
from starlette.staticfiles import StaticFiles
from starlette.websockets import WebSocket

from chladni.drives.problem.threads import one_blas_thread
from chladni.host.studio.boards.builder import BoardBuilder
from chladni.host.studio.boards.catalogue import Catalogue
from chladni.host.studio.boards.prepared import BoardChoice
from chladni.host.studio.http_connection import HttpConnection
from chladni.host.studio.messages.guard import Guard
from chladni.host.studio.messages.requests import LONGEST
from chladni.host.studio.session import Session
from chladni.sim.errors import ArgumentError

PAGE = Path(__file__).parent / "page"
LOOPBACK = "127.0.0.1"
EVERY_ADDRESS = ("", "0.0.0.0", "255.255.255.255")
PORT_FAULTS = {
    errno.EADDRINUSE: ("a port that no one listens at", "is another studio running? 0 takes any"),
    errno.EACCES: ("a port above 1023", "0 takes any"),
}
"""What is expected of a port that cannot be had, and a hint; other errors are the address's."""
MOST_PAGES = 16
"""At once; each has a device and two threads."""
MOST_CONNECTIONS = 128
PING_S, PONG_S = 1.0, 5.0
"""How often a page is asked for a sign of life, and how long that may take. The finger of a page
whose network went away is lifted then. Megabytes of fields may be on their way before it."""
TRY_LATER = 1013
"""Code with which a page is sent away for now (IANA's registry of WebSocket close codes)."""


def application(
    builder: BoardBuilder, choice: BoardChoice, known_ports: Sequence[str] = ()
) -> Starlette:
    """Files and connections, for whoever gets through the guard."""
    pages: set[Session] = set()
    catalogue = Catalogue(choice)

    async def connect(websocket: WebSocket) -> None:
        await websocket.accept()
        if len(pages) >= MOST_PAGES:
            await websocket.close(TRY_LATER, f"{MOST_PAGES} pages are open")
            return
        session = Session(websocket, builder, catalogue, known_ports)
        pages.add(session)
        try:
            await session.run()
        finally:
            pages.discard(session)

    files = StaticFiles(directory=PAGE, html=True)
    return Starlette(routes=[WebSocketRoute("/socket", connect), Mount("/", files)])


def listen(port: int, host: str = LOOPBACK) -> socket.socket:
    """A socket on an address of this machine; port 0 is any that is free.

    Raises
    ------
    InputError
        The port is taken or not to be had, or the address is not one of this machine's.
    """
    if host in EVERY_ADDRESS:
        raise ArgumentError("host", host, "one address of this machine: pages are held against it")
    listening = socket.socket(socket.AF_INET, socket.SOCK_STREAM)
    # A server that was just stopped leaves its port in TIME_WAIT.
    listening.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
    try:
        listening.bind((host, port))
        listening.listen()
    except OSError as error:
        listening.close()
        if error.errno not in PORT_FAULTS:
            expected = "an address of this machine, such as 192.168.1.20"
            raise ArgumentError("host", host, expected) from None
        expected, hint = PORT_FAULTS[error.errno]
        raise ArgumentError("port", port, expected, hint=hint) from None
    return listening


def make_server(
    port: int,
    token: str,
    choice: BoardChoice,
    builder: BoardBuilder,
    *,
    host: str = LOOPBACK,
    known_ports: Sequence[str] = (),
) -> uvicorn.Server:
    """A server of pages.

    Parameters
    ----------
    port, host
        Where it will listen.
    token
        First part of every path.
    choice
        The board of pages.
    builder
        Makes it and others ready.
    known_ports
        Serial ports that a page may choose besides those with a USB bridge.
    """
    app = Guard(application(builder, choice, known_ports), token, port, host)
    config = uvicorn.Config(
        app,
        http=HttpConnection,
        ws="websockets-sansio",
        ws_max_size=LONGEST,
        ws_per_message_deflate=False,
        ws_ping_interval=PING_S,
        ws_ping_timeout=PONG_S,
        lifespan="off",
        log_config=None,
        access_log=False,
        proxy_headers=False,
        server_header=False,
        limit_concurrency=MOST_CONNECTIONS,
        timeout_graceful_shutdown=1,
    )
    return uvicorn.Server(config)


def serve(
    listening: socket.socket,
    token: str,
    choice: BoardChoice,
    *,
    known_ports: Sequence[str] = (),
    jobs: int | None = None,
    seconds: float | None = None,
    begun: Callable[[], None] = lambda: None,
) -> None:
    """Serve pages until Ctrl-C, or for so long.

    Parameters
    ----------
    listening
        As of `listen`.
    token, choice, known_ports
        As of `make_server`; the board is made ready at once.
    jobs
        Threads of a table's build.
    begun
        Called when pages can be asked for.
    """
    builder = BoardBuilder(jobs)
    host, port = listening.getsockname()
    server = make_server(port, token, choice, builder, host=host, known_ports=known_ports)
    # A scorecard's thread gives way to a press within a millisecond; by default it takes five.
    sys.setswitchinterval(1e-3)
    try:
        # Threads are limited once, before there are any: each would put back what it found.
        # Signals are the server's before a board's thread begins: one that came up here while a
        # module is loaded would leave its lock taken, and that thread would wait for it for ever.
        own_signals = server.capture_signals()
        with one_blas_thread(), contextlib.suppress(KeyboardInterrupt), own_signals:
            builder.build(choice)
            if seconds is not None:
                timer = threading.Timer(seconds, setattr, (server, "should_exit", True))
                timer.daemon = True
                timer.start()
            begun()
            server.run([listening])
    finally:
        builder.close()
        listening.close()
