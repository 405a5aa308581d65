"""What stands in a checkpoint, as pydantic checks it before a search goes on from it."""

from __future__ import annotations

from typing import Annotated, Any, Literal

import numpy as np
from pydantic import BaseModel, ConfigDict, Field, TypeAdapter, model_validator

Count = Annotated[int, Field(ge=0, lt=2**53)]
Finite = Annotated[float, Field(allow_inf_nan=False)]
# The search happens in a box of size 1.
Moderate = Annotated[float, Field(ge=-50.0, le=50.0)]
Large = Annotated[float, Field(ge=-1e12, le=1e12)]
SearchParameter = Annotated[float, Field(ge=0.0, le=1.0)]
Genes = Annotated[list[SearchParameter], Field(min_length=1)]
Word = Annotated[int, Field(ge=0, lt=2**32)]
Place = Annotated[int, Field(ge=0, le=624)]
_Exact = ConfigDict(strict=True, extra="forbid")
# Generation and evaluations, then the best and the median cost, which may be infinite.
Row = tuple[Annotated[float, Field(ge=0, lt=2**53)], Annotated[float, Field(ge=0, lt=2**53)], float, float]

# The Mersenne twister of Python (version, words and place in one list, spare Gaussian) and that of numpy.
_PYTHON_RANDOM = TypeAdapter(
    tuple[Literal[3], Annotated[list[Word], Field(min_length=625, max_length=625)], Finite | None]
)
_NUMPY_RANDOM = TypeAdapter(
    tuple[
        Literal["MT19937"], Annotated[list[Word], Field(min_length=624, max_length=624)], Place, Literal[0, 1], Finite
    ]
)


class CmaExtra(BaseModel):
    """What DEAP's CMA-ES carries from one generation to the next besides the best candidate."""

    model_config = _Exact

    centroid: list[Moderate]
    sigma: Annotated[float, Field(gt=0.0, le=50.0)]
    pc: list[Moderate]
    ps: list[Moderate]
    C: list[list[Large]]
    B: list[list[Large]]
    BD: list[list[Large]]
    scales: list[Annotated[float, Field(ge=0.0, le=1e6)]] = Field(alias="diagD")
    update_count: Count

    def fits(self, size: int) -> bool:
        """Whether all vectors and matrices have this size, and the covariance is that of its axes and scales."""
        vectors = (self.centroid, self.pc, self.ps, self.scales)
        matrices = (self.C, self.B, self.BD)
        square = all(len(m) == size and all(len(row) == size for row in m) for m in matrices)
        if not square or any(len(v) != size for v in vectors):
            return False
        covariance, root, axes = np.array(self.C), np.array(self.BD), np.array(self.B)
        near = 1e-6 * float(np.abs(covariance).max())
        return (
            np.allclose(root @ root.T, covariance, rtol=0.0, atol=near)
            and np.allclose(axes * np.array(self.scales), root, rtol=1e-6)
            and np.allclose(axes @ axes.T, np.eye(size), rtol=0.0, atol=1e-6)
            and min(self.scales) > 0.0
        )


class StateBody(BaseModel):
    """The state of a global search (`linid.identification.optimise.genetic.SearchState`)."""

    model_config = _Exact

    method: Literal["genetic", "cma", "plain"]
    generation: Count
    population: Annotated[list[Genes], Field(min_length=1)]
    costs: list[float]
    best: Genes
    best_cost: float
    stalled: Count
    evaluations: Count
    random_state: Any
    extra: dict[str, Any]
    history: list[list[float]]
    starts: list[Annotated[list[Finite], Field(min_length=1)]]
    start_offsets: list[list[Finite]]

    @model_validator(mode="after")
    def _sizes_fit(self) -> StateBody:
        size = len(self.best)
        if any(len(row) != size for row in (*self.population, *self.starts)):
            raise ValueError("candidates differ in length")
        if len(self.starts) != len(self.start_offsets):
            raise ValueError("starts and start_offsets differ in length")
        if len(self.costs) != len(self.population):
            raise ValueError("costs and population differ in length")
        if any(cost != cost for cost in (*self.costs, self.best_cost)):
            raise ValueError("a cost is not a number")
        rows = TypeAdapter(list[Row])
        rows.validate_python([tuple(row) for row in self.history])
        cma = self.method == "cma"
        state = _tuples(self.random_state)
        (_NUMPY_RANDOM if cma else _PYTHON_RANDOM).validate_python(state, strict=True)
        if not cma and state[1][624] > 624:
            raise ValueError("random_state has a place beyond its words")
        if self.extra and not (cma and CmaExtra.model_validate(self.extra).fits(size)):
            raise ValueError("extra does not fit the method")
        return self


def _tuples(state: Any) -> Any:
    return tuple(state) if isinstance(state, list) else state


# Finished steps by key: the text of a model, or the values of one.
STEPS: TypeAdapter[dict[str, str | list[float]]] = TypeAdapter(
    dict[str, str | list[float]], config=ConfigDict(strict=True)
)
