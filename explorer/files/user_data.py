"""Where the page keeps what a person made with it."""

from __future__ import annotations

from pathlib import Path

from platformdirs import user_data_path


def data_folder() -> Path:
    """Folder of this user's studies, diagnoses, presets, uploads and recordings."""
    return user_data_path("repose-explorer")
