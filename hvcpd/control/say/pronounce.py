"""`hvcpctl pronounce`: how words are pronounced, and why."""

from __future__ import annotations

import argparse
import csv
import io
import sys
from collections.abc import Sequence
from itertools import chain

from hvcpd.assembly.sound import Sound, make_sound, user_cache_folder
from hvcpd.assembly.voice_assignment import assign_voices
from hvcpd.config.files import STANDARD_OUTPUT, write_whole
from hvcpd.config.settings_file import load_settings
from hvcpd.control.output import show
from hvcpd.control.say.sounding import require_few_words, sayable_phrases
from hvcpd.errors import AudioFileError, PhraseError, writing
from hvcpd.hardware.soundfile import write_wav
from hvcpd.reporting.text import columns
from hvcpd.synthesis.articulation import controls_for
from hvcpd.synthesis.explain import PAPER_TABLE, PLACE_WORDS, Known, explain, paper_row, respelled
from hvcpd.synthesis.frames import frame_table
from hvcpd.synthesis.homographs import Place
from hvcpd.synthesis.lexicon import Lexicon


def run(options: argparse.Namespace) -> None:
    """Explain words or phrases, or print the paper's table."""
    outputs = [file for file in (options.output, options.track) if file is not None]
    writes = bool(outputs)
    if bool(options.words) == options.paper_table or (options.paper_table and writes):
        raise PhraseError("give words, as in `hvcpctl pronounce Zorg 'wind the clock'`, or --paper-table alone")
    if options.voice_of is not None and not writes:
        raise PhraseError("--as changes the sound alone; leave it out, or write the sound with -o or --track")
    settings = load_settings(options.config, name_needed=False)
    sound = make_sound(options.lexicon or settings.lexicon, user_cache_folder(), settings.accent)
    lexicon, builtin = sound.lexicon, Lexicon.load(None, settings.accent)
    if options.paper_table:
        _print_table(lexicon, options.json)
        return
    if options.track is not None and settings.synthesizer == "natural":
        raise PhraseError("--track: natural voices have no such frames; it needs `synthesizer: formant`")
    phrases = [tuple(chain.from_iterable(sayable_phrases(text))) for text in options.words]
    require_few_words(phrases)
    if options.track is not None and sum(map(len, phrases)) != 1:
        raise PhraseError("--track takes one word")
    if outputs.count(STANDARD_OUTPUT) > 1:
        raise PhraseError("-o and --track cannot both go to standard output; name a file for one of them")
    for words in phrases if STANDARD_OUTPUT not in outputs else ():
        for number, word in enumerate(words):
            _print_word(word, explain(words, number, lexicon, builtin), options.json)
    if writes:
        _render(options, phrases, assign_voices(sound, settings, tuple))


def _print_word(word: str, known: Sequence[Known], as_json: bool) -> None:
    rows = [
        {
            "phones": " ".join(k.phones),
            "respelled": respelled(k.phones),
            "source": k.source,
            "place": k.place.value if k.place else None,
            "used": k.used,
            "why": k.why,
        }
        for k in known
    ]
    width = max(len(str(row["phones"])) for row in rows)
    lines = [
        f"  {'*' if row['used'] else ' '} {row['phones']:{width}}  {row['respelled']}  [{row['source']}] {row['why']}"
        for row in rows
    ]
    show(as_json, {"word": word, "pronunciations": rows}, word, *lines)


def _print_table(lexicon: Lexicon, as_json: bool) -> None:
    """The paper's table I, with our voices' pronunciations of words that the paper's voice said alike."""
    rows = [paper_row(word, lexicon) for word in PAPER_TABLE]
    if as_json:
        for row in rows:
            show(True, row)
        return
    head = ("word", "possible", "paper used", "alone", *(place.value for place in Place))
    cells = [
        (r["word"], ", ".join(r["possible"]), r["paper"], r["alone"], *(str(r.get(p.value, "")) for p in Place))
        for r in rows
    ]
    sys.stdout.writelines(f"{line}\n" for line in (*columns([head, *cells]), ""))
    for place, where in PLACE_WORDS.items():
        sys.stdout.write(f"{place.value}: said where the word is {where}.\n")
    sys.stdout.write("A line of your own lexicon file (`lexicon:` in the settings) overrides all of these.\n")


def _render(options: argparse.Namespace, phrases: Sequence[Sequence[str]], sound: Sound) -> None:
    """Write the words as sound, and the synthesizer's frames, if requested."""
    voice = sound.voice_of(options.voice_of or "Rob")
    if options.output is not None:
        write_wav(options.output, sound.speaker_in(voice).render(phrases))
    if options.track is None:
        return
    ((word,),) = phrases
    columns, table = frame_table(controls_for(sound.lexicon.pronounce(word), voice, final=True))
    text = io.StringIO(newline="")
    writer = csv.writer(text)
    writer.writerow(columns)
    writer.writerows([f"{value:.4g}" for value in row] for row in table)
    with writing(options.track, AudioFileError):
        write_whole(options.track, text.getvalue().encode())
