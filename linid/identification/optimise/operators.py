"""Selection, crossover and mutation of the genetic search: DEAP's operators, with generators of their own."""

from __future__ import annotations

from collections.abc import Callable
from types import FunctionType
from typing import Any

from linid.identification.settings import SearchSettings

Chooser = Callable[[list[Any], int], list[Any]]
Pair = Callable[[Any, Any], Any]
Change = Callable[[Any], Any]

_BLEND = 0.5  # alpha of DEAP's cxBlend: children up to half the parents' distance beyond them
_EXCHANGED = 0.5  # of the coordinates, in uniform crossover
_STEP = 0.05  # of the box, standard deviation of a Gaussian mutation
_USUAL_RATE = 1.5  # coordinates that mutate per child


def drawing_from(operator: Any, generator: Any, **others: Any) -> Any:
    """One of DEAP's operators as it is, but drawing from a generator of its own: the interpreter's belongs to the
    caller, and other threads draw from it. others: what else the operator finds under a global name."""
    names = {**operator.__globals__, "random": generator, **others}
    return FunctionType(operator.__code__, names, operator.__name__, operator.__defaults__, operator.__closure__)


def selection(settings: SearchSettings, generator: Any) -> Chooser:
    """Parents by tournament, or with chances that are inverse to their cost (roulette)."""
    from deap import tools

    if settings.selection == "roulette":
        roulette = drawing_from(tools.selRoulette, generator)
        return lambda parents, count: list(roulette(parents, count))
    one = drawing_from(tools.selTournament, generator, selRandom=drawing_from(tools.selRandom, generator))
    return lambda parents, count: list(one(parents, count, settings.tournament))


def crossover(settings: SearchSettings, generator: Any) -> Pair:
    """Two children in place of their parents' copies; coordinates may leave [0, 1]."""
    from deap import tools

    if settings.crossover == "blend":
        blend = drawing_from(tools.cxBlend, generator)
        return lambda one, two: blend(one, two, _BLEND)
    if settings.crossover == "two_point":
        return drawing_from(tools.cxTwoPoint, generator)  # type: ignore[no-any-return]
    if settings.crossover == "uniform":
        uniform = drawing_from(tools.cxUniform, generator)
        return lambda one, two: uniform(one, two, _EXCHANGED)
    binary = drawing_from(tools.cxSimulatedBinaryBounded, generator)
    return lambda one, two: binary(one, two, settings.crossover_eta, 0.0, 1.0)


def mutation(settings: SearchSettings, generator: Any, dimension: int) -> Change:
    """A child changed in some of its `dimension` coordinates, which may leave [0, 1]."""
    from deap import tools

    rate = _USUAL_RATE / dimension if settings.mutation_rate is None else settings.mutation_rate
    if settings.mutation == "gaussian":
        gaussian = drawing_from(tools.mutGaussian, generator)
        return lambda child: gaussian(child, 0.0, _STEP, rate)
    polynomial = drawing_from(tools.mutPolynomialBounded, generator)
    return lambda child: polynomial(child, settings.mutation_eta, 0.0, 1.0, rate)
