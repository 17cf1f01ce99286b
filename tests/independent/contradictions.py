"""Does `deltille verify` notice a change of a single value in a target's description?

    python tests/independent/contradictions.py target/release/deltille FOLDER [SAMPLES]

Makes targets of each kind with all their files, changes values of their JSON one at a time (numbers a little and a lot,
texts, booleans, nulls), SAMPLES of each field (2), and runs `verify` beside files that were not changed. A change may
remain unnoticed only if no other value in the description and no file depends on the value; the list below gives a
reason for each.
"""

import collections
import json
import random
import re
import shutil
import subprocess
import sys
from pathlib import Path

MADE = {
    "board": "board --rows 4 --cols 5 --edge 20mm --note a --tag-ids",
    "two": "board --rows 4 --cols 5 --edge 20mm --two-sided 3mm",
    "packed": "board --rows 3 --cols 4 --edge 12mm --boards 2 --pack",
    "dense": "board --dense --rows 4 --cols 5 --edge 20mm",
    "glass": "board --rows 4 --cols 5 --edge 20mm --mirrored --white White --contour CutContour",
    "charuco": "charuco --squares 4x4",
    "grid": "aprilgrid --tags 2x2 --edge 40mm",
    "circles": "circles --circles 3x4",
    "tetrahedron": "tetrahedron --edge 90mm --tiles 6 --skeleton --pdf --per-face",
    "cuboid": "cuboid --size 60x50x40mm --pdf --stl",
}

# Small and large change of a number: the tolerance for prints, 0.02 mm, lies between them.
LITTLE, MUCH = 0.002, 0.5

# Changes that are not noticed, with reasons.
UNNOTICED_LITTLE = [
    (r"sheets\..*", "pages are compared to 0.02 mm"),
    (r"spec\.skeleton\..*", "the walls of a skeleton are in its own files, whose coordinates are compared to 0.02 mm"),
    (r"spec\.shape\.cuboid\.\d", "only the ratio of the sides counts, which edges show to 0.02 mm"),
]
UNNOTICED = [
    (r"spec\..*family|spec\.dictionary", "a name that is not that of a shipped family may be that of a file"),
    (r"spec\.tags\.spacing", "another spacing may have the same tags"),
    (r"sheets\.#(\.pages\.#\.marks)?\.texts\.#\.max_width_mm", "no text is so long"),
    (r"sheets\.#\.lines\.#\.kind", "kinds that are drawn alike"),
    (r"spec\.skeleton\.wall_mm", "only the skeleton has walls, and it is not among the files"),
]


def values(value, path=()):
    """The paths of all values that are not lists or objects."""
    if isinstance(value, dict):
        for key, inner in value.items():
            yield from values(inner, (*path, key))
    elif isinstance(value, list):
        for index, inner in enumerate(value):
            yield from values(inner, (*path, index))
    else:
        yield path


def at(value, path):
    for step in path:
        value = value[step]
    return value


def kind_of(path):
    """The field to which a path belongs: indices into lists of objects are merged, indices of coordinates are not."""
    parts = []
    for i, step in enumerate(path):
        is_object = isinstance(step, int) and i + 1 < len(path) and isinstance(path[i + 1], str)
        parts.append("#" if is_object else str(step))
    return ".".join(parts)


def changes(old):
    """Changed values, each with a flag for a small change."""
    if isinstance(old, bool):
        return [(not old, False)]
    if isinstance(old, int):
        return [(old + 1, False)]
    if isinstance(old, float):
        return [(old + LITTLE, True), (old + MUCH, False)]
    return [(1.0, False)] if old is None else [(old + "x", False)]


def main():
    program, folder, samples = Path(sys.argv[1]).resolve(), Path(sys.argv[2]), int((sys.argv[3:] or [2])[0])
    random.seed(1)
    unexpected, told, count = [], collections.Counter(), 0
    for name, arguments in MADE.items():
        work = folder / name
        shutil.rmtree(work, ignore_errors=True)
        subprocess.run([program, *arguments.split(), "--name", name, "-o", work], check=True, capture_output=True)
        description = work / f"{name}.json"
        original = json.loads(description.read_text())
        kinds = collections.defaultdict(list)
        for path in values(original):
            kinds[kind_of(path)].append(path)
        for kind, paths in kinds.items():
            for path in random.sample(paths, min(samples, len(paths))):
                old = at(original, path)
                for new, is_near in changes(old):
                    changed = json.loads(json.dumps(original))
                    at(changed, path[:-1])[path[-1]] = new
                    description.write_text(json.dumps(changed))
                    done = subprocess.run([program, "verify", description], capture_output=True, text=True)
                    count += 1
                    assert done.returncode in (0, 1, 2), done.stderr
                    if done.returncode != 0:
                        continue
                    known = UNNOTICED + (UNNOTICED_LITTLE if is_near else [])
                    reason = next((why for what, why in known if re.fullmatch(what, kind)), None)
                    told[reason] += 1
                    if reason is None:
                        unexpected.append(f"{name}: {'.'.join(map(str, path))} {old} -> {new}")
    print(f"{count} changes in {len(MADE)} descriptions, {count - sum(told.values())} noticed")
    for reason, number in told.items():
        if reason:
            print(f"  {number} not: {reason}")
    assert not unexpected, "not noticed:\n" + "\n".join(unexpected)


main()
