"""The app's answers: who may ask, what is taken, and pages of results kept apart."""

from __future__ import annotations

import hmac
import json
import mimetypes
import tempfile
import time
from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any

from tornado.http1connection import HTTP1Connection
from tornado.iostream import StreamClosedError
from tornado.web import HTTPError, RequestHandler, stream_request_body

import fogml
from fogml.app.state import OFFERED, App
from fogml.errors import FogmlError, InputError

STATIC = Path(__file__).parent / "static"
_OWN_POLICY = (
    "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' data:; connect-src 'self'; "
    "base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
)
_RESULT_POLICY = (
    "sandbox allow-scripts allow-popups allow-downloads; default-src 'none'; script-src 'unsafe-inline'; "
    "style-src 'unsafe-inline'; img-src data: blob:; font-src data:; base-uri 'none'; form-action 'none'; "
    "frame-ancestors 'none'"
)
"""A result's page runs its scripts in an origin of its own: the app's pages and cookie are out of reach."""


class _Handler(RequestHandler):
    """What every answer has: who may ask, and what a browser may do with it."""

    def initialize(self, app: App) -> None:
        self.app = app

    def set_default_headers(self) -> None:
        self.set_header("Content-Security-Policy", _OWN_POLICY)
        self.set_header("X-Content-Type-Options", "nosniff")
        self.set_header("Referrer-Policy", "no-referrer")
        self.set_header("Cache-Control", "no-store")
        self.set_header("Cross-Origin-Resource-Policy", "same-origin")
        self.clear_header("Server")

    def prepare(self) -> None:
        """Refuse other names of this machine, other pages' requests, and who has no token."""
        request = self.request
        # Another name would be one that a stranger's page made point here.
        if request.host not in self.app.hosts:
            raise HTTPError(403, "the address is not the one that fogml app printed")
        origin = request.headers.get("Origin")
        if origin is not None and origin not in [f"http://{host}" for host in self.app.hosts]:
            raise HTTPError(403, "asked by another page")
        # A header that no page of elsewhere can send unasked.
        if request.method not in ("GET", "HEAD") and request.headers.get("X-Fogml") != "1":
            raise HTTPError(403, "asked by another page")
        if not self._has_token():
            raise HTTPError(403, "open the address that fogml app printed")
        self.app.asked_at = time.monotonic()

    def _has_token(self) -> bool:
        held = self.get_cookie(self.app.cookie) or ""
        return hmac.compare_digest(held.encode(), self.app.token.encode())

    def write_error(self, status_code: int, **kwargs: Any) -> None:
        """One line of text."""
        error = kwargs.get("exc_info", (None, None, None))[1]
        told = self._reason
        if isinstance(error, HTTPError) and error.log_message:
            told = error.log_message % error.args
        self.set_header("Content-Type", "text/plain; charset=utf-8")
        self.finish(told)

    def log_exception(self, typ: Any, value: Any, tb: Any) -> None:
        """What is no error of the server's is not logged."""
        if not isinstance(value, HTTPError):
            super().log_exception(typ, value, tb)

    def answer(self, values: Any) -> None:
        """JSON."""
        self.set_header("Content-Type", "application/json")
        self.finish(json.dumps(values))

    def asked(self) -> tuple[str, Mapping[str, Any]]:
        """Command and values of a form.

        Raises
        ------
        HTTPError
            400, if the request holds none.
        """
        try:
            told = json.loads(self.request.body)
            command, values = told["command"], told["values"]
            # No command line holds halves of characters or zero bytes.
            if b"\\u0000" in json.dumps(told, ensure_ascii=False).encode():
                raise ValueError
        except (ValueError, KeyError, TypeError, RecursionError):
            raise HTTPError(400, "no form") from None
        if not isinstance(command, str) or not isinstance(values, dict):
            raise HTTPError(400, "no form")
        return command, values

    def job_folder(self, name: str) -> Path:
        """A job's folder.

        Raises
        ------
        HTTPError
            404, if there is no such job.
        """
        folder = self.app.jobs.folder_of(name)
        if folder is None:
            raise HTTPError(404, f"there is no job {name} any more")
        return folder


class _Nothing(_Handler):
    def prepare(self) -> None:
        super().prepare()
        raise HTTPError(404, "there is nothing of that name")


class _Page(_Handler):
    def prepare(self) -> None:
        """The one address that a token in it opens."""
        token = self.get_query_argument("token", None)
        if token is None or self.request.host not in self.app.hosts:
            super().prepare()
        elif not hmac.compare_digest(token.encode(), self.app.token.encode()):
            raise HTTPError(403, "that token is none of this server's: open the address that it printed last")
        else:
            # A page of results is of another origin: what leads from it to the next comes from elsewhere.
            self.set_cookie(self.app.cookie, self.app.token, httponly=True, samesite="Lax")
            self.redirect("/", status=303)

    def get(self) -> None:
        self.set_header("Content-Type", "text/html; charset=utf-8")
        self.finish((STATIC / "index.html").read_bytes())


class _Static(_Handler):
    def get(self, name: str) -> None:
        place = STATIC / name
        if not place.is_file():
            raise HTTPError(404)
        kind = "text/css" if name.endswith(".css") else "text/javascript"
        self.set_header("Content-Type", f"{kind}; charset=utf-8")
        self.finish(place.read_bytes())


class _State(_Handler):
    def get(self) -> None:
        app = self.app
        files = app.files_told()
        values = {
            "folder": str(app.home),
            "upload_bytes": app.limits.upload_bytes,
            "version": fogml.__version__,
            "files": files,
            "jobs": [app.jobs.told(name) for name in reversed(app.jobs.names())],
            "offered": {takes: app.offered(takes, files) for takes in OFFERED},
        }
        if self.get_query_argument("forms", None) is not None:
            values["forms"] = app.forms
        self.answer(values)


class _Command(_Handler):
    def post(self) -> None:
        """The command line of a form, and what is missing or wrong."""
        self.answer(self.app.line(*self.asked()))


class _NewJob(_Handler):
    def post(self) -> None:
        command, values = self.asked()
        try:
            # What is wrong is said before there is a job.
            self.app.check(command, values)
            name = self.app.jobs.add(lambda results: self.app.words(command, values, results))
        except FogmlError as error:
            raise HTTPError(400, str(error)) from None
        except OSError as error:
            raise HTTPError(507, f"the job cannot be kept: {error.strerror}") from None
        self.answer({"name": name})


class _Job(_Handler):
    def get(self, name: str) -> None:
        self.job_folder(name)
        self.answer(self.app.jobs.in_full(name))

    def delete(self, name: str) -> None:
        self.job_folder(name)
        try:
            self.app.jobs.remove(name)
        except InputError as error:
            raise HTTPError(409, str(error)) from None
        self.answer({})


class _Cancel(_Handler):
    def post(self, name: str) -> None:
        self.job_folder(name)
        self.app.jobs.cancel(name)
        self.answer({})


@stream_request_body
class _Upload(_Handler):
    """A file as it comes, on disk rather than in memory, and never more than allowed."""

    partial: Path | None = None
    fault = ""

    def prepare(self) -> None:
        super().prepare()
        if self.request.method != "PUT":
            return
        assert isinstance(self.request.connection, HTTP1Connection)
        self.request.connection.set_max_body_size(self.app.limits.upload_bytes)
        length = self.request.headers.get("Content-Length", "0")
        if not (length.isascii() and length.isdecimal()):
            raise HTTPError(400, "the length of the file is no number")
        if int(length) > self.app.limits.upload_bytes:
            raise HTTPError(413, f"the file is larger than {self.app.limits.upload_bytes / 1e6:g} MB allowed")
        try:
            self.app.files.place(self.path_args[0])
        except InputError as error:
            raise HTTPError(400, str(error)) from None
        self._file = tempfile.NamedTemporaryFile(  # noqa: SIM115
            dir=self.app.files.folder, prefix=".upload-", delete=False
        )
        self.partial = Path(self._file.name)

    def data_received(self, chunk: bytes) -> None:
        if self.partial is None:
            return  # of another method than PUT, or of a file that is given up
        try:
            self._file.write(chunk)
            self._file.flush()
        except OSError as error:
            # Told once all has come: before, the connection would end without a word.
            self.fault = f"the file cannot be kept: {error.strerror}; make room and drop it again"
            self._drop()

    def put(self, name: str) -> None:
        if self.fault:
            raise HTTPError(507, self.fault)
        self._file.close()
        assert self.partial is not None
        partial, self.partial = self.partial, None
        try:
            self.app.files.keep(partial, name)
        except InputError as error:
            raise HTTPError(409, str(error)) from None
        self.answer({})

    def delete(self, name: str) -> None:
        try:
            self.app.files.remove(name)
        except InputError as error:
            raise HTTPError(404, str(error)) from None
        self.answer({})

    def on_finish(self) -> None:
        self._drop()

    def on_connection_close(self) -> None:
        self._drop()

    def _drop(self) -> None:
        """Remove what came of an upload that ended before its end."""
        if self.partial is not None:
            with suppress(OSError):  # of a full disk, which the rest of it does not fit on
                self._file.close()
            self.partial.unlink(missing_ok=True)
            self.partial = None


class _Result(_Handler):
    """A file that a job wrote, as a page of an origin of its own or as a download."""

    async def get(self, name: str, path: str) -> None:
        home = (self.job_folder(name) / "results").resolve()
        try:
            place = (home / path).resolve()
            is_there = place.is_relative_to(home) and place.is_file()
        except (OSError, ValueError):  # no name that the system has
            is_there = False
        if not is_there:
            raise HTTPError(404, "there is no such file any more")
        self.set_header("Content-Security-Policy", _RESULT_POLICY)
        if place.suffix == ".html":
            self.set_header("Content-Type", "text/html; charset=utf-8")
        else:
            self.set_header("Content-Type", mimetypes.guess_type(place.name)[0] or "application/octet-stream")
            self.set_header("Content-Disposition", "attachment")
        self.set_header("Content-Length", str(place.stat().st_size))
        with open(place, "rb") as file:
            while chunk := file.read(1 << 18):
                self.write(chunk)
                try:
                    await self.flush()
                except StreamClosedError:
                    return


def routes(app: App) -> list[tuple[str, type[RequestHandler], dict[str, Any]]]:
    """Addresses of the app, with what answers them; what is none of them comes last."""
    answers: list[tuple[str, type[RequestHandler]]] = [
        (r"/", _Page),
        (r"/static/([a-z]+\.(?:js|css))", _Static),
        (r"/api/state", _State),
        (r"/api/files/(.+)", _Upload),
        (r"/api/command", _Command),
        (r"/api/jobs", _NewJob),
        (r"/api/jobs/(\d+)", _Job),
        (r"/api/jobs/(\d+)/cancel", _Cancel),
        (r"/results/(\d+)/(.+)", _Result),
        (r".*", _Nothing),
    ]
    return [(address, answer, {"app": app}) for address, answer in answers]
