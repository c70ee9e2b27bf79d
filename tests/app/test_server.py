"""Who may ask the server, what it keeps, and what it gives away."""

from __future__ import annotations

import contextlib
import resource
import socket
from urllib.parse import quote

import pytest

from tests.app.running import Running
from tests.cli.conftest import run_program

pytest.importorskip("tornado")


@pytest.fixture(scope="module")
def app(tmp_path_factory):
    running = Running(tmp_path_factory.mktemp("app") / "lab", "--upload-limit", "0.001")
    yield running
    running.kill()


@pytest.mark.parametrize(
    ("method", "headers"),
    [
        ("GET", {"Cookie": ""}),
        ("GET", {"Cookie": "fogml-app-1=guess"}),
        ("GET", {"Host": "evil.example"}),
        ("GET", {"Host": "evil.example:80"}),
        ("GET", {"Origin": "http://evil.example"}),
        ("GET", {"Origin": "null"}),
        ("POST", {"X_Fogml": ""}),
        ("POST", {"X_Fogml": "", "Content_Type": "text/plain"}),
    ],
)
def test_others_are_refused(app, method, headers):
    path = "/api/state" if method == "GET" else "/api/jobs"
    status, text, _ = app.ask(method, path, **headers)
    assert status == 403
    assert "jobs" not in text


def test_the_token_opens_the_page_and_leaves_the_address(app):
    status, _, headers = app.ask("GET", f"/?token={app.token}", Cookie="")
    assert status == 303 and headers["Location"] == "/"
    cookie = headers["Set-Cookie"].lower()
    assert "httponly" in cookie and "samesite=lax" in cookie
    assert app.ask("GET", "/?token=guess", Cookie="")[0] == 403
    assert app.ask("GET", f"/?token={app.token}", Cookie="", Host="evil.example")[0] == 403
    status, text, headers = app.ask("GET", "/")
    assert status == 200 and "script-src 'self'" in headers["Content-Security-Policy"]
    assert "http://" not in text and "https://" not in text


def test_it_answers_on_this_machine_alone(app):
    port = int(app.host.partition(":")[2])
    others = {one[4][0] for one in socket.getaddrinfo(socket.gethostname(), None, socket.AF_INET)}
    for other in others - {"127.0.0.1"}:
        with socket.socket() as probe:
            probe.settimeout(2.0)
            assert probe.connect_ex((other, port)) != 0


@pytest.mark.parametrize(
    "name", ["..", "%2e%2e%2fout.csv", "a%2Fb.csv", "a%5Cb.csv", ".hidden", "-o", "x" * 181, "a%00b", "a%0Ab"]
)
def test_names_stay_in_the_folder(app, name):
    assert app.ask("PUT", f"/api/files/{name}", b"x")[0] in (400, 404)
    assert not (app.folder.parent / "out.csv").exists()
    assert [p.name for p in (app.folder / "files").iterdir() if p.name != "kept.csv"] == []


def test_uploads_are_bounded_whole_and_never_overwritten(app):
    assert app.ask("PUT", "/api/files/kept.csv", b"first")[0] == 200
    status, text, _ = app.ask("PUT", "/api/files/kept.csv", b"second")
    assert status == 409 and "here already" in text
    assert app.ask("PUT", "/api/files/large.csv", b"x" * 1001)[0] == 413
    # One that ends before its end leaves nothing.
    with socket.create_connection(tuple(app.host.split(":"))) as broken:
        head = (
            f"PUT /api/files/half.csv HTTP/1.1\r\nHost: {app.host}\r\nX-Fogml: 1\r\nContent-Length: 900\r\n"
        )
        cookie = f"Cookie: fogml-app-{app.host.split(':')[1]}={app.token}\r\n\r\n"
        broken.sendall((head + cookie).encode() + b"x" * 100)
    while any(p.name.startswith(".upload") for p in (app.folder / "files").iterdir()):
        app.ask("GET", "/api/state")
    assert [(p.name, p.read_bytes()) for p in (app.folder / "files").iterdir()] == [("kept.csv", b"first")]
    assert app.ask("DELETE", "/api/files/nothing.csv")[0] == 404


def test_an_upload_that_does_not_fit_is_told_and_leaves_nothing(tmp_path):
    app = Running(tmp_path / "lab")
    resource.prlimit(app.process.pid, resource.RLIMIT_FSIZE, (1 << 16, 1 << 16))
    status, text, _ = app.ask("PUT", "/api/files/large.csv", b"x" * (1 << 20))
    assert status == 507 and "cannot be kept: File too large; make room" in text
    assert not list((tmp_path / "lab" / "files").iterdir())
    app.kill()


def test_results_are_pages_of_an_origin_of_their_own_and_nothing_else_is_given(app):
    results = app.folder / "jobs" / "0042" / "results"
    results.mkdir(parents=True)
    (results.parent / "job.json").write_text('{"words": ["docs"], "made": ""}')
    (results.parent / "ended.json").write_text('{"status": 0, "seconds": 1.0}')
    (results / "page.html").write_text("<p>ü</p>")
    (results / "data.json").write_text("{}")
    (results / "away").symlink_to("/etc/hostname")
    status, text, headers = app.ask("GET", "/results/0042/page.html")
    assert status == 200 and text == "<p>ü</p>"
    assert headers["Content-Security-Policy"].startswith("sandbox allow-scripts")
    assert "allow-same-origin" not in headers["Content-Security-Policy"]
    assert app.ask("GET", "/results/0042/data.json")[2]["Content-Disposition"] == "attachment"
    for path in ("../job.json", "%2e%2e/job.json", "..%2fjob.json", "away", "%2Fetc%2Fhostname", "nothing"):
        assert app.ask("GET", f"/results/0042/{path}")[0] == 404, path
    assert app.ask("GET", "/results/0043/page.html")[0] == 404


@pytest.mark.parametrize(
    ("method", "path", "body", "status"),
    [
        *(("GET", f"/results/0044/{name}", None, 404) for name in ("%00", "a%00b", "x" * 300, "x%2f" * 3000)),
        ("POST", "/api/files/a.csv", b"x", 405),
        ("PATCH", "/api/files/a.csv", b"x", 405),
        ("DELETE", "/api/files/folder", b"x", 404),
        ("POST", "/api/jobs", b"[" * 100_000, 400),
        ("POST", "/api/jobs", {"command": "noise", "values": {"axis": "\ud800"}}, 400),
        ("POST", "/api/jobs", {"command": "noise", "values": {"axis": "a\0b"}}, 400),
        ("POST", "/api/command", b'{"a":' * 100_000, 400),
    ],
)
def test_what_no_page_asks_is_no_fault_of_the_server(app, method, path, body, status):
    results = app.folder / "jobs" / "0044" / "results"
    results.mkdir(parents=True, exist_ok=True)
    (results.parent / "job.json").write_text('{"words": ["docs"], "made": ""}')
    (results.parent / "ended.json").write_text('{"status": 0, "seconds": 1.0}')
    (folder := app.folder / "files" / "folder").mkdir()
    try:
        assert app.ask(method, path, body)[0] == status
    finally:
        folder.rmdir()


def test_a_per_cent_sign_in_a_name_is_told_as_it_is(app):
    assert app.ask("PUT", "/api/files/100%25.csv", b"x")[0] == 200
    try:
        assert "'100%.csv'" in app.ask("PUT", "/api/files/100%25.csv", b"x")[1]
    finally:
        assert app.ask("DELETE", "/api/files/100%25.csv")[0] == 200


@pytest.mark.parametrize("name", ["a%20b.csv", "100%41.csv", "a+b ü.csv"])
def test_a_name_is_read_once(app, name):
    """Else `100%41.csv` was kept as `100A.csv`, and a result of such a name was not found."""
    address = quote(name, safe="")
    assert app.ask("PUT", f"/api/files/{address}", b"x")[0] == 200
    assert [p.name for p in (app.folder / "files").iterdir() if p.name != "kept.csv"] == [name]
    assert app.ask("DELETE", f"/api/files/{address}")[0] == 200
    results = app.folder / "jobs" / "0045" / "results"
    results.mkdir(parents=True, exist_ok=True)
    (results.parent / "job.json").write_text('{"words": ["docs"], "made": ""}')
    (results.parent / "ended.json").write_text('{"status": 0, "seconds": 1.0}')
    (results / name).write_text("held")
    assert app.ask("GET", f"/results/0045/{address}")[:2] == (200, "held")


def test_a_bad_form_is_one_line_and_no_job(app):
    before = len(list((app.folder / "jobs").iterdir()))
    for told in ({"command": "blind", "values": {}}, {"command": "inspect", "values": {"out": "/tmp/x"}}):
        status, text, _ = app.ask("POST", "/api/jobs", told)
        assert status == 400 and "the app has no" in text
    status, text, _ = app.ask("POST", "/api/jobs", {"command": "monitor", "values": {}})
    assert (status, text.partition(";")[0]) == (400, "no model is given")
    assert app.ask("POST", "/api/jobs", b"[]")[0] == 400
    # More than a form is not read to its end.
    with contextlib.suppress(ConnectionError):
        assert app.ask("POST", "/api/jobs", b"x" * (2 << 20))[0] in (400, 413)
    assert len(list((app.folder / "jobs").iterdir())) == before


def test_a_port_or_folder_that_is_taken_is_said(app, tmp_path):
    port = app.host.partition(":")[2]
    assert f"--port {port}" in run_program("app", tmp_path / "other", "--port", port, status=2).stderr
    told = run_program("app", app.folder, "--port", "0", status=2).stderr
    assert "another fogml app serves this folder (process" in told and "--out" not in told
    (tmp_path / "file").write_text("x")
    assert "is a file" in run_program("app", tmp_path / "file", status=2).stderr


def test_an_idle_server_ends(tmp_path):
    assert run_program("app", tmp_path / "lab", "--port", "0", "--idle", "0.1").stdout.startswith(
        "Open http://127"
    )
