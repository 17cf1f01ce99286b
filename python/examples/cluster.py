"""Detect a board in a folder or bucket of photographs on a Ray cluster, and calibrate from the results.

    python cluster.py board.json s3://bucket/photographs s3://bucket/found
    python cluster.py board.json photographs found && deltille calibrate found --target board.json --model radtan

Without a cluster, Ray uses the processors of this machine. Repeat the command to resume an interrupted run.
"""

import sys

import pyarrow.parquet as pq

import deltille
import deltille.ray


def main(target: str, photographs: str, found: str) -> None:
    board = deltille.Target.load(target)
    summary = deltille.ray.detect_to(found, photographs, board)
    print(summary)
    pictures = pq.read_table(f"{found}/images").to_pandas()
    print(pictures["why"].value_counts())
    for row in pictures[pictures["error"].notna()].itertuples():
        print(f"{row.image}: {row.error}")


if __name__ == "__main__":
    main(*sys.argv[1:])
