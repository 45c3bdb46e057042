"""The example of a SLURM cluster, run as it is written, with workers of this machine in the place of the cluster's."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

EXAMPLE = Path(__file__).parents[3] / "examples/dask/slurm.py"
STAND_IN = """
from distributed import LocalCluster

def SLURMCluster(queue, account, walltime, cores, processes, memory):
    assert (cores, processes) == (1, 1)
    return LocalCluster(n_workers=1, threads_per_worker=1, dashboard_address=None)
"""


@pytest.mark.slow
def test_the_slurm_example_calibrates(tmp_path):
    (tmp_path / "dask_jobqueue.py").write_text(STAND_IN, encoding="utf-8")
    script = EXAMPLE.read_text(encoding="utf-8").replace("WORKERS = 100", "WORKERS = 2")
    (tmp_path / "slurm.py").write_text(script, encoding="utf-8")
    path = f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"
    environment = os.environ | {"PATH": path, "REPOSE_STORE": str(tmp_path / "pours.sqlite")}
    done = subprocess.run(
        [sys.executable, "slurm.py"], cwd=tmp_path, env=environment, capture_output=True, text=True, timeout=3600
    )
    assert done.returncode == 0, done.stderr
    assert (tmp_path / "results/slurm/result.json").is_file()
