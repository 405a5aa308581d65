"""The command `field`: from dimensions to files, models that run, and a fit beside its data sheet."""

from __future__ import annotations

import json
import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
import yaml

from linid.design.comparison import against_dimensions
from linid.design.model import designed_model
from linid.identification.derived_quantities import derived_quantities
from linid.identification.fit import fit
from linid.identification.model_file import load_model, model_to_text
from linid.identification.result import FitResult
from linid.identification.settings import FitSettings, SearchSettings
from linid.physics.field.geometry import MotorDesign, design, load_geometry
from linid.physics.theta import Theta0
from linid.report.design import design_tables
from linid.stand.description import ThetaMotor, load_axis_description
from linid.stand.generate import generate
from tests.workflow.small import campaign, linid

CONFIG = Path(__file__).parents[2] / "configs" / "motor_geometry.yaml"
SIZES = (
    "--magnet",
    "24,10,4",
    "--remanence",
    1.25,
    "--gap",
    6.5,
    "--pitch",
    14.15,
    "--coil",
    "30,12.4",
    "--turns",
    110,
    "--phase-spacing",
    9.4333,
)


@pytest.fixture(scope="module")
def made() -> MotorDesign:
    return design(load_geometry(CONFIG))


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("field") / "out"
    result = linid("field", CONFIG, "--out", out)
    assert result.exit_code == 0, result.stderr
    assert "sine force constant" in result.stdout and "Halbach" in result.stdout
    return out


def test_the_files_hold_one_motor(folder: Path, made: MotorDesign) -> None:
    data = json.loads((folder / "field.json").read_text(encoding="utf-8"))
    assert data["k"] == pytest.approx(made.k) and data["theta"] == pytest.approx(made.theta)
    assert data["sine_scope"]["limit_k"] == pytest.approx(0.46223, abs=5e-6)
    parameters = pd.read_csv(folder / "parameters.csv").set_index(["model", "name"])["value"]
    assert parameters["theta", "nome"] == pytest.approx(made.nome)
    guideway = pd.read_csv(folder / "guideway_field.csv")
    assert np.allclose(guideway["exact_t"][:101], -guideway["exact_t"][100:], atol=1e-9)  # a pole pitch turns the sign
    thrust = pd.read_csv(folder / "thrust.csv")
    first = 2.0 * np.mean(thrust["exact_n_per_a"][:-1] * np.sin(np.pi * thrust["y_m"][:-1] / made.geometry.pole_pitch))
    assert first == pytest.approx(made.exact[1], rel=1e-6)
    numbers = pd.read_csv(folder / "best_k.csv").set_index("N")["k_N"]
    assert numbers[100] == pytest.approx(0.44892, abs=5e-6)
    drawn = {path.stem for path in (folder / "figures").glob("*.png")}
    assert drawn == {"guideway", "sine_scope", "sine_cost", "theta3", "field_shapes", "magnet_pair", "thrust"}


def test_the_designed_models_run(folder: Path, made: MotorDesign, tmp_path: Path) -> None:
    for kind in ("sine", "theta"):
        model = load_model(folder / f"model_{kind}.json")
        assert model.value("mass") == 0.588 and model.value("coulomb_force") == 1.72
        assert {e.status for e in model.estimates} == {"fixed"}
    assert load_model(folder / "model_sine.json").value("force_constant") == pytest.approx(made.exact[1])
    file = campaign(tmp_path, motor=True)
    result = linid("simulate", folder / "model_theta.json", file, "--out", tmp_path / "run", "--no-figures")
    assert result.exit_code == 0, result.stderr


def test_options_are_a_geometry_and_override_a_file(tmp_path: Path) -> None:
    result = linid("field", *SIZES, "--out", tmp_path / "a", "--no-figures", "--json")
    assert result.exit_code == 0, result.stderr
    by_options = json.loads(result.stdout)
    sizes = {
        "name": "motor",
        "magnet": {"width_mm": 24, "length_mm": 10, "thickness_mm": 4, "remanence_t": 1.25},
        "air_gap_mm": 6.5,
        "pole_pitch_mm": 14.15,
        "coil": {"width_mm": 30, "length_mm": 12.4, "turns": 55},
        "phase_spacing_mm": 9.4333,
    }
    (tmp_path / "motor.yaml").write_text(yaml.safe_dump(sizes), encoding="utf-8")
    result = linid("field", tmp_path / "motor.yaml", "--turns", 110, "--out", tmp_path / "b", "--no-figures", "--json")
    by_file = json.loads(result.stdout)
    assert by_file["theta"] == by_options["theta"] and by_file["models"] == []


def test_without_dimensions_it_judges_a_k(tmp_path: Path) -> None:
    result = linid("field", "--k", 0.42, "--out", tmp_path / "k", "--json", "--no-figures")
    data = json.loads(result.stdout)
    assert data["sine_cost"]["k"] == 0.42 and "theta" in data["sine_cost"]["advice"] and "geometry" not in data
    result = linid("field", "--out", tmp_path / "none", "--no-figures")
    assert result.exit_code == 0 and "0.46223" in result.stdout


@pytest.mark.parametrize(
    ("arguments", "fact"),
    [
        (("--gap", 5), "--magnet"),
        (("--magnet", "24,10"), "expected 3 numbers"),
        (("--k", -1), "must be above zero"),
        ((CONFIG, "--pitch", 8), "overlap"),
        (("nowhere.yaml",), "file not found"),
    ],
)
def test_what_is_wrong_is_said(arguments: tuple[object, ...], fact: str, tmp_path: Path) -> None:
    result = linid("field", *arguments, "--out", tmp_path / "out")
    assert result.exit_code in (2, 3) and fact in result.stderr
    assert not (tmp_path / "out").exists()


def fitted(made: MotorDesign, values: dict[str, float], spread: float) -> FitResult:
    """A theta fit with these motor values and relative standard deviations."""
    values = {name: value for name, value in values.items() if value != 0.0}
    given = {**made.geometry.friction.values, "mass": 0.588}  # type: ignore[union-attr]
    bare = designed_model(made, "theta", given)
    estimates = tuple(
        replace(e, value=values.get(e.name, e.value), status="fitted" if e.name in values else "fixed")
        for e in bare.estimates
    )
    names = tuple(values)
    covariance = np.diag([(spread * values[name]) ** 2 for name in names])
    return replace(bare, estimates=estimates, fitted=names, covariance=covariance, correlation=np.eye(len(names)))


def derived(result: FitResult) -> FitResult:
    """The fit with intervals and what follows from them."""
    told = replace(
        result,
        estimates=tuple(
            replace(e, std=0.01 * abs(e.value), low=e.value - 0.02 * abs(e.value), high=e.value + 0.02 * abs(e.value))
            if e.status == "fitted"
            else e
            for e in result.estimates
        ),
    )
    return replace(told, derived=derived_quantities(told, ()))


def test_a_fit_agrees_with_the_dimensions_it_came_from(made: MotorDesign) -> None:
    result = derived(fitted(made, dict(made.matched), 0.01))
    rows = {row.name: row for row in against_dimensions(result, made)}
    assert set(rows) == {"pole_pitch", "phase_spacing", "coil_length", "field_shape", "fundamental_force_constant"}
    assert all(row.agrees for row in rows.values()), rows
    assert rows["coil_length"].identified == pytest.approx(0.012396)
    wrong = derived(
        fitted(made, {**made.matched, "electrical_wavenumber": 1.2 * made.matched["electrical_wavenumber"]}, 0.01)
    )
    rows = {row.name: row for row in against_dimensions(wrong, made)}
    assert rows["pole_pitch"].agrees is False


def test_equivalent_values_are_no_disagreement(made: MotorDesign) -> None:
    """A coil longer than a pole pitch by as much as it is shorter, phases counted backwards, poles exchanged."""
    alias = dict(made.matched)
    alias["winding_length"] = 0.5 * math.pi - alias["winding_length"]
    alias["winding_displacement"] = math.pi - alias["winding_displacement"]
    alias["force_constant"] = -alias["force_constant"]
    rows = {row.name: row for row in against_dimensions(derived(fitted(made, alias, 0.01)), made)}
    assert all(row.agrees for row in rows.values()), rows
    assert "equivalent" in rows["coil_length"].note


def test_what_a_fit_could_not_tell_is_not_judged(made: MotorDesign) -> None:
    result = derived(fitted(made, dict(made.matched), 0.01))
    lost = tuple(
        replace(e, status="not_identifiable", note="hangs on nome") if e.name == "field_shape" else e
        for e in result.derived
    )
    row = next(r for r in against_dimensions(replace(result, derived=lost), made) if r.name == "field_shape")
    assert row.agrees is None and row.note == "hangs on nome"


def test_a_fit_is_laid_beside_the_dimensions(made: MotorDesign, tmp_path: Path) -> None:
    model = tmp_path / "fit.json"
    model.write_text(model_to_text(derived(fitted(made, dict(made.matched), 0.01))), encoding="utf-8")
    result = linid("field", CONFIG, "--model", model, "--out", tmp_path / "out", "--set-nothing")
    assert result.exit_code == 2
    result = linid("field", CONFIG, "--model", model, "--out", tmp_path / "out")
    assert result.exit_code == 0, result.stderr
    data = json.loads((tmp_path / "out" / "field.json").read_text(encoding="utf-8"))
    assert {row["name"] for row in data["identified"]} >= {"pole_pitch", "field_shape"}
    assert "Recording beside dimensions" in result.stdout


def test_the_stand_s_motor_is_that_of_the_example_magnets(made: MotorDesign) -> None:
    """First and third harmonic; the nome hangs on the hundredths of a millimetre of the magnets."""
    motor = load_axis_description(CONFIG.parent / "stand_axis.yaml").motor
    assert motor.kind == "theta"
    assert made.matched["electrical_wavenumber"] == pytest.approx(motor.electrical_wavenumber_per_m, rel=1e-4)
    assert made.matched["winding_displacement"] == pytest.approx(motor.winding_displacement_rad, rel=1e-4)
    assert made.matched["winding_length"] == pytest.approx(motor.winding_length_rad, rel=1e-4)
    assert made.matched["nome"] == pytest.approx(motor.nome, rel=2e-3)
    assert made.exact[1] == pytest.approx(30.0, rel=1e-3)
    assert made.matched_k == pytest.approx(0.535, abs=1e-3) and made.k == pytest.approx(0.337, abs=1e-3)


def test_thrust_and_back_emf_by_integration_are_the_theta_model_s(made: MotorDesign) -> None:
    for share in (0.2, 0.5):
        y = share * made.geometry.pole_pitch
        closed = made.theta["force_constant"] * Theta0(
            made.theta["electrical_wavenumber"] * y, made.theta["nome"], made.theta["winding_length"]
        )
        assert made.integrated(y) == pytest.approx((closed, closed), rel=1e-6)


def test_both_ratios_k_are_named(folder: Path, made: MotorDesign) -> None:
    data = json.loads((folder / "field.json").read_text(encoding="utf-8"))
    assert data["k_matched"] == pytest.approx(made.matched_k)
    said = " ".join(str(table) for table in design_tables(made, made.k, (), True))
    assert f"{made.k:.4g} is that of the Gaussian" in said and f"{made.matched_k:.4g} is that of the guideway" in said
    assert "from 0.46223" not in said  # the exact field has the say where there are dimensions


def test_from_magnets_to_recordings_and_back(made: MotorDesign, tmp_path: Path) -> None:
    """The designed motor in the stand, its recordings, their fit, and that beside the dimensions it began with."""
    described = load_axis_description(CONFIG.parent / "stand_axis.yaml")
    found = made.matched
    motor = ThetaMotor(
        kind="theta",
        force_constant_n_per_a=found["force_constant"],
        electrical_wavenumber_per_m=found["electrical_wavenumber"],
        winding_displacement_rad=found["winding_displacement"],
        commutation_offset_rad=0.3,
        winding_length_rad=found["winding_length"],
        nome=found["nome"],
    )
    names = ("freewheel_2", "freewheel_4", "freewheel_5", "sine_position_1", "moves_1")
    campaign = generate(described.model_copy(update={"motor": motor}), seed=1, only=names)
    settings = FitSettings(search=SearchSettings(population=16, generations=2), jobs=2)
    model = tmp_path / "fit.json"
    model.write_text(model_to_text(fit("theta", campaign.recordings, settings=settings)), encoding="utf-8")
    result = linid("field", CONFIG, "--model", model, "--out", tmp_path / "out", "--no-figures", "--json")
    assert result.exit_code == 0, result.stderr
    rows = {row["name"]: row for row in json.loads(result.stdout)["identified"]}
    for name in ("pole_pitch", "phase_spacing", "fundamental_force_constant"):
        assert rows[name]["agrees"] is True, rows[name]
        assert rows[name]["high"] - rows[name]["low"] < 0.05 * rows[name]["by_dimensions"]
    assert not [name for name in ("coil_length", "field_shape") if rows[name]["agrees"] is False], rows
