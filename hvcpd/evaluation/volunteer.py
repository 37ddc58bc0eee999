"""The paper's volunteering mode: two robots share out two plants. Success against distance, of robots that drive off
while they talk and of robots that stand still until they are heard."""

from __future__ import annotations

from collections.abc import Sequence

from hvcpd.evaluation import listeners, plots
from hvcpd.evaluation.calls import blocks, hear, series_of
from hvcpd.evaluation.listeners import CALLED, CALLER, OURS, PEER
from hvcpd.evaluation.missions import LIMIT_S, ONE, OTHER, Plot, doers, knows, repository, run
from hvcpd.evaluation.modes import SAID_ONCE, WHOLE, calls_each, mission_distances, missions, table_of
from hvcpd.evaluation.scene import FITTED_ROBOT_NOISE_DB_SPL, Bench
from hvcpd.evaluation.trials import Comparison, Experiment, Findings, Row, Scale, Trial
from hvcpd.evaluation.wake import reached
from hvcpd.ports import SAMPLE_RATE_HZ

PAPER_DROP_M = 0.7
"""From which the paper's success in this mode falls, for the robots drive off (section IV-A)."""
DRIVING, STANDING = "driving off", "standing still"
AWAY_M = 2.0
"""Distance of each robot's plant behind it, away from the other."""
SPEED_M_S = 0.211
"""TurtleBot3's firmware holds the wheels at 61 rpm; the paper's program asks for 0.3 m/s."""
ANSWER_S = 1.0
"""Between one robot's claim and the other's: to understand, and to listen whether nobody else speaks."""
CLAIMS = tuple(f"Hi all, I am {CALLER}, I will complete task {number}" for number in ("one", "two"))
"""The two claims, in the one voice that listeners are tried with."""
FIRST, SECOND = 1, 2
SAID_M = (0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 1.0, 1.1, 1.2, 1.4, 1.7, 2.0)
QUICK_SAID_M = (0.2, 0.4, 0.6, 0.8, 1.1)
"""Nearer than calls: two long sentences must be heard."""


def _trials(scale: Scale) -> Sequence[Trial]:
    noise = FITTED_ROBOT_NOISE_DB_SPL
    at_m = tuple(d for d in mission_distances(scale.quick) if d <= 16.0)  # with the ways behind them in the hall
    found: list[Trial] = []
    for drives in (True, False):
        how = DRIVING if drives else STANDING
        if listeners.available(PEER):
            said_m = QUICK_SAID_M if scale.quick else SAID_M
            more = {"variant": f"{SAID_ONCE}, {how}", "drives": drives, "listeners": [PEER]}
            found += blocks("volunteer", scale.seed, calls_each(scale), said_m, robot_noise_db_spl=noise, **more)
        found += missions("volunteer", scale, f"{WHOLE}, {how}", noise, at_m, drives=drives)
    return found


def _run(trial: Trial) -> Row:
    return _said_once(trial) if "block" in trial.settings else _mission(trial)


def _said_once(trial: Trial) -> Row:
    """As in the paper: each robot claims its plant once; the first one drives off while the second one claims."""
    s, rng, book = trial.settings, trial.generator(), listeners.book(CALLED, CALLER)
    setting = Bench(robot_noise_db_spl=s["robot_noise_db_spl"])
    right = [True] * s["calls"]
    for text, away_m in zip(CLAIMS, (0.0, way_m() if s["drives"] else 0.0), strict=True):
        sentence = listeners.spoken(text, book)
        (got,) = hear([sentence] * s["calls"], s["distance_m"] + away_m, setting, rng, s["listeners"], book).values()
        right = [ok and text == " ".join(sentence[0]) for ok, text in zip(right, got, strict=True)]
    return {**s, PEER: sum(right), f"{PEER} wrong": []}


def way_m() -> float:
    """Distance that the first robot has driven when the second one is in the middle of its claim."""
    _, claim = listeners.spoken(CLAIMS[1], listeners.book(CALLED, CALLER))
    return SPEED_M_S * (ANSWER_S + 0.5 * len(claim) / SAMPLE_RATE_HZ)


def _mission(trial: Trial) -> Row:
    """Whether each plant was watered once, by one robot each, and both know who watered which."""
    s = trial.settings
    plots_ = (Plot(FIRST, -AWAY_M), Plot(SECOND, s["distance_m"] + AWAY_M))
    events, _ = run(trial, repository(plots_), hasty=s["drives"])
    by = doers(events)
    owners = {number: robots[0] for number, robots in by.items() if len(robots) == 1}
    shared = set(owners.values()) == {ONE, OTHER}
    known = all(knows(events, robot, number, who) for number, who in owners.items() for robot in (ONE, OTHER))
    return {**s, OURS: int(shared and known), f"{OURS} wrong": []}


def _summarise(rows: Sequence[Row]) -> Findings:
    series = series_of(rows)
    return Findings(
        "Volunteering: two robots share out two plants",
        (
            f"{SAID_ONCE.capitalize()}, as the paper's robots: each claims a plant in one sentence, and both must be "
            f"heard word for word. {WHOLE.capitalize()}: they greet, claim, confirm, say again what nobody confirmed, "
            f"and drive {AWAY_M:g} m away from each other; a mission counts if within {LIMIT_S:g} s each plant was "
            f"watered once, by one robot each, and both know whose is whose. {DRIVING.capitalize()}: who claims sets "
            f"off at once (the first robot is {way_m():.2f} m away when the second is in the middle of its claim). "
            f"{STANDING.capitalize()}: until the claim is confirmed. The paper's success falls from "
            f"{PAPER_DROP_M * 100:.0f} cm on. Half succeed here:",
            *(f"{text}." for text in reached(series)),
        ),
        table_of(series),
        lambda figure: plots.against_distance(
            figure, series, "success, %", PAPER_DROP_M, "the paper's success\nfalls from"
        ),
        (*Bench().assumptions(), f"robots drive at {SPEED_M_S:g} m/s, plants {AWAY_M:g} m behind them"),
        beside=(
            Comparison(
                "half of the volunteers' missions succeed at",
                f"falls from {PAPER_DROP_M * 100:.0f} cm on",
                "; ".join(reached(series)),
            ),
        ),
    )


EXPERIMENT = Experiment("volunteer", _trials, _run, _summarise, ("pyroomacoustics",))
