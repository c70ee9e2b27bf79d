"""The job of ``fogml app``."""

from __future__ import annotations

from pathlib import Path

from fogml.cli.app import AppSettings
from fogml.cli.app_forms import forms, words_of
from fogml.cli.terminal import Terminal
from fogml.errors import InputError
from fogml.outputs import sole_writer


def serve(settings: AppSettings, terminal: Terminal) -> None:
    """Serve the page until it is interrupted, or idle for as long as asked."""
    try:
        from fogml.app.server import listen
        from fogml.app.server import serve as serve_app
    except ImportError as error:
        raise InputError(
            f"fogml app needs Tornado ({error}): pip install -e '.[app]' in fogml's source"
        ) from None
    home = Path(settings.folder)
    if home.exists() and not home.is_dir():
        raise InputError(f"{home}: is a file, a folder was expected; choose another FOLDER")
    home.mkdir(parents=True, exist_ok=True)
    home = home.resolve()
    from fogml.app.state import App, Limits

    limits = Limits(int(settings.upload_limit * 1e6), settings.jobs, settings.idle)
    # A second server of the folder would start its waiting jobs again.
    with sole_writer(home / "server"):
        app = App(home, forms(), words_of, limits)
        listening, address = listen(app, settings.port)
        terminal.result({"address": address, "folder": str(home)})
        terminal.say(f"Open {address}")
        terminal.say("That address opens the page for whoever has it. End with Ctrl+C; jobs go on.")
        if settings.browser:
            import webbrowser

            webbrowser.open(address)
        serve_app(app, listening)
