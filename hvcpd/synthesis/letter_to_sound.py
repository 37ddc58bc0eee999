"""Letter-to-sound rules: a pronunciation for any word that no lexicon has, such as a robot's name.

Ordered rules in context, the form of Elovitz et al. ("Letter-to-sound rules for automatic translation of English text
to phonetics", IEEE ASSP-24, 1976), written anew and short. At each place the first rule that fits is taken. Stress goes
to the first vowel, since the words here are names and nouns.
"""

from __future__ import annotations

import re

from hvcpd.synthesis.phones import is_vowel

LETTER_NAMES: dict[str, str] = {
    "a": "EY1", "b": "B IY1", "c": "S IY1", "d": "D IY1", "e": "IY1", "f": "EH1 F", "g": "JH IY1", "h": "EY1 CH",
    "i": "AY1", "j": "JH EY1", "k": "K EY1", "l": "EH1 L", "m": "EH1 M", "n": "EH1 N", "o": "OW1", "p": "P IY1",
    "q": "K Y UW1", "r": "AA1 R", "s": "EH1 S", "t": "T IY1", "u": "Y UW1", "v": "V IY1",
    "w": "D AH1 B AH0 L Y UW0", "x": "EH1 K S", "y": "W AY1", "z": "Z IY1",
    "0": "Z IH1 R OW0", "1": "W AH1 N", "2": "T UW1", "3": "TH R IY1", "4": "F AO1 R", "5": "F AY1 V",
    "6": "S IH1 K S", "7": "S EH1 V AH0 N", "8": "EY1 T", "9": "N AY1 N",
}  # fmt: skip

_C = "[^aeiouy]"
_RULES: dict[str, list[tuple[str, str, str, str]]] = {}
"""By first letter: (what stands before, the letters, what follows, phones); the contexts are regular expressions."""


def _rule(before: str, letters: str, after: str, phones: str) -> None:
    _RULES.setdefault(letters[0], []).append((before, letters, after, phones))


_TABLE = f"""
 ; augh ; ; AO
 ; aw ; ; AO
 ; au ; ; AO
 ; ai ; r ; EH
 ; ai ; ; EY
 ; ay ; ; EY
 ; air ; ; EH R
^ ; a ; $ ; EY
 ; a ; $ ; AH
 ; ar ; [aeiou] ; EH R
 ; are ; $ ; EH R
 ; ar ; ; AA R
 ; all ; $ ; AO L
w ; a ; {_C} ; AA
 ; ae ; ; IY
 ; a ; (ng|nk) ; AE
 ; a ; {_C}e$ ; EY
 ; a ; (st|th)e$ ; EY
 ; a ; (ti|ci|si)o ; EY
 ; a ; {_C}(i|y)$ ; EY
 ; aa ; ; AA
 ; ah ; ; AA
 ; a ; ; AE
m ; b ; $ ;
 ; bb ; ; B
 ; b ; ; B
 ; cch ; ; K
 ; chr ; ; K R
 ; ch ; ; CH
 ; ck ; ; K
^s ; c ; [eiy] ;
 ; ci ; [aou] ; SH
 ; cc ; [eiy] ; K S
 ; c ; [eiy] ; S
 ; cc ; ; K
 ; c ; ; K
 ; dd ; ; D
 ; dge ; ; JH
 ; d ; ; D
 ; eigh ; ; EY
 ; eir ; ; EH R
 ; ei ; ; IY
 ; ew ; ; Y UW
 ; ee ; ; IY
 ; ear ; $ ; IH R
 ; ear ; ; ER
 ; ea ; (d|th)$ ; EH
 ; ea ; ; IY
 ; eu ; ; Y UW
 ; ey ; $ ; IY
 ; ey ; ; EY
 ; er ; [aeiouy] ; EH R
 ; ere ; $ ; IH R
 ; er ; ; ER
^{_C}+ ; e ; $ ; IY
[aeiouy].* ; e ; $ ;
[aeiouy].*[td] ; ed ; $ ; AH D
[aeiouy].*[pkfs] ; ed ; $ ; T
[aeiouy].* ; ed ; $ ; D
[aeiouy].*(s|z|x|ch|sh|g) ; es ; $ ; AH Z
[aeiouy].* ; es ; $ ; Z
[aeiouy].* ; e ; ly$ ;
[aeiouy].* ; e ; ment ;
 ; eo ; ; IY OW
 ; e ; {_C}e$ ; IY
 ; e ; ; EH
 ; ff ; ; F
 ; f ; ; F
 ; gn ; $ ; N
^ ; gn ; ; N
 ; gg ; ; G
^ ; gh ; ; G
 ; gh ; ;
 ; gu ; [eia] ; G
 ; ge ; $ ; JH
 ; g ; [ey] ; JH
 ; gi ; [ao] ; JH
 ; g ; ; G
^ ; h ; ; HH
[aeiou] ; h ; $ ;
[aeiou] ; h ; {_C} ;
 ; h ; [aeiouy] ; HH
 ; h ; ;
 ; igh ; ; AY
 ; ign ; $ ; AY N
 ; ild ; $ ; AY L D
 ; ind ; $ ; AY N D
 ; ier ; $ ; IY ER
 ; ie ; $ ; IY
 ; ie ; ; IY
 ; ir ; [aeiou] ; IH R
 ; ir ; ; ER
[st] ; ion ; ; AH N
 ; io ; ; IY OW
 ; ia ; ; IY AH
^ ; i ; $ ; AY
 ; i ; $ ; IY
^ ; i ; [aeou] ; AY
 ; i ; {_C}e$ ; AY
 ; ique ; $ ; IY K
 ; i ; ; IH
 ; j ; ; JH
^ ; kn ; ; N
 ; kk ; ; K
 ; k ; ; K
 ; ll ; ; L
[aeiouy].*{_C} ; le ; $ ; AH L
 ; l ; ; L
 ; mm ; ; M
 ; m ; ; M
 ; ng ; $ ; NG
 ; ng ; [^aeiouyr] ; NG
 ; n ; [kgqx] ; NG
 ; nn ; ; N
 ; n ; ; N
 ; ough ; $ ; OW
 ; ought ; ; AO T
 ; oo ; k ; UH
 ; oor ; ; AO R
 ; oo ; ; UW
 ; ous ; $ ; AH S
 ; our ; $ ; AW ER
 ; ou ; ; AW
 ; ow ; $ ; OW
 ; ow ; ; AW
 ; oy ; ; OY
 ; oi ; ; OY
 ; oa ; ; OW
 ; oe ; $ ; OW
 ; oe ; ; OW IY
 ; ore ; $ ; AO R
 ; or ; ; AO R
 ; old ; ; OW L D
 ; o ; $ ; OW
 ; o ; {_C}e$ ; OW
 ; o ; h ; OW
[st]i ; o ; n ; AH
 ; o ; ; AA
 ; ph ; ; F
^ ; ps ; ; S
^ ; pn ; ; N
 ; pp ; ; P
 ; p ; ; P
 ; que ; $ ; K
 ; qu ; ; K W
 ; q ; ; K
^ ; rh ; ; R
 ; rr ; ; R
 ; r ; ; R
 ; sch ; ; S K
 ; sh ; ; SH
 ; ss ; ; S
 ; si ; on ; ZH
[aeiou] ; s ; [aeiou] ; Z
[aeiouylmnrbdgvw] ; s ; $ ; Z
[^s] ; sc ; [eiy] ; S
 ; s ; ; S
 ; tch ; ; CH
 ; th ; ; TH
 ; ti ; o ; SH
 ; ti ; a ; SH
 ; tt ; ; T
 ; ture ; $ ; CH ER
 ; t ; ; T
 ; uy ; ; AY
 ; ue ; $ ; UW
 ; ui ; ; UW
q ; u ; ;
 ; ur ; [aeiou] ; Y UH R
 ; ure ; $ ; Y UH R
 ; ur ; ; ER
[rljs] ; u ; {_C}[eaiou] ; UW
 ; u ; {_C}[eaiou] ; Y UW
 ; u ; $ ; UW
^ ; u ; n[aeiou] ; Y UW
 ; u ; ; AH
 ; vv ; ; V
 ; v ; ; V
^ ; wr ; ; R
 ; wh ; ; W
 ; wor ; ; W ER
 ; w ; [^aeiouyr] ;
 ; w ; $ ;
 ; w ; ; W
^ ; x ; ; Z
 ; x ; ; K S
^ ; y ; [aeiou] ; Y
^{_C}+ ; y ; $ ; AY
 ; y ; $ ; IY
 ; y ; {_C}e$ ; AY
{_C} ; y ; {_C} ; IH
 ; y ; ; IY
 ; zz ; ; Z
 ; z ; ; Z
"""

for _line in _TABLE.strip("\n").splitlines():
    _rule(*(_field.strip() for _field in _line.split(";")))

_DOUBLE = re.compile(r"(.)\1\1+")


def letter_to_sound(word: str) -> tuple[str, ...]:
    """A pronunciation of any word: ARPAbet phones, the first vowel stressed.

    Digits are read one by one, and so are the letters of a stretch without a vowel (R2D2). Characters that are neither
    ASCII letters nor digits are passed over; a word of nothing else gives no phones.
    """
    phones: list[str] = []
    for part in re.findall(r"[a-z]+|[0-9]", word.lower().replace("'", "")):
        if part.isdigit() or not re.search(r"[aeiouy]", part) or len(part) == 1:
            for letter in part:
                phones += LETTER_NAMES[letter].split()
        else:
            phones += _stressed(_by_rule(_DOUBLE.sub(r"\1\1", part)))
    return tuple(phones)


def _by_rule(part: str) -> list[str]:
    phones: list[str] = []
    place = 0
    while place < len(part):
        for before, letters, after, said in _RULES[part[place]]:
            end = place + len(letters)
            if (
                part.startswith(letters, place)
                and re.search(f"(?:{before})$", part[:place]) is not None
                and re.match(after, part[end:]) is not None
            ):
                phones += said.split()
                place = end
                break
        else:
            place += 1
    return phones


def _stressed(phones: list[str]) -> list[str]:
    """Stress on the first vowel; the others have none, full ones a secondary stress."""
    out = []
    seen = False
    for phone in phones:
        if not is_vowel(phone):
            out.append(phone)
            continue
        digit = "1" if not seen else "0" if phone in ("AH", "ER", "IY", "OW") else "2"
        seen = True
        out.append(phone + digit)
    return out
