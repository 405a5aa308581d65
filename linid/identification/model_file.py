"""The MODEL file `parameters.json`: a FitResult as JSON, every float exact, nothing that hangs on time or threads."""

from __future__ import annotations

import json
import math
from dataclasses import fields
from pathlib import Path
from typing import Any

import numpy as np

from linid.errors import ConfigError
from linid.identification.result import Estimate, FitResult, Generation, Profile, Start

SCHEMA = 1


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
    """The fit result of a MODEL file's text; raises ConfigError with `place` if it is none."""
    try:
        body = json.loads(text)
    except json.JSONDecodeError as error:
        raise ConfigError(
            f"{place}:{error.lineno}", f"is not JSON ({error.msg})", "Give the parameters.json of a fit"
        ) from error
    if not isinstance(body, dict) or body.get("kind") != "linid model":
        raise ConfigError(
            place, "is not a linid model", "Give the parameters.json that fit-friction or fit-motor wrote"
        )
    if body.get("schema") != SCHEMA:
        raise ConfigError(
            place, f"has model schema {body.get('schema')!r}, expected {SCHEMA}", "Fit again with this version"
        )
    try:
        return FitResult(
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
        )
    except (KeyError, TypeError, ValueError) as error:
        raise ConfigError(place, f"is a damaged model file ({error!r})", "Fit again, or restore the file") from error


def load_model(path: str | Path) -> FitResult:
    """Read a MODEL file; raises ConfigError if it is missing or none."""
    path = Path(path)
    try:
        text = path.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        raise ConfigError(str(path), f"cannot be read ({error})", "Give the parameters.json of a fit") from error
    return model_from_text(text, str(path))
