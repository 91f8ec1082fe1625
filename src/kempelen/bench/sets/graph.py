"""Writing a trained network as an ONNX file, layer by layer; needs the dependency group ``train``."""

from pathlib import Path

import numpy as np
import numpy.typing as npt
import onnx
from onnx import TensorProto, helper, numpy_helper

Weights = npt.NDArray[np.float32]


class Graph:
    """A network that grows from its input; weights are kept in half precision.

    Args:
        name: Of the input.
        shape: Of one input.
    """

    def __init__(self, name: str, shape: tuple[int, ...]) -> None:
        self._input = helper.make_tensor_value_info(name, TensorProto.FLOAT, ["n", *shape])
        self._nodes: list[onnx.NodeProto] = []
        self._weights: list[onnx.TensorProto] = []

    def add(self, kind: str, inputs: list[str], name: str, **attributes: object) -> str:
        """A node; gives its output's name."""
        self._nodes.append(helper.make_node(kind, inputs, [name], **attributes))
        return name

    def convolution(self, x: str, name: str, weight: Weights, bias: Weights, stride: int) -> str:
        """A convolution of an odd size that keeps the edges; gives its output's name."""
        size = weight.shape[-1]
        inputs = [x, self._constant(name + ".w", weight), self._constant(name + ".b", bias)]
        return self.add(
            "Conv", inputs, name, kernel_shape=[size, size], strides=[stride, stride], pads=[size // 2] * 4
        )

    def linear(self, x: str, name: str, weight: Weights, bias: Weights) -> str:
        """A dense layer of (outputs, inputs) weights; gives its output's name."""
        inputs = [x, self._constant(name + ".w", weight), self._constant(name + ".b", bias)]
        return self.add("Gemm", inputs, name, transB=1)

    def save(self, path: Path, output: str, length: int) -> None:
        """Write it, with one output of that length."""
        given = helper.make_tensor_value_info(output, TensorProto.FLOAT, ["n", length])
        graph = helper.make_graph(self._nodes, path.stem, [self._input], [given], self._weights)
        model = helper.make_model(graph, opset_imports=[helper.make_opsetid("", 13)], ir_version=8)
        onnx.checker.check_model(model)
        path.write_bytes(model.SerializeToString())

    def _constant(self, name: str, value: Weights) -> str:
        half = np.ascontiguousarray(value).astype(np.float16)
        self._weights.append(numpy_helper.from_array(half, name + ".half"))
        return self.add("Cast", [name + ".half"], name, to=TensorProto.FLOAT)
