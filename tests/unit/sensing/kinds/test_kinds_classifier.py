"""The piece classifier: what it says, how it learns a set, and what it does with damaged weights."""

import json
import shutil
from pathlib import Path

import chess
import numpy as np
import pytest
from scipy.special import log_softmax

from kempelen.core.errors import SensorError
from kempelen.sensing.kinds.classifier import (
    CLASSES,
    FEATURES,
    NOTES,
    WEIGHTS,
    LastLayer,
    PieceClassifier,
    labels_of,
    likeliest,
)
from kempelen.sensing.kinds.crops import HEIGHT, WIDTH

QUEEN, KNIGHT = chess.Piece.from_symbol("q"), chess.Piece.from_symbol("n")


def random_crops(count: int, seed: int = 1) -> np.ndarray:
    return np.random.default_rng(seed).integers(0, 256, (count, HEIGHT, WIDTH, 4), dtype=np.uint8)


def test_the_weights_are_small_and_tell_what_they_have_seen() -> None:
    assert WEIGHTS.stat().st_size + WEIGHTS.with_suffix(NOTES).stat().st_size <= 3_000_000
    notes = PieceClassifier().notes
    assert 0.2 < notes.temperature < 5
    assert all(len(digest) == 64 for digest in notes.photos.values())


def test_log_likelihoods_are_relative_to_the_best_and_bounded() -> None:
    likely = PieceClassifier().judged(random_crops(64))
    assert likely.shape == (64, 13)
    assert likely.max(axis=1) == pytest.approx(np.zeros(64))
    assert likely.min() >= -12.0


def test_a_crop_is_judged_alike_in_any_company() -> None:
    squares = random_crops(8)
    classifier = PieceClassifier()
    assert classifier.judged(squares)[3:5] == pytest.approx(classifier.judged(squares[3:5]), abs=1e-3)


def test_a_known_position_teaches_the_set() -> None:
    squares, labels = random_crops(26), np.arange(26) % 13
    before = PieceClassifier()
    after = before.taught(squares, labels, stiffness=0.001)
    assert (after.judged(squares).argmax(axis=1) == labels).mean() > 0.9
    assert (before.judged(squares).argmax(axis=1) == labels).mean() < 0.5  # and is itself unchanged


def test_an_infinitely_stiff_layer_learns_nothing() -> None:
    squares, labels = random_crops(26), np.arange(26) % 13
    before = PieceClassifier()
    after = before.taught(squares, labels, stiffness=1e9)
    assert after.judged(squares) == pytest.approx(before.judged(squares), abs=1e-4)


def test_the_fitted_layer_is_the_most_probable() -> None:
    rng = np.random.default_rng(3)
    layer = LastLayer(rng.normal(0, 0.1, (FEATURES, 13)), rng.normal(0, 0.1, 13))
    features, labels = rng.normal(0, 1, (20, FEATURES)), rng.integers(0, 13, 20)

    def cost(other: LastLayer) -> float:
        likely = log_softmax(other(features), axis=1)[np.arange(20), labels].sum()
        change = ((other.weight - layer.weight) ** 2).sum() + ((other.bias - layer.bias) ** 2).sum()
        return float(0.5 * 0.3 * change - likely)

    best = layer.fitted(features, labels, 0.3)
    assert cost(best) < cost(layer)
    for _ in range(10):
        nearby = LastLayer(best.weight + rng.normal(0, 0.02, best.weight.shape), best.bias)
        assert cost(best) < cost(nearby)


def test_a_question_among_a_few_kinds_is_answered_with_its_margin() -> None:
    row = np.full(13, -9.0)
    row[CLASSES.index(".")], row[CLASSES.index("q")], row[CLASSES.index("n")] = 0.0, -2.0, -5.5
    assert likeliest(row, [KNIGHT, QUEEN]) == (QUEEN, 3.5)
    assert likeliest(row, [KNIGHT, QUEEN, None]) == (None, 2.0)
    assert likeliest(row, [KNIGHT]) == (KNIGHT, float("inf"))


def test_labels_follow_python_chess() -> None:
    labels = labels_of(chess.Board())
    assert [CLASSES[labels[square]] for square in (chess.A1, chess.E1, chess.D8, chess.H7, chess.E4)] == list(
        "RKqp."
    )


def test_damaged_or_missing_weights_are_told(tmp_path: Path) -> None:
    with pytest.raises(SensorError, match="cannot be read"):
        PieceClassifier(tmp_path / "none.onnx")
    broken = tmp_path / "broken.onnx"
    broken.write_bytes(b"not a network")
    shutil.copy(WEIGHTS.with_suffix(NOTES), broken.with_suffix(NOTES))
    with pytest.raises(SensorError, match="cannot be read"):
        PieceClassifier(broken)
    whole = tmp_path / "whole.onnx"
    shutil.copy(WEIGHTS, whole)
    for notes in ("{", json.dumps({"temperature": 1}), json.dumps([1])):
        whole.with_suffix(NOTES).write_text(notes)
        with pytest.raises(SensorError, match="notes"):
            PieceClassifier(whole)
