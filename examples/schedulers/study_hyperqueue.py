"""A study in shares on HyperQueue. This starts a server and a worker here; with a running server, use `Client` instead of `LocalCluster`."""
from pathlib import Path

from hyperqueue import Job, LocalCluster

COUNT = 8
with LocalCluster() as cluster:
    cluster.start_worker()
    job, here = Job(), Path.cwd()
    words = ["leadlag", "study", "run", "study", "--threads", "1", "--shard"]
    shares = [job.program([*words, f"{k}/{COUNT}"], cwd=here) for k in range(1, COUNT + 1)]
    job.program(["leadlag", "study", "merge", "study"], deps=shares, cwd=here)
    client = cluster.client()
    client.wait_for_jobs([client.submit(job)])
