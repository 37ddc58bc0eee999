"""Endpointing for the channel search: segments of sound in which somebody seems to speak, and when they end."""

from __future__ import annotations

from dataclasses import dataclass, field

from hvcpd.ports import SAMPLE_RATE_HZ
from hvcpd.recognition.channel.onsets import Onset
from hvcpd.recognition.channel.path import Path
from hvcpd.recognition.channel.recogniser import ChannelSegment, SearchResult
from hvcpd.recognition.events import Garbled, Recognised

ONSET_LAG = SAMPLE_RATE_HZ // 4
"""Longest time (samples) from the beginning of speech to its first sign."""
FAINT_ONSET_LAG = SAMPLE_RATE_HZ
"""The same (1 s) for a voice that hardly rises over the noise, whose first word may not have risen at all."""
QUIET = SAMPLE_RATE_HZ // 2
"""Samples without a sign of speech that end a segment: more than a pause at a comma in a room without echoes."""
MIN_LENGTH = SAMPLE_RATE_HZ // 4
"""Samples (0.25 s) below which signs of speech are not a sentence: "stop" takes 0.4 s."""
USUAL_LENGTH = 7 * SAMPLE_RATE_HZ
"""Samples (7 s) after a greeting by which nearly all sentences have ended: if signs of speech go on, clatter hides
the end."""
MAX_LENGTH = 10 * SAMPLE_RATE_HZ
"""Samples (10 s) after which a segment is cut: no sentence takes longer. A sentence in progress at the cut is searched
again, together with the sound after it."""
CLATTER = 8 * SAMPLE_RATE_HZ
"""Samples (8 s) of signs of speech without QUIET among them, from which on they count as clatter and no longer show
onsets and ends: a slow sentence takes 8 s or less, and is followed by quiet."""
SIGN_SHARE = 0.6
"""Share of the time with signs of speech from which on they show where a speaker ends: chosen between a voice that
stands out, and so has them nearly all the time, and one that noise hides. No other share was tried."""
SIGN_LAG = 3 * SAMPLE_RATE_HZ // 5
"""Longest time (0.6 s) between the onset of a greeting and its first sign of speech."""
CUT_AFTER = 5 * SAMPLE_RATE_HZ // 2
"""Samples (2.5 s) after which a segment is cut whose end no sign of speech shows: otherwise the speaker would wait for
an answer until the clatter ends."""
CUT_AGAIN_AFTER = 5 * SAMPLE_RATE_HZ // 4
"""The same (1.25 s) while a sentence was in progress at the last cut."""


@dataclass(eq=False)
class OpenSegment:
    """A segment from its first sign of speech to the last, and the first pass's events held for it; positions in
    samples."""

    begin: int
    end: int
    cut_at: int
    """The sample at which it is cut."""
    end_hidden: bool = False
    """Whether signs of speech do not show its end, since noise hides it or other sound goes on after it."""
    continues: OpenSegment | None = None
    """The segment before the cut at which it begins, if a sentence was or may be in progress there."""
    first_sign: int | None = None
    sign_samples: int = 0
    """Number of samples with signs of speech, the first of which was `first_sign`."""
    greeted: bool = False
    """Whether a greeting was found in it."""
    held_events: list[Recognised | Garbled] = field(default_factory=list)
    closed_at: int = 0
    whole_from: int = 0
    """A sentence that begins before this sample may lack its beginning."""
    earlier: tuple[Path, ...] = ()
    """Paths in progress at the end of the segment with which it was joined."""
    job: ChannelSegment | None = None
    result: SearchResult | None = None

    @property
    def shows_end(self) -> bool:
        """Whether there were signs of speech for most of the time, so that their end is the speaker's."""
        if self.first_sign is None:
            return False
        return self.sign_samples >= max(SIGN_SHARE * (self.end - self.first_sign), SAMPLE_RATE_HZ // 2)

    @property
    def in_progress(self) -> tuple[Path, ...]:
        """The paths in progress at the segment's end, the best first."""
        return self.result.in_progress if self.result is not None else ()

    @property
    def first_start(self) -> int:
        """The sample at which the first of the paths in progress began. Raises ValueError if there is none."""
        return min(path.starts[0] for path in self.in_progress)

    def note_sign(self, at: int, now: int, clatters: bool) -> None:
        """Note signs of speech from sample `at` up to `now`; `clatters`: they count as clatter (CLATTER)."""
        self.end = now
        self.sign_samples += now - at
        if self.first_sign is None:
            self.first_sign = at
        if clatters and not self.end_hidden and not self.greeted:
            self.end_hidden, self.cut_at = True, min(self.cut_at, now + CUT_AGAIN_AFTER)

    def note_onset(self, found: Onset, at: int, begin: int, since: int | None) -> None:
        """Note an onset at sample `at`, and not before `begin`; `since`: there have been signs of speech since this
        sample; None: there are none."""
        self.begin = min(self.begin, begin)
        self.greeted = self.greeted or found.greeting
        if self.continues is not None:  # a sentence in progress is searched soon, whatever sounds like another greeting
            self.cut_at = min(self.cut_at, at + CUT_AFTER)
        elif since is not None and abs(since - at) <= SIGN_LAG:
            self.end_hidden, self.cut_at = False, at + USUAL_LENGTH
        else:
            self.end_hidden, self.cut_at = True, at + CUT_AFTER

    def is_over(self, now: int) -> bool:
        """Whether the speaker has surely ended."""
        return (not self.end_hidden or self.shows_end) and now - self.end >= QUIET
