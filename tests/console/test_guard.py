"""Nobody but the page itself presses its buttons, by no other name, and not without its key."""

from __future__ import annotations

from http.cookies import SimpleCookie

import pytest

from tests.console.asking import Page, request

STOP = {"do": "stop"}


@pytest.mark.parametrize(
    "host", ["evil.example", "127.0.0.1.evil.example:8765", "", "localhost:8765@evil.example", "192.168.1.7"]
)
def test_a_name_that_somebody_resolved_to_this_computer_is_refused(host: str) -> None:
    page = Page()
    assert page.get("/", host=host).status == 421
    assert page.act(STOP, host=host, origin=f"http://{host}").status == 421
    assert page.robot.asked == []


@pytest.mark.parametrize("host", ["127.0.0.1:8765", "localhost:9000", "[::1]:8765", "LOCALHOST"])
def test_the_names_of_this_computer_are_let_in(host: str) -> None:
    assert Page().get("/", host=host).status == 200


def test_another_address_is_let_in_only_where_it_was_asked_for() -> None:
    assert Page().get("/", host="10.0.0.5:8765").status == 421
    assert Page(hosts=frozenset({"10.0.0.5:8765"})).get("/", host="10.0.0.5:8765").status == 200


@pytest.mark.parametrize(
    "headers",
    [
        {"origin": "http://evil.example"},
        {"origin": "null"},
        {"origin": "http://127.0.0.1:9999"},
        {"origin": ""},
        {"x_hvcpd_token": ""},
        {"x_hvcpd_token": "guessed"},
        {"x_hvcpd_token": "gu\u00e9ss"},
    ],
)
def test_another_page_presses_no_button(headers: dict[str, str]) -> None:
    page = Page()
    assert page.act(STOP, **headers).status == 403
    assert page.robot.asked == []
    assert page.act(STOP).status == 200
    assert page.robot.asked == [("stop", {})]


def test_a_page_with_a_key_is_opened_by_its_address_and_then_by_the_cookie() -> None:
    page = Page(key="secret")
    for path in ("/", "/?key=wrong", "/events?key=secret", "/lines", "/part/main.js"):
        assert page.get(path).status == 403
    opened = page.get("/?key=secret")
    assert (opened.status, opened.headers["location"]) == (303, "/")
    cookie = opened.headers["set-cookie"]
    assert "HttpOnly" in cookie
    assert "SameSite=strict" in cookie
    kept = cookie.partition(";")[0]
    assert page.get("/", cookie=kept).status == 200
    assert page.get("/", cookie=kept.replace("secret", "wrong")).status == 403
    assert page.act(STOP).status == 403
    assert page.act(STOP, cookie=kept).status == 200


@pytest.mark.parametrize("host", ["127.0.0.1:8766", "[::1]:8766", "localhost"])
def test_a_second_page_at_another_port_leaves_the_first_one_its_key(host: str) -> None:
    """Two robots' pages in one browser, which keeps cookies by host alone: the newer one's replaced the older one's."""
    first, second = Page(key="one"), Page(key="two")
    jar: SimpleCookie = SimpleCookie(first.get("/?key=one").headers["set-cookie"])
    jar.load(second.get("/?key=two", host=host).headers["set-cookie"])
    cookies = "; ".join(f"{name}={kept.value}" for name, kept in jar.items())
    assert first.act(STOP, cookie=cookies).status == 200
    assert second.get("/", host=host, cookie=cookies).status == 200


def test_every_answer_forbids_foreign_content_and_scripts_in_the_page() -> None:
    page = Page()
    for answer in (page.get("/"), page.get("/part/main.js"), page.get("/nothing"), page.get("/", host="evil.example")):
        policy = answer.headers["content-security-policy"]
        assert "default-src 'none'" in policy
        assert "unsafe" not in policy
        assert "frame-ancestors 'none'" in policy
        assert answer.headers["x-content-type-options"] == "nosniff"
    index = page.get("/").text
    assert "<style" not in index
    assert " style=" not in index
    assert "<script>" not in index
    assert "http" not in index, "nothing from elsewhere"


@pytest.mark.parametrize("method", ["POST", "PUT", "DELETE", "PATCH", "OPTIONS"])
def test_other_methods_need_the_token_too(method: str) -> None:
    assert request(Page().app, "/", method).status == 403
