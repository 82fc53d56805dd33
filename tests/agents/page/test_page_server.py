import http.client
import json
import logging
import time

import numpy as np
import pytest

pytest.importorskip("uvicorn", reason="needs the extra 'ui'")
pytest.importorskip("starlette", reason="needs the extra 'ui'")
from page_server import served
from websockets.exceptions import ConnectionClosed, InvalidStatus
from websockets.sync.client import connect

from mplearn_agents.cli import main
from mplearn_agents.page import hub as hub_module


@pytest.fixture(scope="module")
def server():
    with served() as found:
        yield found


def get(server, path="/", **headers):
    connection = http.client.HTTPConnection("127.0.0.1", server.port, timeout=10)
    connection.request("GET", path, headers=headers)
    response = connection.getresponse()
    body = response.read()
    connection.close()
    return response, body


def open_socket(server, *, origin="own", **headers):
    if origin == "own":
        origin = server.url.rstrip("/")
    return connect(
        f"ws://127.0.0.1:{server.port}/socket",
        origin=origin,
        additional_headers=headers,
        max_size=None,
        compression=None,
        close_timeout=0.2,
    )


def texts(socket, kind, timeout=5.0):
    """Return the next message of a kind."""
    end = time.monotonic() + timeout
    while time.monotonic() < end:
        message = socket.recv(timeout=end - time.monotonic())
        if isinstance(message, str) and json.loads(message)["kind"] == kind:
            return json.loads(message)
    raise AssertionError(f"no {kind}")


def test_the_page_keeps_to_itself(server):
    for path in ("/", "/main.js", "/page.css", "/icon.svg"):
        response, body = get(server, path)
        assert response.status == 200 and body
        policy = response.headers["content-security-policy"]
        assert "default-src 'none'" in policy and "script-src 'self'" in policy
        assert "unsafe" not in policy and "http" not in policy
        assert response.headers["x-content-type-options"] == "nosniff"
        text = body.decode().replace("http://www.w3.org/2000/svg", "")
        assert "http://" not in text and "https://" not in text  # nothing is loaded from elsewhere
        assert "innerHTML" not in text and "insertAdjacentHTML" not in text and "eval(" not in text


def test_every_module_of_the_page_is_served(server):
    _, main = get(server, "/main.js")
    for line in main.decode().splitlines():
        if line.startswith("import"):
            name = line.split('"./')[1].split('"')[0]
            response, _ = get(server, f"/{name}")
            assert response.headers["content-type"].startswith("text/javascript")


@pytest.mark.parametrize("path", ["/../hub.py", "/%2e%2e/hub.py", "/hub.py", "/static/main.js"])
def test_nothing_else_is_served(server, path):
    assert get(server, path)[0].status == 404


def test_a_name_that_is_not_loopback_is_refused(server):
    """A stranger's name that was made to point here (DNS rebinding)."""
    assert get(server, Host="evil.example")[0].status == 403
    assert get(server, Host=f"localhost:{server.port}")[0].status == 200
    assert get(server, Host="[::1]:1")[0].status == 200


@pytest.mark.parametrize(
    "origin", [None, "http://evil.example", "null", "http://127.0.0.1:1", "file://127.0.0.1"]
)
def test_sockets_of_other_pages_are_refused(server, origin):
    with pytest.raises((InvalidStatus, ConnectionClosed)), open_socket(server, origin=origin) as s:
        s.recv(timeout=5)


def test_a_socket_tells_all_there_is_and_what_comes(server):
    server.hear({"kind": "knowledge", "primitives": [], "nodes": [], "edges": [], "revision": 3})
    with open_socket(server) as socket:
        assert texts(socket, "hello")["you"] >= 1
        assert texts(socket, "knowledge")["revision"] == 3
        server.hear({"kind": "event", "what": "born", "text": "{1}", "time_s": 1.0})
        event = texts(socket, "event")
        assert event["text"] == "{1}" and event["seq"] >= 1
    with open_socket(server) as socket:  # reload shows it again
        past = texts(socket, "past")
        assert past["events"][-1] == event


def test_ticks_carry_what_moves_and_every_row_once(server):
    server.hear({"kind": "stream", "channels": ["a", "b"], "rate_hz": 100.0, "stride": 2})
    pose = np.arange(14, dtype=np.float32).reshape(2, 7)
    with open_socket(server) as socket:
        texts(socket, "stream")
        rows = np.random.default_rng(0).normal(size=(300, 2)).astype(np.float32)
        got = np.zeros((0, 2), np.float32)
        for first in range(0, 300, 30):
            part = rows[first : first + 30]
            header = {"kind": "live", "first": first, "n": 30, "bodies": 2}
            server.hear(header, pose.tobytes() + part.tobytes())
        end = time.monotonic() + 5
        while len(got) < 300 and time.monotonic() < end:
            message = socket.recv(timeout=5)
            if isinstance(message, bytes) and message[0] == 1:
                head = np.frombuffer(message, "<u2", 3, 2)
                first, n = np.frombuffer(message, "<u4", 2, 8)
                values = np.frombuffer(message, "<f4", offset=16)
                if n:
                    assert first == len(got)
                    np.testing.assert_array_equal(values[:14].reshape(2, 7), pose)
                    size = 7 * int(head[0] + head[1])
                    got = np.concatenate((got, values[size:].reshape(n, 2)))
        np.testing.assert_array_equal(got, rows)


@pytest.mark.parametrize(
    ("request_", "why"),
    [
        ("not json", "must be JSON"),
        ("[" * 3000, "must be JSON"),
        ("[]", "object"),
        ('{"do": 3}', "string"),
        ('{"do": "__init__"}', "nobody knows"),
        ('{"do": "undo", "by": "' + "x" * 9000 + '"}', "at most 8192"),
    ],
)
def test_bad_requests_are_answered_with_the_reason(server, request_, why):
    with open_socket(server) as socket:
        socket.send(request_)
        reply = texts(socket, "reply")
        assert not reply["ok"] and why in reply["text"]


def test_what_is_too_long_ends_the_socket_and_nothing_else(server):
    with open_socket(server) as other:
        with open_socket(server) as socket:
            socket.send("x" * 100_000)
            with pytest.raises(ConnectionClosed):
                for _ in range(1000):
                    socket.recv(timeout=5)
        server.hear({"kind": "event", "what": "x", "text": "still here", "time_s": 0.0})
        while texts(other, "event")["text"] != "still here":
            pass


def test_bytes_from_a_page_end_its_socket_quietly(server):
    with open_socket(server) as socket:
        socket.send(b"\x00\x01")
        with pytest.raises(ConnectionClosed):
            for _ in range(1000):
                socket.recv(timeout=5)


def test_who_goes_with_much_still_asked_goes_quietly(server, caplog):
    """Who sends to it finds out first; what it asked is not an error of the server."""
    logger = logging.getLogger("uvicorn.error")
    logger.addHandler(caplog.handler)
    with open_socket(server) as socket:
        texts(socket, "hello")
        for _ in range(300):
            socket.send("{}")
        socket.socket.close()
    end = time.monotonic() + 20
    while server.hub.clients and time.monotonic() < end:
        time.sleep(0.02)
    logger.removeHandler(caplog.handler)
    ours = [each for each in caplog.records if each.name != "websockets.client"]  # it was cut off
    assert not server.hub.clients and not ours


def test_who_reads_slowly_gets_the_latest_and_costs_no_memory(server):
    """Of what is only worth knowing now the latest is kept; of the rest all is told anew."""
    with open_socket(server) as reading, open_socket(server):  # the second one never reads
        texts(reading, "hello")
        padding = "x" * 1000
        event = {"kind": "event", "what": "x", "text": padding, "time_s": 0.0}

        def happens(first):
            for k in range(first, first + 100):
                server.hub.hear({"kind": "status", "k": k, "padding": padding})
                server.hub.hear(event)

        for first in range(0, 3000, 100):
            server.call(lambda first=first: happens(first))
        waiting = [
            sum(len(m) for m in client._told) + sum(len(m) for m in client._latest.values())
            for client in server.hub.clients
        ]
        assert max(waiting) < (hub_module.MOST_BEHIND + hub_module.MOST_EVENTS + 10) * 1200
        while texts(reading, "status")["k"] != 2999:
            pass


def test_clients_that_go_are_forgotten(server):
    with open_socket(server) as socket:
        texts(socket, "hello")
        before = len(server.hub.clients)
    end = time.monotonic() + 5
    while len(server.hub.clients) >= before and time.monotonic() < end:
        time.sleep(0.02)
    assert len(server.hub.clients) == before - 1


def test_a_reply_goes_to_who_asked(server):
    with open_socket(server) as one, open_socket(server) as two:
        number = texts(one, "hello")["you"]
        texts(two, "hello")
        reply = {"kind": "reply", "client": number, "ref": 5, "ok": True, "text": "done"}
        server.hear(reply)
        server.hear({"kind": "event", "what": "x", "text": "after", "time_s": 0.0})
        assert texts(one, "reply") == reply
        seen = []
        while "event" not in seen:
            message = two.recv(timeout=5)
            seen += [json.loads(message)["kind"]] if isinstance(message, str) else []
        assert "reply" not in seen


def test_with_a_token_only_who_knows_it_looks_on():
    with served(token="s3cret") as server:
        assert get(server)[0].status == 403
        assert get(server, "/?token=wrong")[0].status == 403
        assert get(server, "/main.js")[0].status == 403
        response, _ = get(server, "/?token=s3cret")
        assert response.status == 303 and response.headers["location"] == "/"
        cookie = response.headers["set-cookie"]
        assert "HttpOnly" in cookie and "samesite=strict" in cookie.lower()
        own = cookie.split(";")[0]
        assert get(server, Cookie=own)[0].status == 200
        with open_socket(server, Cookie=own) as socket:
            texts(socket, "hello")
        for stolen in ({}, {"Cookie": own + "x"}):
            with pytest.raises((InvalidStatus, ConnectionClosed)), open_socket(server, **stolen):
                pass


@pytest.mark.parametrize(
    ("options", "why"),
    [
        (["--port", "99999"], "65535"),
        (["--host", "203.0.113.7", "--port", "0"], "cannot listen"),
        (["recording:/no/such/file{1}.bvh", "--port", "0"], "file{1}.bvh"),
    ],
)
def test_what_cannot_be_is_refused_in_a_line(options, why, capsys):
    assert main(["live", *options]) == 2
    told = capsys.readouterr()
    assert why in told.err and len(told.err.splitlines()) == 1
    assert not told.out  # no address of a page that will not be there
