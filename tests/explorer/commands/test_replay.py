"""`explorer replay`: the static folder, its server, the native viewer."""

import os
import threading
import urllib.error
import urllib.request

import pytest
import rerun as rr

from explorer.recordings import replay
from explorer.recordings.replay import RECORDING_NAME, replay_page
from tests.explorer.command_line import explorer, refused


@pytest.fixture(scope="module")
def recording(tmp_path_factory):
    path = tmp_path_factory.mktemp("replay") / "pour.rrd"
    stream = rr.RecordingStream("test")
    stream.set_sinks(rr.FileSink(str(path)))
    stream.log("log", rr.TextLog("hello"))
    stream.flush()
    stream.disconnect()
    return path


def test_static_folder_is_complete(recording, tmp_path):
    result = explorer("replay", recording, "--static", tmp_path / "page")
    assert result.exit_code == 0, result.output
    folder = tmp_path / "page"
    names = sorted(path.name for path in folder.iterdir())
    assert names == ["index.html", "re_viewer.js", "re_viewer_bg.wasm", RECORDING_NAME]
    assert (folder / RECORDING_NAME).read_bytes() == recording.read_bytes()
    assert (folder / "re_viewer_bg.wasm").read_bytes()[:4] == b"\0asm"
    page = (folder / "index.html").read_text()
    # the viewer's own page asks other hosts; the browser is told not to
    assert "connect-src 'self' data: blob:" in page
    assert page.index("Content-Security-Policy") < page.index("fonts.googleapis.com")
    assert RECORDING_NAME in page


def test_server_listens_on_this_machine_only(tmp_path):
    (tmp_path / "index.html").write_text("here")
    with replay.replay_server(tmp_path, 0) as server:
        host, port = server.server_address[:2]
        assert host == "127.0.0.1"
        threading.Thread(target=server.serve_forever, daemon=True).start()
        opener = urllib.request.build_opener(urllib.request.ProxyHandler({}))
        with opener.open(f"http://127.0.0.1:{port}/", timeout=10) as answer:
            assert answer.read() == b"here"
        with pytest.raises(urllib.error.HTTPError, match="404"):
            opener.open(f"http://127.0.0.1:{port}/../../etc/passwd", timeout=10)
        server.shutdown()


def test_busy_port_is_refused(recording, tmp_path):
    with replay.replay_server(tmp_path, 0) as server:
        port = server.server_address[1]
        assert f"--port {port}" in refused(explorer("replay", recording, "--port", port, "--no-browser"))


def test_native_viewer_runs_without_statistics(recording, tmp_path, monkeypatch):
    program = tmp_path / "viewer"
    program.write_text(f'#!/bin/sh\necho "CI=$CI $1" > {tmp_path}/call\nexit ${{EXIT_WITH:-0}}\n')
    program.chmod(0o755)
    monkeypatch.delenv("CI", raising=False)
    monkeypatch.setattr(replay, "viewer_program", lambda: str(program))
    assert explorer("replay", recording, "--native").exit_code == 0
    assert (tmp_path / "call").read_text() == f"CI=1 {recording}\n"
    assert "CI" not in os.environ
    monkeypatch.setenv("EXIT_WITH", "3")
    assert "ended with exit code 3" in refused(explorer("replay", recording, "--native"))


def test_replay_refuses_what_is_no_recording(recording, tmp_path):
    text = tmp_path / "text.rrd"
    text.write_text("not a recording")
    assert "is not a rerun recording" in refused(explorer("replay", text))
    assert "no such file" in refused(explorer("replay", tmp_path / "none.rrd"))
    assert "is a folder" in refused(explorer("replay", tmp_path))
    assert "--static" in refused(explorer("replay", recording, "--native", "--static", tmp_path / "page"))
    assert "not empty" in refused(explorer("replay", recording, "--static", tmp_path))
    for option in (["--port", 9], ["--no-browser"]):
        for way in (["--native"], ["--static", tmp_path / "page"]):
            assert "which open no page" in refused(explorer("replay", recording, *way, *option))
    assert [path.name for path in tmp_path.iterdir()] == ["text.rrd"]


def test_an_unknown_viewer_page_is_refused():
    with pytest.raises(ValueError, match="not supported"):
        replay_page("<html></html>")
