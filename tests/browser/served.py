"""`explorer serve` as a user starts it, for browsers to come to."""

import os
import re
import shutil
import subprocess
import sys
from contextlib import contextmanager
from pathlib import Path

EXAMPLE = Path(__file__).parents[2] / "examples" / "trefoil_2"
"""A finished diagnosis."""


def diagnosed(data):
    """The finished diagnosis of ``EXAMPLE`` among the user's data; its folder."""
    folder = Path(data) / "repose-explorer" / "diagnoses" / "trefoil_2-20260101-000000"
    folder.mkdir(parents=True)
    shutil.copy(EXAMPLE / "diagnosis.json", folder)
    return folder


@contextmanager
def served(*arguments, data=None, kernels=None, patience=20.0):
    """Address of a page of ``explorer serve`` with ``arguments``; it has to end well within ``patience`` [s].

    ``data`` stands in for the folder of the user's data, ``kernels`` for that of compiled ones.
    """
    folders = {"XDG_DATA_HOME": data, "TI_OFFLINE_CACHE_FILE_PATH": kernels}
    server = subprocess.Popen(
        [sys.executable, "-m", "explorer", "serve", "--port", "0", *map(str, arguments)],
        stdout=subprocess.PIPE,
        text=True,
        env=os.environ | {name: str(folder) for name, folder in folders.items() if folder is not None},
    )
    try:
        found = re.search(r"http://\S+", server.stdout.readline())
        assert found, "the server did not tell its address"
        yield found[0]
    finally:
        server.terminate()
        assert server.wait(patience) == 0
