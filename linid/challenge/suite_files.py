"""Files of a suite.

SUITE/axis_0001/campaign.yaml, *.csv    what an entrant may see
SUITE/suite.json                        version, groups, campaigns, SHA-256 of every file and of the keys
SUITE/submission.schema.json            what a submission must look like
SUITE/README.md, SUITE/LICENSE          for entrants
SUITE_keys.yaml                         what is hidden, beside the suite
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from linid.challenge.files import CAMPAIGN_FILE
from linid.challenge.submission import submission_schema
from linid.challenge.suite import GROUPS, SUITE_VERSION, SuiteKeys, group_sizes, make_campaigns, write_suite_keys
from linid.challenge.suite_texts import LICENSE, readme
from linid.config import json_text, read_json
from linid.digests import file_digest
from linid.errors import ConfigError, DataError, UsageError

MANIFEST_FILE, SCHEMA_FILE = "suite.json", "submission.schema.json"
README_FILE, LICENSE_FILE = "README.md", "LICENSE"
_REMEDY = "Name the folder that `linid challenge export` wrote."


@dataclass(frozen=True)
class Manifest:
    """What suite.json says. suite: version; seed: None where it is kept with the keys; sizes: campaigns of each group;
    campaigns: their names; files: SHA-256 by path; keys: SHA-256 of the keys file."""

    suite: str
    seed: int | None
    sizes: dict[str, int]
    campaigns: tuple[str, ...]
    files: dict[str, str]
    keys: str


def default_keys(folder: Path) -> Path:
    """Where the keys of a suite in `folder` go: beside it."""
    whole = folder.resolve()
    return whole.with_name(f"{whole.name}_keys.yaml")


def export_suite(
    folder: Path,
    keys_path: Path,
    *,
    seed: int,
    size: int,
    groups: Sequence[str] = tuple(GROUPS),
    secret_seed: bool = False,
    jobs: int = 1,
    progress: Callable[[int, int], None] | None = None,
) -> Manifest:
    """Write a suite into an empty folder and its keys outside of it.

    size: campaigns in all; secret_seed: suite.json does not state the seed, which makes the keys again; jobs: threads.
    Raises UsageError for a folder that holds something, a keys file that exists or would lie in the suite, and for
    groups and sizes that cannot be.
    """
    sizes = group_sizes(size, groups)
    if folder.is_file() or (folder.exists() and any(folder.iterdir())):
        raise UsageError(str(folder), "is not an empty folder", "Name another one.")
    if keys_path.exists():
        raise UsageError(str(keys_path), "exists", "Name another file by --keys.")
    if keys_path.resolve().is_relative_to(folder.resolve()):
        raise UsageError(str(keys_path), "lies in the suite, which entrants get", "Name a file elsewhere by --keys.")
    campaign_groups, keys = make_campaigns(sizes, seed, folder, jobs=jobs, progress=progress)
    campaigns = tuple(keys)
    hashes = file_hashes(folder)
    suite = f"{SUITE_VERSION}-{_digest_of(hashes)[:8]}"
    _write(folder / SCHEMA_FILE, json_text(submission_schema(suite, campaigns)))
    _write(folder / README_FILE, readme(suite, sizes, None if secret_seed else seed))
    _write(folder / LICENSE_FILE, LICENSE)
    write_suite_keys(SuiteKeys(suite, campaign_groups, keys), keys_path, seed=seed)
    hashes |= {name: file_digest(folder / name) for name in (SCHEMA_FILE, README_FILE, LICENSE_FILE)}
    files = dict(sorted(hashes.items()))
    manifest = Manifest(suite, None if secret_seed else seed, sizes, campaigns, files, file_digest(keys_path))
    _write(folder / MANIFEST_FILE, json_text(_body(manifest)))
    return manifest


def file_hashes(folder: Path) -> dict[str, str]:
    """SHA-256 of every file below a folder, by its path in it."""
    found = sorted(path.relative_to(folder).as_posix() for path in folder.rglob("*") if path.is_file())
    return {name: file_digest(folder / name) for name in found}


def read_manifest(folder: Path) -> Manifest:
    """What a suite's suite.json says; raises ConfigError where it cannot be read or is none."""
    path = folder / MANIFEST_FILE
    body = read_json(path, _REMEDY)
    try:
        return Manifest(
            str(body["suite"]),
            body["seed"],
            {str(name): int(group["campaigns"]) for name, group in body["groups"].items()},
            tuple(map(str, body["campaigns"])),
            {str(name): str(digest) for name, digest in body["files"].items()},
            str(body["keys_sha256"]),
        )
    except (KeyError, TypeError, AttributeError, ValueError):
        raise ConfigError(str(path), "is not the manifest of a suite", _REMEDY) from None


def check_files(folder: Path, manifest: Manifest) -> None:
    """Raise DataError where a file of the suite, or a campaign, is missing, changed or more than it lists."""
    for name, digest in manifest.files.items():
        path = folder / name
        if not path.is_file():
            raise DataError(str(path), "of the suite is missing", "Fetch the suite again.")
        if file_digest(path) != digest:
            raise DataError(str(path), "is not what suite.json lists: its SHA-256 differs", "Fetch the suite again.")
    more = {path.parent.name for path in folder.glob(f"axis_*/{CAMPAIGN_FILE}")} - set(manifest.campaigns)
    if more:
        raise DataError(str(folder / min(more)), "is no campaign of the suite", "Remove the folder.")


def check_keys(path: Path, sealed: SuiteKeys, manifest: Manifest) -> None:
    """Raise ConfigError unless the keys, from the file `path`, are those that the suite was sealed with."""
    if sealed.suite != manifest.suite:
        raise ConfigError(str(path), f"holds the keys of {sealed.suite}, not of {manifest.suite}", "Take its own keys.")
    if file_digest(path) != manifest.keys:
        raise ConfigError(str(path), "was changed since the suite was made: its SHA-256 differs", "Take the original.")


def _body(manifest: Manifest) -> dict[str, Any]:
    from importlib.metadata import version

    return {
        "schema": 1,
        "suite": manifest.suite,
        "version": SUITE_VERSION,
        "seed": manifest.seed,
        "linid": version("linid"),
        "license": "CC-BY-4.0",
        "groups": {name: {"campaigns": n, "hidden": GROUPS[name].text} for name, n in manifest.sizes.items()},
        "campaigns": list(manifest.campaigns),
        "keys_sha256": manifest.keys,
        "files": manifest.files,
    }


def _write(path: Path, text: str) -> None:
    path.write_text(text, encoding="utf-8", newline="\n")


def _digest_of(hashes: Mapping[str, str]) -> str:
    return hashlib.sha256("".join(f"{digest}  {name}\n" for name, digest in hashes.items()).encode()).hexdigest()
