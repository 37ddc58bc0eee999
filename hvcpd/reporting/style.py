"""The pages' style sheets: files of this package, and the robots' colours."""

from __future__ import annotations

from importlib import resources

from markupsafe import Markup

from hvcpd.reporting.palette import ROBOT_DARK, ROBOT_LIGHT


def own_file(name: str) -> str:
    """The text of a file of this package."""
    return resources.files("hvcpd.reporting").joinpath(name).read_text(encoding="utf-8")


def style_sheet(*names: str) -> Markup:
    """These files one after the other, and the robots' colours: a class r0 to r11 sets --robot."""

    def block(colours: list[str]) -> str:
        return "".join(f".r{k}{{--robot:{colour}}}" for k, colour in enumerate(colours))

    light, dark = block(ROBOT_LIGHT), block(ROBOT_DARK)
    robots = f"{light}@media screen and (prefers-color-scheme:dark){{{dark}}}"
    return Markup("".join(map(own_file, names)) + robots)
