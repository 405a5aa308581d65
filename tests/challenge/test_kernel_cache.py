"""Machine code of the hidden plant that is kept on disk goes by every function of its kernel."""

from __future__ import annotations

import pytest

from linid.challenge.kernel import friction, integration, motor
from linid.simulation.compiled import fingerprint


@pytest.mark.parametrize(("module", "name"), [(friction, "ELEMENTS"), (motor, "SIXTH"), (integration, "BASE_W")])
def test_the_key_follows_all_files_of_the_kernel(module: object, name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    before = fingerprint(integration.integrate)
    assert before == fingerprint(integration.integrate)
    monkeypatch.setattr(module, name, 77)
    assert fingerprint(integration.integrate) != before
