"""The paper's other media: robots order and report through open air, up to 180 m, and through water, up to 2,030 m;
alone, and with a third robot half-way that relays missed sentences. Simulation only."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cache
from typing import Any

from hil_fakes.bench import Bench, BenchPlan
from hil_fakes.loudspeakers import IDEAL
from hil_fakes.medium import WATER_M_S, Absorbing, Absorption, air_db_m, water_db_m
from hil_fakes.room import Air
from hvcpd.coordination.actions import Timing
from hvcpd.evaluation import listeners, plots, scene
from hvcpd.evaluation.calls import series_of
from hvcpd.evaluation.listeners import OURS
from hvcpd.evaluation.missions import Plot, doers, knows, repository, spoken_dbfs
from hvcpd.evaluation.modes import missions, table_of
from hvcpd.evaluation.trials import Comparison, Experiment, Findings, Row, Scale, Trial
from hvcpd.ports import Pose

NEAR, FAR, BETWEEN = "Rob", "Zoe", "Max"
PLANT = 1
MET_S, LIMIT_S = 25.0, 150.0
"""By then all have greeted, at switch-on times of up to 1.5 s, and are where they are tried; and the end. Both come
later by FLIGHTS times as long as sound takes, the end twice that, for the robots wait for each other."""
FLIGHTS = 30
ALONE, RELAYED = "alone", "with one half-way"


@dataclass(frozen=True)
class Medium:
    """A medium, and the equipment on both sides. Levels of water are re 1 µPa, those of air re 20 µPa."""

    name: str
    paper_m: float
    """As far as verbal signals travel in it, by the paper's introduction."""
    sound_speed_m_s: float
    absorption: Absorption
    speech_db: float
    """At 1 m."""
    noise_db: float
    """Pink, 0 to 8 kHz."""
    full_scale_db: float
    own_m: float
    """From a robot's loudspeaker to its own microphone: far enough not to overdrive it, or "stop" is heard in that."""
    distances_m: tuple[float, ...]
    quick_m: tuple[float, ...]
    assumed: str

    def air(self) -> Air:
        """The medium for the bench."""
        return Air(
            sound_speed_m_s=self.sound_speed_m_s,
            speech_db_spl=self.speech_db,
            speech_dbfs=spoken_dbfs((NEAR, FAR, BETWEEN)),
            microphone_full_scale_db_spl=self.full_scale_db,
            noise_db_spl=self.noise_db,
            own_distance_m=self.own_m,
        )


AIR = Medium(
    "air",
    180.0,
    343.0,
    air_db_m,
    85.0,  # a person shouting (ISO 9921:2003, table A.1: shouted 78, very loud 84 dB)
    scene.Bench().self_noise_db_spl,  # a quiet night: 20 dB, as the paper has it, drown in the microphone's own noise
    120.0,  # without the 14 dB of gain that quieter robots have
    0.2,
    (20.0, 40.0, 60.0, 90.0, 120.0, 150.0, 180.0, 240.0, 320.0, 400.0, 500.0, 650.0),
    (180.0, 400.0),
    "open air of 20 °C and 50 %, absorption as ISO 9613-1, no ground, no wind; a shout, 85 dB SPL at 1 m; noise 33 dB",
)
WATER = Medium(
    "water",
    2030.0,
    WATER_M_S,
    water_db_m,
    160.0,  # a small underwater loudspeaker; large ones have 180 dB (Lubell LL916, datasheet)
    101.0,  # sea state 3: 63 dB re 1 µPa²/Hz at 1 kHz, less by 17 dB a decade (Knudsen et al. 1948), 0.1 to 8 kHz
    180.0,
    1.0,
    (50.0, 100.0, 200.0, 400.0, 700.0, 1000.0, 1400.0, 2030.0, 2800.0, 4000.0),
    (2030.0, 2800.0),
    "sea water of 10 °C, absorption as Ainslie & McColm, no surface, no ground; 160 dB re 1 µPa at 1 m; noise 101 dB",
)
MEDIA = {medium.name: medium for medium in (AIR, WATER)}


def _trials(scale: Scale) -> Sequence[Trial]:
    found: list[Trial] = []
    for medium in MEDIA.values():
        for relayed in (False, True):
            variant = f"{medium.name}, {RELAYED if relayed else ALONE}"
            at_m = medium.quick_m if scale.quick else medium.distances_m
            found += missions("medium", scale, variant, medium.noise_db, at_m, medium=medium.name, relayed=relayed)
    return found


@cache
def _ways(name: str) -> Absorbing:
    medium = MEDIA[name]
    return Absorbing(medium.sound_speed_m_s, 1.1 * max(medium.distances_m), medium.absorption)


def patient(flight_s: float) -> Timing:
    """Settings of robots that know the sound's travel time between them: those for a sound card with the same delay,
    and an answer may come later by the round trip."""
    timing = Timing().for_latency(flight_s)
    both = 2.0 * flight_s
    return replace(timing, answer_s=timing.answer_s + both, greeting_wait_s=timing.greeting_wait_s + both)


def _run(trial: Trial) -> Row:
    """Whether the plant was watered once, by the distant robot, and the robot that gave the order knows."""
    s = trial.settings
    medium, distance_m = MEDIA[s["medium"]], s["distance_m"]
    places = {NEAR: 0.0, **({BETWEEN: 0.5 * distance_m} if s["relayed"] else {}), FAR: distance_m}
    flight_s = distance_m / medium.sound_speed_m_s
    plan = BenchPlan(
        tuple(places),
        repository([Plot(PLANT)]),
        int(trial.generator().integers(2**31)),
        coordinator=NEAR,
        air=medium.air(),
        ways=_ways(medium.name),
        loudspeaker=IDEAL,
        starts=tuple(Pose(x_m, 0.0) for x_m in places.values()),
        met_s=MET_S + FLIGHTS * flight_s,
        timing=patient(flight_s),
        unable={BETWEEN: frozenset({PLANT})},
        limit_s=LIMIT_S + 2 * FLIGHTS * flight_s,
    )
    events = Bench(plan, listeners.sound()).run().events
    done = doers(events) == {PLANT: [FAR]} and knows(events, NEAR, PLANT, FAR)
    return {**s, OURS: int(done), f"{OURS} wrong": []}


def _summarise(rows: Sequence[Row]) -> Findings:
    series = series_of(rows)
    media = [medium for medium in MEDIA.values() if any(row["medium"] == medium.name for row in rows)]
    reached = [_reached(medium, _within(medium, series)) for medium in media]
    return Findings(
        "Across open air and across water (simulation only)",
        (
            f"{NEAR} orders {FAR} to water a plant, as in the coordinating mode, and is told of its end; a mission "
            f"counts if that was done once within {LIMIT_S:g} s (later where sound takes long) and {NEAR} knows. They "
            "have met before, and wait for each other longer by the time that sound takes, which a robot's settings "
            "cannot say yet. "
            f"{RELAYED.capitalize()}, {BETWEEN} stands there, cannot do it itself, and passes on what stays without "
            "answer. The paper says that verbal signals travel 180 m in air and 2,030 m under water; it tried neither.",
            *reached,
        ),
        table_of(series),
        lambda figure: _draw(figure, media, series),
        (
            "nobody has tried this outside of a computer; noise is pink, 0 to 8 kHz; sound spreads over a sphere",
            *(f"{medium.name}: {medium.assumed}; {medium.sound_speed_m_s:g} m/s" for medium in media),
        ),
        (8.4, 5.0),
        beside=tuple(
            Comparison(f"how far across {medium.name}", f"{medium.paper_m:,.0f} m, from books", text)
            for medium, text in zip(media, reached, strict=True)
        ),
    )


def _within(medium: Medium, series: Sequence[plots.Series]) -> list[plots.Series]:
    return [s for s in series if s.condition.startswith(f"{medium.name},")]


def _reached(medium: Medium, series: Sequence[plots.Series]) -> str:
    """Number of missions that succeed at the paper's distance, and the distance at which half succeed."""
    texts = []
    for s in series:
        there = next((step for step in s.steps if step.at == medium.paper_m), None)
        at_paper = f", {there.right} of {there.n} at the paper's {medium.paper_m:,.0f} m" if there is not None else ""
        texts.append(f"{s.condition}: half of the missions succeed at {s.pivot.text(digits=0)}{at_paper}")
    return f"{'; '.join(texts).capitalize()}."


def _draw(figure: Any, media: Sequence[Medium], series: Sequence[plots.Series]) -> None:
    panels = figure.subplots(1, len(media), sharey=True, squeeze=False)[0]
    for axes, medium in zip(panels, media, strict=True):
        here = _within(medium, series)
        plots.shares(axes, here, "distance, m", "success, %" if axes is panels[0] else "")
        plots.mark(axes, medium.paper_m, f"the paper's\n{medium.paper_m:,.0f} m")
        plots.by_distance(axes, here)


EXPERIMENT = Experiment("medium", _trials, _run, _summarise)
