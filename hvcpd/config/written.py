"""Written quantities as they are read out: dates, times, units, ranges and decimals; and signs that have no sound."""

from __future__ import annotations

import re

from hvcpd.config.names import plain_letters

_UNSAYABLE = re.compile(
    r"(?<![A-Za-z0-9.–—-])(?:[–—-]\.?|\.)[0-9]+|(?<![0-9])[0-9]+(?:[.,][0-9]+|:0[0-9])|[^A-Za-z0-9'\s,.!?;:\"“”()\[\]…–—-]"
)
"""Numbers whose minus sign, point or comma would get lost, or whose zero (8:61:05); all but letters, digits, and the
punctuation that a reader passes over."""

_UNITS = {
    "mm": "millimetre", "cm": "centimetre", "m": "metre", "km": "kilometre", "mg": "milligram", "g": "gram",
    "kg": "kilogram", "ml": "millilitre", "mL": "millilitre", "l": "litre", "ms": "millisecond",
    "s": "second", "min": "minute", "h": "hour", "mV": "millivolt", "V": "volt", "mA": "milliamp",
    "mAh": "milliamp hour", "Ah": "amp hour", "W": "watt", "kW": "kilowatt", "Wh": "watt hour",
    "kWh": "kilowatt hour", "dB": "decibel", "kB": "kilobyte", "MB": "megabyte", "GB": "gigabyte", "lb": "pound",
    "oz": "ounce", "$": "dollar", "€": "euro",
}  # fmt: skip
"""Symbols that stand behind a number (ISO 80000), and their names. Not among them: A, C and in, which are words, or
letters of rooms ("room 5 A")."""
_NAMES = {symbol: (name, f"{name}s") for symbol, name in _UNITS.items()} | {
    "ft": ("foot", "feet"),
    "Hz": ("hertz", "hertz"),
    "kHz": ("kilohertz", "kilohertz"),
    "MHz": ("megahertz", "megahertz"),
    "GHz": ("gigahertz", "gigahertz"),
    "%": ("percent", "percent"),
    "°": ("degree", "degrees"),
    "°C": ("degree celsius", "degrees celsius"),
    "°F": ("degree fahrenheit", "degrees fahrenheit"),
    "m/s": ("metre per second", "metres per second"),
    "km/h": ("kilometre per hour", "kilometres per hour"),
    "£": ("pound", "pounds"),
}
"""Of one, and of more."""

_CALENDAR = {
    name[:letters]: name
    for letters, names in (
        (3, "January February March April May June July August September October November December"),
        (3, "Monday Tuesday Wednesday Thursday Friday Saturday Sunday"),
        (4, "September Tuesday Thursday"),
        (5, "Thursday"),
    )
    for name in names.split()
}
_DATES = "|".join(sorted(_CALENDAR, key=len)[::-1])
_DATE = re.compile(rf"\b({_DATES})\b\.?(?=,? ?\d)|(?:(?<=\d )|(?<=\d[snrt][tdh] ))({_DATES})\b\.?")
"""A month or a day of the week beside a number; "sun" and "Jan" alone are words."""

_END = r"(\d{1,2}(?:\.\d{1,2})?)((?::\d\d)?(?: ?[ap]m)?)"
_RANGE = re.compile(rf"(?<![\w.,:/–—-]){_END}[–—-]{_END}(?![\d.,:/–—-]*\d|[–—-])", re.IGNORECASE)
_CLOCK = re.compile(r"(?<![\d.,:])(\d|[01]\d|2[0-3]):([0-5]\d)(?![.,:]?\d)(?= ?([ap]\.? ?m\b)?)", re.IGNORECASE)
_DOTTED = re.compile(r"(?<![\d.,:])(\d{1,2})\.(?=[0-5]\d(?:[–—-]\d{1,2}\.[0-5]\d)? ?[ap]\.? ?m\b)", re.IGNORECASE)
"""A British time of day, 3.05 pm."""
_GLUED = re.compile(r"(?<![\w-])(\d+(?:\.\d+)?)(?!(?:st|nd|rd|th)\b|(?<=0)s\b)(?=[A-Za-z]+\b)")
"""Not the 90s."""
_SYMBOLS = "|".join((" " if each[0].isalpha() else " ?") + re.escape(each) for each in sorted(_NAMES, key=len)[::-1])
_UNIT = re.compile(rf"(?<![A-Za-z0-9.])([\d.]*\d)({_SYMBOLS})(?![A-Za-z0-9/²³])")
_DECIMAL = re.compile(r"(?<![\d.,-])(\d+)\.(\d{1,2})(?!\d|[.,–—-]\d)")
"""Not 1.000, which is a thousand in much of Europe, and no part of a date, a version or a range that falls."""
_PRICE = re.compile(r"([$€£])(\d+)(?:\.(\d\d))?(?![.,]?\d|[–—-][$€£]?\d|[A-Za-z])")
"""Neither $5-10, which as "five dollars ten" would be $5.10, nor $5m."""
_NUMBERED = re.compile(r"(?:#|\b[Nn]o\. ?)(?=\d)")


def with_quantities(text: str) -> str:
    """The text with dates ("5 Dec"), ranges ("3-5"), times of day ("9:05") and units ("20cm") in words.

    All other signs stay, the point and the minus sign of a number too.
    """
    if not any(sign.isdigit() for sign in text):
        return text
    text = _DATE.sub(lambda found: _CALENDAR[found[1] or found[2]], text)
    text = _CLOCK.sub(_time, _RANGE.sub(_range, _DOTTED.sub(r"\1:", text)))
    return _UNIT.sub(_quantity, _GLUED.sub(r"\1 ", text))


def read_out(text: str) -> str:
    """The text as it is read out: `with_quantities`, and also with decimals, prices, # and & in words."""
    text = _PRICE.sub(_price, _NUMBERED.sub("number ", text.replace("&", " and ")))
    return _DECIMAL.sub(lambda found: f"{found[1]} point {' '.join(found[2])}", with_quantities(text))


def unsayable(text: str) -> str | None:
    """A part of a sentence that would not be said as it is meant: a sign of another script, -5, 1,000, m²."""
    raised = next((sign for sign in text if sign.isnumeric() and not sign.isdecimal()), None)
    found = _UNSAYABLE.search(read_out(plain_letters(text)))
    return raised or (found and found[0])


def _range(found: re.Match[str]) -> str:
    """The ends of a range that rises, or of times; what falls may be a score or a date."""
    rises = float(found[1]) < float(found[3]) or found[2] != ""
    return f"{found[1]}{found[2]} to {found[3]}{found[4]}" if rises else found[0]


def _time(found: re.Match[str]) -> str:
    hour, minute = int(found[1]), int(found[2])
    if minute:
        return f"{hour} {'o ' if minute < 10 else ''}{minute}"
    return str(hour) if found[3] else f"{hour} o'clock" if 1 <= hour <= 12 else f"{hour} hundred"


def _quantity(found: re.Match[str]) -> str:
    one, more = _NAMES[found[2].lstrip()]
    return f"{found[1]} {one if found[1] == '1' else more}"


def _price(found: re.Match[str]) -> str:
    one, more = _NAMES[found[1]]
    return f"{found[2]} {one if found[2] == '1' else more} {int(found[3] or 0) or ''}".rstrip()
