"""The paper's Table I: words of several pronunciations, and which one is used."""

from __future__ import annotations

from collections.abc import Sequence

from hvcpd.evaluation.listeners import sound
from hvcpd.evaluation.trials import Comparison, Experiment, Findings, Row, Scale, Table, Trial
from hvcpd.synthesis.explain import PAPER_TABLE, paper_row
from hvcpd.synthesis.homographs import Place


def _trials(scale: Scale) -> Sequence[Trial]:
    return [Trial("pronunciation", scale.seed, {"word": word}) for word in PAPER_TABLE]


def _run(trial: Trial) -> Row:
    return paper_row(trial.settings["word"], sound().lexicon)


def _summarise(rows: Sequence[Row]) -> Findings:
    columns = ("word", "possible", "paper", "alone", *(place.value for place in Place))
    cells = tuple(
        tuple(", ".join(row[c]) if isinstance(row.get(c), list) else row.get(c, "") for c in columns) for row in rows
    )
    several = sum(len(row["possible"]) > 1 for row in rows)
    placed = sum(any(place.value in row for place in Place) for row in rows)
    return Findings(
        "Words of several pronunciations (the paper's Table I)",
        (
            f"The paper's speech service says each of its {len(rows)} words in one way, whatever is meant. Our lexicon "
            f"knows several pronunciations of {several} of them, and chooses among those of {placed} by the words "
            "around; a lexicon file of the user's own overrides all of it.",
        ),
        Table(columns, cells),
        beside=(
            Comparison(
                f"of {len(rows)} words, said as the words around ask for",
                "0",
                f"{placed}; of {several} several pronunciations are known",
            ),
        ),
    )


EXPERIMENT = Experiment("pronunciation", _trials, _run, _summarise)
