"""The MODEL file of an earlier result, which may be named by its folder."""

from __future__ import annotations

from pathlib import Path

from linid.errors import ConfigError
from linid.report.result_files import MODEL_AFTER, MODEL_FILE


def model_path(path: Path, place: str) -> Path:
    """A MODEL file itself, or that of a folder which a fit or a diagnosis has made; raises ConfigError, naming the
    place, where there is none.
    """
    if not path.is_dir():
        return path
    for name in (MODEL_FILE, MODEL_AFTER):
        if (path / name).is_file():
            return path / name
    raise ConfigError(
        place,
        f"folder {str(path)!r} holds no {MODEL_FILE} and no {MODEL_AFTER}",
        "Name the folder of a finished fit or diagnosis, or a MODEL.json.",
    )
