"""Do two calibrations of one camera differ as their uncertainties predict? Compares calibrations from two halves of one
recording.

    python halves.py path/to/deltille DETECTIONS FOLDER --model radtan [--measure] [--seeds 100-119] [--split random]
                     [-- options of calibrate, such as --grid deltille --rows 10 --cols 11 --edge 20mm]

splits the detections of one camera into two halves, calibrates each, compares the results at infinity, and prints a
row: the ratio of observed to expected difference (RMS over all splits), the numbers of splits that `compare` reports as
significant at 5 % and at its own level, and the smallest p-value. Splits are `random` or `alternate`. An alternate
split assigns the two images of each neighbouring pair, by file name, to different halves at random, so both halves
contain all kinds of views.

Both halves show the same board. Effects of its errors that are common to both are not part of the observed or the
expected difference.
"""

import argparse
import json
import math
import pathlib
import random
import shutil
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor


def halves(names, seed, split):
    names, chance = sorted(names), random.Random(seed)
    if split == "random":
        chance.shuffle(names)
        return names[: len(names) // 2], names[len(names) // 2 :]
    first = [chance.choice(names[i : i + 2]) for i in range(0, len(names), 2)]
    return first, [name for name in names if name not in first]


def calibrate(deltille, names, stem, options):
    command = [deltille, "calibrate", *names, *options, "-o", f"{stem}.yaml", "--force"]
    done = subprocess.run([str(part) for part in command], capture_output=True, text=True)
    if done.returncode not in (0, 1) or not pathlib.Path(f"{stem}.json").exists():
        sys.exit(done.stderr)


def one(deltille, names, folder, seed, split, options):
    folder = folder / f"{seed}"
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    stems = folder / "first", folder / "second"
    for of_half, stem in zip(halves(names, seed, split), stems):
        calibrate(deltille, of_half, stem, options)
    first, second, out = (folder / f"{name}.json" for name in ("first", "second", "compared"))
    done = subprocess.run([deltille, "compare", first, second, "-o", out], capture_output=True, text=True)
    if done.returncode not in (0, 1):
        sys.exit(done.stderr)
    found = json.loads(out.read_text())["cameras"][0]
    return found["rms_px"], found["expected_px"], found["p_value"]


def main():
    given, options = sys.argv[1:], []
    if "--" in given:
        given, options = given[: given.index("--")], given[given.index("--") + 1 :]
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("deltille")
    parser.add_argument("detections", type=pathlib.Path)
    parser.add_argument("folder", type=pathlib.Path)
    parser.add_argument("--model", action="append", required=True)
    parser.add_argument("--measure", action="store_true")
    parser.add_argument("--seeds", default="100-119")
    parser.add_argument("--split", choices=["random", "alternate"], default="random")
    args = parser.parse_args(given)
    low, high = map(int, args.seeds.split("-"))
    names = list(args.detections.glob("*.json"))
    for model in args.model:
        wanted = options + ["--model", model] + ["--measure-target"] * args.measure
        folder = args.folder / model
        run = lambda seed: one(args.deltille, names, folder, seed, args.split, wanted)
        with ThreadPoolExecutor(2) as pool:
            rows = list(pool.map(run, range(low, high + 1)))
        found, expected, chance = zip(*rows)
        mean = lambda values: math.sqrt(sum(v * v for v in values) / len(values))
        ratio = [a / b for a, b in zip(found, expected)]
        print(
            f"{model:15} {'measured' if args.measure else 'plain':8} {args.split:9} {len(rows)} splits:"
            f" {mean(found):.4f} px found, {mean(expected):.4f} expected, ratio {mean(found) / mean(expected):.2f}"
            f" ({min(ratio):.2f}–{max(ratio):.2f}),"
            f" p < 0.05 in {sum(p < 0.05 for p in chance)}, p < 0.001 in {sum(p < 0.001 for p in chance)}, least {min(chance):.1e}",
            flush=True,
        )


if __name__ == "__main__":
    main()
