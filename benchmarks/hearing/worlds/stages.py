"""Processor time of the stages of the ears, measured from outside."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from functools import wraps
from typing import Any

from benchmarks.ablation.switches import instead, owner_of

HEARING = "hvcpd.recognition"
STAGES = {
    "front end": ("stream:energies_of",),
    "noise": ("noise:NoiseTracker.push", "noise:NoiseTracker.follow_step"),
    "templates": ("decoder_session:DecoderSession.feed", "decoder_session:DecoderSession.wake"),
    "beginnings": ("channel.recogniser:ChannelRecogniser.onset",),
    "keyword": ("keyword.stage:KeywordStage._detect",),
    "channel search": ("channel.recogniser:ChannelRecogniser.search",),
}
"""None of them calls another one."""
PEOPLE = "hvcpd.people.second_pass:SecondPassRecogniser.search"


@contextmanager
def timed() -> Iterator[dict[str, float]]:
    """Yield the processor time, s, that each stage takes in this thread while the `with` block lasts."""
    stages = {name: [f"{HEARING}.{target}" for target in targets] for name, targets in STAGES.items()}
    stages["people"] = [PEOPLE]
    spent = dict.fromkeys(stages, 0.0)
    with ExitStack() as stack:
        for name, targets in stages.items():
            for target in targets:
                owner, attribute = owner_of(target)
                stack.enter_context(instead(target, _counted(vars(owner)[attribute], name, spent))())
        yield spent


def _counted(function: Callable[..., Any], name: str, spent: dict[str, float]) -> Callable[..., Any]:
    @wraps(function)
    def called(*arguments: Any, **named: Any) -> Any:
        began = time.thread_time()
        try:
            return function(*arguments, **named)
        finally:
            spent[name] += time.thread_time() - began

    return called
