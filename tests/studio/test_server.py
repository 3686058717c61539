"""The server from a socket of our own: who may speak to it, how much, and what it answers."""

from __future__ import annotations

import contextlib
import http.client
import json
import os
import signal
import socket
import subprocess
import sys
import urllib.request
from pathlib import Path

import numpy as np
import pytest
from websockets.exceptions import ConnectionClosed, InvalidStatus
from websockets.sync.client import ClientConnection, connect
from websockets.typing import Origin

from chladni.drives.problem.problem import solved_board
from chladni.host.studio import http_connection
from chladni.host.studio.boards.board_message import board_message, fields_bytes
from chladni.host.studio.boards.prepared import BoardChoice, Prepared
from chladni.host.studio.messages.guard import Rate
from chladni.host.studio.server import MOST_CONNECTIONS, listen, serve
from chladni.sim.board.board import Board
from conftest import CommandLine
from studio.conftest import Studio, serving
from studio.wire import PRESS, TIMEOUT_S, VOICE, opened, read_fields, told_of


def close_code(own: ClientConnection) -> int | None:
    try:
        while True:
            own.recv(TIMEOUT_S)
    except ConnectionClosed as closed:
        return closed.rcvd.code if closed.rcvd else None


def test_fields_travel_once_as_they_are(studio: Studio, small_board: Board) -> None:
    with connect(studio.socket_url, origin=Origin(f"http://127.0.0.1:{studio.port}")) as own:
        board = told_of(own, "board")
        data = own.recv(TIMEOUT_S)
    assert isinstance(data, bytes)
    fields = solved_board(small_board).fields.values
    # float32 has 24 bits; they are rounded once.
    assert np.abs(read_fields(board, data) - fields).max() <= 2.0**-23 * np.abs(fields).max()


def test_large_fields_travel_at_fewer_points(prototype: Board) -> None:
    """0.7 MB for five coils: every other point of 179 × 367, both ends among them."""
    prepared = Prepared(BoardChoice(prototype, "ssim"), solved_board(prototype))
    data = fields_bytes(prepared)
    assert len(data) == 5 * 90 * 184 * 8 == 662_400
    fields = prepared.solved.fields.values[:, ::2, ::2]
    found = read_fields(board_message(prepared, ""), data)
    assert np.abs(found - fields).max() <= 2.0**-23 * np.abs(fields).max()


@pytest.mark.parametrize(
    ("message", "field"),
    [
        ("{", "message"), ("[]", "message"), ("[" * 1500, "message"), ('{"type": "own"}', "type"),
        ('{"type": "lift", "number": 1}', "finger"),
        *((json.dumps(PRESS | {key: value}), key) for key, value in (
            ("x_mm", "far"), ("y_mm", 1e9), ("finger", 7), ("finger", True), ("number", -1),
            ("more", 1),
        )),
        (json.dumps(PRESS | {"x_mm": float("inf")}), "message"),
        *((json.dumps(VOICE | {key: value}), key) for key, value in (
            ("finger", 5), ("tone_hz", 5.0), ("tone_hz", 251.0), ("tone_hz", "high"),
            ("level", -0.1), ("level", 1.1), ("level", None), ("x_mm", 0.0),
        )),
        (json.dumps(VOICE | {"level": float("nan")}), "message"),
    ],
)  # fmt: skip
def test_a_malformed_message_is_answered_and_does_no_harm(
    studio: Studio, message: str, field: str
) -> None:
    with opened(studio) as own:
        own.send(message)
        refused = told_of(own, "refused")
        # A page that has numbered its request must not wait for another answer.
        has_number = '"number": 1' in message
        assert (refused["field"], refused["number"]) == (field, 1 if has_number else None)
        own.send(json.dumps(PRESS))
        assert told_of(own, "played")["number"] == 1


def test_an_oversized_message_closes_its_own_connection_only(studio: Studio) -> None:
    with opened(studio) as other, opened(studio) as own:
        own.send(json.dumps(PRESS | {"x_mm": "9" * 300_000}))
        assert close_code(own) == 1009  # message too big
        other.send(json.dumps(PRESS))
        assert told_of(other, "played")["state"] == "playing"


def test_bytes_are_no_message(studio: Studio) -> None:
    with opened(studio) as own:
        own.send(b"\0" * 16)
        assert close_code(own) == 1003


def test_a_flood_ends_its_own_connection_and_no_other(studio: Studio) -> None:
    """Among the flood another page's presses are answered, each of them."""
    with opened(studio) as other, opened(studio) as own:
        other.send(json.dumps(PRESS))
        try:
            for number in range(5000):
                own.send(json.dumps(PRESS | {"number": number}))
        except ConnectionClosed:
            pass
        assert close_code(own) == 1008
        for number in range(2, 6):
            other.send(json.dumps(PRESS | {"number": number}))
            while told_of(other, "played")["number"] != number:
                pass


def test_a_rate_lets_through_what_it_says_and_no_more() -> None:
    now = [0.0]
    rate = Rate(10.0, 3.0, lambda: now[0])
    assert [rate.allows() for _ in range(4)] == [True, True, True, False]
    now[0] = 0.1
    assert [rate.allows() for _ in range(2)] == [True, False]
    now[0] = 100.0
    assert sum(rate.allows() for _ in range(10)) == 3


@pytest.mark.parametrize("origin", ["http://evil.example", "null", None, "http://127.0.0.1:1"])
def test_another_page_cannot_open_a_socket(studio: Studio, origin: str | None) -> None:
    with pytest.raises(InvalidStatus) as refused, opened(studio, origin=origin):
        pass
    assert refused.value.response.status_code == 403


def get(studio: Studio, path: str, **headers: str) -> tuple[int, str, dict[str, str]]:
    own = http.client.HTTPConnection("127.0.0.1", studio.port, timeout=TIMEOUT_S)
    own.request("GET", path, headers=headers)
    answer = own.getresponse()
    found = answer.status, answer.read().decode(), {k.lower(): v for k, v in answer.getheaders()}
    own.close()
    return found


def test_only_the_address_with_its_token_is_answered(studio: Studio) -> None:
    path = "/" + studio.url.split("/", 3)[3]
    status, text, headers = get(studio, path)
    assert (status, "Chladni studio" in text) == (200, True)
    assert headers["content-security-policy"].startswith("default-src 'none'; script-src 'self'")
    assert headers["referrer-policy"] == "no-referrer"
    assert headers["content-type"].startswith("text/html")
    assert get(studio, path + "view.js")[2]["content-type"].startswith("text/javascript")
    wrong = "/" + "x" * (len(path) - 2) + "/"
    for other in ("/", "/index.html", wrong, wrong + "view.js", path[:-2] + "/", "/%ff/"):
        assert get(studio, other)[0] == 404, other
    for outside in ("../server.py", "%2e%2e/server.py", "..%2fserver.py", "/etc/passwd"):
        assert get(studio, path + outside)[0] == 404, outside


def test_connections_that_ask_for_nothing_are_closed_and_pages_come(
    studio: Studio, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(http_connection, "REQUEST_S", 0.3)
    begun = b"GET / HTTP/1.1\r\nHost: 127.0.0.1\r\n"
    with opened(studio) as own, contextlib.ExitStack() as stack:
        silent = [
            stack.enter_context(socket.create_connection(("127.0.0.1", studio.port), TIMEOUT_S))
            for _ in range(MOST_CONNECTIONS)
        ]
        for one in silent[::2]:
            one.sendall(begun)
        assert [one.recv(1) for one in silent] == [b""] * len(silent)
        with urllib.request.urlopen(studio.url, timeout=TIMEOUT_S) as answer:
            assert answer.status == 200
        # A page's own connection is not among them.
        own.send(json.dumps(PRESS))
        assert told_of(own, "played")["state"] == "playing"


def test_a_name_that_is_not_its_own_is_refused(studio: Studio) -> None:
    """As of a foreign domain that resolves to 127.0.0.1."""
    path = "/" + studio.url.split("/", 3)[3]
    for host in ("evil.example", f"evil.example:{studio.port}", "127.0.0.1", "127.0.0.1:1"):
        assert get(studio, path, Host=host)[0] == 403, host
    assert get(studio, path, Host=f"localhost:{studio.port}")[0] == 200
    assert get(studio, path, Origin="http://evil.example")[0] == 403


def test_a_server_of_another_address_is_known_by_that_alone() -> None:
    """Every address of 127/8 is this machine's."""
    with serving("prototype", "--host", "127.0.0.2", "--port", 0, "--seconds", 60) as own:
        assert own.url.startswith("http://127.0.0.2:")
        path = "/" + own.url.split("/", 3)[3]
        for host, status in (("127.0.0.2", 200), ("127.0.0.1", 403), ("localhost", 403)):
            connection = http.client.HTTPConnection("127.0.0.2", own.port, timeout=TIMEOUT_S)
            connection.request("GET", path, headers={"Host": f"{host}:{own.port}"})
            assert connection.getresponse().status == status, host
            connection.close()
        with pytest.raises(ConnectionRefusedError):
            socket.create_connection(("127.0.0.1", own.port))


@pytest.mark.parametrize("host", ["0.0.0.0", "192.0.2.1"])
def test_an_address_that_is_none_of_this_machine_is_refused(
    chladni: CommandLine, host: str
) -> None:
    answer = chladni("studio", "prototype", "--host", host, "--port", 0)
    assert (answer.code, "--host" in answer.err, host in answer.err) == (2, True, True)


def test_what_cannot_be_served_is_said_at_once(
    chladni: CommandLine, studio: Studio, tmp_path: Path
) -> None:
    taken = chladni("studio", "--port", studio.port)
    assert taken.code == 2
    assert f"--port: expected a port that no one listens at, got {studio.port}" in taken.err
    for arguments, named in (
        (("--port", 70000), "--port"),
        (("nowhere.toml",), "BOARD"),
        (("--seconds", 0), "--seconds"),
        (("--objective", "best"), "objective"),
        (("--jobs", 0), "--jobs"),
        (("--key", tmp_path), "--key"),
    ):
        answer = chladni("studio", *arguments)
        assert (answer.code, named in answer.err) == (2, True), answer.err
        assert "Traceback" not in answer.err


def test_ctrl_c_ends_it_while_a_table_is_built(small_file: Path, tmp_path: Path) -> None:
    """0 as every command that serves until then, and no traceback of what was at work."""
    fine = tmp_path / "fine.toml"
    text = small_file.read_text(encoding="utf-8")
    fine.write_text(text.replace("pitch_mm = 18.0", "pitch_mm = 2.0"), encoding="utf-8")
    process = subprocess.Popen(
        [sys.executable, "-m", "chladni.host.cli.app", "studio", str(fine), "--port", "0"],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    assert process.stdout is not None
    assert process.stdout.readline().startswith("http://127.0.0.1:")
    process.send_signal(signal.SIGINT)
    _, said = process.communicate(timeout=TIMEOUT_S)
    assert process.returncode == 0
    assert "Traceback" not in said, said


def test_ctrl_c_while_it_begins_interrupts_no_line_of_it(small_board: Board) -> None:
    """It would leave locks of modules taken that a board's thread waits for."""
    said = []

    def begun() -> None:
        os.kill(os.getpid(), signal.SIGINT)
        said.append("begun")

    listening = listen(0)
    serve(listening, "own", BoardChoice(small_board, "ssim"), jobs=1, begun=begun)
    assert said == ["begun"]
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler


def test_it_serves_for_as_long_as_it_is_told(chladni: CommandLine, small_file: Path) -> None:
    answer = chladni("studio", small_file, "--port", 0, "--seconds", 0.2, "--json")
    assert answer.code == 0, answer.err
    with socket.socket() as own, pytest.raises(ConnectionRefusedError):
        own.connect(("127.0.0.1", int(answer.json["url"].split("/")[2].split(":")[1])))
