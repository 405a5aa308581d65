"""`learned` and other short names of own terms in fits: taken from a model, or sought in the recordings, and held."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

import linid
from linid.cli.main import cli
from linid.diagnosis.base import numbered
from linid.diagnosis.laws import try_laws
from linid.diagnosis.means import Means
from linid.interface.own_terms import LEARNED, _fitted, with_terms
from linid.interface.settings import make_settings
from linid.interface.stages import stages_of
from linid.physics.effects.registry import find_effect
from linid.report.tables import formula_notes, parameter_csv, parameter_table_console, table_text
from tests.diagnosis.test_controls import coast_downs

DRAG = 6.0  # N s^2/m^2


@pytest.fixture(scope="module")
def dragged() -> linid.Campaign:
    """Free wheels with an air drag."""
    return linid.Campaign.of(coast_downs("quadratic_drag", {"drag_coefficient": DRAG}, 1.5))


@pytest.fixture(scope="module")
def found(dragged: linid.Campaign) -> linid.Fit:
    """Their friction with the term that they ask for."""
    return linid.fit(dragged, "friction", effects=[LEARNED], generations=20)


def ahead(fit: linid.Fit, campaign: linid.Campaign) -> float:
    """Mean error 0.1 s ahead on held-out recordings in m."""
    return float(np.mean([gap.ahead for gap in linid.validate(fit, campaign.held_out, among=campaign).gaps]))


def plain_names(fit: linid.Fit) -> list[str]:
    """Names of what a fit has found beside its terms."""
    return [name for name in fit.result.fitted if not name.startswith(LEARNED)]


def test_the_term_that_recordings_ask_for_is_found_and_held(dragged: linid.Campaign, found: linid.Fit) -> None:
    (effect,) = map(find_effect, found.result.effects)
    assert effect.own.name == LEARNED and effect.own.variables == {"v"}
    ratios = np.array([found[p.name].value for p in effect.parameters]) / np.array(
        [found.result.settings["proportions"][p.name] for p in effect.parameters]
    )
    assert np.ptp(ratios) < 1e-9 and 0.25 < ratios[0] < 4.0
    assert len(found.result.fitted) == 1 + len(plain_names(found))
    plain = linid.fit(dragged, "friction", generations=20)
    assert ahead(found, dragged) < 0.5 * ahead(plain, dragged)


def test_nothing_is_fitted_where_nothing_is_asked_for() -> None:
    campaign = linid.Campaign.of(coast_downs("constant_force", {"constant_force": 0.0}, 0.6))
    with pytest.raises(linid.UsageError, match=r"--effect learned: .*no term.*model_after\.json"):
        linid.fit(campaign, "friction", effects=[LEARNED])
    few = linid.Campaign.of([replace(r, split="fit") for r in campaign.recordings[:3]])
    with pytest.raises(linid.UsageError, match="too few recordings"):
        linid.fit(few, "friction", effects=[LEARNED])


def test_a_term_is_sought_beside_the_law_that_is_named(dragged: linid.Campaign) -> None:
    """The base under that law is fitted to the same recordings, and is no worse than the law's first values."""
    recordings, means = numbered(dragged.recordings), Means(seed=1)
    lugre, _ = _fitted(recordings, "friction", make_settings({}), {}, "lugre", means)
    dahl, step = _fitted(recordings, "friction", make_settings({}), {}, "dahl", means)
    assert (lugre.fitted.model.law, dahl.fitted.model.law, step.model.law) == ("lugre", "dahl", "dahl")
    (trial,) = (one for one in try_laws(lugre.judge, lugre.fitted) if one.law == "dahl")
    assert dahl.fitted.level <= trial.fitted.level + 1e-6 * abs(trial.fitted.level)


def test_a_model_gives_its_term(dragged: linid.Campaign, found: linid.Fit, tmp_path: Path) -> None:
    """By its short name, with its coefficients, whatever it is called; a value of the user's stands above them."""
    settings = with_terms(dragged, make_settings({"effects": [LEARNED]}), "friction", found.result)
    assert settings.effects == found.result.effects
    values = {p.name: found[p.name].value for p in find_effect(settings.effects[0]).parameters}
    assert settings.proportions == values and settings.known == {}
    held = with_terms(dragged, make_settings({"effects": [LEARNED], "known": values}), "friction", found.result)
    (task,) = (stage.task for stage in stages_of(dragged, held, "friction", found.result))
    assert not set(task.free_names()) & set(values)
    hump = linid.fit(dragged, "friction", effects={"hump": "-c*v*abs(v)"}, generations=20)
    again = linid.fit(dragged, "friction", start=linid.load(hump.save(tmp_path / "hump.json")), effects=["hump"])
    assert again.result.effects == ("hump: -c * v * abs(v)",)
    # It begins there. (The value itself goes on moving: these coast-downs hardly tell forces from the mass.)
    assert again.result.history[-1].best <= hump.result.history[-1].best


def test_other_names_stay_as_they_are(dragged: linid.Campaign) -> None:
    plain = make_settings({"effects": ["constant_force", "hump: -c*v*abs(v)"]})
    assert with_terms(dragged, plain, "friction") is plain
    with pytest.raises(linid.UsageError, match="there is no effect 'hump'"):
        linid.fit(dragged, "friction", effects=["hump"])


def test_tables_give_the_term_one_line(found: linid.Fit) -> None:
    (effect,) = map(find_effect, found.result.effects)
    text = table_text(parameter_table_console(found.result), 400)
    (note,) = formula_notes(found.result)
    assert " ".join(note.split()) in " ".join(text.split())
    assert note.startswith(f"learned = {effect.own.formula} in N; learned_1 to 20 (their ratios are held, their size")
    assert "learned_2" not in text
    assert parameter_csv(found.result).count("\nlearned_") == len(effect.parameters)


def test_a_term_of_the_motor_force_waits_for_the_motor(dragged: linid.Campaign) -> None:
    """The friction fit before a motor's leaves it out, and the names of its coefficients with it."""
    runs = [replace(r, name=f"run_{k}", kind="motor", drive_input=np.ones(r.t.size)) for k, r in enumerate(dragged)]
    both = linid.Campaign.of([*dragged, *runs])
    settings = make_settings({"effects": ["grip: -c*abs(F)*sign(v)"], "known": {"grip_c": 0.1}})
    friction, motor = stages_of(both, settings, "force")
    assert friction.task.settings.effects == () and "grip_c" not in friction.task.known
    assert motor.task.settings.effects == settings.effects and motor.task.known["grip_c"] == 0.1


def test_the_command_takes_a_diagnosis_model(dragged: linid.Campaign, found: linid.Fit, tmp_path: Path) -> None:
    lines = ["recordings:"]
    for recording in dragged:
        rows = np.column_stack([recording.t, recording.y])
        np.savetxt(tmp_path / f"{recording.name}.csv", rows, "%.9f", ",", header="time [s],position [m]", comments="")
        lines.append(f"  - {{file: {recording.name}.csv, kind: free_wheel, split: {recording.split}, ")
        lines[-1] += f"added_mass_kg: {recording.added_mass}}}"
    (tmp_path / "campaign.yaml").write_text("\n".join([*lines, ""]), encoding="utf-8")
    model = found.save(tmp_path / "model_after.json")
    command = ["fit-friction", "--effect", LEARNED, "--friction", str(model), "--no-figures", "--dry-run", "--json"]
    command += ["--set", "find_coast_down=false"]
    done = CliRunner().invoke(cli, [*command, str(tmp_path / "campaign.yaml")])
    assert done.exit_code == 0, done.output
    assert found.result.effects[0] in done.output
