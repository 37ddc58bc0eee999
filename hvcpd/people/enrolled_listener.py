"""Hears enrolled people: the robots' own recogniser once more, with their words, and asking less of each frame.

What robots say is known to the sample; what people say is not, from one time to the next. So the filler, to which every
frame is compared, is dearer here, more paths are followed, and how sure a sentence is follows from how it fared beside
the best of all frames.
"""

from __future__ import annotations

from collections.abc import Iterable
from copy import deepcopy
from dataclasses import replace

from hvcpd.language.graph import WordGraph
from hvcpd.people.ears import Piece
from hvcpd.people.enrolled import Person, spoken_takes
from hvcpd.recognition.events import Recognised
from hvcpd.recognition.pruning import Beam
from hvcpd.recognition.recogniser import Recogniser, RecogniserSettings
from hvcpd.recognition.spotter import SpotterSettings

FILLER_COST = 2.5
"""Twice the robots': with three enrolled synthetic voices 86 of 87 fluent sentences were found from one take of each
word, with the robots' 1.2 and 100 pairs 76."""
MAX_PAIRS = 300
SETTINGS = RecogniserSettings(
    min_confidence=0.0,
    min_margin=-1e9,
    max_lead_in=99.0,
    max_pause=1e6,
    min_gain=-1e9,
    spotter=SpotterSettings(filler_cost=FILLER_COST, beam=Beam(max_pairs=MAX_PAIRS)),
)
"""Every sentence is told, however badly it fits; how sure it is is judged here."""


class EnrolledListener:
    """Knows the enrolled people, and their sentences."""

    def __init__(self, graph: WordGraph, people: Iterable[Person]) -> None:
        """Raises ValueError if nobody has a word of `graph`."""
        takes = {person.voice: spoken_takes(person, graph.words) for person in people}
        voices = {voice: words for voice, words in takes.items() if words}
        self._fresh = Recogniser(graph, voices, SETTINGS, partial=frozenset(voices))
        """Has heard nothing; what listens is a copy, so that no piece of sound changes how the next is heard."""

    def sentence(self, piece: Piece) -> Recognised | None:
        """The sentence that covers most of the speech of a piece, at the samples of its own clock; None if none does.

        Its confidence is that of a voice known to the sample, and says little.
        """
        ears = deepcopy(self._fresh)
        speech = (piece.lead, piece.lead + piece.end - piece.start)
        events = ears.push(piece.sound) + ears.flush()
        found = [e for e in events if isinstance(e, Recognised)]
        shared = [min(e.end_sample, speech[1]) - max(e.start_sample, speech[0]) for e in found]
        most = max(shared, default=0)  # words may also be found in the noise after it
        return _moved(found[shared.index(most)], piece.origin) if most > 0 else None


def _moved(sentence: Recognised, by: int) -> Recognised:
    spans = tuple(replace(s, start_sample=s.start_sample + by, end_sample=s.end_sample + by) for s in sentence.spans)
    return replace(sentence, start_sample=sentence.start_sample + by, end_sample=sentence.end_sample + by, spans=spans)
