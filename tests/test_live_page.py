"""The live page in a hostile house: strangers get nothing, nonsense is dropped, nobody holds it up."""

from __future__ import annotations

import asyncio
import http.client
import json
import logging
import os
import socket
import time
from base64 import b64encode
from collections.abc import Iterator

import pytest
from ports import port_of_this_worker
from tornado.websocket import websocket_connect

from softhand import Recording, load_scenario, simulate, view
from softhand.viewer.live import bounded, handlers
from softhand.viewer.live.admission import Names
from softhand.viewer.live.replay import Replay
from softhand.viewer.live.wishes import read_wish

PORT = port_of_this_worker(7740)
POLICY = "Content-Security-Policy"


@pytest.fixture(scope="module")
def recording() -> Recording:
    return simulate(load_scenario("target-a", {"duration": 0.05}))


@pytest.fixture(scope="module")
def replay(recording: Recording) -> Iterator[Replay]:
    with view(recording, port=PORT) as page:
        page._obey({"playing": False, "time": 0.02})
        yield page


def ask(replay: Replay, path: str, method: str = "GET", **headers: str) -> http.client.HTTPResponse:
    connection = http.client.HTTPConnection("127.0.0.1", replay._server.port, timeout=10)
    connection.putrequest(method, path, skip_host="Host" in headers)
    for name, value in headers.items():
        connection.putheader(name.replace("_", "-"), value)
    connection.endheaders()
    return connection.getresponse()


UPGRADE = {"Upgrade": "websocket", "Connection": "Upgrade", "Sec_WebSocket_Version": "13",
           "Sec_WebSocket_Key": b64encode(bytes(16)).decode()}  # fmt: skip
STRANGERS = ["evil.example", "evil.example:7740", "127.0.0.1.evil.example", "localhost.evil.example", "192.0.2.1",
             "evil@localhost", "[::1", "localhost,evil.example"]  # fmt: skip
OWN = ["localhost", "localhost:7740", "LOCALHOST", "127.0.0.1:1", "127.3.4.5", "[::1]:7740"]


@pytest.mark.parametrize("path", ["/", "/scene.json", "/live.js", "/meshcat.js", "/stream", "/none"])
@pytest.mark.parametrize("host", STRANGERS)
def test_a_name_that_is_not_ours_gets_nothing(replay: Replay, host: str, path: str) -> None:
    """As from a page whose name leads here: neither the scene nor the stream, which are there for our own names."""
    extra = UPGRADE | {"Origin": f"http://{host}"} if path == "/stream" else {}
    answer = ask(replay, path, Host=host, **extra)
    assert answer.status in (400, 403) and len(answer.read()) < 200


@pytest.mark.parametrize("host", OWN)
def test_the_names_of_the_loopback_get_the_page(replay: Replay, host: str) -> None:
    """With any port, since it may have been forwarded."""
    answer = ask(replay, "/scene.json", Host=host)
    assert answer.status == 200 and json.loads(answer.read())["items"]


@pytest.mark.parametrize(("origin", "status"), [
    ("http://evil.example", 403), ("null", 403), ("http://localhost:9", 403), ("https://127.0.0.1:9", 403),
    ("http://HERE", 101),
])  # fmt: skip
def test_a_stream_is_for_our_own_page(replay: Replay, origin: str, status: int) -> None:
    """Another page of the same machine is as foreign as any."""
    here = f"127.0.0.1:{replay._server.port}"
    assert ask(replay, "/stream", **UPGRADE, Host=here, Origin=origin.replace("HERE", here)).status == status


@pytest.mark.parametrize(("given", "asked", "known"), [
    ("127.0.0.1", "hand.example", False), ("127.0.0.1", "", False), ("hand.example", "hand.example:70", True),
    ("hand.example", "HAND.example", True), ("hand.example", "other.example", False),
    ("192.0.2.7", "192.0.2.7", True), ("192.0.2.7", "192.0.2.8", False), ("0.0.0.0", "192.0.2.8", True),
    ("::", "[2001:db8::1]:7000", True), ("0.0.0.0", "evil.example", False),
    ("0.0.0.0", socket.gethostname(), True), ("hand.example", "localhost", True),
])  # fmt: skip
def test_the_name_that_the_user_gave_is_ours_too(given: str, asked: str, known: bool) -> None:
    """Where all interfaces are listened on, any address in digits, which no name can stand for."""
    assert Names.of(given).have(asked) is known


@pytest.mark.parametrize(("path", "method", "headers", "status"), [
    ("/", "GET", {}, 200), ("/scene.json", "GET", {}, 200), ("/meshcat.js", "GET", {}, 200), ("/none", "GET", {}, 404),
    ("/", "POST", {}, 405), ("/", "BREW", {}, 405), ("/", "GET", {"Host": "evil.example"}, 403),
    ("/stream", "GET", {}, 400), ("/stream", "GET", UPGRADE, 101),
])  # fmt: skip
def test_every_answer_has_the_policy(
    replay: Replay, path: str, method: str, headers: dict[str, str], status: int
) -> None:
    """Errors too."""
    answer = ask(replay, path, method, **headers)
    assert answer.status == status and "default-src 'self'" in (answer.headers[POLICY] or "")


NONSENSE = ["", "{", "nul", "null", "[]", "3", '"next"', "[" * 250, '{"time": NaN}', '{"time": Infinity}',
            '{"time": 1e999}', '{"time": "1"}', '{"time": true}', '{"time": null}', '{"time": 1' + "0" * 400 + "}",
            '{"speed": 0}', '{"speed": -1}', '{"speed": 1e9}', '{"speed": NaN}', '{"playing": 1}', '{"other": 1}',
            '{"time": 1, "other": 1}', b'{"time": 1}', b"\xff\xfe", "x" * 5000]  # fmt: skip


@pytest.mark.parametrize("message", NONSENSE, ids=lambda message: repr(message[:20]))
def test_nonsense_is_no_wish(message: str | bytes) -> None:
    """Numbers that are none, what is unknown, what is too long."""
    assert read_wish(message) is None


def test_what_the_page_says_is_a_wish() -> None:
    """Its buttons and its slider."""
    assert read_wish('{"playing":false,"time":0.25}') == {"playing": False, "time": 0.25}
    assert read_wish('{"speed": 2}') == {"speed": 2.0} and read_wish('{"time": 1' + "0" * 200 + "}") == {"time": 1e200}


def test_nonsense_stops_no_page(
    replay: Replay, capfd: pytest.CaptureFixture[str], caplog: pytest.LogCaptureFixture
) -> None:
    """The page that sent it and another one get their frames; nothing is said, nothing is wound."""

    async def talk() -> list[bytes]:
        address = f"ws://127.0.0.1:{replay._server.port}/stream"
        pages = [await websocket_connect(address) for _ in range(2)]
        for message in NONSENSE:
            if len(message) <= 256:
                await pages[0].write_message(message, binary=isinstance(message, bytes))
        await pages[0].write_message('{"time": 0.02}')
        for page in pages:
            await page.write_message("next")
        frames = [await asyncio.wait_for(page.read_message(), 10) for page in pages]
        for page in pages:
            page.close()
        return frames

    with caplog.at_level(logging.INFO):
        first, second = asyncio.run(talk())
    assert len(first) > 1000 and first == second and replay.time == 0.02
    assert capfd.readouterr().err == "" and not caplog.records


def test_so_many_pages_watch_and_no_more(replay: Replay, monkeypatch: pytest.MonkeyPatch) -> None:
    """One beyond is told so; when another goes there is room again."""
    monkeypatch.setattr(handlers, "_MOST_PAGES", 2)
    deadline = time.monotonic() + 10.0
    while replay._server._audience.pages and time.monotonic() < deadline:  # those of other tests go
        time.sleep(0.01)

    def upgrade() -> tuple[int, http.client.HTTPResponse]:
        answer = ask(replay, "/stream", **UPGRADE)
        return answer.status, answer

    first, second = upgrade(), upgrade()
    assert (first[0], second[0], upgrade()[0]) == (101, 101, 503)
    first[1].close()
    while (last := upgrade())[0] != 101 and time.monotonic() < deadline:
        time.sleep(0.05)
    assert last[0] == 101


def test_connections_and_idle_time_are_bounded(recording: Recording, monkeypatch: pytest.MonkeyPatch) -> None:
    """Those that say nothing are closed; while there are too many of them a further one is closed at once."""
    monkeypatch.setattr(bounded, "MOST_CONNECTIONS", 3)
    monkeypatch.setattr(bounded, "IDLE", 1.0)
    with view(recording, port=PORT + 50) as page:
        place = "127.0.0.1", page._server.port
        silent = [socket.create_connection(place, timeout=10) for _ in range(3)]
        silent[0].sendall(b"GET / HTTP/1.1\r\nHost: localhost\r\n")  # and no end
        refused = socket.create_connection(place, timeout=10)
        begin = time.monotonic()
        assert refused.recv(1) == b"" and time.monotonic() - begin < 0.9
        assert [one.recv(1) for one in silent] == [b"", b"", b""]
        assert 0.5 < time.monotonic() - begin < 8.0
        assert ask(page, "/").status == 200


def test_a_page_that_takes_nothing_is_sent_one_frame(recording: Recording) -> None:
    """However often it asks: what it has not taken does not pile up here."""
    with view(recording, port=PORT + 100) as page:
        client = socket.create_connection(("127.0.0.1", page._server.port), timeout=10)
        client.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
        lines = [
            "GET /stream HTTP/1.1",
            "Host: localhost",
            *(f"{n.replace('_', '-')}: {v}" for n, v in UPGRADE.items()),
        ]
        client.sendall("\r\n".join([*lines, "", ""]).encode())
        assert client.recv(12).endswith(b"101")
        counts = []
        page._server._render = lambda: (counts.append(1) or len(counts), os.urandom(10_000_000))  # type: ignore[func-returns-value]
        for _ in range(40):
            client.sendall(b"\x81\x84\x00\x00\x00\x00next")
            time.sleep(0.01)
        assert len(counts) <= 2
        client.close()
