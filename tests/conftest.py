"""What every test needs: no model of the person who runs the tests is ever used."""

from __future__ import annotations

from pathlib import Path

import pytest


@pytest.fixture(autouse=True)
def _no_models(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.delenv("OVITA_MODEL", raising=False)
    monkeypatch.setenv("OVITA_MODELS", str(tmp_path / "models"))
