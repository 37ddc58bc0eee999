"""The command line of `hvcpctl evaluate`."""

from __future__ import annotations

from pathlib import Path

from hvcpd.control.arguments import Commands, Run, seed, whole


def add_evaluate(commands: Commands, run: Run) -> None:
    """Add `evaluate`."""
    from hvcpd.evaluation.experiments import NAMES

    count = whole(1, 100_000)
    c = commands.add_parser(
        "evaluate",
        help="run the paper's experiments in a simulated room",
        epilog="Results are kept in --out: the same command continues where it was interrupted.",
    )
    one_of = f"one of {', '.join(NAMES)}, or all"
    c.add_argument("experiment", choices=(*NAMES, "all"), metavar="EXPERIMENT", help=one_of)
    c.add_argument("--jobs", type=count, metavar="N", help="processes (default: one for each core)")
    c.add_argument("--scheduler", metavar="ADDRESS", help="dask cluster to run on, such as tcp://10.0.0.1:8786")
    c.add_argument("--seed", type=seed, default=1, metavar="N", help="same seed, same results (default 1)")
    c.add_argument(
        "--trials", type=count, default=20, metavar="N", help="trials at each step (default 20, as in the paper)"
    )
    c.add_argument(
        "--missions",
        type=count,
        metavar="N",
        help="missions of whole robots at each step (default: as trials, 1 with --quick)",
    )
    c.add_argument("--out", type=Path, default=Path("out/evaluation"), metavar="DIR", help="(default out/evaluation)")
    c.add_argument(
        "--from-recordings",
        type=Path,
        metavar="DIR",
        help="with wake: recordings of real robots (docs/experiment.md) instead of a simulation",
    )
    c.add_argument("--quick", action="store_true", help="fewer steps: rough results within minutes")
    c.set_defaults(run=run)
