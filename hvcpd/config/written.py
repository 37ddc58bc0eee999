"""Written quantities and addresses as they are read out: dates, times, units, ranges, decimals; signs without sound."""

from __future__ import annotations

import re
from collections.abc import Callable
from typing import TypeAlias

from hvcpd.config.names import plain_letters

_UNSAYABLE = re.compile(
    r"(?<![A-Za-z0-9.–—-])(?:[–—-]\.?|[.,])[0-9]+|(?<![0-9])[0-9]+(?:[.,][0-9]+|:0[0-9])|\b[2-9]0s\b|[^A-Za-z0-9'\s,.!?;:\"“”()\[\]…–—-]"
)
"""Numbers whose minus sign, point or comma would get lost, or whose zero (8:61:05); 90s, which may be seconds or years;
all but letters, digits, and the punctuation that a reader passes over."""
_FEET_OR_INCHES = re.compile(r"""[^"]*[0-9](?=")|(?:[^']|(?<=[A-Za-z])'|(?<=[0-9])'(?=\w))*[0-9](?='(?!\w))""")
"""A quotation mark after it ends no quotation, and would get lost."""

_UNITS = {
    "mm": "millimetre", "cm": "centimetre", "m": "metre", "km": "kilometre", "mg": "milligram", "g": "gram",
    "kg": "kilogram", "ml": "millilitre", "mL": "millilitre", "l": "litre", "L": "litre", "ms": "millisecond",
    "s": "second", "min": "minute", "h": "hour", "mV": "millivolt", "V": "volt", "mA": "milliamp",
    "mAh": "milliamp hour", "Ah": "amp hour", "W": "watt", "kW": "kilowatt", "Wh": "watt hour",
    "kWh": "kilowatt hour", "dB": "decibel", "kB": "kilobyte", "MB": "megabyte", "GB": "gigabyte", "lb": "pound",
    "oz": "ounce", "$": "dollar", "€": "euro", "cl": "centilitre", "cL": "centilitre", "dl": "decilitre",
    "dL": "decilitre", "hPa": "hectopascal", "kPa": "kilopascal", "yd": "yard", "sec": "second", "hr": "hour",
    "wk": "week", "yr": "year", "tsp": "teaspoon", "tbsp": "tablespoon", "pcs": "piece", "TB": "terabyte",
}  # fmt: skip
"""Symbols that stand behind a number (ISO 80000), and their names. Not among them: A, C and in, which are words, or
letters of rooms ("room 5 A")."""
_BOTH = {symbol: (name, f"{name}s") for symbol, name in _UNITS.items()} | {
    "ft": ("foot", "feet"),
    "Hz": ("hertz", "hertz"),
    "kHz": ("kilohertz", "kilohertz"),
    "MHz": ("megahertz", "megahertz"),
    "GHz": ("gigahertz", "gigahertz"),
    "%": ("percent", "percent"),
    "°": ("degree", "degrees"),
    "°C": ("degree celsius", "degrees celsius"),
    "°F": ("degree fahrenheit", "degrees fahrenheit"),
    "mph": ("mile per hour", "miles per hour"),
    "psi": ("p s i", "p s i"),
    "£": ("pound", "pounds"),
}
"""Of one, and of more."""
_ONE_CASE = frozenset("ms mA mV Ah Wh".split())
"""Symbols that mean something else in other letters, or are words."""


def _as_written(symbol: str) -> set[str]:
    """A symbol as people write it, too: 5 kgs, 5 Kg, 5 KG, 5 khz."""
    if len(symbol) == 1 or not symbol.isalpha() or symbol in _ONE_CASE:
        return {symbol}
    small = {symbol, f"{symbol}s"} if symbol.islower() else {symbol, symbol.lower()}
    return small | {each.upper() for each in small} | ({each.title() for each in small} if symbol.islower() else set())


_NAMES = {written: names for symbol, names in _BOTH.items() for written in sorted(_as_written(symbol))} | _BOTH

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
_DAY = "(?:Mon|Tues?|Wed|Thu(?:rs?)?|Fri|Sat|Sun)"
_WEEK = re.compile(rf"\b(?:{_DATES}) ?[–—-] ?(?:{_DATES})\b|\b{_DAY}(?:\.?(?:,? +(?:and|or|to|&) +|, *){_DAY}\b)+")
"""Mon-Fri, or "Mon, Wed and Fri", where no number is needed."""
_ON_DAY = re.compile(
    r"\b((?i:on|every|each|next|until|till|since)) (Mon|Tue|Wed|Thu|Fri|Sat|Sun)(?:(?<=Tue)s|(?<=Thu)rs?)?\b\.?"
)
"""On Mon, where no number is needed either; alone, Mon and Fri may be names."""
_LONG = "|".join(dict.fromkeys(_CALENDAR.values()))
_NTH = r"\d(?:st|nd|rd|th)\b"
_DAYS = re.compile(rf"(\d|{_NTH}|{_LONG}) ?[–—-] ?(?=(?:{_LONG}) \d|\d{{1,2}} (?:{_LONG})|\d{{0,3}}{_NTH})")
"""The dash between two dates, or two ordinals."""

_TIME = r"(?::\d\d)?(?: ?(?i:[ap]m|[ap]\.m\.))?"
_SYMBOL = r"[A-Za-z]+|[%°$€£][CF]?"
_UNITED = f" ?(?:{_SYMBOL})(?:/[A-Za-z]+)?"
_END = r"(\d{1,4}(?:\.\d{1,2})?)"
_RANGE = re.compile(
    rf"(?<![\w.,:/–—-])(?<![–—-] ){_END}({_TIME}|{_UNITED})(?:[–—-]| [–—-] ){_END}({_TIME})"
    r"(?![\d.,:/–—-]*\d|[–—-]| [–—-] ?\d)"
)
_CLOCK = re.compile(
    r"(?<![\d.,:])(\d|[01]\d|2[0-3]):([0-5]\d)(?![.,:]?\d)(?: ?h(?:rs)?\b)?(?= ?([ap]\.? ?m\b)?)", re.IGNORECASE
)
_DOTTED = re.compile(r"(?<![\d.,:])(\d{1,2})\.(?=[0-5]\d(?:[–—-]\d{1,2}\.[0-5]\d)? ?[ap]\.? ?m\b)", re.IGNORECASE)
"""A British time of day, 3.05 pm."""
_GLUED = re.compile(r"(?<![\w-])(?![2-9]0s\b)(\d+(?:\.\d+)?)(?!(?i:st|nd|rd|th)\b)(?=[A-Za-z]+\b)")
_DECADE = re.compile(
    r"(?:\b(?P<of>the|early|late|mid|my|our|your|his|her|their)[ -]|(?<![\w.,:-]))'?\b"
    r"(?P<century>1[5-9]|2[01])?(?P<tens>\d)0'?s\b",
    re.IGNORECASE,
)
_DECADES = "hundreds tens twenties thirties forties fifties sixties seventies eighties nineties".split()
_MANY = {"10": "tens", "100": "hundreds", "1000": "thousands"}
_SO_MANY = re.compile(r"(?<![\w.,-])(10|100|1000)s(?= of\b)")
_GROUPED = re.compile(r"(?<=\d) (?=000\b)")
"""Thousands apart, as 20 000; not 2 500 ml, which may be two bottles."""
_HOURS = re.compile(r"(?<![\w.,:–—-])(\d{1,2})(?: ?h ?(?=\d\d? ?m(?:in)?\b)|h)([0-5]?\d)(?: ?m(?:in)?)?\b")
"""1h30, 1h30min and 1 h 5 m, where the m are no metres."""
_MINUTES = re.compile(r"(?<![\d.,:–—-])(\d{1,3}) ?m(?:in)? ?([0-5]?\d) ?s\b")
"""5m 30s, where they are none either."""
_ADJECTIVE = re.compile(r"(?<![A-Za-z0-9.])([\d.]*\d)-([A-Za-z]+)(?=[ -][a-z])")
"""A 10-m rope."""
_UNIT = re.compile(rf"(?<![A-Za-z0-9.])([\d.]*\d)(?: |(?![A-Za-z]))({_SYMBOL})(?:/([A-Za-z]+))?(?![A-Za-z0-9/²³])")
_DECIMAL = re.compile(r"(?<![\d.,-])(\d+)\.(\d{1,2})(?!\d|[.,–—-]\d)")
"""Not 1.000, which is a thousand in much of Europe, and no part of a date, a version or a range that falls."""
_PRICE = re.compile(r"([$€£])(\d+)(?:\.(\d\d))?(?![.,]?\d| ?[–—-] ?[$€£]?\d|[A-Za-z])")
"""Neither $5-10, which as "five dollars ten" would be $5.10, nor $5m."""
_NUMBERED = re.compile(r"(?:#|\b(?i:no)\. ?)(?=\d)")

_PLURAL = re.compile(r"\b([A-Z][A-Z0-9]+)s\b")
"""PDFs, which in small letters would be spelt with the s."""

_ROMANS = {
    numeral: number
    for number, numeral in enumerate("II III IV V VI VII VIII IX X XI XII XIII XIV XV XVI".split(), start=2)
    if len(numeral) > 1
}
_ROMAN = re.compile(rf"\b([A-Za-z]+) ({'|'.join(sorted(_ROMANS, key=len)[::-1])})\b")
_NUMBERED_WITH = frozenset(
    "act chapter class grade level mark part phase room section stage step type volume war".split()
)
"""Words with which IV is four and no drip, and XI eleven and no name."""

_SUFFIXES = "com|org|net|edu|gov|info|io|uk|eu|de|txt|pdf|csv|json|yaml|wav|html"
_ADDRESS = re.compile(
    r"(?<![\w.-])(?:[\w.-]{1,64}@[\w-]{1,64}(?:\.[\w-]+)+"
    rf"|(?:www\.)?[\w-]{{1,64}}(?:\.[\w-]{{1,64}}){{0,4}}\.(?:{_SUFFIXES})(?:\.[a-z][a-z])?)\b",
    re.IGNORECASE,
)
"""Of a person, a site or a file: elsewhere a point between letters ends a sentence."""
_SAID_IN_ADDRESSES = {"@": " at ", ".": " dot ", "-": " dash ", "_": " underscore "}


def _week(found: re.Match[str]) -> str:
    days = re.sub(rf"\b({_DATES})\b\.?", lambda day: _CALENDAR[day[1]], found[0])
    return re.sub(" ?[–—-] ?", " to ", days)


def _address(found: re.Match[str]) -> str:
    return "".join(_SAID_IN_ADDRESSES.get(sign, sign) for sign in found[0])


def _roman(found: re.Match[str]) -> str:
    before, numeral = found.groups()
    is_number = numeral == "II" or len(numeral) > 2 or before.lower() in _NUMBERED_WITH
    return f"{before} {_ROMANS[numeral]}" if is_number else found[0]


def _decade(found: re.Match[str]) -> str:
    """Years; what may be seconds stays."""
    of, century, tens = found["of"] or "", found["century"] or "", int(found["tens"])
    is_marked = of != "" or "'" in found[0]
    if not (is_marked and century if tens == 0 else is_marked or century):
        return found[0]
    years = "two thousands" if (century, tens) == ("20", 0) else f"{century} {_DECADES[tens]}"
    return f"{of} {years}"


def _range(found: re.Match[str]) -> str:
    """The ends of a range that rises, or of times or quantities; what falls may be a score or a date, and what grows to
    four digits a number of a telephone."""
    if found[2] == "":
        is_range = float(found[1]) < float(found[3]) and (len(found[3]) < 4 or len(found[1]) >= 4)
    else:
        is_range = found[2].lstrip().partition("/")[0] in _NAMES or re.fullmatch(_TIME, found[2]) is not None
    return f"{found[1]}{found[2]} to {found[3]}{found[4]}" if is_range else found[0]


def _time(found: re.Match[str]) -> str:
    hour, minute = int(found[1]), int(found[2])
    if minute:
        return f"{hour} {'o ' if minute < 10 else ''}{minute}"
    return str(hour) if found[3] else f"{hour} o'clock" if 1 <= hour <= 12 else f"{hour} hundred"


def _quantity(found: re.Match[str]) -> str:
    if found[2] not in _NAMES or (found[3] or found[2]) not in _NAMES:
        return found[0]
    one, more = _NAMES[found[2]]
    per = f" per {_NAMES[found[3]][0]}" if found[3] else ""
    return f"{found[1]} {one if found[1] == '1' else more}{per}"


def _adjective(found: re.Match[str]) -> str:
    return f"{found[1]} {_NAMES[found[2]][0]}" if found[2] in _NAMES else found[0]


def _price(found: re.Match[str]) -> str:
    one, more = _NAMES[found[1]]
    rest = int(found[3] or 0)
    if int(found[2]) == 0 and rest:
        one, more = ("penny", "pence") if found[1] == "£" else ("cent", "cents")
        return f"{rest} {one if rest == 1 else more}"
    return f"{found[2]} {one if found[2] == '1' else more} {rest or ''}".rstrip()


_Replacement: TypeAlias = tuple[re.Pattern[str], str | Callable[[re.Match[str]], str]]

_WORDS: tuple[_Replacement, ...] = (
    (_PLURAL, r"\1's"),
    (_ROMAN, _roman),
    (_ADDRESS, _address),
    (_ON_DAY, lambda found: f"{found[1]} {_CALENDAR[found[2]]}"),
    (_WEEK, _week),
)
"""What is written in letters, and the words of it, in the order in which it is replaced."""
_NUMBERS: tuple[_Replacement, ...] = (
    (_NUMBERED, "number "),
    (_GROUPED, ""),
    (_PRICE, _price),
    (_DECADE, _decade),
    (_SO_MANY, lambda found: _MANY[found[1]]),
    (_DATE, lambda found: _CALENDAR[found[1] or found[2]]),
    (_DAYS, r"\1 to "),
    (_DOTTED, r"\1:"),
    (_MINUTES, r"\1 min \2 s"),
    (_HOURS, r"\1 h \2 min"),
    (_ADJECTIVE, _adjective),
    (_RANGE, _range),
    (_CLOCK, _time),
    (_GLUED, r"\1 "),
    (_UNIT, _quantity),
)
"""The same of what has a digit."""


def with_quantities(text: str) -> str:
    """The text with addresses, dates ("5 Dec"), prices, ranges ("3-5"), times of day ("9:05") and units ("20cm") in
    words.

    All other signs stay, the point and the minus sign of a number too.
    """
    for pattern, words in _WORDS:
        text = pattern.sub(words, text)
    for pattern, words in _NUMBERS if any(sign.isdigit() for sign in text) else ():
        text = pattern.sub(words, text)
    return text


def read_out(text: str) -> str:
    """The text as it is read out: `with_quantities`, and also with decimals and & in words."""
    return _DECIMAL.sub(
        lambda found: f"{found[1]} point {' '.join(found[2])}", with_quantities(text.replace("&", " and "))
    )


def unsayable(text: str) -> str | None:
    """A part of a sentence that would not be said as it is meant: a sign of another script, -5, 1,000, m²."""
    raised = next((sign for sign in text if sign.isnumeric() and not sign.isdecimal()), None)
    plain = plain_letters(text)
    found = _UNSAYABLE.search(read_out(plain))
    marked = _FEET_OR_INCHES.match(plain)
    return raised or (found and found[0]) or (marked and plain[marked.end()])
