"""Tables and a plot of a comparison.

    python tables.py FOLDER --write        # of what the other scripts left in FOLDER, into docs/benchmarks.md and results.json
    python tables.py --check               # the tables are those of results.json, and the claims of protocol.py hold
"""

import argparse
import json
import pathlib
import platform
import sys
import time

import protocol
import score

HERE = pathlib.Path(__file__).resolve().parent
RESULTS = HERE / "results.json"
DOCUMENT = HERE.parent / "docs/benchmarks.md"
README = HERE.parent / "README.md"
PLOT = HERE.parent / "docs/images/detectors.svg"
BEGIN, END = "<!-- written by benchmarks/tables.py -->\n", "<!-- end -->\n"
OURS = "deltille"


def collected(folder):
    """The figures of all detectors, calibrators and generators."""
    rows, truths = [], {}
    for path in sorted((folder / "found").glob("*.json")):
        result = json.loads(path.read_text())
        of_board = folder / result["board"] / "truth.json"
        if not of_board.exists():
            continue
        truth = truths[result["board"]] = json.loads(of_board.read_text())
        try:
            score.checked(truth, result)
        except score.Invalid as error:
            sys.exit(f"{path}: {error}")
        about = {"detector": path.stem, "version": "", "settings": "", "memory_mb": None}
        about |= {key: value for key, value in result.items() if key != "photographs"}
        rows.append(about | score.score(truth, result))
    if not rows:
        sys.exit(f"{folder}: no results; run.py writes them")
    if len(seeds := {truth["seed"] for truth in truths.values()}) > 1:
        sys.exit(f"{folder}: photographs of the seeds {sorted(seeds)}; use a folder for each")
    order = list(protocol.BOARDS)
    rows.sort(key=lambda row: (order.index(row["board"]), row["detector"] != OURS, row["detector"].lower()))
    about = {"date": time.strftime("%Y-%m-%d"), "machine": processor(), "seed": seeds.pop()}
    more = {
        name: json.loads(path.read_text()) if (path := folder / f"{name}.json").exists() else {}
        for name in ("cameras", "prints", "paper", "public", "fixtures")
    }
    return {"about": about, "detectors": rows} | more


def processor():
    try:
        lines = pathlib.Path("/proc/cpuinfo").read_text().splitlines()
        return next(line.split(": ")[1] for line in lines if line.startswith("model name"))
    except (OSError, StopIteration):
        return platform.processor() or platform.machine()


def lines(results):
    """The figures as JSON that can be compared line by line."""
    rows = lambda of: ",\n".join(map(json.dumps, of)) if isinstance(of, list) else ",\n".join(
        f"{json.dumps(key)}: {json.dumps(value)}" for key, value in of.items())
    part = lambda of: f"[\n{rows(of)}\n]" if isinstance(of, list) else f"{{\n{rows(of)}\n}}"
    return "{\n" + ",\n".join(f"{json.dumps(key)}: {part(of)}" for key, of in results.items()) + "\n}\n"


def number(value, places):
    return "–" if value is None else f"{value:.{places}f}"


def table(head, rows):
    line = lambda cells: "| " + " | ".join(cells) + " |\n"
    return line(head) + "|" + "---|" * len(head) + "\n" + "".join(map(line, rows))


def share(row):
    return 100 * row["found"] / row["due"] if row["due"] else 0.0


def least(value):
    """A figure for comparison; that of no corners is larger than any."""
    return float("inf") if value is None else value


def behind(ours, peers):
    """In what a peer is ahead: in corners, or in the error of at least nine tenths as many."""
    if any(of["found"] > ours["found"] or of["wrong"] < ours["wrong"] for of in peers):
        yield "corners"
    as_many = (of for of in peers if of["found"] >= 0.9 * ours["found"] and of["rms_px"] is not None)
    if any(of["rms_px"] < least(ours["rms_px"]) for of in as_many):
        yield "error"


def detectors_table(results):
    head = ["board", "detector", "corners", "wrong", "RMS px", "median px", "over bound", "e²/σ²", "ms/Mpx", "worst", "MB"]
    rows = [
        [
            row["board"], f"{row['detector']} {row['version']}".strip(), f"{share(row['all']):.1f} %", str(row["all"]["wrong"]),
            number(row["all"]["rms_px"], 4), number(row["all"]["median_px"], 4), number(row["all"]["over_bound"], 2),
            number(row["all"]["over_stated"], 2), number(row["all"]["ms_per_mpx"], 1),
            number(row["all"]["worst_ms_per_mpx"], 1), number(row["memory_mb"], 0),
        ]
        for row in results["detectors"]
    ]
    return table(head, rows)


def scenes_table(results, board):
    rows = [row for row in results["detectors"] if row["board"] == board]
    names = [row["detector"] for row in rows]
    has_ours = names[0] == OURS
    cell = lambda of: f"{share(of):.0f} %, {number(of['rms_px'], 4)}" + (f", {of['wrong']} wrong" if of["wrong"] else "")
    lines = []
    for scene in rows[0]["scenes"]:
        of_scene = [row["scenes"][scene] for row in rows]
        lost = [", ".join(behind(of_scene[0], of_scene[1:]))] if has_ours else []
        lines.append([scene, *map(cell, of_scene), *lost])
    return table(["scene", *names, *(["deltille is behind in"] if has_ours else [])], lines)


def cameras_table(results):
    head = [
        "corners", "calibration", "projection, px", "e²/σ²", "held out, px", "fx, px", "fx: e²/σ²", "halves: e²/σ²", "CPU s", "failed",
    ]
    rows = [
        [
            case, name, number(of["projection_px"], 3), number(of["projection_share"], 2), number(of["held_out_px"], 4),
            number(of["fx_px"], 3), number(of["over_stated"], 2), number(of["halves"], 2), number(of["cpu_s"], 2),
            str(of.get("failed", 0)),
        ]
        for case, by_name in results["cameras"].items()
        for name, of in by_name.items()
    ]
    return table(head, rows)


def paper_table(results):
    rows = [
        [
            of["set"], f"{of['detector']} {of['version']}".strip(), f"{of['found']} of {of['due']}",
            f"{of['whole']} of {of['photographs']}", number(of["ms_per_mpx"], 1), number(of["worst_ms_per_mpx"], 1),
        ]
        for of in results["paper"]
    ]
    return table(["set", "detector", "corners", "whole boards", "ms/Mpx", "worst"], rows)


def public_table(results):
    head = ["photographs", "detector", "images", "corners", "elsewhere", "RMS residual, px", "deltille, same corners", "ms/Mpx"]
    rows = [
        [
            of["set"], f"{of['detector']} {of['version']}".strip(), f"{of['images']} of {of['photographs']}",
            f"{of['corners']} of {of['due']}", "–" if of["detector"] == OURS else str(of["elsewhere"]), number(of["rms_px"], 3), number(of["deltille_rms_px"], 3),
            number(of["ms_per_mpx"], 0),
        ]
        for of in results["public"]
    ]
    return table(head, rows)


def fixtures_table(results):
    names = [name for name in next(iter(results["fixtures"].values())) if name != "bound"]
    whole = protocol.OFFSETS**2

    def cell(of):
        few = "" if of["found"] == whole else f" ({of['found']})"
        return f"{number(of['drawn'], 4)}, {number(of['stated'], 3)}{few}"

    rows = [
        [condition, number(of["bound"], 4), *(cell(of[name]) for name in names)]
        for condition, of in results["fixtures"].items()
    ]
    published = [[f"stated by {name}", *(number(of, 3) for of in figures)] for name, figures in protocol.PUBLISHED.items()]
    columns = [list(column) for column in zip(["condition", "bound", *names], *rows)]
    return table(columns[0], columns[1:] + published)


def prints_table(results):
    head = [
        "generator and file", "scale across, ppm", "scale along, ppm", "RMS µm", "largest µm", "corners", "markers",
        "corners by its own detector", "cells exact, closed",
    ]
    rows = [
        [
            name, *(number(ppm, 0) for ppm in of.get("scale_ppm", [None] * 2)), number(of.get("rms_um"), 1),
            number(of.get("largest_um"), 1), str(of["corners"]), str(of["markers"]), str(of.get("by_own_detector", "–")),
            ", ".join("yes" if of[key] else "no" for key in ("tags_exact", "closed") if key in of) or "–",
        ]
        for name, of in results["prints"].items()
    ]
    return table(head, rows)


def written(results):
    """The part of docs/benchmarks.md."""
    about = results["about"]
    with_peers = [b for b in protocol.BOARDS if len({row["detector"] for row in results["detectors"] if row["board"] == b}) > 1]
    settings = {row["detector"]: f"{row['detector']}: {row['settings']}" for row in results["detectors"]}
    text = f"Seed {about['seed']}, {about['date']}, {about['machine']}, one thread.\n\n"
    text += detectors_table(results) + "\n"
    text += "![CPU time and error of each detector](images/detectors.svg)\n\n"
    text += "Settings: " + "; ".join(settings.values()) + ".\n"
    for board in with_peers:
        text += f"\nCorners found and RMS error in px by scene, `{board}`:\n\n" + scenes_table(results, board)
    parts = [
        ("paper", paper_table, "Photographs of untagged boards by Ha et al.: a checkerboard of 8 × 11 corners through a fisheye of 220° (`fisheye`), and a deltille grid of 10 × 11 corners (`robot-hand`):"),
        ("public", public_table, "Photographs by other people. Nobody knows the true corners: those of deltille are the reference, and *elsewhere* are corners more than 3 px from those with the same label. Residuals are those of `calibrateCamera` (four distortion parameters), for EuRoC and TUM VI of a pose with the published camera, over the corners that the detector and deltille have in common; they contain the errors of the board and of the lens model:"),
        ("fixtures", fixtures_table, "The fixture of chess-corners: mean distance of a refined corner from the position that is drawn, and from the one that is stated, px (see `benchmarks/fixtures.py`; in brackets the number of corners found, if not all 36):"),
        ("cameras", cameras_table, "Calibrations from the same simulated corners (RMS or mean over 20 seeds; `calibrateCameraRO`: 5). *Projection* is the difference from the true camera over the image, after the best rotation, with its square over the stated variance of projections at infinity; *held out* the residual of other views of a flat board, with noise of 0.05 px; *halves* the squared difference of the focal lengths from two halves of the views, over the stated variances:"),
        ("prints", prints_table, "One ChArUco board from several generators, and AprilTags in 3MF files for printers with two colours. RMS and largest are errors of single corners, without the scales; 3MF files have all cells of the tags as in the dictionary, and closed bodies:"),
    ]
    for name, of, heading in parts:
        if results.get(name):
            text += f"\n{heading}\n\n{of(results)}"
    return text


def for_readme(results):
    """Boards that others read too: deltille beside the best of all other detectors in each figure."""
    lines = []
    for board in protocol.BOARDS:
        of_board = {row["detector"]: row["all"] | {"share": share(row["all"])} for row in results["detectors"] if row["board"] == board}
        ours = of_board.pop(OURS, None)
        if ours is None or not of_board:
            continue
        # Few corners are easy ones.
        many = {name: of for name, of in of_board.items() if is_comparable(of, ours)} or of_board
        cells = []
        for key, best, text in (
            ("share", max, lambda value: f"{value:.1f} %"), ("rms_px", min, lambda value: f"{number(value, 4)} px"),
            ("ms_per_mpx", min, lambda value: f"{number(value, 0)} ms/Mpx"),
        ):
            name = best(many, key=lambda name: least(many[name][key]))
            cells += [text(ours[key]), f"{text(many[name][key])} ({name})"]
        lines.append([f"`{board}`", *cells])
    head = ["18 scenes", "corners", "the best other", "RMS error", "the best other", "CPU time", "the best other"]
    return table(head, lines)


def is_comparable(of, ours):
    """Whether a detector finds so many corners that its errors and times can be compared."""
    return of["found"] >= 0.5 * ours["found"]


def plot(results, path):
    """CPU time against error over the bound, a dot for each detector and board."""
    import matplotlib

    matplotlib.use("svg")
    matplotlib.rcParams |= {"svg.hashsalt": "deltille", "svg.fonttype": "none", "font.family": "sans-serif"}
    import matplotlib.pyplot as plt

    marks = {"deltille": "^", "checkerboard": "s", "charuco": "D", "aprilgrid": "o", "tags": "p"}
    figure, axes = plt.subplots(figsize=(8, 5))
    # A detector that finds few corners has an error of easy ones only.
    shown = [row for row in results["detectors"] if row["all"]["over_bound"] is not None and share(row["all"]) >= 50]
    axes.set(xscale="log", yscale="log", xlim=(3, 1000), ylim=(0.8, 200))
    axes.set(xlabel="CPU time in one thread, ms per megapixel", ylabel="RMS error over the bound")
    at = [axes.transData.transform((row["all"]["ms_per_mpx"], row["all"]["over_bound"])) for row in shown]
    taken = [(x - 6, y - 6, x + 6, y + 6) for x, y in at]
    for row, (x, y) in zip(shown, at):
        of, is_ours = row["all"], row["detector"] == OURS
        colour = "#c1121f" if is_ours else "#8d99ae"
        axes.plot(of["ms_per_mpx"], of["over_bound"], marks[row["board"]], color=colour, markersize=9)
        if is_ours:
            continue
        # Beside its marker, where nothing else is.
        width = 5.2 * len(row["detector"])
        places = [(8, -4), (-8 - width, -4), (-width / 2, 8), (-width / 2, -16), (8, 6), (8, -14)]
        boxes = [(x + dx, y + dy, x + dx + width, y + dy + 9) for dx, dy in places]
        hits = lambda a: sum(a[0] < b[2] and b[0] < a[2] and a[1] < b[3] and b[1] < a[3] for b in taken)
        place, box = min(zip(places, boxes), key=lambda of: hits(of[1]))
        taken.append(box)
        axes.annotate(row["detector"], (of["ms_per_mpx"], of["over_bound"]), xytext=place, textcoords="offset pixels",
                      fontsize=8, color="#2b2d42")
    axes.axhline(1, color="#2b2d42", linewidth=0.8, linestyle=":")
    line = lambda mark, colour, label: plt.Line2D([], [], marker=mark, linestyle="", color=colour, label=label)
    handles = [line(mark, "#2b2d42", f"{board} board" if board == OURS else board) for board, mark in marks.items()]
    handles += [line("s", "#c1121f", OURS), line("s", "#8d99ae", "others")]
    axes.legend(handles=handles, fontsize=8, frameon=False)
    axes.spines[["top", "right"]].set_visible(False)
    figure.tight_layout()
    figure.savefig(path, metadata={"Date": None})


def failed_claims(results, measures):
    """Claims of protocol.py that the figures contradict, for boards that were photographed."""
    lower_is_better = {"wrong", "rms_px", "over_bound", "ms_per_mpx"}
    for measure in measures:
        for board in protocol.CLAIMS[measure]:
            of_board = {row["detector"]: row["all"] for row in results["detectors"] if row["board"] == board}
            ours = of_board.pop(OURS, None)
            if ours is None and of_board:
                yield f"{board}: deltille is missing"
                continue
            for name, of in of_board.items():
                # Few corners are easy ones: their error is not comparable.
                if of[measure] is None or (measure in ("rms_px", "over_bound") and not is_comparable(of, ours)):
                    continue
                is_ahead = of[measure] < least(ours[measure]) if measure in lower_is_better else of[measure] > ours[measure]
                if is_ahead:
                    yield f"{board}, {measure}: {name} {of[measure]:.4g}, deltille {ours[measure]:.4g}"


def failed_fixtures(results):
    """Conditions of the fixture in which the claim of protocol.py does not hold."""
    for condition in protocol.FIXTURES_AHEAD if results.get("fixtures") else []:
        errors = {name: of["drawn"] for name, of in results["fixtures"][condition].items() if name != "bound"}
        best = min((name for name in errors if errors[name] is not None), key=errors.get)
        if not best.startswith(OURS):
            yield f"fixture, {condition}: {best} {errors[best]:.4g} px"


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folder", nargs="?", type=pathlib.Path)
    parser.add_argument("--write", action="store_true", help="replace the tables of docs/benchmarks.md, the plot and results.json")
    parser.add_argument("--check", action="store_true", help="check the committed tables")
    given = parser.parse_args()
    if given.check and given.folder:
        parser.error("--check: checks the committed tables; a folder is not read")
    results = collected(given.folder) if given.folder else json.loads(RESULTS.read_text())
    results = json.loads(json.dumps(results), parse_float=lambda text: float(f"{float(text):.5g}"))
    scenes = min(len(row["scenes"]) for row in results["detectors"])
    if given.write and (scenes, {row["board"] for row in results["detectors"]}) != (len(protocol.SCENES), set(protocol.BOARDS)):
        sys.exit(f"{given.folder}: --write needs all scenes and boards")
    texts = {DOCUMENT: written(results), README: for_readme(results)}
    if given.write:
        RESULTS.write_text(lines(results))
        plot(results, PLOT)
    for path, text in texts.items():
        before, rest = path.read_text().split(BEGIN)
        current, after = rest.split(END)
        if given.write:
            path.write_text(before + BEGIN + "\n" + text + "\n" + END + after)
        elif given.check and current.strip() != text.strip():
            sys.exit(f"{path.name} is not what results.json says: run tables.py --write")
    if not given.check:
        print(texts[DOCUMENT])
    # Times of a single run on a busy machine are no test.
    measures = [of for of in protocol.CLAIMS if of != "ms_per_mpx" or given.write or given.check]
    failed = [*failed_claims(results, measures), *failed_fixtures(results)]
    if failed:
        sys.exit("deltille is not ahead as claimed:\n  " + "\n  ".join(failed))


if __name__ == "__main__":
    main()
