"""inspect from the command line: pictures, proposed campaigns, and what it never writes over."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import pytest
from click.testing import CliRunner

from linid.cli.main import cli
from linid.recording import read_campaign
from linid.recording.checks import HEADER, checks_legend

STAND = Path(__file__).parents[2] / "data" / "stand"


def run(*arguments: object) -> tuple[int, str]:
    """Exit code and output of `linid inspect`."""
    result = CliRunner().invoke(cli, ["inspect", *map(str, arguments)])
    return result.exit_code, result.output


@pytest.fixture
def recordings(tmp_path: Path) -> Path:
    for name in ("freewheel_1", "freewheel_2", "freewheel_3", "moves_1", "moves_2"):
        shutil.copy(STAND / f"{name}.csv", tmp_path / f"{name}.csv")
    shutil.copy(STAND / "moves_1.csv", tmp_path / "moves_1_again.csv")
    (tmp_path / "notes.txt").write_text("not a recording\n", encoding="utf-8")
    return tmp_path


def test_a_proposed_campaign_can_be_read(recordings: Path) -> None:
    campaign = recordings / "campaign.yaml"
    code, output = run(recordings, "--campaign", campaign)
    assert code == 0, output
    assert "NOT USABLE notes.txt" in output
    found = {r.name: r for r in read_campaign(campaign).recordings}
    assert {r.kind for r in found.values()} == {"free_wheel", "motor"} and len(found) == 6
    assert found["moves_1_again"].repeat_of == "moves_1" and found["moves_1_again"].split == "held_out"
    assert found["freewheel_3"].split == "held_out" and found["moves_1"].split == "fit"
    code, output = run(recordings, "--campaign", campaign)
    assert code == 2 and "exists" in output
    assert run(recordings, "--campaign", campaign, "--overwrite")[0] == 0
    code, output = run(recordings, "--campaign", recordings.parent / "elsewhere.yaml")
    assert code == 2 and "beside its recordings" in output


def test_nothing_of_the_user_is_written_over(recordings: Path) -> None:
    file = recordings / "moves_1.csv"
    other = recordings / "mine.yaml"
    other.write_text("channels: {}\n", encoding="utf-8")
    link = recordings / "link.yaml"
    link.symlink_to(file)
    before = file.read_bytes()
    for target in (file, link, other, recordings / "moves_2.csv"):
        for option in ("--mapping", "--plot"):
            code, output = run(file, option, target, "--overwrite")
            assert code == 2 and "stays as it is" in output, output
    assert file.read_bytes() == before and other.read_text(encoding="utf-8") == "channels: {}\n"
    mapping = recordings / "mapping.yaml"
    assert run(file, "--mapping", mapping)[0] == 0 and run(file, "--mapping", mapping)[0] == 2
    assert run(file, "--mapping", mapping, "--overwrite")[0] == 0


def test_a_picture_with_gaps_and_without_a_clock(recordings: Path) -> None:
    lines = (recordings / "moves_1.csv").read_text(encoding="utf-8").splitlines()
    lines[500] = lines[500].replace(lines[500].split(",")[1], "x")
    gapped = recordings / "gapped.csv"
    gapped.write_text("\n".join(lines[:2000] + lines[2100:]), encoding="utf-8")
    picture = recordings / "gapped.png"
    code, output = run(gapped, "--plot", picture)
    assert code == 0 and picture.read_bytes().startswith(b"\x89PNG"), output
    assert "only the longest gap-free part is used" in " ".join(output.split())
    assert run(gapped, "--plot", picture)[0] == 2 and run(gapped, "--plot", picture, "--overwrite")[0] == 0
    bare = recordings / "bare.csv"
    bare.write_text("\n".join(["a,b", *(f"{k},{k % 7}" for k in range(100))]), encoding="utf-8")
    assert run(bare, "--plot", recordings / "bare.png")[0] == 4
    assert (recordings / "bare.png").exists()


def test_what_was_cut_is_said_by_every_command_and_kept_with_the_run(recordings: Path) -> None:
    """A gap of more than ten periods once lost half a recording without a word."""
    lines = (recordings / "freewheel_2.csv").read_text(encoding="utf-8").splitlines()
    (recordings / "freewheel_2.csv").write_text("\n".join(lines[:1300] + lines[1340:]), encoding="utf-8")
    out = recordings / "out"
    arguments = ["fit-friction", *(recordings / f"freewheel_{k}.csv" for k in (1, 2)), "--out", out, "--no-figures"]
    result = CliRunner().invoke(cli, [*map(str, arguments), "--set", "generations=2", "--jobs", "1"])
    assert result.exit_code in (0, 5), result.output
    assert "warning: freewheel_2" in result.output and "were cut off" in result.output
    record = json.loads((out / "run.json").read_text(encoding="utf-8"))
    read = next(one for one in record["inputs"] if one["file"].endswith("freewheel_2.csv"))
    assert read["read"]["cut"] > 100 and read["read"]["gaps"] == 1 and any("longest" in note for note in read["notes"])


def test_the_legend_explains_the_columns_that_are_shown_and_no_others(recordings: Path) -> None:
    """A free wheel has no input that it might follow, a move has no input at its limit."""
    code, output = run(recordings / "freewheel_1.csv")
    table, legend = output[output.index("Recording") :].split("Step, noise:")
    assert code == 0 and "Floor %" in table and "Floor: acceleration" in legend
    for column in ("Follows", "Late", "At limit", "Field"):
        assert column not in table and column not in legend
    code, output = run(recordings / "moves_1.csv")
    words = " ".join(output[output.index("Recording") :].split())
    for column in ("Follows: share", "Step, noise: of", "Field: electrical"):
        assert column in words
    assert "At limit" not in words
    assert checks_legend() == checks_legend(HEADER) and "At limit: of the time." in checks_legend()
