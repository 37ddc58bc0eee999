"""First consonants in sentences: the listener picks the word that was said from a few that begin otherwise.

The rhyme test has words alone; here each is said inside four sentences, as robots say theirs, in quiet and in white
noise. PocketSphinx with its large-vocabulary models is the listener; it knows the sentence and the words that could
stand in it, most of which only another first consonant tells apart.

    python -m benchmarks.onsets [--only oak,oak-n,espeak-ng] [--snr 15] [--sets T,H] [--wrong]
"""

from __future__ import annotations

import argparse
from collections import Counter
from typing import Any

from benchmarks.judging import in_noise, talkers
from hvcpd.evaluation.sphinx import heard, make_bare_decoder
from hvcpd.synthesis.lexicon import Lexicon

SENTENCES = ("i will complete {} three", "hi all i am here {}", "please do {} now", "say {} again")
ROOM_RMS = 1e-3
"""The noise of the quiet condition: 40 dB below the words."""

SETS = {
    "T": """
task: asked fast test past mask cask bask ask flask cast tax desk
two: who do coo few you chew
take: cake bake fake ache shake make
tool: pool cool fool stool
tap: cap gap map lap chap nap
ten: pen hen den fen ken men
tea: key fee pea he knee
top: shop cop chop pop hop
time: dime climb chime lime
tall: call fall paul hall ball
team: beam seem cream dream theme keep peak
table: cable fable able label
tent: went sent bent dent rent
tin: pin kin fin din sin in chin
tail: pale fail hail sale ale
turn: burn learn fern earn churn
town: down gown noun crown
tie: pie high die guy buy
talk: chalk cork fork hawk
test: best rest west nest chest guest
tear: pier fear hear near deer cheer
tip: hip dip chip sip
tease: cheese keys fees
tore: chore four shore core
""",
    "P": """
pan: tan can fan ban van man
pot: tot cot hot dot lot
pin: tin kin fin bin thin
pail: tail fail bale hail
pay: bay hay say
pole: toll coal hole foal bowl
peel: teal keel feel heel
post: toast coast host most boast
""",
    "K": """
cat: pat fat hat bat that
key: pea tea fee he she
cold: told fold hold bold sold
cool: pool tool fool
kill: till pill fill hill bill chill
cart: part heart chart
couch: pouch touch vouch ouch
call: tall paul fall hall ball
""",
    "H": """
hall: fall call tall paul ball all
hill: fill kill till pill ill
heat: feet peat seat eat
hope: cope pope folk soap
home: foam comb tome
hat: fat cat pat at
who: two few coo
hen: fen pen ten ken
""",
    "F": """
fall: tall call hall paul
fill: till kill hill pill
five: hive dive
fan: tan pan can van
fine: pine kind vine
feet: heat seat
face: case pace ace chase
""",
    "CH": """
chime: time dime climb lime
chair: tear care fair share
chip: tip ship zip
chest: test best guest rest
chalk: talk hawk cork
choose: shoes two coos
cheese: keys tease peas she
chain: cane plane pain
""",
    "with L, R or W": """
plant: slant grant brand planned lent
please: fleas leas keys
clock: flock block lock
clean: lean queen keen
try: dry cry fry pry rye
train: drain crane brain rain grain
twin: win queen quin thin
play: clay lay flay bray
""",
}
"""For each first consonant, the words that are said, each with those that it could be taken for."""


def words_of(lines: str) -> dict[str, list[str]]:
    """Each word of a set, and all that may stand in its place."""
    pairs = (line.split(": ") for line in lines.strip().splitlines())
    return {word: [word, *others.split()] for word, others in pairs}


def listener() -> Any:
    """A decoder with a grammar for each word in each sentence, called by both."""
    decoder = make_bare_decoder()
    for lines in SETS.values():
        for word, all_words in words_of(lines).items():
            for number, sentence in enumerate(SENTENCES):
                said = sentence.format(f"({' | '.join(all_words)})")
                jsgf = f"#JSGF V1.0; grammar {word}{number}; public <sentence> = {said};"
                decoder.add_jsgf_string(f"{word}{number}", jsgf)
    return decoder


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--snr", type=float, default=15.0, help="of the second condition, dB (the first is quiet)")
    parser.add_argument("--only", default="", help="names of talkers, separated by commas")
    parser.add_argument(
        "--sets", default="", help=f"consonants, separated by commas (default: all of {', '.join(SETS)})"
    )
    parser.add_argument("--wrong", action="store_true", help="print which words were taken for which")
    options = parser.parse_args()
    decoder = listener()
    conditions: dict[str, float | None] = {"quiet": None, f"{options.snr:g} dB": options.snr}
    names = [name for name in SETS if not options.sets or name in options.sets.split(",")]
    print("words wrong, of those said: " + ", ".join(conditions))
    print(f"{'talker':12}" + "".join(f"{name:>17}" for name in names))
    for name, talker in talkers(Lexicon.load()).items():
        if options.only and name not in options.only.split(","):
            continue
        wrong: Counter[tuple[str, str, str, str]] = Counter()
        counts = []
        for each in names:
            words = words_of(SETS[each])
            for place, word in enumerate(words):
                for number, sentence in enumerate(SENTENCES):
                    sound = talker.speak([sentence.format(word).split()])
                    decoder.activate_search(f"{word}{number}")
                    for condition, snr_db in conditions.items():
                        got = heard(decoder, in_noise(sound, snr_db, 100 * place + number, ROOM_RMS)).split()
                        if word not in got:
                            at = sentence.split().index("{}")
                            wrong[each, condition, word, got[at] if at < len(got) else "?"] += 1
            sums = [sum(n for key, n in wrong.items() if key[:2] == (each, c)) for c in conditions]
            counts.append(" ".join(map(str, sums)) + f" of {len(words) * len(SENTENCES)}")
        print(f"{name:12}" + "".join(f"{count:>17}" for count in counts), flush=True)
        if options.wrong:
            print("    " + ", ".join(f"{b} for {a} {n} ({c})" for (_, c, a, b), n in wrong.most_common()))


if __name__ == "__main__":
    main()
