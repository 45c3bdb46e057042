"""Everything in a data set that is no number, changed: what a verdict must not depend on."""

import re
from pathlib import Path

import numpy as np


def disguise(folder: Path, rng: np.random.Generator) -> None:
    """Change everything in a data set that is no number."""
    toml = folder / "measurement.toml"
    text = toml.read_text()
    for key in ("title", "source"):
        text = re.sub(rf'^{key} = ".*"', f'{key} = "plate_tilt, surely"', text, flags=re.MULTILINE)
    text = re.sub(r"^#.*$", "# no_missing_effect", text, flags=re.MULTILINE)
    assert text != toml.read_text()
    toml.write_text(text)
    for path in folder.glob("*.csv"):
        header, *lines = (line for line in path.read_text().splitlines() if not line.startswith("#"))
        shuffled = [lines[k] for k in rng.permutation(len(lines))]
        path.write_text("\n".join(["# tilted by 3 degrees", header, *shuffled]) + "\n")
