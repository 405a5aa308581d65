"""Campaign files."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from linid.errors import ConfigError, DataError
from linid.recording import in_order, is_campaign, read_campaign

from .exports import Y, lines, write


def campaign(folder: Path, text: str) -> Path:
    for name in ("a.csv", "b.csv"):
        write(folder, lines(), name=name)
    path = folder / "campaign.yaml"
    path.write_text(text)
    return path


def error_of(folder: Path, text: str, *parts: str) -> None:
    with pytest.raises(ConfigError) as caught:
        read_campaign(campaign(folder, text))
    assert caught.value.exit_code == 3
    for part in ("campaign.yaml", *parts):
        assert part in str(caught.value), str(caught.value)


def test_is_campaign() -> None:
    assert is_campaign("x/campaign.yaml") and is_campaign(Path("A.YML")) and not is_campaign("a.csv")


def test_complete_campaign(tmp_path: Path) -> None:
    text = """
name: stage
axis: linear
known: {force_constant: 12, viscous: 1e-3}
comments: measured warm
recordings:
  - {file: a.csv, kind: motor, split: fit, added_mass_kg: 0.5, window: [0.05, 0.15], comments: [one, two]}
  - file: a.csv
    window: [0, 1e-1]
  - {file: b.csv, split: held_out}
"""
    read = read_campaign(campaign(tmp_path, text))
    assert (read.name, read.axis, read.known) == ("stage", "linear", {"force_constant": 12.0, "viscous": 1e-3})
    assert [r.name for r in read.recordings] == ["a", "a_2", "b"]
    first, second, third = read.recordings
    assert (first.kind, first.split, first.added_mass, len(first.t)) == ("motor", "fit", 0.5, 101)
    assert second.t[-1] == pytest.approx(0.1) and third.split == "held_out"
    np.testing.assert_allclose(third.y, Y, atol=1e-7)
    assert read.of(split="held_out") == (third,)


def test_name_defaults_to_the_folder(tmp_path: Path) -> None:
    assert read_campaign(campaign(tmp_path, "recordings: [{file: a.csv}]")).name == tmp_path.name


def test_channels_are_shared_and_overridden(tmp_path: Path) -> None:
    text = """
channels:
  position: {column: Actual Position, unit: um}
  current_q: Phase Current U
recordings:
  - {file: a.csv}
  - {file: b.csv, channels: {position: {column: Actual Position, unit: m, scale: 1e-3}}}
"""
    first, second = read_campaign(campaign(tmp_path, text)).recordings
    np.testing.assert_allclose(first.y, 1e-3 * Y, atol=1e-9)
    np.testing.assert_allclose(second.y, Y, atol=1e-6)
    assert first.drive_input is not None and second.drive_input is not None


def test_rotary_takes_inertia(tmp_path: Path) -> None:
    mapping = "axis: rotary\nchannels: {position: {column: Actual Position, unit: deg}}\n"
    text = mapping + "recordings: [{file: a.csv, added_inertia_kg_m2: 1e-4}]"
    assert read_campaign(campaign(tmp_path, text)).recordings[0].added_mass == 1e-4
    error_of(tmp_path, mapping + "recordings:\n  - {file: a.csv, added_mass_kg: 1}", "line 4", "added_inertia_kg_m2")
    error_of(tmp_path, "recordings:\n  - {file: a.csv, added_inertia_kg_m2: 1}", "line 2", "added_mass_kg")


def test_unknown_keys(tmp_path: Path) -> None:
    error_of(tmp_path, "recordings:\n - {file: a.csv}\nchanels: {}\n", "line 3", "Did you mean 'channels'?")
    error_of(tmp_path, "recordings:\n - file: a.csv\n   spilt: fit\n", "line 3", "Did you mean 'split'?")
    text = "channels:\n  position: {column: A, unti: mm}\nrecordings: [{file: a.csv}]\n"
    error_of(tmp_path, text, "line 2", "'channels.position.unti'", "Did you mean 'unit'?")


def test_wrong_values(tmp_path: Path) -> None:
    error_of(tmp_path, "recordings:\n - {file: a.csv, kind: driven}\n", "line 2", "'driven'", "'motor'")
    error_of(tmp_path, "recordings:\n - {file: a.csv, added_mass_kg: -1}\n", "line 2", "-1")
    error_of(tmp_path, "recordings:\n - {file: a.csv, window: [3]}\n", "line 2", "window")
    error_of(tmp_path, "recordings:\n - {file: a.csv, window: [3, 1]}\n", "line 2", "ends before it starts")
    error_of(tmp_path, "known: {force_constant: big}\nrecordings: [{file: a.csv}]", "line 1", "'big'")
    error_of(tmp_path, "axis: round\nrecordings: [{file: a.csv}]", "line 1", "'round'", "'rotary'")
    error_of(tmp_path, "channels: {period: 3 mm}\nrecordings: [{file: a.csv}]", "line 1", "not a time")
    error_of(tmp_path, "name: x\nrecordings: []\n", "line 2", "recordings")
    error_of(tmp_path, "name: x\n", "'recordings' is missing")


def test_files_missing_or_listed_twice(tmp_path: Path) -> None:
    error_of(tmp_path, "recordings:\n - {file: a.csv}\n - {file: bb.csv}\n", "line 3", "not found", "'b.csv'")
    error_of(tmp_path, "recordings:\n - {file: a.csv}\n - {file: ./a.csv}\n", "line 3", "listed twice", "line 2")


def test_bad_recording_is_a_data_error(tmp_path: Path) -> None:
    path = campaign(tmp_path, "recordings: [{file: c.csv}]")
    write(tmp_path, b"", name="c.csv")
    with pytest.raises(DataError, match=r"c\.csv: the file is empty"):
        read_campaign(path)


def test_repeats_name_the_first_recording_of_their_command(tmp_path: Path) -> None:
    rows = "{file: a.csv, window: [0.0, 0.1]}, {file: b.csv, repeat_of: a.csv}, {file: a.csv, repeat_of: b.csv}"
    read = read_campaign(campaign(tmp_path, f"recordings: [{rows}]"))
    assert [r.repeat_of for r in read.recordings] == ["", "a", "a"]
    error_of(tmp_path, "recordings: [{file: a.csv, repeat_of: b.csv}, {file: b.csv}]", "repeat_of", "no earlier entry")
    mixed = "{file: a.csv, kind: motor}, {file: b.csv, kind: free_wheel, repeat_of: a.csv}"
    error_of(tmp_path, f"recordings: [{mixed}]", "repeat_of", "another kind")


def test_recordings_are_numbered_and_carry_the_running_time(tmp_path: Path) -> None:
    """elapsed + t runs on through the campaign, also for recordings whose clock does not start at 0."""
    text = "recordings:\n  - {file: a.csv, window: [0.05, 0.15]}\n  - {file: b.csv, window: [0.02, 0.12]}\n"
    first, second = read_campaign(campaign(tmp_path, text)).recordings
    assert (first.number, second.number) == (1, 2)
    assert first.elapsed + first.t[0] == pytest.approx(0.0, abs=1e-12)
    assert second.elapsed + second.t[0] == pytest.approx(first.duration, abs=1e-12)
    assert in_order([second, first])[1].number == 2
