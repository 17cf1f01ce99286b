"""Compares two cameras with OpenCV and numpy, and checks the result of `deltille compare`: compare.py PROGRAM FOLDER.

cv2.projectPoints projects points, and Newton's method with finite differences inverts the lens. The motion is estimated
with the Gauss–Newton method and finite differences. Only the parameters in deltille's files are used, none of its code.
"""

import json
import subprocess
import sys

import cv2
import numpy as np

program, folder = sys.argv[1:3]


def camera(name):
    found = json.load(open(f"{folder}/{name}.json"))
    value = {p["name"]: p["value"] for p in found["parameters"]}
    matrix = np.array([[value["fx"], 0, value["cx"]], [0, value["fy"], value["cy"]], [0, 0, 1]])
    lens = np.array([value.get(k, 0.0) for k in ("k1", "k2", "p1", "p2", "k3")])
    return lambda points: cv2.projectPoints(
        points.reshape(-1, 1, 3), np.zeros(3), np.zeros(3), matrix, lens
    )[0].reshape(-1, 2)


def solved(function, x, size=1e-6, steps=20):
    """Minimizes a sum of squares with finite-difference derivatives."""
    for _ in range(steps):
        here = function(x)
        columns = [(function(x + size * e) - function(x - size * e)) / (2 * size) for e in np.eye(len(x))]
        x = x - np.linalg.lstsq(np.stack(columns, 1), here, rcond=None)[0]
    return x


def rays(project, pixels):
    """The points at depth 1 that project to the given pixels."""
    flat = np.zeros_like(pixels)
    lift = lambda q: np.column_stack([q, np.ones(len(q))])
    for _ in range(50):
        off, h = project(lift(flat)) - pixels, 1e-7
        across = [(project(lift(flat + h * e)) - project(lift(flat - h * e))) / (2 * h) for e in np.eye(2)]
        flat = flat - np.linalg.solve(np.stack(across, 2), off[:, :, None])[:, :, 0]
    return lift(flat)


def check(distance):
    asked = [] if distance is None else ["--distance", f"{distance}mm"]
    subprocess.run(
        [program, "compare", f"{folder}/first.json", f"{folder}/second.json", "-o", f"{folder}/compared.json", *asked],
        check=False, stdout=subprocess.DEVNULL,
    )
    said = json.load(open(f"{folder}/compared.json"))["cameras"][0]
    places = [place for place in said["positions"] if place.get("compared")]
    pixels = np.array([[place["x"], place["y"]] for place in places])
    theirs = np.array([[place["dx"], place["dy"]] for place in places])
    first, second = camera("first"), camera("second")
    points = rays(first, pixels)
    points /= np.linalg.norm(points, axis=1)[:, None]
    move = lambda x: points @ cv2.Rodrigues(x[:3])[0].T + (0 if distance is None else x[3:] / distance)
    start = np.zeros(3 if distance is None else 6)
    # Translation in hundreds of millimetres, rotation in radians.
    unit = np.ones(3) if distance is None else np.array([1, 1, 1, 100, 100, 100.0])
    off = lambda x: (second(move(unit * x)) - pixels).ravel()
    ours = off(solved(off, start)).reshape(-1, 2)
    worst = np.abs(ours - theirs).max()
    rms = np.sqrt((ours**2).mean())
    assert worst < 1e-3, (distance, worst)
    assert abs(rms - said["rms_px"]) < 1e-4, (rms, said["rms_px"])
    at = "infinity" if distance is None else f"{distance} mm"
    print(f"compare: {len(places)} places at {at} differ by {rms:.4f} px, at most {worst:.1e} px from OpenCV and numpy")


check(None)
check(400)
