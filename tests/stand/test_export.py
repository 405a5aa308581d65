"""What is written is what was measured: exports, campaign file and truth read back equal."""

from __future__ import annotations

import io
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
import yaml

from linid.errors import ConfigError, DataError, UsageError
from linid.recording.campaign import read_campaign
from linid.recording.recording import Recording
from linid.stand.description import AxisDescription
from linid.stand.export import read_truth, write_campaign
from linid.stand.generate import GeneratedCampaign, generate
from linid.stand.layouts import LAYOUTS
from linid.stand.mode_descriptions import SinePosition
from linid.stand.modes import sine_position

NAMES = ["freewheel_4", "square_current_2"]
REPOSITORY = Path(__file__).resolve().parents[2]


@pytest.fixture(scope="module")
def small(stand: AxisDescription) -> GeneratedCampaign:
    return generate(stand, seed=5, only=NAMES)


def body(text: str, layout: str, mark: str) -> np.ndarray:
    """Time (ms), position (mm) and three currents (A), read by another program than the one that wrote them."""
    separator = "\t" if layout == "twincat" else "," if mark == "." else ";"
    lines = text.splitlines()
    skip = {
        "generic": 1,
        "twincat": next((i for i, line in enumerate(lines) if line.startswith("Unit\t")), 0) + 2,
        "elmo": next((i for i, line in enumerate(lines) if line.startswith("[Data]")), 0) + 2,
        "controldesk": 2,
    }[layout]
    columns = {
        "generic": [0, 1, 2, 3, 4],
        "twincat": [0, 1, 3, 5, 7],
        "elmo": [0, 1, 2, 3, 4],
        "controldesk": [1, 2, 3, 4, 5],
    }[layout]
    frame = pd.read_csv(
        io.StringIO(text), sep=separator, decimal=mark, skiprows=skip, header=None, skip_blank_lines=False
    )
    return frame[columns].to_numpy(dtype=float)


def assert_equal(table: np.ndarray, recording: Recording) -> None:
    assert recording.phase_currents is not None
    np.testing.assert_allclose(table[:, 0] / 1e3, recording.t, rtol=0, atol=1e-15)
    # One rounding of the unit conversion is all that may differ.
    np.testing.assert_allclose(table[:, 1] / 1e3, recording.y, rtol=2.3e-16, atol=0)
    np.testing.assert_array_equal(table[:, 2:].T, recording.phase_currents)


@pytest.mark.parametrize("mark", [".", ","])
@pytest.mark.parametrize("layout", list(LAYOUTS))
def test_every_layout_reads_back_equal(small: GeneratedCampaign, tmp_path: Path, layout: str, mark: str) -> None:
    write_campaign(small, tmp_path, layout, decimal_mark=mark)
    for recording in small.recordings:
        assert_equal(body((tmp_path / f"{recording.name}.csv").read_text(), layout, mark), recording)


@pytest.mark.parametrize("mark", [".", ","])
@pytest.mark.parametrize("layout", list(LAYOUTS))
def test_the_campaign_reader_understands_every_layout(
    small: GeneratedCampaign, tmp_path: Path, layout: str, mark: str
) -> None:
    write_campaign(small, tmp_path, layout, decimal_mark=mark)
    campaign = read_campaign(tmp_path / "campaign.yaml")
    assert campaign.name == "stand"
    for read, written in zip(campaign.recordings, small.recordings, strict=True):
        assert (read.name, read.kind, read.split) == (written.name, written.kind, written.split)
        assert read.added_mass == written.added_mass
        np.testing.assert_allclose(read.t, written.t, rtol=0, atol=1e-12)
        np.testing.assert_allclose(read.y, written.y, rtol=0, atol=1e-12)
        if written.kind == "motor":
            assert read.phase_currents is not None
            assert written.phase_currents is not None
            np.testing.assert_allclose(read.phase_currents, written.phase_currents, rtol=0, atol=1e-12)


def test_unquantised_measurements_are_written_to_a_picometre(stand: AxisDescription, tmp_path: Path) -> None:
    content = stand.model_dump()
    content["measurement"] |= {"position_resolution_m": 0, "current_resolution_a": 0}
    generated = generate(AxisDescription.model_validate(content), seed=1, only=["square_current_1"])
    write_campaign(generated, tmp_path)
    table = body((tmp_path / "square_current_1.csv").read_text(), "generic", ".")
    np.testing.assert_allclose(table[:, 1] / 1e3, generated.recordings[0].y, rtol=0, atol=1e-15)


def test_generic_header_carries_units(small: GeneratedCampaign, tmp_path: Path) -> None:
    write_campaign(small, tmp_path)
    header = (tmp_path / "freewheel_4.csv").read_text().splitlines()[0]
    assert header == ("Time (ms),Actual Position (mm),Phase Current U (A),Phase Current V (A),Phase Current W (A)")


def test_campaign_file_lists_every_recording(small: GeneratedCampaign, tmp_path: Path) -> None:
    write_campaign(small, tmp_path)
    campaign = yaml.safe_load((tmp_path / "campaign.yaml").read_text())
    assert campaign["name"] == "stand"
    assert campaign["recordings"] == [
        {"file": "freewheel_4.csv", "kind": "free_wheel", "split": "fit", "added_mass_kg": 0.5},
        {"file": "square_current_2.csv", "kind": "motor", "split": "held_out", "added_mass_kg": 0},
    ]


@pytest.mark.parametrize("name", ["stand", "yes", "3: x #y", "größe"])
def test_axis_names_survive_the_campaign_file(stand: AxisDescription, tmp_path: Path, name: str) -> None:
    renamed = AxisDescription.model_validate(stand.model_dump() | {"name": name})
    write_campaign(generate(renamed, seed=1, only=["freewheel_1"]), tmp_path)
    assert yaml.safe_load((tmp_path / "campaign.yaml").read_text("utf-8"))["name"] == name


def test_truth_reads_back_equal(small: GeneratedCampaign, tmp_path: Path) -> None:
    write_campaign(small, tmp_path)
    assert read_truth(tmp_path) == small.truth
    assert read_truth(tmp_path / "truth.yaml") == small.truth
    content = yaml.safe_load((tmp_path / "truth.yaml").read_text())
    assert (content["seed"], content["motor"]) == (5, "theta")


def test_nothing_is_overwritten_unasked(small: GeneratedCampaign, tmp_path: Path) -> None:
    write_campaign(small, tmp_path)
    (tmp_path / "freewheel_4.csv").write_text("mine")
    with pytest.raises(UsageError, match="already holds"):
        write_campaign(small, tmp_path)
    assert (tmp_path / "freewheel_4.csv").read_text() == "mine"
    write_campaign(small, tmp_path, overwrite=True)
    assert (tmp_path / "freewheel_4.csv").read_text() != "mine"


def test_bad_requests_are_refused_before_writing(small: GeneratedCampaign, tmp_path: Path) -> None:
    with pytest.raises(UsageError, match="layout"):
        write_campaign(small, tmp_path / "a", "excel")
    with pytest.raises(UsageError, match="decimal mark"):
        write_campaign(small, tmp_path / "a", decimal_mark="'")
    assert not (tmp_path / "a").exists()
    with pytest.raises(DataError, match="cannot be read"):
        read_truth(tmp_path / "truth.yaml")
    (tmp_path / "truth.yaml").write_text("parameters: 3")
    with pytest.raises(ConfigError, match="parameters"):
        read_truth(tmp_path)


def test_the_data_in_the_repository_are_those_of_seed_1(campaign: GeneratedCampaign) -> None:
    folder = REPOSITORY / "data" / "stand"
    assert read_truth(folder) == campaign.truth
    for recording in campaign.recordings:
        table = body((folder / f"{recording.name}.csv").read_text(), "generic", ".")
        motion = campaign.exact[recording.name]
        # Not bit for bit: another processor's rounding may move a quantised value by a step.
        assert np.max(np.abs(table[:, 1] / 1e3 - recording.y)) < 1.5e-7, recording.name
        assert np.max(np.abs(table[:, 2:].T - motion.currents)) < 6 * 3e-3, recording.name
    assert sum(path.stat().st_size for path in folder.iterdir()) < 4_000_000


@pytest.mark.parametrize("layout", list(LAYOUTS))
def test_the_set_position_is_logged_where_the_loop_is_closed(
    stand: AxisDescription, tmp_path: Path, layout: str
) -> None:
    """Read back as `reference`; the following error is the drive's, and recordings without a loop have no column."""
    measurement = stand.measurement.model_copy(update={"log_reference": True})
    described = stand.model_copy(update={"measurement": measurement})
    names = ("sine_position_1", "sine_current_1")
    generated = generate(described, seed=1, only=names)
    write_campaign(generated, tmp_path, layout)
    current, position = read_campaign(tmp_path / "campaign.yaml").recordings
    assert current.reference is None and position.reference is not None
    mode = next(mode for mode in stand.campaign if mode.name == "sine_position_1")
    assert isinstance(mode, SinePosition)
    told = mode.start_position_m + sine_position(mode, position.t)[0]
    np.testing.assert_allclose(position.reference, told, atol=0.51e-7)
    error = position.reference - position.y
    exact = generated.exact["sine_position_1"]
    assert 1e-5 < np.max(np.abs(error)) < 2e-3
    np.testing.assert_allclose(error, told - exact.y, atol=2e-6)
    assert "log_reference" not in (tmp_path / "truth.yaml").read_text(encoding="utf-8")
