import xml.etree.ElementTree as ET

from kempelen.bench.svg_plot import Chart, draw_charts


def test_charts_share_one_scale_and_are_well_formed() -> None:
    charts = [
        Chart("axial <noise>", "mm", [0, 1, 2], {"ours": [0, 0, 1], "rule": [10, 20, 40]}),
        Chart("flying", "off, on", [0, 1], {"ours": [0, 0], "rule": [5, 5]}),
    ]
    root = ET.fromstring(draw_charts(charts, "title & more", "wrong, %"))  # noqa: S314 - our own
    space = "{http://www.w3.org/2000/svg}"
    lines = [line.attrib["points"] for line in root.iter(f"{space}polyline")]
    assert len(lines) == 4
    heights = [[float(point.split(",")[1]) for point in line.split()] for line in lines]
    assert heights[1][2] < heights[1][1] < heights[1][0]  # more is higher up
    assert heights[0][0] == heights[2][0] > heights[3][0]
    assert "title & more" in [text.text for text in root.iter(f"{space}text")]


def test_one_value_and_no_error_are_drawn() -> None:
    ET.fromstring(draw_charts([Chart("x", "", [1], {"ours": [0]})], "t", "y"))  # noqa: S314 - our own
