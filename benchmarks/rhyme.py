"""The modified rhyme test: the listener picks one of six words that differ in one consonant.

The fifty sets of House, Williams, Hecker and Kryter ("Articulation-testing methods: consonantal differentiation with a
closed-response set", JASA 37, 1965), half of them with other first consonants, half with other last ones. PocketSphinx
with its large-vocabulary models is the listener; it knows which six words there are and nothing else. Each word is said
alone, with 0.5 s of a quiet room's noise (-60 dBFS) around it: over less PocketSphinx loses many words of all talkers.

    python -m benchmarks.rhyme [--snr 10] [--only oak,espeak-ng] [--wrong]
"""

from __future__ import annotations

import argparse
from collections import Counter
from typing import Any

from benchmarks.judging import in_noise, talkers
from hvcpd.evaluation.sphinx import heard, make_bare_decoder
from hvcpd.ports import Samples
from hvcpd.synthesis.lexicon import Lexicon

SETS = tuple(
    tuple(line.split())
    for line in """
went sent bent dent tent rent
hold cold told fold sold gold
pat pad pan path pack pass
lane lay late lake lace lame
kit bit fit hit wit sit
must bust gust rust dust just
teak team teal teach tear tease
din dill dim dig dip did
bed led fed red wed shed
pin sin tin fin din win
dug dung duck dud dub dun
sum sun sung sup sub sud
seep seen seethe seek seem seed
not tot got pot hot lot
vest test rest best west nest
pig pill pin pip pit pick
back bath bad bass bat ban
way may say pay day gay
pig big dig wig rig fig
pale pace page pane pay pave
cane case cape cake came cave
shop mop cop top hop pop
coil oil soil toil boil foil
tan tang tap tack tam tab
fit fib fizz fill fig fin
same name game tame came fame
peel reel feel eel keel heel
hark dark mark bark park lark
heave hear heat heal heap heath
cup cut cud cuff cuss cub
thaw law raw paw jaw saw
pen hen men then den ten
puff puck pub pus pup pun
bean beach beat beak bead beam
heat neat feat seat meat beat
dip sip hip tip lip rip
kill kin kit kick king kid
hang sang bang rang fang gang
took cook look hook shook book
mass math map mat man mad
ray raze rate rave rake race
save same sale sane sake safe
fill kill will hill till bill
sill sick sip sing sit sin
bale gale sale tale pale male
wick sick kick lick pick tick
peace peas peak peach peat peal
bun bus but bug buck buff
sag sat sass sack sad sap
fun sun bun gun run nun
""".strip().splitlines()
)

ROOM_DBFS = -60.0
"""Level of the quiet condition's noise, about 40 dB below the words."""

SPOKEN = {"tear": "T IH1 R", "bass": "B AE1 S"}
"""How the test means the words with two pronunciations; programs outside are told by another spelling."""
RESPELT = {"tear": "teer", "bass": "bas"}


def listener() -> Any:
    """A decoder with a grammar for each of the fifty sets, called by its number."""
    decoder = make_bare_decoder()
    for word, phones in (("cud", "K AH D"), ("sud", "S AH D")):  # the two that its dictionary lacks
        decoder.add_word(word, phones, True)
    for number, words in enumerate(SETS):
        jsgf = f"#JSGF V1.0; grammar set{number}; public <word> = {' | '.join(words)};"
        decoder.add_jsgf_string(f"set{number}", jsgf)
    return decoder


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--snr", type=float, default=10.0, help="of the second condition, dB (the first is quiet)")
    parser.add_argument("--only", default="", help="names of talkers, separated by commas")
    parser.add_argument("--wrong", action="store_true", help="print which words were taken for which")
    options = parser.parse_args()
    decoder = listener()
    lexicon = Lexicon.load()
    ours = Lexicon({**lexicon.entries, **{word: (tuple(said.split()),) for word, said in SPOKEN.items()}})
    conditions: dict[str, float | None] = {"quiet": None, f"{options.snr:g} dB": options.snr}
    floor = 10.0 ** (ROOM_DBFS / 20.0)
    n_words = sum(map(len, SETS))
    print(f"errors of {n_words} words")
    print(f"{'talker':12}" + "".join(f"{name:>8}" for name in conditions))
    for name, talker in talkers(ours).items():
        if options.only and name not in options.only.split(","):
            continue
        wrong: dict[str, Counter[tuple[str, str]]] = {condition: Counter() for condition in conditions}
        for number, words in enumerate(SETS):
            decoder.activate_search(f"set{number}")
            for place, word in enumerate(words):
                sound: Samples = talker.speak([[word if talker.own else RESPELT.get(word, word)]])
                for condition, snr_db in conditions.items():
                    got = heard(decoder, in_noise(sound, snr_db, 10 * number + place, floor)).partition("(")[0]
                    if got != word:
                        wrong[condition][word, got or "?"] += 1
        print(f"{name:12}" + "".join(f"{100.0 * sum(w.values()) / n_words:7.1f}%" for w in wrong.values()), flush=True)
        if options.wrong:
            for condition, pairs in wrong.items():
                print(f"    {condition}: " + ", ".join(f"{a} for {b}" for b, a in sorted(pairs)))


if __name__ == "__main__":
    main()
