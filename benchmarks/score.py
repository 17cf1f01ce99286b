"""Scores detections of the benchmark's photographs. Needs Python, numpy, and `protocol.py` beside it.

    python score.py FOLDER/charuco/truth.json mine.json

The file of a detector:

    {"detector": "mine", "version": "1.0", "board": "charuco",
     "photographs": {"usual-0": {"corners": [{"label": {"id": 12}, "x": 310.2, "y": 207.9, "covariance": null}],
                                 "cpu_s": 0.004, "px": 691200}}}

The centre of the upper left pixel is (0, 0). A label is `{"id": …}` as in the description of the board, or, for a board without
codes, `{"row": …, "col": …}` in any frame of the lattice. `covariance` is `[xx, xy, yy]` in px², or null. `cpu_s`, `px` and
`memory_mb` are optional. Photographs that are absent count as without corners.

For each scene and for all together:

    found     corners within 0.3 of the distance to their nearest neighbour, over those that are visible
    wrong     corners elsewhere, that do not exist, or whose label was reported before; also those that are not numbers
    rms       RMS error per axis of the found corners, px; median: of their distance from the truth
    bound     RMS of errors over the Cramér–Rao bound of each corner; scenes without a bound (colour, JPEG) do not count
    e²/σ²     mean squared error over the stated variance, per axis; 1 if it is right
    ms/Mpx    CPU time, median and largest
"""

import json
import math
import pathlib
import sys
from collections import Counter

import numpy as np

from protocol import WRONG


def labelled(truth, corners):
    """Pairs of a found corner and the truth of its label; None if there is no such label."""
    if all("id" in corner["label"] for corner in corners):
        by_id = {of["label"]["id"]: of for of in truth}
        return [(corner, by_id.get(corner["label"]["id"])) for corner in corners]
    return aligned(truth, corners)


TURNS = [np.array(turn) for turn in (
    [[1, 0], [0, 1]], [[0, 1], [-1, 0]], [[-1, 0], [0, -1]], [[0, -1], [1, 0]],
    [[1, 0], [0, -1]], [[-1, 0], [0, 1]], [[0, 1], [1, 0]], [[0, -1], [-1, 0]],
)]


def aligned(truth, corners):
    """The same for labels in any frame of the lattice: that turn and shift in which most labels are right."""
    places = np.array([[of["x"], of["y"]] for of in truth])
    lattice = np.array([[of["label"]["row"], of["label"]["col"]] for of in truth])
    own = np.array([[of["label"]["row"], of["label"]["col"]] for of in corners])
    seen = np.array([[of["x"], of["y"]] for of in corners])
    nearest = np.linalg.norm(seen[:, None] - places[None], axis=2).argmin(1)
    votes = Counter()
    for index, turn in enumerate(TURNS):
        votes.update((index, *shift) for shift in (lattice[nearest] - own @ turn.T).tolist())
    index, *shift = votes.most_common(1)[0][0]
    by_place = {tuple(at): of for at, of in zip(lattice.tolist(), truth)}
    labels = own @ TURNS[index].T + shift
    return [(corner, by_place.get(tuple(label))) for corner, label in zip(corners, labels.tolist())]


def judged(truth, corners):
    """What one photograph contributes: corners due, found and wrong; errors, shares of bounds and of stated variances."""
    of = {"due": sum(corner["visible"] for corner in truth), "wrong": 0, "errors": [], "over_bound": [], "over_stated": []}
    labels = set()
    for corner, at in labelled(truth, corners) if corners else []:
        if id(at) in labels:
            at = None
        labels.add(id(at))
        error = np.array([corner["x"] - at["x"], corner["y"] - at["y"]]) if at else np.array([np.inf, np.inf])
        if not math.hypot(*error) < WRONG * (at["nearest_px"] if at else 1):
            of["wrong"] += 1
            continue
        if not at["visible"]:
            continue
        of["errors"].append(error.tolist())
        for covariance, shares in ((at["bound"], of["over_bound"]), (corner.get("covariance"), of["over_stated"])):
            if covariance:
                xx, xy, yy = covariance
                shares.append(float(error @ np.linalg.solve([[xx, xy], [xy, yy]], error)) / 2)
    return of


def summed(parts):
    """Figures of some photographs: what `judged` returned, with their files' entries."""
    due, wrong = (sum(part[key] for part, _ in parts) for key in ("due", "wrong"))
    errors = np.array([error for part, _ in parts for error in part["errors"]]).reshape(-1, 2)
    mean = lambda key: np.mean(shares) if (shares := [share for part, _ in parts for share in part[key]]) else None
    times = [1e9 * of["cpu_s"] / of["px"] for _, of in parts if of and of.get("cpu_s") is not None]
    bound = mean("over_bound")
    return {
        "due": due,
        "found": len(errors),
        "wrong": wrong,
        "rms_px": float(np.sqrt(np.mean(errors**2))) if len(errors) else None,
        "median_px": float(np.median(np.hypot(*errors.T))) if len(errors) else None,
        "over_bound": float(np.sqrt(bound)) if bound is not None else None,
        "over_stated": None if mean("over_stated") is None else float(mean("over_stated")),
        "ms_per_mpx": float(np.median(times)) if times else None,
        "worst_ms_per_mpx": float(np.max(times)) if times else None,
    }


def score(truth, result):
    """The figures of a detector: of all photographs, and by scene."""
    parts = {}
    for name, photograph in truth["photographs"].items():
        found = result["photographs"].get(name, {})
        part = (judged(photograph["corners"], found.get("corners", [])), found)
        parts.setdefault(photograph["scene"], []).append(part)
    every = [part for of in parts.values() for part in of]
    return {"all": summed(every), "scenes": {scene: summed(of) for scene, of in parts.items()}}


class Invalid(Exception):
    """The file of a detector is not as described above."""


def checked(truth, result):
    """Raises Invalid with the photograph and what is wrong with it."""
    if result.get("board", truth["board"]) != truth["board"]:
        raise Invalid(f"its board is {result['board']!r}, that of the photographs {truth['board']!r}")
    if not isinstance(result.get("photographs"), dict):
        raise Invalid("it has no `photographs`, by name")
    is_number = lambda of: isinstance(of, (int, float)) and not isinstance(of, bool)
    is_whole = lambda of: isinstance(of, int) and not isinstance(of, bool)
    for name, photograph in result["photographs"].items():
        if name not in truth["photographs"]:
            raise Invalid(f"there is no photograph {name!r}: names have no ending, as in {next(iter(truth['photographs']))!r}")
        if "cpu_s" in photograph and not (is_number(photograph["cpu_s"]) and photograph.get("px", 0) > 0):
            raise Invalid(f"{name}: `cpu_s` needs a number, and the number of pixels as `px`")
        for index, corner in enumerate(photograph.get("corners", [])):
            label, covariance = corner.get("label"), corner.get("covariance")
            kinds = [{"id"}, {"row", "col"}] if truth["board"] == "checkerboard" else [{"id"}]
            if not isinstance(label, dict) or set(label) not in kinds or not all(map(is_whole, label.values())):
                keys = " or ".join(str(sorted(of)) for of in kinds)
                raise Invalid(f"{name}, corner {index}: the label {label!r} is not {keys} with whole numbers")
            if not (is_number(corner.get("x")) and is_number(corner.get("y"))):
                raise Invalid(f"{name}, corner {index}: `x` and `y` must be numbers")
            if covariance is not None:
                xx, xy, yy = covariance
                if not (xx > 0 and xx * yy > xy * xy):
                    raise Invalid(f"{name}, corner {index}: the covariance {covariance} is not positive definite")


def shown(figures):
    number = lambda value, places: "–" if value is None else f"{value:.{places}f}"
    return (
        f"{figures['found']:6} of {figures['due']:6}  {figures['wrong']:5}  {number(figures['rms_px'], 4):>8}  "
        f"{number(figures['median_px'], 4):>8}  {number(figures['over_bound'], 2):>6}  {number(figures['over_stated'], 2):>6}  "
        f"{number(figures['ms_per_mpx'], 1):>7}  {number(figures['worst_ms_per_mpx'], 1):>7}"
    )


def main():
    if len(sys.argv) != 3:
        sys.exit("usage: score.py BOARD/truth.json mine.json; see the first lines of score.py")
    read = []
    for path in sys.argv[1:]:
        try:
            read.append(json.loads(pathlib.Path(path).read_text()))
        except OSError as error:
            sys.exit(f"{path}: {error.strerror}")
        except ValueError as error:
            sys.exit(f"{path}: not JSON: {error}")
    truth, result = read
    if "photographs" not in truth or "size_px" not in truth:
        sys.exit(f"{sys.argv[1]}: not the truth.json of a board")
    try:
        checked(truth, result)
    except Invalid as error:
        sys.exit(f"{sys.argv[2]}: {error}")
    figures = score(truth, result)
    print(f"{'scene':14}  {'found':>16}  wrong  {'rms px':>8}  {'median':>8}  bound  {'e²/σ²':>7}  {'ms/Mpx':>7}  {'worst':>7}")
    for scene, of in (*figures["scenes"].items(), ("all", figures["all"])):
        print(f"{scene:14}  {shown(of)}")


if __name__ == "__main__":
    main()
