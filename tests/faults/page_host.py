"""What the page does with a study, without its drawing: starts it, presses *Resume* where it stopped, and looks on.

    python -m tests.faults.page_host --out FOLDER --store runs.sqlite [--resume]

`tests.faults.kills` kills this process as it would the page's. It ends with 0 once a study in ``FOLDER`` is finished.
"""

import argparse
import time
from pathlib import Path

from explorer.background.command_process import BackgroundError
from explorer.scene.file import study_path
from explorer.study.process import CalibrationProcess

PROFILE, LOOK = "quick", 0.1
"""Profile of the study; seconds between two looks."""


def main() -> None:
    """Start the study, or go on with the one that an earlier page has started, until it is finished."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--store", type=Path, required=True)
    parser.add_argument("--resume", action="store_true")
    asked = parser.parse_args()
    study = CalibrationProcess(study_path("sunflower_extract"), asked.out, asked.store)
    if not asked.resume or not (study.resumable() or study.finished()):
        study.start(PROFILE)
    while not study.finished() or study.status().alive:
        if study.status().state in ("idle", "failed"):
            try:
                study.resume()
            except BackgroundError as error:
                # The command of a page that was killed is still at work.
                print(error, flush=True)
        time.sleep(LOOK)


if __name__ == "__main__":
    main()
