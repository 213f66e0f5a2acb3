"""The server of live pages: this machine, this page and this token only; nothing that arrives brings it down."""

from __future__ import annotations

import json
import signal
import socket
import subprocess
import sys
import urllib.error
import urllib.request
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest

import flyball as fb
from flyball.live.server import MAX_MESSAGE_SIZE, MAX_PAGES, LiveServer, serve_model
from flyball.live.session import MAX_INVALID_MESSAGES
from tests.live.pages import FOUR_BAR, options, read

client = pytest.importorskip("websockets.sync.client", reason="websockets is not installed")
exceptions = pytest.importorskip("websockets.exceptions")


@pytest.fixture(scope="module")
def server() -> Iterator[LiveServer]:
    made = LiveServer(lambda: fb.load(FOUR_BAR), options())
    thread = made.start()
    yield made
    made.stop()
    thread.join(timeout=30)
    assert not thread.is_alive()


def origin(server: LiveServer) -> str:
    return server.address.rpartition("/")[0]


@contextmanager
def connection(server: LiveServer, **changed: Any) -> Iterator[Any]:
    given: dict[str, Any] = {"origin": origin(server), "compression": None, "max_size": None} | changed
    with client.connect(server.address.replace("http", "ws", 1) + "/socket", **given) as page:
        yield page


def kinds(page: Any, until: str) -> list[str]:
    """What comes, up to the first of a kind."""
    found: list[str] = []
    while not found or found[-1] != until:
        found.append(read(page.recv(timeout=60))["kind"])
    return found


def status(address: str, **headers: str) -> int:
    try:
        with urllib.request.urlopen(urllib.request.Request(address, headers=headers)) as answer:
            return answer.status
    except urllib.error.HTTPError as error:
        return error.code


def test_only_the_address_with_the_token_has_the_page(server: LiveServer) -> None:
    with urllib.request.urlopen(server.address) as answer:
        text = answer.read().decode()
        assert answer.headers["Cache-Control"] == "no-store"
    assert f"connect-src ws{origin(server)[4:]}" in text
    assert server.address.rpartition("/")[2] not in text
    assert len(server.address.rpartition("/")[2]) >= 32
    wrong = (origin(server), origin(server) + "/", server.address + "x", server.address + "/x", server.address[:-1])
    assert {status(address) for address in wrong} == {404}
    assert status(server.address, Host="flyball.example") == 403


def test_a_path_that_is_no_text_is_refused(server: LiveServer) -> None:
    host, port = origin(server).removeprefix("http://").split(":")
    with socket.create_connection((host, int(port))) as raw:
        raw.sendall(b"GET /\xff HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n")
        assert b"".join(iter(lambda: raw.recv(1000), b"")) == b""  # closed without an answer
    assert status(server.address) == 200


def test_the_browser_is_given_a_private_file_and_not_the_token(monkeypatch: pytest.MonkeyPatch) -> None:
    opened: list[tuple[str, str, int]] = []

    def open_page(address: str) -> None:
        path = Path(urllib.request.url2pathname(address.removeprefix("file://")))
        opened.append((address, path.read_text(encoding="utf-8"), path.stat().st_mode & 0o777))

    monkeypatch.setattr("webbrowser.open", open_page)
    monkeypatch.setattr(LiveServer, "run", lambda server: server._server.socket.close())
    shown: list[str] = []
    serve_model(lambda: fb.load(FOUR_BAR), options(no_open=False), lambda address, note: shown.append(address))
    ((address, page, mode),) = opened
    assert f"url={shown[0]}" in page
    assert shown[0].rpartition("/")[2] not in address
    assert mode == 0o600 or sys.platform == "win32"
    assert not Path(urllib.request.url2pathname(address.removeprefix("file://"))).exists()


def test_it_listens_to_this_machine_only(server: LiveServer) -> None:
    assert server.address.startswith("http://127.0.0.1:")


@pytest.mark.parametrize("foreign", [None, "null", "http://127.0.0.1:1", "http://localhost", "https://flyball.example"])
def test_another_origin_may_not_connect(server: LiveServer, foreign: str | None) -> None:
    with pytest.raises(exceptions.InvalidStatus) as refused, connection(server, origin=foreign):
        pass
    assert refused.value.response.status_code == 403


def test_a_page_gets_the_model_and_its_motion(server: LiveServer) -> None:
    with connection(server) as page:
        assert kinds(page, "run") == ["model", "busy", "run"]
        page.send(json.dumps({"do": "set", "name": "speed", "value": 70}))
        assert kinds(page, "run") == ["busy", "run"]


def test_a_flood_is_thinned_to_the_newest(server: LiveServer) -> None:
    with connection(server) as page:
        kinds(page, "run")
        for k in range(2000):
            page.send(json.dumps({"do": "set", "name": "speed", "value": 40 + k / 100}))
        runs = 0
        while True:
            content = read(page.recv(timeout=60))
            runs += content["kind"] == "run"
            if content["kind"] == "run" and content["values"]["speed"] == pytest.approx(59.99):
                break
        assert runs < 1000


def test_large_and_invalid_messages_end_that_page_only(server: LiveServer) -> None:
    with connection(server) as other:
        kinds(other, "run")
        with connection(server) as page:
            kinds(page, "run")
            page.send("x" * (MAX_MESSAGE_SIZE + 1))
            with pytest.raises(exceptions.ConnectionClosed) as closed:
                page.recv(timeout=30)
            assert closed.value.rcvd.code == 1009
        with connection(server) as page:
            kinds(page, "run")
            for _ in range(MAX_INVALID_MESSAGES):
                page.send("nonsense")
                assert kinds(page, "error") == ["error"]
            page.send("nonsense")
            with pytest.raises(exceptions.ConnectionClosed) as closed:
                page.recv(timeout=30)
            assert closed.value.rcvd.code == 1008
        other.send(json.dumps({"do": "step"}))
        assert kinds(other, "stepping") == ["motion", "stepping"]


def test_a_closed_tab_makes_room(server: LiveServer) -> None:
    for _ in range(3 * MAX_PAGES):
        with connection(server) as page:
            kinds(page, "model")
            page.send(json.dumps({"do": "start"}))
            page.socket.close()  # without a good-bye
    with connection(server) as page:
        assert kinds(page, "run")[-1] == "run"


def test_without_the_package_the_extra_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "websockets.sync.server", None)
    with pytest.raises(fb.ModelError, match=r"pip install 'flyball\[live\]'"):
        LiveServer(lambda: fb.load(FOUR_BAR), options())


def test_a_port_that_is_taken_is_refused(server: LiveServer) -> None:
    port = int(origin(server).rpartition(":")[2])
    with pytest.raises(fb.ModelError, match=f"port {port} of 127.0.0.1 cannot be used: .*; leave port out"):
        LiveServer(lambda: fb.load(FOUR_BAR), options(port=port))


@pytest.mark.parametrize("do", ["start", "pause"])
def test_ctrl_c_ends_the_command_while_a_page_is_open(do: str, tmp_path: Any) -> None:
    command = [sys.executable, "-m", "flyball", "live", str(FOUR_BAR), "--no-open", "--json", "--t-end", "1"]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    try:
        assert process.stdout is not None
        address = json.loads(process.stdout.readline())["address"]
        with client.connect(
            address.replace("http", "ws", 1) + "/socket", origin=address.rpartition("/")[0], max_size=None
        ) as page:
            kinds(page, "run")
            page.send(json.dumps({"do": do}))
            if do == "start":
                kinds(page, "stepping")
            process.send_signal(signal.SIGINT)
            _, errors = process.communicate(timeout=60)
        assert (process.returncode, errors) == (0, "")
    finally:
        process.kill()


def test_faults_of_the_command_are_those_of_other_commands(capfd: pytest.CaptureFixture[str]) -> None:
    from typer.testing import CliRunner

    from flyball.cli import app

    said = CliRunner().invoke(app, ["live", str(FOUR_BAR), "--range", "speed=90 rpm:30 rpm", "--no-open"])
    assert said.exit_code == 2
    assert "the first must be less than the second" in said.stderr
    said = CliRunner().invoke(app, ["live", str(FOUR_BAR), "--range", "speed=90", "--no-open"])
    assert "write name=least:largest" in said.stderr
