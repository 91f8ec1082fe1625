"""Which piece stands on a square: a small convolutional network, run by OpenCV.

For positions without history, promotions and the set-up. What it says are log-likelihoods: differences within
a row are evidence, to be added to what the rules and the game make likely. A set that it has never seen is
read better after `PieceClassifier.adapted` has seen one known position of it.
"""

import json
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any, Self

import chess
import cv2
import numpy as np
import numpy.typing as npt
from scipy.optimize import minimize
from scipy.special import log_softmax

from kempelen.core.camera import Picture
from kempelen.core.errors import SensorError
from kempelen.core.geometry import Array
from kempelen.sensing.kinds.crops import Crops, crops
from kempelen.sensing.sighting import BoardSighting

CLASSES = ".PNBRQKpnbrqk"
"""Columns: empty, White's men, Black's."""
FEATURES = 96
"""Length of the network's description of a crop."""
WEIGHTS = Path(__file__).with_name("kinds.onnx")
NOTES = ".json"
"""Ending of the file beside the weights that tells how they were made."""

_STIFFNESS = 30.0
"""Of the last layer against a new set; chosen on drawn sets (docs/explanation/piece-classifier.md)."""
_FLOOR = -12.0
"""Log-likelihoods so far below the best are cut: no network is as sure as it says."""


@dataclass(frozen=True, slots=True, eq=False)
class LastLayer:
    """From features to scores: the part that a new set changes.

    Attributes:
        weight: (FEATURES, 13).
        bias: (13,).
    """

    weight: Array
    bias: Array

    def __call__(self, features: Array) -> Array:
        """(n, 13) scores of (n, FEATURES)."""
        out: Array = features @ self.weight + self.bias
        return out

    def fitted(self, features: Array, labels: npt.NDArray[np.int64], stiffness: float) -> "LastLayer":
        """The most probable layer given examples, with a Gaussian about this one as prior.

        Args:
            features: (n, FEATURES).
            labels: (n,) indices into `CLASSES`.
            stiffness: Inverse variance of a weight.
        """
        known = np.column_stack([features, np.ones(len(features))])
        scores, target = self(features), np.eye(len(CLASSES))[labels]

        def cost(flat: Array) -> tuple[float, Array]:
            change = flat.reshape(-1, len(CLASSES))
            likely = log_softmax(scores + known @ change, axis=1)
            slope = known.T @ (np.exp(likely) - target) + stiffness * change
            return float(0.5 * stiffness * (change**2).sum() - (likely * target).sum()), slope.ravel()

        start = np.zeros(known.shape[1] * len(CLASSES))
        change = minimize(cost, start, jac=True, method="L-BFGS-B").x.reshape(-1, len(CLASSES))
        return LastLayer(self.weight + change[:-1], self.bias + change[-1])


@dataclass(frozen=True, slots=True, eq=False)
class Notes:
    """What stands beside a file of weights.

    Attributes:
        temperature: By which scores are divided so that their probabilities are right.
        photos: SHA-256 of every photo that was trained on, by name.
        layer: The network's last.
    """

    temperature: float
    photos: Mapping[str, str]
    layer: LastLayer

    @classmethod
    def beside(cls, weights: Path) -> Self:
        """Of a file of weights.

        Raises:
            SensorError: they are missing or damaged.
        """
        path = weights.with_suffix(NOTES)
        try:
            told = json.loads(path.read_text(encoding="utf-8"))
            layer = LastLayer(np.array(told["weight"], dtype=float), np.array(told["bias"], dtype=float))
            return cls(float(told["temperature"]), dict(told["photos"]), layer)
        except (OSError, ValueError, KeyError, TypeError) as error:
            raise SensorError(
                f"The notes of the piece classifier's weights, {path}, cannot be read: {error}.",
                hint="Install Kempelen again, or run bench/train_pieces.py.",
            ) from error


class PieceClassifier:
    """Reads all 64 squares of a picture at once."""

    def __init__(self, weights: Path = WEIGHTS, layer: LastLayer | None = None) -> None:
        """With the weights in the package, or others that bench/train_pieces.py wrote.

        Args:
            weights: File of the network, with its notes beside it.
            layer: Instead of the network's last.

        Raises:
            SensorError: the weights are missing or damaged.
        """
        self._weights = weights
        self.notes = Notes.beside(weights)
        self._network = _loaded(weights)
        self._layer = layer or self.notes.layer

    def read(self, picture: Picture, sighting: BoardSighting) -> Array:
        """(64, 13) log p(seen | piece), in python-chess order of squares; the best of each row is 0.

        Args:
            picture: (height, width, 3) blue, green, red.
            sighting: Where the board is in it, its orientation known.
        """
        return self.judged(crops(picture, sighting))

    def judged(self, squares: Crops) -> Array:
        """(n, 13) log-likelihoods of (n, 96, 64, 4) crops."""
        scores = self._layer(self._network.features(squares)) / self.notes.temperature
        out: Array = np.maximum(scores - scores.max(axis=1, keepdims=True), _FLOOR)
        return out

    def adapted(self, picture: Picture, sighting: BoardSighting, board: chess.Board) -> "PieceClassifier":
        """One that also knows the set at hand, from a picture of a known position.

        Call it again on the result to learn from a further picture.
        """
        return self.taught(crops(picture, sighting), labels_of(board))

    def taught(
        self, squares: Crops, labels: npt.NDArray[np.int64], stiffness: float = _STIFFNESS
    ) -> "PieceClassifier":
        """As `adapted`, from (n, 96, 64, 4) crops and (n,) indices into `CLASSES`."""
        layer = self._layer.fitted(self._network.features(squares), labels, stiffness)
        return PieceClassifier(self._weights, layer)


class _Network:
    """OpenCV's."""

    def __init__(self, data: bytes) -> None:
        self._net: Any = cv2.dnn.readNetFromONNX(np.frombuffer(data, np.uint8))

    def features(self, squares: Crops) -> Array:
        """(n, FEATURES) of (n, 96, 64, 4) crops."""
        self._net.setInput(
            np.ascontiguousarray(squares.transpose(0, 3, 1, 2), dtype=np.float32) / np.float32(255)
        )
        return np.asarray(self._net.forward(), dtype=np.float64)


@cache
def _loaded(weights: Path) -> _Network:
    try:
        return _Network(weights.read_bytes())
    except (OSError, cv2.error) as error:
        raise SensorError(
            f"The piece classifier's weights, {weights}, cannot be read: {error}.",
            hint="Install Kempelen again, or run bench/train_pieces.py.",
        ) from error


def labels_of(board: chess.BaseBoard) -> npt.NDArray[np.int64]:
    """(64,) index into `CLASSES` of what stands on each square."""
    symbols = [piece.symbol() if (piece := board.piece_at(square)) else "." for square in chess.SQUARES]
    return np.array([CLASSES.index(symbol) for symbol in symbols], dtype=np.int64)


def likeliest(row: Array, among: Iterable[chess.Piece | None]) -> tuple[chess.Piece | None, float]:
    """Which of a few answers a square's row speaks for: "is the man on e8 a queen or a knight?".

    Args:
        row: (13,) log-likelihoods of the square.
        among: The answers that are possible, None for an empty square; at least one.

    Returns:
        The likeliest, and by how much in log-likelihood it leads before the next (infinite without a next).
    """
    answers = list(among)
    likely = np.array([row[CLASSES.index(answer.symbol() if answer else ".")] for answer in answers])
    order = np.argsort(-likely)
    lead = float(likely[order[0]] - likely[order[1]]) if len(answers) > 1 else float("inf")
    return answers[int(order[0])], lead
