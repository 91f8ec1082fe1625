"""Train the piece classifier and write its weights into the package.

    python bench/train_pieces.py --data ../shared/real

Needs the dependency group ``train`` (PyTorch for the training, ONNX for the file) and OpenGL; neither is
needed to run Kempelen. Everything random is seeded. Drawn crops are kept in ``--work`` and drawn only once.

Photos of one game are never split: ``--without 1`` trains without the photos of game 1, which the file's
notes then do not list, so that ``kempelen bench vision`` scores the weights on them.
"""

import argparse
import json
from collections.abc import Callable, Iterable
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
import numpy.typing as npt
import torch
from torch import nn
from torch.nn import functional

from kempelen.bench.sets.graph import Graph
from kempelen.bench.sets.samples import Known, Labels, drawn, joined, photographed, real_photos, staged
from kempelen.sensing.kinds.classifier import CLASSES, FEATURES, NOTES, WEIGHTS
from kempelen.sensing.kinds.crops import DARKEST, FOOT, HEIGHT, LIGHTEST, WIDTH, Crops

LABELS = Path(__file__).with_name("piece_labels.json")
"""What stands on photos whose labels are wrong or missing, by the SHA-256 of the file; ``?`` is not told."""
CHUNK = 50
SEEDS = [range(0, 1050, CHUNK), range(1200, 1250, CHUNK), range(1400, 2350, CHUNK)]
"""Of the pictures that the weights in the package were trained on, by chunks."""
STAGED = range(5_000_000, 5_000_005)
"""Seeds of chunks of the twin's studio."""
STAGED_CHUNK = 20
VALIDATION = range(1_000_000, 1_000_100, CHUNK)
"""Seeds of pictures that are not trained on."""
LOOKS = 12
"""Crops of each man in a photo: photos are few and worth more than drawings."""
BATCH = 128
OF_STUDIO, OF_PHOTOS = 24, 56
"""In a batch, once all are mixed."""
RATE = 2e-3
GREY, COVERED, ELSEWHERE, MIRRORED = 0.1, 0.25, 0.5, 0.5
"""Shares of crops in a batch that are treated so."""
WIDTHS = (24, 32, 64, 96)


class Residual(nn.Module):
    """Two convolutions around which the input goes."""

    def __init__(self, width: int) -> None:
        super().__init__()
        self.first, self.second = layer(width, width, 3, 1), layer(width, width, 3, 1)

    def forward(self, x: torch.Tensor) -> torch.Tensor:
        """The sum."""
        return functional.relu(x + self.second(functional.relu(self.first(x))))


def layer(inputs: int, outputs: int, size: int, stride: int) -> nn.Sequential:
    """Convolution and normalisation."""
    convolution = nn.Conv2d(inputs, outputs, size, stride, size // 2, bias=False)
    return nn.Sequential(convolution, nn.BatchNorm2d(outputs))


class Network(nn.Module):
    """Four halvings, three residual blocks, and a dense layer that knows where in the crop something is."""

    def __init__(self) -> None:
        super().__init__()
        a, b, c, d = WIDTHS
        self.downs = nn.ModuleList(
            [layer(4, a, 5, 2), layer(a, b, 3, 2), layer(b, c, 3, 2), layer(c, d, 3, 2)]
        )
        self.blocks = nn.ModuleList([Residual(b), Residual(c), Residual(d)])
        self.dense = nn.Linear(d * (HEIGHT // 16) * (WIDTH // 16), FEATURES)
        self.drop = nn.Dropout(0.2)
        self.last = nn.Linear(FEATURES, len(CLASSES))

    def forward(self, x: torch.Tensor) -> torch.Tensor:
        """(n, 13) scores of (n, 4, 96, 64) crops."""
        x = functional.relu(self.downs[0](x))
        for down, block in zip(self.downs[1:], self.blocks, strict=True):
            x = block(functional.relu(down(x)))
        x = functional.relu(self.dense(x.flatten(1)))
        scores: torch.Tensor = self.last(self.drop(x))
        return scores


@dataclass(frozen=True, slots=True, eq=False)
class Pool:
    """Crops to draw batches from; rare classes come more often than they are, by the root of their share.

    Attributes:
        crops: (n, 96, 64, 4).
        labels: (n,).
    """

    crops: Crops
    labels: Labels

    def some(self, count: int, rng: np.random.Generator) -> tuple[Crops, Labels]:
        """Crops and labels of ``count``."""
        weight = (np.bincount(self.labels, minlength=len(CLASSES)).astype(float) ** -0.5)[self.labels]
        chosen = np.sort(rng.choice(len(self.labels), count, p=weight / weight.sum()))
        return self.crops[chosen], self.labels[chosen]


def drawn_chunk(start: int) -> tuple[Crops, Labels]:
    """Of drawn pictures."""
    cv2.setNumThreads(1)
    return joined([drawn(seed) for seed in range(start, start + CHUNK)])


def staged_chunk(seed: int) -> tuple[Crops, Labels]:
    """Of the twin's studio."""
    cv2.setNumThreads(1)
    return staged(seed, STAGED_CHUNK)


def kept(
    options: argparse.Namespace, name: str, make: Callable[[int], tuple[Crops, Labels]], starts: Iterable[int]
) -> Pool:
    """Crops and labels of all chunks, from ``--work`` where they are there."""
    options.work.mkdir(parents=True, exist_ok=True)
    files = {start: options.work / f"{name}{start:06d}.npz" for start in starts}
    missing = [start for start in files if not files[start].exists()]
    with ProcessPoolExecutor(options.workers) as pool:
        for start, (x, y) in zip(missing, pool.map(make, missing), strict=True):
            np.savez(files[start], crops=x, labels=y)
    chunks = [np.load(file) for file in files.values()]
    crops, labels = ([chunk[name] for chunk in chunks] for name in ("crops", "labels"))
    return Pool(np.concatenate(crops), np.concatenate(labels))


def seeds_of(text: str) -> range:
    """First seeds of the chunks of ``0-1050``, the end not included."""
    first, end = (int(part) for part in text.split("-"))
    return range(first, end, CHUNK)


def pool_of(photos: list[Known], looks: int = LOOKS) -> Pool:
    """Their crops."""
    pairs = [photographed(photo.truth, photo.labels, looks, n) for n, photo in enumerate(photos)]
    return Pool(*joined(pairs))


def spoilt(crops: Crops, rng: np.random.Generator, *, moved: bool) -> torch.Tensor:
    """(n, 4, 96, 64) in other light and colours, mirrored, with something in the way.

    Args:
        crops: (n, 96, 64, 4).
        rng: Of what is done.
        moved: Whether also shifted and in other surroundings: photos of one game show the same men in the
            same company again and again.
    """
    n = len(crops)

    def uniform(low: float, high: float, *shape: int) -> torch.Tensor:
        return torch.from_numpy(rng.uniform(low, high, (n, *shape)).astype(np.float32))

    x = torch.from_numpy(np.ascontiguousarray(crops.transpose(0, 3, 1, 2))).float().div_(255)
    gain = uniform(0.8, 1.25, 1, 1, 1) * uniform(0.9, 1.1, 3, 1, 1)
    offset = uniform(-0.06, 0.06, 1, 1, 1) + uniform(-0.04, 0.04, 3, 1, 1)
    colour = x[:, :3]
    colour.sub_(1 / 3).mul_(gain).add_(offset + 1 / 3)
    grey = np.flatnonzero(rng.random(n) < GREY)
    colour[grey] = colour[grey].mean(dim=1, keepdim=True)
    speck = rng.standard_normal((1, 3, HEIGHT, WIDTH), dtype=np.float32)
    colour.add_(torch.from_numpy(speck) * uniform(-0.04, 0.04, 1, 1, 1))
    for i in np.flatnonzero(rng.random(n) < COVERED):
        left, top = int(rng.integers(0, WIDTH - 8)), int(rng.integers(0, HEIGHT - 8))
        wide, tall = (int(v) for v in rng.integers(6, 22, 2))
        fill = torch.from_numpy(rng.uniform(0, 1, (3, 1, 1)).astype(np.float32))
        colour[i, :, top : top + tall, left : left + wide] = fill
    colour.clamp_(0, 1)
    x = moved_a_little(elsewhere(x, rng), rng) if moved else x
    mirrored = np.flatnonzero(rng.random(n) < MIRRORED)
    x[mirrored] = x[mirrored].flip(3)
    return x


def elsewhere(x: torch.Tensor, rng: np.random.Generator) -> torch.Tensor:
    """Some of the crops with what stands beside their square taken from another crop."""
    for i in np.flatnonzero(rng.random(len(x)) < ELSEWHERE):
        other, reach = int(rng.integers(len(x))), int(rng.integers(13, 25))
        for side in (slice(0, WIDTH // 2 - reach), slice(WIDTH // 2 + reach, WIDTH)):
            x[i, :3, :, side] = x[other, :3, :, side]
    return x


def moved_a_little(x: torch.Tensor, rng: np.random.Generator) -> torch.Tensor:
    """Each crop turned, scaled and shifted about its foot."""
    n = len(x)
    turn, scale = rng.normal(0, 0.06, n), rng.normal(1, 0.05, n)
    matrix = np.zeros((n, 2, 3), np.float32)
    matrix[:, 0, 0] = matrix[:, 1, 1] = np.cos(turn) * scale
    matrix[:, 0, 1], matrix[:, 1, 0] = (
        -np.sin(turn) * scale * HEIGHT / WIDTH,
        np.sin(turn) * scale * WIDTH / HEIGHT,
    )
    foot = np.array([2 * FOOT[0] / WIDTH - 1, 2 * FOOT[1] / HEIGHT - 1])
    shift = rng.normal(0, 1.2, (n, 2)) * (2 / WIDTH, 2 / HEIGHT)
    matrix[:, :, 2] = foot - matrix[:, :, :2] @ foot + shift
    grid = functional.affine_grid(torch.from_numpy(matrix), list(x.shape), align_corners=False)
    return functional.grid_sample(x, grid, padding_mode="border", align_corners=False)


def train(
    network: Network, pools: list[tuple[Pool, int]], steps: int, rate: float, seed: int, *, moved: bool
) -> None:
    """Train for ``steps`` batches of so many crops from each pool; the rate rises and falls once."""
    rng = np.random.default_rng(seed)
    network.train().to(memory_format=torch.channels_last)
    optimiser = torch.optim.AdamW(network.parameters(), lr=rate, weight_decay=0.02)
    schedule = torch.optim.lr_scheduler.OneCycleLR(optimiser, rate, total_steps=steps, pct_start=0.15)
    mean = 0.0
    for step in range(1, steps + 1):
        parts = [pool.some(count, rng) for pool, count in pools]
        x = spoilt(np.concatenate([part[0] for part in parts]), rng, moved=moved)
        y = torch.from_numpy(np.concatenate([part[1] for part in parts]))
        with torch.autocast("cpu", torch.bfloat16):
            scores = network(x.contiguous(memory_format=torch.channels_last))
        loss = functional.cross_entropy(scores.float(), y, label_smoothing=0.02)
        optimiser.zero_grad()
        loss.backward()
        optimiser.step()
        schedule.step()
        mean = 0.98 * mean + 0.02 * loss.item()
        if step % 100 == 0:
            say(f"step {step} of {steps}: loss {mean / (1 - 0.98**step):.3f}")
    network.eval()


def say(text: str) -> None:
    """Tell how it goes."""
    print(text, flush=True)  # noqa: T201 - a script's progress


def learnt(drawn_crops: Pool, options: argparse.Namespace) -> Network:
    """A network that has seen drawings alone; kept in ``--work``."""
    torch.manual_seed(options.seed)
    torch.set_num_threads(1)
    network = Network()
    file = options.work / f"drawings-{options.steps}-{options.seed}.pt"
    if file.exists():
        network.load_state_dict(torch.load(file))
        network.eval()
    else:
        train(network, [(drawn_crops, BATCH)], options.steps, RATE, options.seed, moved=False)
        torch.save(network.state_dict(), file)
    return network


def scores_of(network: Network, crops: Crops) -> npt.NDArray[np.float32]:
    """(n, 13)."""
    out = []
    with torch.no_grad():
        for start in range(0, len(crops), 256):
            part = np.ascontiguousarray(crops[start : start + 256].transpose(0, 3, 1, 2))
            out.append(network(torch.from_numpy(part).float() / 255).numpy())
    return np.concatenate(out)


def temperature(scores: npt.NDArray[np.float32], labels: Labels) -> float:
    """By which scores are to be divided so that their probabilities are right (Guo et al. 2017)."""
    choices = np.geomspace(0.3, 4.0, 60)
    given, wanted = torch.from_numpy(scores), torch.from_numpy(labels)
    losses = [float(functional.cross_entropy(given / float(t), wanted)) for t in choices]
    return float(choices[int(np.argmin(losses))])


def write(network: Network, path: Path) -> None:
    """The network up to its features, as ONNX: the last layer stands in the notes, for sets to change."""
    graph = Graph("crops", (4, HEIGHT, WIDTH))

    def convolution(x: str, name: str, module: nn.Sequential) -> str:
        fused = torch.nn.utils.fusion.fuse_conv_bn_eval(module[0], module[1])
        weight, bias = fused.weight.detach().numpy(), fused.bias.detach().numpy()
        return graph.convolution(x, name, weight, bias, fused.stride[0])

    x = graph.add("Relu", [convolution("crops", "down0", network.downs[0])], "relu0")
    for i, (down, block) in enumerate(zip(network.downs[1:], network.blocks, strict=True), 1):
        x = graph.add("Relu", [convolution(x, f"down{i}", down)], f"relu{i}")
        inner = graph.add("Relu", [convolution(x, f"first{i}", block.first)], f"inner{i}")
        summed = graph.add("Add", [x, convolution(inner, f"second{i}", block.second)], f"sum{i}")
        x = graph.add("Relu", [summed], f"out{i}")
    flat = graph.add("Flatten", [x], "flat", axis=1)
    dense = network.dense.weight.detach().numpy(), network.dense.bias.detach().numpy()
    graph.add("Relu", [graph.linear(flat, "dense", *dense)], "features")
    graph.save(path, "features", FEATURES)


def notes(
    network: Network, photos: list[Known], options: argparse.Namespace, unseen: Pool
) -> dict[str, object]:
    """The last layer, and what is to be known of the weights: above all, which photos they have seen."""
    scores, labels = scores_of(network, unseen.crops), unseen.labels
    right = scores.argmax(axis=1) == labels
    return {
        "classes": CLASSES,
        "temperature": round(temperature(scores, labels), 4),
        "range": [DARKEST, LIGHTEST],
        "seed": options.seed,
        "drawn": [[some.start, some.stop] for some in options.seeds],
        "steps": options.steps,
        "mixed_steps": options.mixed_steps,
        "mixed_rate": options.mixed_rate,
        "validation_right": round(float(right.mean()), 4),
        "validation_men_right": men_right(network, unseen),
        "photos": {photo.name: photo.digest for photo in photos},
        "bias": np.round(network.last.bias.detach().numpy().astype(float), 4).tolist(),
        "weight": np.round(network.last.weight.detach().numpy().T.astype(float), 4).tolist(),
    }


def men_right(network: Network, pool: Pool) -> float:
    """Share of the men that are told rightly."""
    men = pool.labels > 0
    return round(float((scores_of(network, pool.crops[men]).argmax(axis=1) == pool.labels[men]).mean()), 4)


def main() -> None:
    """Draw, train, measure, write."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--data", type=Path, help="folder of labelled pictures, as ../shared/real")
    parser.add_argument("--without", type=int, nargs="*", default=[1], help="games that are held out")
    parser.add_argument(
        "--seeds", type=seeds_of, nargs="+", default=SEEDS, help="of drawn pictures, as 0-1050"
    )
    parser.add_argument("--steps", type=int, default=4000, help="batches of drawings")
    parser.add_argument(
        "--mixed-steps", type=int, default=1800, help="batches of drawings, studio and photos"
    )
    parser.add_argument("--mixed-rate", type=float, default=1e-3, help="greatest step length of these")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--workers", type=int, default=2, help="processes that draw")
    parser.add_argument("--work", type=Path, default=Path("build/pieces"), help="where drawn crops are kept")
    parser.add_argument("--out", type=Path, default=WEIGHTS)
    options = parser.parse_args()
    photos, others = real_photos(options.data, options.without, LABELS) if options.data else ([], [])
    drawings = kept(options, "drawn", drawn_chunk, [start for some in options.seeds for start in some])
    studio = kept(options, "staged", staged_chunk, STAGED)
    say(f"{len(drawings.labels)} crops of drawings, {len(studio.labels)} of the studio, {len(photos)} photos")
    network = learnt(drawings, options)
    pools = [(drawings, BATCH - OF_STUDIO), (studio, OF_STUDIO)]
    if photos:
        real = pool_of(photos)
        pools = [(drawings, BATCH - OF_STUDIO - OF_PHOTOS), (studio, OF_STUDIO), (real, OF_PHOTOS)]
    train(network, pools, options.mixed_steps, options.mixed_rate, options.seed + 1, moved=True)
    unseen = kept(options, "drawn", drawn_chunk, VALIDATION)
    write(network, options.out)
    told = notes(network, photos, options, unseen)
    if others:
        told["other_real_sets_men_right"] = men_right(network, pool_of(others, looks=1))
    options.out.with_suffix(NOTES).write_text(json.dumps(told) + "\n")
    say(str({key: value for key, value in told.items() if key not in {"photos", "bias", "weight"}}))


if __name__ == "__main__":
    main()
