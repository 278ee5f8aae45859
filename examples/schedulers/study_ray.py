"""A study in shares on a Ray cluster. All machines see the folder `study`, which `leadlag study plan` made."""
import subprocess

import ray

ray.init()  # address="auto" on a cluster
COUNT = 8


@ray.remote(num_cpus=1)
def share(number: int) -> None:
    words = ["study", "run", "study", "--shard", f"{number}/{COUNT}", "--threads", "1"]
    subprocess.run(["leadlag", *words], check=True)


ray.get([share.remote(number) for number in range(1, COUNT + 1)])
subprocess.run(["leadlag", "study", "merge", "study"], check=True)
