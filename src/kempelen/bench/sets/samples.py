"""What the piece classifier is trained on: crops with labels, from drawn pictures and from photos."""

import json
from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import chess
import numpy as np
import numpy.typing as npt
from numpy.random import Generator

from kempelen.bench.real_data import Labelled, labelled, sighting_of
from kempelen.bench.sets.pictures import Truth, draw
from kempelen.core.camera import Picture
from kempelen.sensing.kinds.classifier import CLASSES, labels_of
from kempelen.sensing.kinds.crops import Crops, crops
from kempelen.sensing.sighting import OUTER_CORNERS, BoardSighting
from kempelen.twin.cameras.studio import Studio

Labels = npt.NDArray[np.int64]

_SAME_GAME = 12
"""Squares: photos taken one after the other that differ in no more are of one game."""
_EMPTIES = 12
"""Of a picture: the others would teach nothing new."""
_LOOKS = 2
"""Crops of each man in a drawn picture, each from a sighting with its own error."""
_CUT = 1 / 3
"""Share of pictures of which a part is shown: there the lens's axis is not in the middle."""


@dataclass(frozen=True, slots=True)
class Photo:
    """A photo of a game.

    Attributes:
        source: The picture and its labels; its corners are those of a8, h8, h1 and a1.
        board: What stands on it.
        game: Number of the game that it belongs to, from 1.
    """

    source: Labelled
    board: chess.Board
    game: int

    def truth(self) -> Truth:
        """The picture with its sighting."""
        return Truth(self.source.picture(), self.source.sighting(), self.board)


def game_photos(data: Path) -> list[Photo]:
    """Photos of games in a folder of labelled pictures, by name; empty where there are none.

    Raises:
        ConfigError: the labels cannot be read.
    """
    photos: list[Photo] = []
    for source in sorted(labelled(data, "game-photos"), key=lambda each: each.path.name):
        board = chess.Board(None)
        board.set_board_fen(str(source.label["fen"]).split()[0])
        last = photos[-1] if photos else None
        same = last is not None and differing(last.board, board) <= _SAME_GAME
        game = 1 if last is None else last.game + (not same)
        photos.append(Photo(source, board, game))
    return photos


@dataclass(frozen=True, slots=True, eq=False)
class Known:
    """A photo to train on or to be measured on.

    Attributes:
        name: Of the file.
        digest: SHA-256 of the file.
        truth: Picture and sighting.
        labels: (64,) what stands there, -1 where nobody can tell.
    """

    name: str
    digest: str
    truth: Truth
    labels: Labels


def real_photos(data: Path, without: Collection[int], labels: Path) -> tuple[list[Known], list[Known]]:
    """Photos to train on, and photos of sets that are not trained on.

    Args:
        data: Folder of labelled pictures.
        without: Games that are held out.
        labels: File that corrects labels of game photos and tells what stands on board photos, by SHA-256.
    """
    told = json.loads(labels.read_text(encoding="utf-8"))
    learn: list[Known] = []
    for photo in game_photos(data):
        if photo.game not in without:
            digest = photo.source.digest
            board = chess.BaseBoard(told["corrected"].get(digest, photo.board.board_fen()))
            learn.append(Known(photo.source.path.name, digest, photo.truth(), labels_of(board)))
    other: list[Known] = []
    for source in labelled(data, "board-photos"):
        digest = source.digest
        for group, name in ((learn, "trained_on"), (other, "other_sets")):
            if rows := told[name].get(digest):
                ranks = [[CLASSES.find(symbol) for symbol in rank] for rank in reversed(rows.split("/"))]
                truth = Truth(source.picture(), source.sighting(), chess.Board(None))
                group.append(Known(source.path.name, digest, truth, np.array(ranks).ravel()))
    return learn, other


def differing(one: chess.Board, other: chess.Board) -> int:
    """On how many squares two positions differ."""
    return sum(one.piece_at(square) != other.piece_at(square) for square in chess.SQUARES)


def drawn(seed: int) -> tuple[Crops, Labels]:
    """Crops of one drawn picture with their labels."""
    rng = np.random.default_rng(seed)
    return _looks(draw(rng), rng)


def staged(seed: int, count: int) -> tuple[Crops, Labels]:
    """Crops of ``count`` pictures of the twin's studio with their labels.

    Raises:
        TwinError: nothing can be drawn here.
    """
    rng = np.random.default_rng(seed)
    return joined([_looks(truth, rng) for truth in studio_pictures(seed, count)])


def studio_pictures(seed: int, count: int) -> Iterator[Truth]:
    """Pictures of the twin's studio.

    Raises:
        TwinError: nothing can be drawn here.
    """
    rng = np.random.default_rng(seed)
    with Studio(seed=seed) as studio:
        for _ in range(count):
            shot = studio.render(rng)
            if shot.frame.colour is None:
                raise ValueError("a studio's frame always has a colour picture")
            yield Truth(shot.frame.colour, sighting_of(shot.corners[[3, 2, 1, 0]]), shot.board)


def photographed(truth: Truth, labels: Labels, looks: int, seed: int) -> tuple[Crops, Labels]:
    """Crops of one photo, from ``looks`` sightings with errors, with their labels.

    Args:
        truth: The photo and its sighting.
        labels: (64,) what stands there, -1 where nobody can tell.
        looks: How many crops of each square.
        seed: Of the errors.
    """
    rng = np.random.default_rng(seed)
    known = labels >= 0
    return joined([(_glance(truth, rng)[known], labels[known]) for _ in range(looks)])


def _looks(truth: Truth, rng: Generator) -> tuple[Crops, Labels]:
    """All men at every look, and some empty squares at the first."""
    labels = labels_of(truth.board)
    out: list[tuple[Crops, Labels]] = []
    for look in range(_LOOKS):
        seen = _glance(truth, rng)
        empty = rng.permutation(np.flatnonzero(labels == 0))[: 0 if look else _EMPTIES]
        wanted = np.sort(np.concatenate([np.flatnonzero(labels), empty]))
        out.append((seen[wanted], labels[wanted]))
    return joined(out)


def _glance(truth: Truth, rng: Generator) -> Crops:
    """All squares, from a sighting with an error."""
    return crops(*_cut(truth.picture, _astray(truth.sighting, rng), rng))


def joined(pairs: Sequence[tuple[Crops, Labels]]) -> tuple[Crops, Labels]:
    """Crops and labels of all pairs."""
    return np.concatenate([pair[0] for pair in pairs]), np.concatenate([pair[1] for pair in pairs])


def _astray(sighting: BoardSighting, rng: Generator) -> BoardSighting:
    """With corners wrong by as much as a finder may be wrong."""
    spread = rng.uniform(0, 0.08)
    return sighting_of(sighting.pixels(OUTER_CORNERS[[3, 2, 1, 0]] + rng.normal(0, spread, (4, 2))))


def _cut(picture: Picture, sighting: BoardSighting, rng: Generator) -> tuple[Picture, BoardSighting]:
    """Some pictures are cut to a part that holds the board."""
    if rng.random() > _CUT:
        return picture, sighting
    height, width = picture.shape[:2]
    corners = sighting.corners
    low = np.clip(corners.min(axis=0), 0, [width - 2, height - 2])
    high = np.clip(corners.max(axis=0), low + 1, [width - 1, height - 1])
    left, top = (rng.uniform(0, 1, 2) * low).astype(int)
    right, bottom = (high + rng.uniform(0, 1, 2) * ([width, height] - high)).astype(int)
    part = np.ascontiguousarray(picture[top : bottom + 1, left : right + 1])
    return part, sighting_of(corners[[3, 2, 1, 0]] - [left, top])
