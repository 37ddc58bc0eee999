"""The range: the distance at which 95 of 100 sentences are understood."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from itertools import pairwise

from benchmarks.hearing.table import Result

SHARE = 0.95


def range_m(points: Iterable[tuple[float, float]]) -> tuple[str, float]:
    """The distance at which the share of right sentences, given at distances (m), first falls below SHARE: linear in
    the logarithm of the distance between two points; with "<" or ">" when it falls before the first or not before the
    last."""
    ordered = sorted(points)
    if ordered[0][1] < SHARE:
        return "<", ordered[0][0]
    for (near_m, before), (far_m, after) in pairwise(ordered):
        if after < SHARE:
            part = (before - SHARE) / (before - after)
            return "", math.exp(math.log(near_m) + part * math.log(far_m / near_m))
    return ">", ordered[-1][0]


def ranges(results: Sequence[Result]) -> list[str]:
    """A line for free field and each room: our range, PocketSphinx's, and how many times as far."""
    lines = []
    for name in dict.fromkeys(r.name for r in results if r.group in ("range", "rooms")):
        here = [r for r in results if r.name == name]
        sign, far_m = range_m((r.value, r.ours.share) for r in here)
        text = f"{name:12} range {sign}{far_m:.1f} m"
        theirs = [(r.value, r.peer.share) for r in here if r.peer is not None]
        if theirs:
            peer_sign, peer_m = range_m(theirs)
            bound = ">" if sign == ">" or peer_sign == "<" else ""
            text += f", PocketSphinx {peer_sign}{peer_m:.1f} m: {bound}{far_m / peer_m:.1f} times as far"
            if sign == "<":
                text += " (both from bounds)" if peer_sign else " (at most)"
        lines.append(text)
    return lines
