"""Cells of triangular tags, as `deltille_core::lattice::TagCells` has them: their order, their places, their neighbours."""

import numpy as np

BORDER_BITS = 1.5


def cells(rows):
    """Row, column and whether it points up, of the cell of each bit; the first carries bit 0."""
    by_bit = {}
    for row in range(rows):
        for k in range(2 * (rows - row) - 1):
            by_bit[rows**2 - 1 - (rows - 1 - row) ** 2 - k] = (row, k // 2, k % 2 == 0)
    return [by_bit[bit] for bit in range(rows**2)]


def neighbours(rows):
    """Pairs of bits whose cells share an edge."""
    bit_of = {cell: bit for bit, cell in enumerate(cells(rows))}
    pairs = []
    for (row, col, upright), bit in bit_of.items():
        if not upright:
            beside = [(row, col, True), (row, col + 1, True), (row + 1, col, True)]
            pairs += [(bit, bit_of[cell]) for cell in beside if cell in bit_of]
    return np.array(pairs)


def turned(rows, words):
    """Words after a turn by 120° counter-clockwise: the cell at (row, rest, col) comes to (col, row, rest)."""
    bit_of = {cell: bit for bit, cell in enumerate(cells(rows))}
    result = np.zeros_like(words)
    for (row, col, upright), bit in bit_of.items():
        rest = rows - 1 - row - col - (0 if upright else 1)
        source = bit_of[rest, row, upright]
        result |= (words >> np.uint64(source) & np.uint64(1)) << np.uint64(bit)
    return result


def sample_points(rows):
    """Where the cells are sampled, in tile coordinates: [bit, 4, 2], the middle and half-way to the corners."""
    width = rows + 3 * BORDER_BITS
    points = []
    for row, col, upright in cells(rows):
        u, v = BORDER_BITS + col, BORDER_BITS + row
        corners = [(u, v), (u + 1, v), (u, v + 1)] if upright else [(u + 1, v + 1), (u, v + 1), (u + 1, v)]
        corners = np.array(corners) / width
        middle = corners.mean(0)
        points.append(np.vstack([middle, (corners + middle) / 2]))
    return np.array(points)


def differing(rows, words):
    """Number of pairs of neighbours that differ."""
    count = np.zeros(len(words), np.uint8)
    for a, b in neighbours(rows):
        count += ((words >> np.uint64(a) ^ words >> np.uint64(b)) & np.uint64(1)).astype(np.uint8)
    return count


def white(words):
    """Number of white cells."""
    return np.bitwise_count(words)


def counts_of_words(rows):
    """How many words have so many pairs that differ and so many white cells: [pairs + 1, bits + 1], exactly.

    Cell by cell, with what is known of the inverted cells of the row below and of the cell to the left.
    """
    pairs, bits = 3 * rows * (rows - 1) // 2, rows**2
    # State: colours of the inverted cells of the last row and of this, as tuples.
    states = {(): np.zeros((pairs + 1, bits + 1), object)}
    states[()][0, 0] = 1
    for row in range(rows):
        width = rows - row
        states = {(below, (), None): table for below, table in states.items()}
        for k in range(2 * width - 1):
            col, upright, following = k // 2, k % 2 == 0, {}
            for (below, this, left), table in states.items():
                for colour in (0, 1):
                    edges = int(left is not None and left != colour)
                    if upright and below:
                        edges += below[col] != colour
                    moved = np.zeros_like(table)
                    moved[edges:, colour:] = table[: pairs + 1 - edges, : bits + 1 - colour]
                    key = (below, this if upright else this + (colour,), colour)
                    following[key] = following[key] + moved if key in following else moved
            states = following
        merged = {}
        for (_, this, _), table in states.items():
            merged[this] = merged[this] + table if this in merged else table
        states = merged
    return states[()]
