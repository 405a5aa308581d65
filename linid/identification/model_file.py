"""The MODEL file `parameters.json`: a FitResult as JSON, every float exact, nothing that hangs on time or threads."""

from __future__ import annotations

import json
import math
from dataclasses import fields
from pathlib import Path
from typing import Any

import numpy as np

from linid.config import parse_json, read_json
from linid.errors import ConfigError, LinidError
from linid.former_names import present_name, with_present_keys
from linid.identification.result import Estimate, FitResult, Generation, Profile, Start
from linid.physics.laws.registry import LUGRE

SCHEMA = 1
MOST_SUBSTEPS = 1000  # internal steps per sample, as settings allow
LARGEST_VALUE = 1e15  # SI, of either sign; the stiffest contact is far below
_REMEDY = "Give the parameters.json that fit-friction or fit-motor wrote"


def _plain(value: Any) -> Any:
    if isinstance(value, np.ndarray):
        return _plain(value.tolist())
    if isinstance(value, (Estimate, Generation, Profile, Start)):
        return {f.name: _plain(getattr(value, f.name)) for f in fields(value)}
    if isinstance(value, dict):
        return {str(k): _plain(v) for k, v in value.items()}
    if isinstance(value, (tuple, list)):
        return [_plain(v) for v in value]
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    return value


def model_to_text(result: FitResult) -> str:
    """The JSON text of a fit result; equal results give equal text."""
    body = {f.name: _plain(getattr(result, f.name)) for f in fields(result)}
    return json.dumps({"schema": SCHEMA, "kind": "linid model", **body}, indent=1, allow_nan=False) + "\n"


def _number(value: Any) -> float:
    return math.nan if value is None else float(value)


def _estimate(row: dict[str, Any]) -> Estimate:
    return Estimate(
        row["name"],
        row["symbol"],
        row["unit"],
        _number(row["value"]),
        _number(row["std"]),
        _number(row["low"]),
        _number(row["high"]),
        row["status"],
        row["note"],
    )


def model_from_text(text: str, place: str) -> FitResult:
    """The fit result of a MODEL file's text; raises ConfigError with `place` if it is none, or none that can be."""
    return _result(parse_json(text, place, _REMEDY), place)


def _with_present_names(body: dict[str, Any]) -> dict[str, Any]:
    """The content of a MODEL file with its parameters called as they are today."""
    for key in ("estimates", "derived", "profiles"):
        for row in body.get(key, ()):
            row["name"] = present_name(row["name"])
    body["fitted"] = [present_name(name) for name in body["fitted"]]
    body["pairs"] = [(present_name(a), present_name(b), *rest) for a, b, *rest in body["pairs"]]
    settings = with_present_keys(body["settings"])
    body["settings"] = settings | {
        key: with_present_keys(settings[key]) for key in ("fixed", "bounds") if key in settings
    }
    return body


def _result(body: Any, place: str) -> FitResult:
    if not isinstance(body, dict) or body.get("kind") != "linid model":
        raise ConfigError(
            place, "is not a linid model", "Give the parameters.json that fit-friction or fit-motor wrote"
        )
    if body.get("schema") != SCHEMA:
        raise ConfigError(
            place, f"has model schema {body.get('schema')!r}, expected {SCHEMA}", "Fit again with this version"
        )
    try:
        body = _with_present_names(body)
        result = FitResult(
            model=body["model"],
            axis=body["axis"],
            effects=tuple(body["effects"]),
            estimates=tuple(_estimate(row) for row in body["estimates"]),
            fitted=tuple(body["fitted"]),
            correlation=np.array(body["correlation"], dtype=float).reshape((len(body["fitted"]),) * 2),
            condition_number=_number(body["condition_number"]),
            pairs=tuple((a, b, float(rho), why) for a, b, rho, why in body["pairs"]),
            starts={
                name: Start(_number(s["t"]), _number(s["y"]), _number(s["v"]), _number(s["w"]))
                for name, s in body["starts"].items()
            },
            objectives=dict(body["objectives"]),
            residual_rms={name: _number(value) for name, value in body["residual_rms"].items()},
            history=tuple(
                Generation(
                    h["stage"], int(h["generation"]), int(h["evaluations"]), _number(h["best"]), _number(h["median"])
                )
                for h in body["history"]
            ),
            stop_reasons=tuple(body["stop_reasons"]),
            converged=bool(body["converged"]),
            seed=int(body["seed"]),
            evaluations=int(body["evaluations"]),
            substeps=int(body["substeps"]),
            step_error=_number(body["step_error"]),
            warnings=tuple(body["warnings"]),
            derived=tuple(_estimate(row) for row in body["derived"]),
            per_mass=bool(body["per_mass"]),
            input_unit=body["input_unit"],
            covariance=np.array(body["covariance"], dtype=float).reshape((len(body["fitted"]),) * 2),
            settings=dict(body["settings"]),
            profiles=tuple(
                Profile(p["name"], tuple(p["values"]), tuple(p["statistic"]), _number(p["low"]), _number(p["high"]))
                for p in body.get("profiles", ())
            ),
            winding=body.get("winding", ""),
            law=body.get("law", LUGRE),
            search_check=body.get("search_check", ""),
        )
    except (KeyError, TypeError, ValueError, OverflowError, AttributeError) as error:
        fact = f"{type(error).__name__}: {error}"[:120]
        raise ConfigError(place, f"is a damaged model file ({fact})", "Fit again, or restore the file") from error
    _check(result, place)
    return result


def _check(result: FitResult, place: str) -> None:
    """ConfigError for what no fit writes: unknown kinds, numbers beyond all physics, texts that are none."""
    from linid.physics.model import Model
    from linid.physics.motors.registry import MOTORS

    def refuse(fact: str) -> ConfigError:
        return ConfigError(place, fact, _REMEDY)

    texts = (result.model, result.axis, result.input_unit, result.winding, result.law, result.search_check)
    if not all(isinstance(x, str) for x in (*texts, *result.effects, *result.fitted, *result.warnings)):
        raise refuse("holds names that are no text")
    if result.model not in MOTORS:
        raise refuse(f"has the unknown model kind {str(result.model)[:40]!r}")
    if result.axis not in ("linear", "rotary"):
        raise refuse(f"has the unknown axis {str(result.axis)[:40]!r}")
    if not 1 <= result.substeps <= MOST_SUBSTEPS:
        raise refuse(f"has {result.substeps} substeps, expected 1 to {MOST_SUBSTEPS}")
    try:
        known = {p.name: p for p in Model(result.model, result.effects, law=result.law).parameters}
    except LinidError as error:
        raise refuse(f"names effects or a friction law that this linid does not have ({error.fact})") from None
    for estimate in (*result.estimates, *result.derived):
        if not all(isinstance(x, str) for x in (estimate.name, estimate.symbol, estimate.unit, estimate.status)):
            raise refuse("holds an estimate without name, symbol, unit or status")
        parameter = known.get(estimate.name)
        if parameter is None:
            continue
        value = estimate.value
        if (
            not abs(value) <= LARGEST_VALUE
            or (parameter.lower >= 0.0 and value < 0.0)
            or (parameter.log and value == 0.0)
        ):
            raise refuse(f"gives {estimate.name} the value {value:g}, which no axis has")
    if missing := known.keys() - {estimate.name for estimate in result.estimates}:
        raise refuse(f"lacks the parameter {min(missing)}")


def load_model(path: str | Path) -> FitResult:
    """Read a MODEL file; raises ConfigError if it is missing or none."""
    return _result(read_json(path, _REMEDY), str(path))
