"""Calibrate on Kubernetes: python kubernetes.py, where kubectl reaches a cluster that has Dask's operator.

Needs pip install 'repose-explorer[dask]' dask-kubernetes, and an image that has the same version of this program:

    FROM python:3.12-slim
    RUN apt-get update && apt-get install -y --no-install-recommends libx11-6
    RUN pip install 'repose-explorer[dask]'
"""

import subprocess

from dask_kubernetes.operator import KubeCluster

IMAGE = "registry.example.org/repose-explorer:0.1.0"
STUDY = "sunflower_extract"  # or a file of yours: lentil_study.toml
WORKERS = 100
COMMAND = ["dask", "worker", "--nthreads", "1"]

if __name__ == "__main__":
    one_core = {"requests": {"cpu": "1", "memory": "2Gi"}, "limits": {"cpu": "1", "memory": "2Gi"}}
    with KubeCluster(
        name="repose", image=IMAGE, n_workers=WORKERS, resources=one_core, worker_command=COMMAND
    ) as cluster:
        study = ["--study", STUDY, "--profile", "quick", "--out", "results/kubernetes"]
        scheduler = ["--scheduler", cluster.scheduler_address]
        subprocess.run(["explorer", "calibrate", "--headless", *study, *scheduler], check=True)
