"""Do tag ids in small type reduce the precision of the corners beside them?

    ids.py <program> <folder>

Boards with and without --tag-ids, rendered by cairo and photographed with numpy from the same poses.
"""

import pathlib
import sys

import numpy as np

from dense import Board, detect, labelled

VIEWS = 8


def precision(program, folder, sizes, edges_px):
    boards = {
        "with ids": Board(program, folder, "ids", *sizes, "--tag-ids"),
        "without": Board(program, folder, "plain", *sizes),
    }
    for edge_px in edges_px:
        errors = {}
        for name, board in boards.items():
            rng = np.random.default_rng(13)
            views = [board.view(rng, edge_px, None) for _ in range(VIEWS)]
            found = detect(program, board, f"{folder}/views", [image for image, _ in views])
            off = [labelled(detection, corners) for detection, (_, corners) in zip(found, views)]
            assert sum(map(len, off)) == VIEWS * len(board.corners), (name, edge_px, list(map(len, off)))
            errors[name] = np.sqrt(np.mean(np.square(np.concatenate(off)) / 2))
        words = ", ".join(f"{error:.4f} px {name}" for name, error in errors.items())
        print(f"tiles of {edge_px:g} px: {words}")
        assert errors["with ids"] < 1.1 * errors["without"]


def main():
    program, folder = sys.argv[1:3]
    pathlib.Path(folder).mkdir(parents=True, exist_ok=True)
    sizes = ["--rows", "12", "--cols", "14", "--edge", "12mm", "--family", "d36h9", "--first-id", "12000"]
    precision(program, folder, sizes, (20.0, 30.0, 60.0))


if __name__ == "__main__":
    main()
