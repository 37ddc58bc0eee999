"""Times, quantities, ranges and abbreviations as people write them, in the words that are said and heard."""

from __future__ import annotations

import pytest

from hvcpd.config.written import unsayable
from hvcpd.errors import PhraseError
from hvcpd.language.phrasebook import Phrasebook, Vocabulary
from hvcpd.language.words import spoken_phrases, spoken_words


@pytest.mark.parametrize(
    ("written", "said"),
    [
        ("meet at 10 am", "meet at ten a m"),
        ("at seven am", "at seven a m"),
        ("7AM", "seven a m"),
        ("10 a.m.", "ten a m"),
        ("9:00 am", "nine a m"),
        ("10:30 am", "ten thirty a m"),
        ("I am here", "i am here"),
        ("R2 am", "r2 am"),
        ("at 9:00", "at nine o'clock"),
        ("at 14:00", "at fourteen hundred"),
        ("at 3:05 pm", "at three o five pm"),
        ("at 3.05 pm, 9.30-10.30 a.m.", "at three o five pm nine thirty to ten thirty a m"),
        ("from 9:00-10:30", "from nine o'clock to ten thirty"),
        ("9 am-5 pm", "nine a m to five pm"),
        ("pages 10-12", "pages ten to twelve"),
        ("2\N{EN DASH}3kg", "two to three kilograms"),
        ("it ended 5-3", "it ended five three"),
        ("2026-05-12", "2026 five twelve"),
        ("call 55-12-34", "call fifty five twelve thirty four"),
        ("20cm of 1 m", "twenty centimetres of one metre"),
        ("500 ml", "five hundred millilitres"),
        ("12V, 3.3 V", "twelve volts three point three volts"),
        ("it was 3.5, now 4", "it was three point five now four"),
        ("0.05 kg", "zero point zero five kilograms"),
        ("20 °C, 90°", "twenty degrees celsius ninety degrees"),
        ("50% or 50 %", "fifty percent or fifty percent"),
        ("2 m/s", "two metres per second"),
        ("5 l/min, 2-3 km/h, 1 €/kg", "five litres per minute two to three kilometres per hour one euro per kilogram"),
        ("2 m/s - 3 m/s", "two metres per second to three metres per second"),
        (
            "5 Kg, 2 KM, 10 MIN, 3 khz, 2 KWH",
            "five kilograms two kilometres ten minutes three kilohertz two kilowatt hours",
        ),
        ("5 MS, 5 M, 5 mv", "five ms five m five mv"),
        ("6 ft", "six feet"),
        ("$5, £1.50, 3 €", "five dollars one pound fifty three euros"),
        ("wait 5s, in the 90s", "wait five seconds in the nineties"),
        ("room 12b", "room twelve b"),
        ("room 5 A", "room five a"),
        ("R2D2 and nova7 m", "r2d2 and nova7 m"),
        ("Tue. 5 Dec, Thurs 9:00", "tuesday five december thursday nine o'clock"),
        ("Jan. 3rd or 3rd Feb", "january third or third february"),
        ("Jan sat in the sun", "jan sat in the sun"),
        ("#5 and No. 5", "number five and number five"),
        ("he said no.", "he said no"),
        (
            "\N{LEFT SINGLE QUOTATION MARK}Rob\N{RIGHT SINGLE QUOTATION MARK} said «re\N{NON-BREAKING HYPHEN}use it»",
            "rob said re use it",
        ),
        ("Rob & Bot", "rob and bot"),
        ("100, 1500, 20000", "one hundred fifteen hundred twenty thousand"),
        ("room 101 in 2024", "room 101 in 2024"),
        ("the 100th and 121st", "the one hundredth and one hundred twenty first"),
        ("the 1000th, 2005th, 1500th", "the one thousandth two thousand fifth fifteen hundredth"),
        ("room 007 on 05 Dec", "room 007 on five december"),
        ("1.5-2 m, 2.5\N{EN DASH}3.5 m", "one point five to two metres two point five to three point five metres"),
        ("$5.00 or £1.05", "five dollars or one pound five"),
        ("№ 5 and №5", "number five and number five"),
        ("20 ºC, 20 ˚C, Robo™", "twenty degrees celsius twenty degrees celsius robo"),
        ("the 1990s, '80s, her 30s, mid-60s", "the nineteen nineties eighties her thirties mid sixties"),
        ("the 1900s and the 2000s", "the nineteen hundreds and the two thousands"),
        ("wait 10s or 100s, 10s of roses", "wait ten seconds or one hundred seconds tens of roses"),
        ("10 \N{EN DASH} 20, 3 - 5 m", "ten to twenty three to five metres"),
        ("9:00 - 10:30", "nine o'clock to ten thirty"),
        ("5 cm - 10 cm, 90cm-1m", "five centimetres to ten centimetres ninety centimetres to one metre"),
        ("100-200 ml, rooms 101-105", "one hundred to two hundred millilitres rooms 101 to 105"),
        ("2024-2026, call 555-1234", "2024 to 2026 call 555 1234"),
        ("10 - 20 - 30", "ten twenty thirty"),
        ("Nov 29 - Dec 5, 5 - 10 Dec", "november twenty nine to december five five to ten december"),
        ("PDFs, MP3s, IDs and buses", "pdf's mp3's id's and buses"),
        ("$0.50, £0.01, $20 000", "fifty cents one penny twenty thousand dollars"),
        ("the 2ND and 3RD", "the second and third"),
        ("on Mon, every Tues. and Thurs", "on monday every tuesday and thurs"),
        ("Hi Fri, I am Mon", "hi fri i am mon"),
        ("Mon-Fri, 1st-3rd floor", "monday to friday first to third floor"),
        ("Nov 29th - Dec 5th", "november twenty ninth to december fifth"),
        ("20 000 of 1 000", "twenty thousand of one thousand"),
        ("100 000 l, 1 000 000 and 300000", "one hundred thousand litres one million and three hundred thousand"),
        ("2 500 ml bottles", "two five hundred millilitres bottles"),
        ("1h30, 10h05m or 2h15min", "one hour thirty minutes ten hours five minutes or two hours fifteen minutes"),
        ("3 L, 3L, 5 cL and 2 dL", "three litres three litres five centilitres and two decilitres"),
        ("2 hrs, 1 hr, 5 mins, 2 yds", "two hours one hour five minutes two yards"),
        ("3 tbsp, 1 tsp, 30 mph, 2 psi", "three tablespoons one teaspoon thirty miles per hour two p s i"),
        ("Phase II, type IV, part XI", "phase two type four part eleven"),
        ("check the IV, ask XI", "check the iv ask xi"),
        ("write to rob@example.com.", "write to rob at example dot com"),
        ("www.my-robots.co.uk, notes.txt", "www dot my dash robots dot co dot uk notes dot txt"),
        ("it is there.then go", "it is there then go"),
        ('"room 5" and 6', "room five and six"),
        ("'room 5' and 6, the 60's, 6'2", "room five and six the sixties 6'2"),
        ("5 kgs, 10kms, 2 yrs, 1 wk", "five kilograms ten kilometres two years one week"),
        ("a 10-m rope, the 1.5-l pots, 40-ft-pole", "a ten metre rope the one point five litre pots forty foot pole"),
        ("a 10-15-min walk to 5-A", "a ten to fifteen minute walk to five a"),
        (
            "8h 30m, 8 h 5 min, 1h30m15s",
            "eight hours thirty minutes eight hours five minutes one hour thirty minutes fifteen seconds",
        ),
        (
            "2m 30s, 2 m 10 cm, 10 h 5 mm",
            "two minutes thirty seconds two metres ten centimetres ten hours five millimetres",
        ),
        ("5 p.m. - 7 p.m., 9-10 a.m.", "five p m to seven p m nine to ten a m"),
        ("20:00 h, 8:00\N{EN DASH}9:30 hrs", "twenty hundred eight o'clock to nine thirty"),
        (
            "Mon, Wed and Fri, Sat & Sun, Tue to Thurs",
            "monday wednesday and friday saturday and sunday tuesday to thursday",
        ),
        ("don´t, don`t, donʼt, re\N{SOFT HYPHEN}use\N{ZERO WIDTH SPACE}", "don't don't don't reuse"),
    ],
)
def test_what_is_written_is_read_out(written: str, said: str) -> None:
    assert " ".join(spoken_words(written)) == said
    assert unsayable(written) is None


@pytest.mark.parametrize(
    ("written", "phrases"),
    [
        ("Dinner is ready. Please come, Rob!", "dinner is ready | please come | rob"),
        ("Go to room 5. (Then) wait... then go", "go to room five | then wait | then go"),
        ("note: the door - a big one - is open; close it", "note | the door | a big one | is open | close it"),
        ('he said "go." "Why?"', "he said go | why"),
        ("first\nthen \N{EM DASH} last", "first | then | last"),
        ("Mr. Smith, Dr. Lee and J. R. Roe", "mr smith | dr lee and j r roe"),
        ("e.g. at 9 a.m. in the U.S. Army", "e g at nine a m in the u s army"),
        ("it is 3.5 m from 8:30-9:00 at rob@example.com", None),
    ],
)
def test_a_reader_pauses_where_the_writer_does(written: str, phrases: str | None) -> None:
    said = [" ".join(phrase) for phrase in spoken_phrases(written)]
    assert said == (phrases.split(" | ") if phrases else [" ".join(spoken_words(written))])


@pytest.mark.parametrize(
    "written",
    [
        "20 m²",
        "1.000 roses",
        "1,5 m",
        "-5 °C",
        "12.05.2026",
        "1/2 a litre",
        "5 m/s²",
        "5 kg/m3",
        "2 l/2 h",
        "$5-10",
        "$5m",
        "3.5-1",
        "$5 - $10",
        "wait 90s",
        '5" pipe',
        "Rob's 6' ladder",
    ],
)
def test_what_could_be_misread_is_refused(written: str) -> None:
    assert unsayable(written) is not None


REMARKS = (
    *("Meet at 10 am", "it is 20.5 °C", "use 500ml", "done by 14:00", "pages 10-12", "half of it is 50%", "pay $5"),
    *("pay $1.50", "room no. 5 is free", "№ 7 is free", "give me #8", "the 90s party", "notes.txt is here"),
)


@pytest.mark.parametrize("remark", REMARKS)
def test_a_teams_sentence_is_typed_as_it_is_written(remark: str) -> None:
    book = Phrasebook(Vocabulary(("Rob",), remarks=REMARKS))
    (typed,) = {book.parse_text(f"Hi all, I am Rob, {each}") for each in (remark, remark.upper().replace("ML", "ml"))}
    assert book.phrases(typed)[-1] == spoken_words(remark)


@pytest.mark.parametrize("number", ["-1", "\N{EN DASH}1", ".1", "-.1", "1.5", "1-3", "100", "5 m", "5%", "5 am"])
def test_no_other_quantity_is_taken_for_a_tasks_number(number: str) -> None:
    with pytest.raises(PhraseError):
        Phrasebook(Vocabulary(("Rob",))).parse_text(f"Hi all, I am Rob, I will complete task {number}")


@pytest.mark.parametrize(
    "part",
    [
        "9",
        "1.",
        "1:",
        "1-",
        "1-2,",
        "$1.",
        "1 - ",
        "1'",
        "a'",
        "1 m ",
        "1h",
        "1-m ",
        "Mon, ",
        "A. A",
        "a..",
        "a -",
        "a.",
        "a@",
        "mid-",
        "V ",
        "1 000",
    ],
)
def test_a_long_text_takes_a_time_in_proportion(part: str) -> None:
    unsayable(part * 100_000)  # 44 s, where each digit began a search to the end of its number
    assert spoken_words(part * 1000)
