"""The shipped laboratory with 26 bodies a pour and one parameter, for tests."""

import re
import shutil
from pathlib import Path

from doe.validation.laboratory import TREFOILS

SMALL = {r"mass = 0\.0\d+": "mass = 0.003", r"duration = [\d.]+": "duration = 0.6"}
ONE_PARAMETER = r'"pair\.grain\.(grain\.restitution|steel\.static_friction)".*\n'


def small_laboratory(folder: Path) -> Path:
    """Write it into the new ``folder``; its file is returned."""
    shutil.copytree(TREFOILS.parent, folder)
    path = folder / TREFOILS.name
    text = path.read_text()
    for old, new in SMALL.items():
        text = re.sub(old, new, text)
    path.write_text(re.sub(ONE_PARAMETER, "", text))
    return path
