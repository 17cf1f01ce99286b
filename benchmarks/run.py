"""deltille beside other detectors, calibrators and generators: installs them, makes the data, measures, and prints tables.

    python benchmarks/run.py FOLDER                # everything: about three quarters of an hour on two cores
    python benchmarks/run.py FOLDER --scene usual "tilt 60°" --board charuco
    python benchmarks/run.py FOLDER --write        # also into docs/benchmarks.md, its plot and results.json

The peers of requirements.txt are installed from PyPI into FOLDER/venv, and deltille from this repository, which needs Rust.
What cannot be installed is not compared, and named. poppler (pdftocairo) draws the pages; Chromium is optional.
"""

import argparse
import os
import pathlib
import shutil
import subprocess
import sys

import protocol

HERE = pathlib.Path(__file__).resolve().parent
PROJECT = HERE.parent


def installed(folder):
    """Python with the peers and deltille."""
    python = folder / "venv/bin/python"
    if not python.exists():
        subprocess.run([sys.executable, "-m", "venv", folder / "venv"], check=True)
    pip = [python, "-m", "pip", "install", "--quiet"]
    # aprilcube asks for OpenCV 4, and works with 5.
    alone = ["--no-deps", "aprilcube==0.3.1"]
    lines = (HERE / "requirements.txt").read_text().splitlines()
    packages = [line for line in lines if line and not line.startswith("#")]
    if subprocess.run([*pip, *packages]).returncode != 0:
        for package in packages:
            if subprocess.run([*pip, package]).returncode != 0:
                print(f"not installed: {package}")
    if subprocess.run([*pip, *alone]).returncode != 0:
        print("not installed: aprilcube")
    subprocess.run([*pip, PROJECT], check=True)
    return python


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=pathlib.Path)
    parser.add_argument("--seed", type=int, default=protocol.SEED)
    parser.add_argument("--scene", nargs="+", choices=protocol.SCENES, metavar="NAME", help=", ".join(protocol.SCENES))
    parser.add_argument("--board", nargs="+", choices=protocol.BOARDS)
    parser.add_argument("--paper", type=pathlib.Path, help="the paper's data set: a folder with `fisheye` and `robot-hand`")
    parser.add_argument("--reference", type=pathlib.Path, help="the paper's detector, see detectors.py, class Reference")
    parser.add_argument("--write", action="store_true", help="replace the tables of docs/benchmarks.md, the plot and results.json")
    parser.add_argument("--python", type=pathlib.Path, help="an interpreter that has the packages; nothing is installed")
    parser.add_argument("--program", type=pathlib.Path, help="the program deltille [default: it is built]")
    given = parser.parse_args()
    if given.seed < 0:
        parser.error("--seed: must not be negative")
    if not shutil.which("pdftocairo"):
        parser.error("pdftocairo was not found: install poppler (Debian: poppler-utils)")
    for option in ("python", "program", "reference"):
        if (path := getattr(given, option)) and not os.access(path, os.X_OK):
            parser.error(f"--{option}: {path} is not a program")
    if given.paper and not any((given.paper / name).is_dir() for name in ("fisheye", "robot-hand")):
        parser.error(f"--paper: {given.paper} has neither the folder fisheye nor robot-hand")
    if given.write and (given.scene or given.board):
        parser.error("--write: needs all scenes and boards")
    folder = given.folder.resolve()
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        parser.error(f"{folder}: {error.strerror}")
    # `resolve` would leave a virtual environment.
    python = given.python.absolute() if given.python else installed(folder)
    program = given.program and given.program.resolve()
    if program is None:
        subprocess.run(["cargo", "build", "--release", "--bin", "deltille"], cwd=PROJECT, check=True)
        program = pathlib.Path(os.environ.get("CARGO_TARGET_DIR", PROJECT / "target")) / "release/deltille"
    chosen = [part for name in ("scene", "board") if (of := getattr(given, name)) for part in (f"--{name}", *of)]

    def script(name, *arguments):
        code = subprocess.run([python, HERE / f"{name}.py", *map(str, arguments)]).returncode
        if code != 0:
            sys.exit(f"{name}.py ended with exit code {code}")

    if given.reference:
        os.environ["REFERENCE_DETECTOR"] = str(given.reference.resolve())
    script("photographs", program, folder, "--seed", given.seed, *chosen)
    script("measured", folder)
    if not chosen:
        script("cameras", folder)
        script("prints", program, folder)
        script("fixtures", program, folder)
        script("public", program, folder)
    if given.paper:
        script("paper", program, folder, given.paper.resolve())
    done = subprocess.run([python, HERE / "tables.py", folder, *(["--write"] if given.write else [])])
    sys.exit(done.returncode)


if __name__ == "__main__":
    main()
