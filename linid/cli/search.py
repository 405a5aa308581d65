"""Options of the global search of a fit."""

from __future__ import annotations

import click

SEARCH_OPTIONS = (
    click.option(
        "--method",
        type=click.Choice(["genetic", "cma", "plain", "scratch"]),
        help="Global search; plain: the genetic algorithm whole, from random candidates, no least squares; scratch: "
        "from random candidates in stages [genetic].",
    ),
    click.option("--population", type=int, metavar="N", help="Candidates per generation [64]."),
    click.option("--generations", type=int, metavar="N", help="Largest number of generations [120]."),
    click.option(
        "--selection", type=click.Choice(["tournament", "roulette"]), help="How parents are chosen [tournament]."
    ),
    click.option(
        "--crossover",
        type=click.Choice(["simulated_binary", "blend", "two_point", "uniform"]),
        help="Operator on pairs [simulated_binary].",
    ),
    click.option("--crossover-rate", type=float, metavar="SHARE", help="Share of the pairs that cross [0.9]."),
    click.option(
        "--mutation", type=click.Choice(["polynomial", "gaussian"]), help="Operator on children [polynomial]."
    ),
    click.option(
        "--mutation-rate",
        type=float,
        metavar="SHARE",
        help="Probability that a coordinate mutates [1.5 over their number].",
    ),
    click.option(
        "--least-squares-steps",
        type=int,
        metavar="N",
        help="Steps of the least squares after the search, at most; 0: none [60; plain: 0].",
    ),
    click.option(
        "--verify-search/--no-verify-search",
        default=None,
        help="Say whether a search from random candidates finds the same minimum [no; in a batch yes, but for theta].",
    ),
)
SEARCH_NAMES = (
    "method",
    "population",
    "generations",
    "selection",
    "crossover",
    "crossover_rate",
    "mutation",
    "mutation_rate",
    "least_squares_steps",
    "verify_search",
)
