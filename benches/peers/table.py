"""One table from the output of run.sh: medians over all rounds, and how many times faster leadlag's lanes and, where there is a GPU, its
`gpu` are. CPU time is meaningless on a GPU, so its ratio is of wall times."""

import json
import statistics
import sys


def main():
    rounds = [json.loads(line) for line in open(sys.argv[1])]
    found, versions, worst = {}, {}, {}

    def add(name, precision, population, steps, cpu_s, wall_s):
        times = found.setdefault((name, precision, population), ([], []))
        # CPU time may be 0 while a GPU computes.
        times[0].extend(population * steps / 1e6 / max(x, 1e-9) for x in cpu_s)
        times[1].extend(population * steps / 1e6 / x for x in wall_s)

    on_device = set()
    for entry in rounds:
        for row in entry.get("rows", []):
            if row["model_id"] == 1:
                key = (f"leadlag {row['evaluator']}", row["precision"], row["population"])
                add(*key, row["steps"], row["cpu_s"], row["wall_s"])
                if row["core_second_of"] == "device":
                    on_device.add(key[0])
        if "peer" in entry:
            if entry["on_gpu"]:
                on_device.add(entry["peer"])
            add(entry["peer"], entry["precision"], entry["population"], entry["steps"], entry["cpu_s"], entry["wall_s"])
            versions[entry["peer"]] = entry["version"]
            worst[entry["precision"]] = max(worst.get(entry["precision"], 0), entry["worst_difference"])

    print("peers     " + ", ".join(sorted(set(versions.values()))))
    print("scores    agree with leadlag's f64 reference to " +
          ", ".join(f"{worst[width]:.0e} ({width})" for width in sorted(worst)) + "\n")
    print(f"{'program':<18}{'precision':<12}{'cand.':>7}{'Mcs/core-s':>12}{'Mcs/s':>8}{'lanes f32':>11}{'lanes f64':>11}"
          + (f"{'gpu f32':>10}" if on_device else ""))
    for (name, precision, population), (cpu, wall) in sorted(found.items(), key=lambda entry: (entry[0][2], entry[0][0], entry[0][1])):
        speed = statistics.median(cpu)

        def ratio(width):
            lanes = found.get(("leadlag lanes", width, population))
            return f"{statistics.median(lanes[0]) / speed:.1f} x" if lanes and name not in on_device else "-"

        gpu = found.get(("leadlag gpu", "plain", population))
        against_gpu = f"{statistics.median(gpu[1]) / statistics.median(wall):.1f} x" if gpu else "-"
        per_core = "-" if name in on_device else f"{speed:.0f}"
        print(f"{name:<18}{precision:<12}{population:>7}{per_core:>12}{statistics.median(wall):>8.0f}"
              f"{ratio('plain'):>11}{ratio('f64'):>11}" + (f"{against_gpu:>10}" if on_device else ""))


if __name__ == "__main__":
    main()
