"""Detection tables in other programs, and cameras calibrated from the tables that these programs write.

    python tables.py path/to/deltille FOLDER

makes a board and views of it in FOLDER, and detections of these as JSON and as Parquet. pyarrow, DuckDB and Polars read
the tables, whose numbers must equal those of the JSON to the last bit, and write them again. `deltille calibrate` must
compute the same camera from all of them. Programs that are not installed are reported and skipped.
"""

import json
import pathlib
import random
import subprocess
import sys

CAMERA = "width: 640\nheight: 480\nfocal_px: [600, 600]\ncentre_px: [320, 240]\n"
TABLES = ("corners", "images")


def run(*command):
    done = subprocess.run([str(part) for part in command], capture_output=True, text=True)
    if done.returncode != 0:
        sys.exit(f"{' '.join(map(str, command))}: {done.stderr.strip()}")


def shuffled_by_pandas(source, to):
    import pandas

    # Rows in another order, and labels as floating-point numbers, which some programs write if values are missing.
    frame = pandas.read_parquet(source).sample(frac=1, random_state=3)
    if "panel" in frame:
        frame = frame.astype({"panel": float, "id": float})
    frame.to_parquet(to)
    return frame.sort_values([name for name in ("image", "grid", "row", "col") if name in frame]).to_dict("records")


def by_pyarrow(source, to):
    import pyarrow.parquet as parquet

    table = parquet.read_table(source)
    parquet.write_table(table, to, data_page_version="2.0", row_group_size=50)
    return table.to_pylist()


def by_duckdb(source, to):
    import duckdb

    duckdb.sql(f"copy (select * from '{source}') to '{to}' (format parquet)")
    found = duckdb.sql(f"select * from '{source}'")
    return [dict(zip(found.columns, row)) for row in found.fetchall()]


def by_polars(source, to):
    import polars

    table = polars.read_parquet(source)
    table.write_parquet(to, compression="snappy")
    return table.to_dicts()


READERS = {"pyarrow": by_pyarrow, "DuckDB": by_duckdb, "Polars": by_polars, "pandas": shuffled_by_pandas}


def compare(rows, folder):
    """Compares rows of the table of corners with the JSON."""
    due = []
    for path in sorted(folder.glob("*.json")):
        found = json.loads(path.read_text())
        for index, grid in enumerate(found["grids"]):
            for corner in grid["corners"]:
                due.append((found["image"], index, grid["panel"], corner["row"], corner["col"], corner["id"],
                            corner["x"], corner["y"], *corner["cov"]))
    names = ("image", "grid", "panel", "row", "col", "id", "x", "y", "cov_xx", "cov_xy", "cov_yy")
    seen = [tuple(row[name] for name in names) for row in rows]
    assert seen == due, "numbers differ from those of the JSON"
    return len(due)


def main(deltille, folder):
    folder.mkdir(parents=True, exist_ok=True)
    run(deltille, "board", "--rows", 8, "--cols", 9, "--name", "b", "--no-verify", "-o", folder)
    (folder / "camera.yaml").write_text(CAMERA)
    dice = random.Random(4)
    views = folder / "views"
    views.mkdir(exist_ok=True)
    for index in range(10):
        eye = f"{dice.uniform(-200, 200):.0f},{dice.uniform(-200, 200):.0f},{dice.uniform(350, 450):.0f}"
        run(deltille, "render", folder / "b.json", "--camera", folder / "camera.yaml", "--eye", eye,
            "--seed", index, "-o", views / f"{index}.png")
    images = sorted(views.glob("*.png"))
    target = ("--target", folder / "b.json")
    run(deltille, "detect", *images, *target, "--format", "json", "-o", folder / "json")
    run(deltille, "detect", *images, *target, "--format", "parquet", "-o", folder / "own")

    def camera(of):
        run(deltille, "calibrate", of, *target, "--model", "radtan", "-o", folder / "cameras" / of.name)
        return [(folder / "cameras" / of.name / f"camera.{end}").read_bytes() for end in ("json", "yaml")]

    expected = camera(folder / "json")
    assert camera(folder / "own") == expected, "another camera from tables"
    for name, read in READERS.items():
        anew = folder / name
        anew.mkdir(exist_ok=True)
        try:
            rows = {table: read(folder / f"own/{table}.parquet", anew / f"{table}.parquet") for table in TABLES}
        except ImportError:
            print(f"not there, and so not asked: {name}")
            continue
        count = compare(rows["corners"], folder / "json")
        assert [row["image"] for row in rows["images"]] == [image.name for image in images]
        assert camera(anew) == expected, f"another camera from what {name} wrote"
        print(f"{name}: {count} corners as in the JSON, and the same camera from its tables")


if __name__ == "__main__":
    main(pathlib.Path(sys.argv[1]), pathlib.Path(sys.argv[2]))
