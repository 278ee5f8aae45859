"""What the benchmarks of the field share: events as tables, and the commands that choose the causes and fit one law for all drivers."""
import json
import subprocess
import sys

MAP = """title = "events"
rows = "pairs"
[columns]
group = { name = "event" }
time = { name = "time_s", unit = "s" }
speed = { name = "speed_mps", unit = "m/s" }
lead_speed = { name = "lead_speed_mps", unit = "m/s" }
gap = { name = "spacing_m", unit = "m" }
"""


def table(events, target, step_s=0.1):
    """Writes events, each of spacing [m], speed and speed ahead [m/s] at every step."""
    with open(target, "w") as out:
        out.write("event,time_s,spacing_m,speed_mps,lead_speed_mps\n")
        for number, event in enumerate(events, 1):
            for i, (spacing, speed, ahead) in enumerate(zip(*event)):
                out.write(f"{number},{i * step_s:.1f},{spacing:.6g},{speed:.6g},{ahead:.6g}\n")


def run(leadlag, *words):
    """The JSON of a command; its error ends the benchmark."""
    done = subprocess.run([leadlag, *words], capture_output=True, text=True)
    if done.returncode:
        sys.exit(done.stderr)
    return json.loads(done.stdout)


def fits(leadlag, out, train, test, base, score, window=(), gof="rmse-s"):
    """Yields the base and the chosen model, each with its result. `diagnose` proposes models: those that it cannot distinguish from the best.
    Of them and the base, the chosen one has the lowest `score` on training drivers whom each of five calibrations left out."""
    columns = out / "map.toml"
    columns.write_text(MAP)
    read = [str(train), "--columns", str(columns)]
    found = run(leadlag, "diagnose", *read, "--all", "--base", base, "--effort", "quick", "--json")
    print(f"diagnosis: {found['verdict']}; {found['reason']}")
    proposed = [trial["causes"] for trial in found["closed_loop"]["trials"] if trial["in_set"]]

    def fit(causes, *more):
        extend = [word for cause in causes for word in ("--extend", cause)]
        folder = out / ("+".join(causes) or "base")
        return run(leadlag, "calibrate", *read, "--joint", "--model", base, *extend, "--bounds", "human", "--gof", gof, *window,
                   "--no-intervals", *more, "--out", str(folder), "--json")

    left_out = {}
    for causes in [[], *proposed]:
        scores = fit(causes, "--folds", "5")["held_back"]
        left_out[tuple(causes)] = (scores["failed"], score(scores))
        print(f"left-out training drivers, {' + '.join(causes) or base}: {score(scores):.4f}, {scores['failed']} fail")
    chosen = min(left_out, key=left_out.get)
    for causes in dict.fromkeys([(), chosen]):
        yield " + ".join(causes) or "base", fit(causes, "--holdout", str(test))
