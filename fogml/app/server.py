"""The app's server, bound to this machine alone.

Tornado serves it: one package without further ones, of an asynchronous server that takes uploads as they come
and stands under Jupyter and Dask.
"""

from __future__ import annotations

import asyncio
import socket

from tornado.httpserver import HTTPServer
from tornado.web import Application

from fogml.app.handlers import routes
from fogml.app.state import App
from fogml.errors import InputError

HOST = "127.0.0.1"
LOOK_EVERY_S = 0.5
"""How often waiting jobs are looked after [s]."""
FORM_BYTES = 1 << 20
"""Greatest size of a request that is no file."""


def listen(app: App, port: int) -> tuple[socket.socket, str]:
    """Bind to a port of this machine: what listens, and the address that opens the page.

    Raises
    ------
    InputError
        If the port is taken.
    """
    try:
        listening = socket.create_server((HOST, port), backlog=128)
    except OSError as error:
        raise InputError(f"--port {port}: {error.strerror or error}; choose another, or 0 for any") from None
    listening.setblocking(False)
    port = listening.getsockname()[1]
    app.hosts = (f"{HOST}:{port}", f"localhost:{port}")
    # Cookies are the host's, not the port's: each server has one of its own.
    app.cookie = f"fogml-app-{port}"
    return listening, f"http://{HOST}:{port}/?token={app.token}"


def serve(app: App, listening: socket.socket) -> None:
    """Serve until interrupted, or idle."""
    asyncio.run(_serve(app, listening))


async def _serve(app: App, listening: socket.socket) -> None:
    application = Application(routes(app), log_function=lambda handler: None)
    server = HTTPServer(application, max_body_size=FORM_BYTES, max_header_size=1 << 16)
    server.add_socket(listening)
    try:
        while not app.idle():
            app.jobs.start_waiting()
            await asyncio.sleep(LOOK_EVERY_S)
    finally:
        server.stop()
