"""Calibrate on a SLURM cluster: python slurm.py, on a node that may submit jobs and stays while the study runs.

Needs pip install 'repose-explorer[dask]' dask-jobqueue, in an environment that the nodes see under the same path.
"""

import subprocess

from dask_jobqueue import SLURMCluster

STUDY = "sunflower_extract"  # or a file of yours: lentil_study.toml
WORKERS = 100

if __name__ == "__main__":
    # A job is one worker: one pour at a time, in one thread. The first pour of a kind compiles for some seconds.
    with SLURMCluster(
        queue="standard", account="my-project", walltime="02:00:00", cores=1, processes=1, memory="2GB"
    ) as cluster:
        cluster.scale(WORKERS)
        study = ["--study", STUDY, "--profile", "quick", "--out", "results/slurm"]
        scheduler = ["--scheduler", cluster.scheduler_address]
        subprocess.run(["explorer", "calibrate", "--headless", *study, *scheduler], check=True)
