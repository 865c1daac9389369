"""The falling curve: points where they belong, words escaped, the level drawn."""

from __future__ import annotations

import re

from logger.report.charts import Steps, steps_figure


def test_points_fall_with_their_values_to_the_level() -> None:
    svg = steps_figure(Steps("Error", "error", (("as it <is>", 0.4), ("refitted", 0.2), ("with a & b", 0.1)),
                             (0.1, "noise alone")))
    heights = [float(y) for y in re.findall(r'<circle class="dot" cx="[\d.]+" cy="([\d.]+)"', svg)]
    level = float(re.findall(r'<path class="thick s3" d="M\d+ ([\d.]+)H', svg)[0])
    assert heights[0] < heights[1] < heights[2] == level  # down the page is down in value
    assert abs((heights[2] - heights[1]) - (heights[1] - heights[0]) / 2) < 0.2
    assert "as it &lt;is&gt;" in svg and "with a &amp; b" in svg and "noise alone" in svg


def test_one_step_is_a_point_without_a_line() -> None:
    svg = steps_figure(Steps("Error", "error", (("only", 0.0),)))
    assert svg.count("<circle") == 1 and "thick s0" not in svg and "nan" not in svg
