"""Who gets in: tokens, names, origins; and that nothing goes out."""

import http.client
from urllib.parse import urlsplit

import pytest
import websockets.exceptions
from studio_tab import Tab

from ovita.errors import RequestError
from ovita.studio import Studio, StudioSettings
from ovita.studio.security import StudioUnsafe, gate_for, guarded, is_local

TOKEN = "correct-horse-battery"


def get(studio, path="/", **headers):
    parts = urlsplit(studio.url)
    connection = http.client.HTTPConnection(parts.hostname, parts.port, timeout=10)
    connection.putrequest("GET", path, skip_host="Host" in headers)
    for name, value in headers.items():
        connection.putheader(name, value)
    connection.endheaders()
    answer = connection.getresponse()
    body = answer.read()
    connection.close()
    return answer.status, dict(answer.getheaders()), body


def test_the_page_may_load_nothing_from_anywhere(start):
    status, headers, body = get(start())
    policy = headers["Content-Security-Policy"]
    assert status == 200 and b"<title>ovita studio</title>" in body and b"<title>Viser</title>" not in body
    assert policy.startswith("default-src 'none'") and "http:" not in policy and "*" not in policy
    assert headers["X-Frame-Options"] == "DENY"


@pytest.mark.parametrize("path", ["/../pyproject.toml", "/%2e%2e/%2e%2e/x", "/nothing"])
def test_no_other_files_are_served(start, path):
    assert get(start(), path)[0] == 404


def test_another_name_is_not_answered(start):
    studio = start()
    assert get(studio, Host="evil.example")[0] == 403
    assert get(studio, Host="evil.example:80")[0] == 403
    port = urlsplit(studio.url).port
    assert get(studio, Host=f"localhost:{port}")[0] == 200
    with pytest.raises(websockets.exceptions.InvalidStatus):
        Tab(studio.url, headers={"Host": "evil.example"})


def test_another_page_cannot_open_a_socket(start):
    studio = start()
    with pytest.raises(websockets.exceptions.InvalidStatus):
        Tab(studio.url, headers={"Origin": "http://evil.example"})
    with pytest.raises(websockets.exceptions.InvalidStatus):
        Tab(studio.url, headers={"Origin": "null"})
    Tab(studio.url, headers={"Origin": f"http://{urlsplit(studio.url).netloc}"}).close()


def test_a_token_is_checked_before_anything_is_served(start, visit):
    studio = start(token=TOKEN)
    status, _, body = get(studio)
    assert status == 401 and b"root" not in body and b"viser" not in body.lower()
    assert get(studio, "/?token=wrong-wrong-wrong")[0] == 401
    assert get(studio, Cookie=f"ovita-studio-{studio.port}=wrong-wrong-wrong")[0] == 401
    with pytest.raises(websockets.exceptions.InvalidStatus):
        Tab(studio.url)
    status, headers, body = get(studio, f"/?token={TOKEN}")
    assert (status, headers["Location"], body) == (303, "/", b"")
    assert "HttpOnly" in headers["Set-Cookie"] and TOKEN not in headers["Location"]
    cookie = headers["Set-Cookie"].partition(";")[0]
    assert get(studio, Cookie=cookie)[0] == 200
    visit(studio, headers={"Cookie": cookie})


@pytest.mark.parametrize("host", ["0.0.0.0", "::", "192.168.1.5", "example.org"])
def test_strangers_need_a_token(host):
    with pytest.raises(StudioUnsafe, match="--token"):
        gate_for(host, "", lambda: b"")
    assert not is_local(host)


@pytest.mark.parametrize("token", ["short", "has spaces in it", "semi;colon-and-more", "x" * 300])
def test_weak_tokens_are_refused(token):
    with pytest.raises(StudioUnsafe, match="token"):
        gate_for("127.0.0.1", token, lambda: b"")


def test_a_server_without_a_gate_does_not_start():
    with pytest.raises(StudioUnsafe, match="viser"), guarded(gate_for("127.0.0.1", "", lambda: b"")):
        pass


def test_open_to_others_with_a_token(start):
    studio = start(host="0.0.0.0", token="auto")
    assert "token=" in studio.url and get(studio)[0] == 401
    assert get(studio, urlsplit(studio.url).path + "?" + urlsplit(studio.url).query)[0] == 303


def test_a_taken_port_is_told(start, template, tmp_path):
    studio = start()
    with pytest.raises(RequestError, match="choose another --port"):
        Studio(StudioSettings(template, port=studio.port, folder=tmp_path / "other"))


def test_the_tunnel_of_viser_is_shut(start, visit):
    studio = start()
    tab = visit(studio)
    tab.send("ShareUrlRequest")
    tab.say("go up by 0.1")
    tab.wait(lambda: tab.points("/lines/adapted") is not None)
    assert studio.server.request_share_url() is None and studio.server._share_tunnel is None


def test_what_viser_prints_stays_off_the_terminal(start, capfd):
    start().stop()
    told = capfd.readouterr()
    assert told.out == "" and told.err == ""
