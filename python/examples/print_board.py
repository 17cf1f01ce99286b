"""Make a board, write it for printing, and verify the file by reading it back.

    python print_board.py [FOLDER]
"""

import sys
from pathlib import Path

import deltille


def main() -> None:
    folder = Path(sys.argv[1] if len(sys.argv) > 1 else "desk")
    # 10 rows of 11 corners, tiles of 20 mm, tags of the default family.
    board = deltille.Board(10, 11, edge_mm=20, name="desk")
    for path in board.save(folder, formats=["pdf"]):
        print("wrote", path)
    # Print it at 100 %, and measure the check bars with a ruler.
    verdict = board.verify(folder / "desk.pdf")
    print(verdict)
    if not verdict:
        raise SystemExit("\n".join(verdict.findings))
    print(f"{len(board)} corners, the last at {board.corners[-1]} mm; {len(board.tags)} tags")


if __name__ == "__main__":
    main()
