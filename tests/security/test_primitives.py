"""Keys, codes and seals against the vectors of their standards."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from hvcpd.security.hkdf import MAX_BYTES, expand, extract
from hvcpd.security.keys import KEY_BYTES, KeyRing, TeamKey
from hvcpd.security.one_time import authenticator_uri, counted_code, step_of
from hvcpd.security.recovery import checked_number, secret_of
from hvcpd.security.seal import Seals, Sentence

SECRET = b"12345678901234567890"
"""Of the appendices of RFC 4226 and RFC 6238."""
KEY = TeamKey(bytes(range(KEY_BYTES)))


@pytest.mark.parametrize(
    ("salt", "secret", "info", "length", "out"),
    [
        (
            bytes(range(13)),
            b"\x0b" * 22,
            bytes(range(0xF0, 0xFA)),
            42,
            "3cb25f25faacd57a90434f64d0362f2a2d2d0a90cf1a5a4c5db02d56ecc4c5bf34007208d5b887185865",
        ),
        (
            b"",
            b"\x0b" * 22,
            b"",
            42,
            "8da4e775a563c18f715f802a063c5a31b8a11f5c5ee1879ec3454e5f3c738d2d9d201395faa4b61a96c8",
        ),
    ],
)
def test_hkdf_gives_the_vectors_of_rfc_5869(salt: bytes, secret: bytes, info: bytes, length: int, out: str) -> None:
    assert expand(extract(salt, secret), info, length).hex() == out


def test_hkdf_gives_no_more_than_it_can() -> None:
    assert len(expand(bytes(32), b"", MAX_BYTES)) == MAX_BYTES
    with pytest.raises(ValueError, match="not 8161"):
        expand(bytes(32), b"", MAX_BYTES + 1)


def test_counted_codes_are_those_of_rfc_4226() -> None:
    wanted = "755224 287082 359152 969429 338314 254676 287922 162583 399871 520489".split()
    assert [counted_code(SECRET, count) for count in range(10)] == wanted


@pytest.mark.parametrize(
    ("wall_s", "code"),
    [(59, "94287082"), (1111111109, "07081804"), (1234567890, "89005924"), (20000000000, "65353130")],
)
def test_codes_of_the_clock_are_those_of_rfc_6238(wall_s: int, code: str) -> None:
    assert counted_code(SECRET, step_of(wall_s), digits=8) == code


def test_an_authenticator_is_told_the_secret_in_base_32() -> None:
    assert "secret=GEZDGNBVGY3TQOJQGEZDGNBVGY3TQOJQ&" in authenticator_uri(SECRET, "plant")


def test_each_name_has_a_key_of_its_own() -> None:
    derived = [KEY.voice_key("rob"), KEY.voice_key("bot"), KEY.sheet_key, KEY.clock_key]
    assert len({bytes(key) for key in derived}) == 4
    assert KEY.voice_key("Rob") == KEY.voice_key("rob")
    assert TeamKey(bytes(KEY_BYTES)).voice_key("rob") != KEY.voice_key("rob")


def test_a_key_does_not_show_itself() -> None:
    shown = repr(KeyRing(KEY, (KEY,))) + str(KEY)
    assert KEY.secret.hex() not in shown
    assert repr(KEY.secret)[2:-1] not in shown


def test_a_key_of_the_wrong_length_is_refused() -> None:
    with pytest.raises(ValueError, match="16 bytes"):
        TeamKey(b"short")


@given(st.binary(min_size=KEY_BYTES, max_size=KEY_BYTES))
def test_a_written_key_is_read_again(secret: bytes) -> None:
    assert secret_of(checked_number(secret)) == secret


@given(st.binary(min_size=KEY_BYTES, max_size=KEY_BYTES), st.integers(0, 143))
def test_a_wrong_bit_of_a_written_key_is_noticed_nearly_always(secret: bytes, bit: int) -> None:
    wrong = secret_of(checked_number(secret) ^ (1 << bit))
    assert wrong is None or wrong != secret


def test_wrong_words_of_a_written_key_are_noticed() -> None:
    number = checked_number(KEY.secret)
    assert sum(secret_of(number ^ (1 << bit)) is not None for bit in range(144)) == 0


SAID = Sentence("Rob", "bot", ("hi", "bot", "i", "am", "rob", "confirmed"))


def test_a_seal_is_of_its_words_its_counter_its_key_and_its_challenge() -> None:
    key = KEY.voice_key("rob")
    seals = {
        Seals(key, SAID).at(5),
        Seals(key, SAID).at(6),
        Seals(KEY.voice_key("bot"), SAID).at(5),
        Seals(key, Sentence("rob", "bot", (*SAID.words[:-1], "negative"))).at(5),
        Seals(key, Sentence("zoe", "bot", SAID.words)).at(5),
        Seals(key, Sentence("rob", "max", SAID.words)).at(5),
        Seals(key, SAID, challenge=0).at(5),
        Seals(key, SAID, challenge=1).at(5),
    }
    assert len(seals) == 8
    assert max(seals) < 2**24


def test_words_cannot_be_cut_otherwise() -> None:
    key = KEY.voice_key("rob")
    cuts = (("bot", ("ab", "c")), ("bot", ("a", "bc")), ("botab", ("c",)))
    assert len({Seals(key, Sentence("rob", to, words)).at(0) for to, words in cuts}) == 3


def test_capitals_of_names_do_not_count() -> None:
    key = KEY.voice_key("rob")
    assert Seals(key, SAID).at(1) == Seals(key, Sentence("ROB", "Bot", SAID.words)).at(1)


def test_a_seal_is_found_in_its_window_only() -> None:
    seals = Seals(KEY.voice_key("rob"), SAID)
    assert seals.find(seals.at(7), range(8)) == 7
    assert seals.find(seals.at(7), range(7)) is None
    assert seals.find(seals.at(7), range(-3, 8)) == 7
