import pickle

import numpy
import pytest

import deltille


def test_families_have_arrays_of_codes():
    assert "d25h7" in deltille.Family.shipped()
    family = deltille.Family.load("delTag25h7")
    assert family.codes.dtype == numpy.uint64 and len(family) == len(family.codes) == 343
    assert (family.bits, family.distance, family.correctable, family.kind) == (25, 7, 3, "deltille")
    distances, counts = family.distances()
    assert distances[0] == 7 and counts.sum() > len(family) ** 2
    assert pickle.loads(pickle.dumps(family)).fingerprint == family.fingerprint


def test_words_are_decoded_with_their_errors():
    family = deltille.Family.load("delTag25h7")
    generator = numpy.random.default_rng(1)
    words = family.codes.copy()
    errors = generator.integers(0, 4, len(words))
    for i, count in enumerate(errors):
        for bit in generator.choice(25, count, replace=False):
            words[i] ^= numpy.uint64(1 << int(bit))
    ids, rotations, corrected = family.decode(words)
    assert (ids == numpy.arange(len(words))).all() and (rotations == 0).all()
    assert (corrected == errors).all()
    ids, rotations, corrected = family.decode(words, max_errors=0)
    assert ((ids >= 0) == (errors == 0)).all()
    with pytest.raises(deltille.FamilyError, match="25 bits"):
        family.decode(numpy.array([1 << 30], numpy.uint64))


def test_a_search_reports_progress_and_can_be_stopped(tmp_path):
    reports = []
    family = deltille.search_family("d16h7", work=1, seed=3, callback=lambda part, codes: reports.append((part, codes)))
    assert len(family) > 0 and family.distance == 7
    again = deltille.search_family("d16h7", work=1, seed=3)
    assert (again.codes == family.codes).all()
    path = family.save(tmp_path / "own.json")
    board = deltille.Board(4, 5, family=path)
    assert board.family.name == family.name
    assert deltille.Board(4, 5, family=family).family.fingerprint == family.fingerprint

    ended = deltille.search_family("d25h7", seconds=60, callback=lambda part, codes: False)
    assert len(ended) >= 1208

    def fails(part, codes):
        raise RuntimeError("mine")

    with pytest.raises(RuntimeError, match="mine"):
        deltille.search_family("d25h7", seconds=60, callback=fails)
    for wrong in ("h7", "d25", "d1h1", "d25h99"):
        with pytest.raises(deltille.FamilyError):
            deltille.search_family(wrong)
