"""CSV files of loggers: what is recognised, what has to be named, and how times and cells are read."""

from __future__ import annotations

from datetime import UTC, datetime, timedelta
from pathlib import Path

import numpy as np
import pytest

from logger.errors import BadInput
from logger.store.formats.logger_csv import (
    LAYOUTS,
    LoggerTable,
    advice,
    named_columns,
    read_header,
    read_table,
    recognise,
    recognised,
    seconds,
    units_of,
)

TIME_S = np.arange(40) * 0.0097


def table(path: Path, text: str | bytes, columns: str | None = None) -> LoggerTable:
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    header = read_header(path)
    known = recognised(header, named_columns(columns) if columns else None)
    assert known is not None
    return read_table(header, known)


@pytest.mark.parametrize("layout", LAYOUTS, ids=lambda one: f"{one.name}-{len(one.columns)}")
def test_every_layout_is_recognised_by_its_own_header(layout) -> None:
    names = [column.header for column in layout.columns.values()] + ["something else"]
    for spelling in (names, [f' "{name.upper()}" ' for name in names], [n.replace("^2", "²") for n in names]):
        found = recognise(spelling, layout.stem or "any", None)
        assert found is not None
        assert {role: found.columns[role].unit for role in layout.columns if role in found.columns} == {
            role: column.unit for role, column in layout.columns.items() if role in found.columns}
    assert recognise(names[:1] + names[2:], layout.stem or "any", None) is None or len(names) > 3
    assert all(column.unit in units_of(role) for role, column in layout.columns.items())


def test_a_gyroscope_is_not_taken_for_an_accelerometer() -> None:
    names = ("time", "seconds_elapsed", "z", "y", "x")
    assert recognise(names, "Gyroscope", None) is None
    linear, whole = recognise(names, "Accelerometer", None), recognise(names, "TotalAcceleration", None)
    assert linear is not None and linear.is_linear
    assert whole is not None and not whole.is_linear


@pytest.mark.parametrize(("unit", "scale", "begin"), [
    ("s", 1.0, 0.0), ("ms", 1e3, 0.0), ("us", 1e6, 0.0), ("ns", 1e9, 0.0), ("s", 1.0, 62_608.0),
    ("s", 1.0, 1.7e9), ("ms", 1e3, 1.7e9), ("us", 1e6, 1.7e9), ("ns", 1e9, 1.7e9),
])
@pytest.mark.parametrize("is_named", [True, False])
def test_any_unit_of_time_is_the_same_seconds(
        unit: str, scale: float, begin: float, is_named: bool, tmp_path: Path) -> None:
    lines = [f"{(begin + t) * scale:.6f},0,0,9.8" for t in TIME_S]
    word = f":{unit}" if is_named else ""
    found = table(tmp_path / "a.csv", "\n".join(["clock,x,y,z", *lines]), f"t=clock{word},x=x:g,y=y:g,z=z:g")
    assert seconds(found) - begin == pytest.approx(TIME_S, abs=1e-6)


@pytest.mark.parametrize("form", ["%Y-%m-%dT%H:%M:%S.%fZ", "%Y-%m-%d %H:%M:%S.%f", "%Y-%m-%dT%H:%M:%S.%f+02:00"])
def test_dates_are_seconds_since_1970(form: str, tmp_path: Path) -> None:
    begin = datetime(2026, 3, 1, 23, 59, 59, 900_000, UTC)
    local = begin + timedelta(hours=2 * ("+02" in form))
    lines = [f"{(local + timedelta(seconds=t)).strftime(form)},0,0,9.8" for t in TIME_S.round(6)]
    found = table(tmp_path / "a.csv", "\n".join(["clock,x,y,z", *lines]), "t=clock,x=x:g,y=y:g,z=z:g")
    assert seconds(found) - begin.timestamp() == pytest.approx(TIME_S, abs=2e-6)


def test_a_time_that_no_unit_fits_is_asked_for(tmp_path: Path) -> None:
    found = table(tmp_path / "a.csv", "clock,v\n1,2\n2,2\n3,3\n", "t=clock,speed=v:m/s")
    other, same = (table(tmp_path / "b.csv", f"{name},u\n0,9.8\n10,9.8\n", f"t={name},up=u") for name in ("t", "clock"))
    with pytest.raises(BadInput, match="t=clock:UNIT"):
        seconds(found, other)  # fixes come once a second, or a thousand times as fast: who knows
    assert seconds(found, same).tolist() == [0.001, 0.002, 0.003]
    with pytest.raises(BadInput, match="t=clock:UNIT"):
        seconds(table(tmp_path / "c.csv", "clock,u\n0,1\n0,2\n", "t=clock,up=u"))


def test_separators_decimal_commas_marks_and_empty_cells(tmp_path: Path) -> None:
    plain = table(tmp_path / "a.csv", "t_s,accel_z_mps2\n0.5,1.25\n1.5,-2.5\n")
    others = (
        "\ufefft_s;accel_z_mps2\r\n0,5;1,25\r\n1,5;-2,5\r\n",
        '"t_s"\t"accel_z_mps2"\n0.5\t1.25\n1.5\t−2.5\n',
        "sep=;\nt_s;accel_z_mps2\n0,5;1,25\n\n1,5;−2,5\n",
        "\nt_s,accel_z_mps2,note\n0.5,1.25,\"a, b\"\n1.5,-2.5,x\n",
    )
    for number, text in enumerate(others):
        found = table(tmp_path / f"{number}.csv", text)
        for role in ("t", "up"):
            assert (found.columns[role] == plain.columns[role]).all()
    holes = table(tmp_path / "b.csv", "t_s,accel_z_mps2\n0.5,\n1.5,null\n2.5,3\n")
    assert np.isnan(holes.columns["up"]).tolist() == [True, True, False]
    assert holes.lines.tolist() == [2, 3, 4]
    latin = "t,ACC X (m/s²),ACC Y (m/s²),ACC Z (m/s²)\n1,2,3,4\n".encode("latin-1")
    found = table(tmp_path / "c.csv", latin, "t=t:s,x=ACC X (m/s²),y=ACC Y (m/s²),z=ACC Z (m/s²)")
    assert found.unit("x") == "m/s2"


@pytest.mark.parametrize(("text", "said"), [
    ("t_s,accel_z_mps2\n1,2\n1,2,3\n", "a.csv:3: expected 2 fields"),
    ("t_s,accel_z_mps2\n1,2\nx,3\n", "a.csv:3: expected a time for t, found 'x'"),
    ("t_s,accel_z_mps2\n1,2\n2,inf\n", "a.csv:3: expected a number for up, found 'inf'"),
    ("t_s,accel_z_mps2\n\n", "a.csv:2: expected numbers below the header"),
])
def test_a_bad_cell_is_named_with_its_line(text: str, said: str, tmp_path: Path) -> None:
    with pytest.raises(BadInput, match=said):
        table(tmp_path / "a.csv", text)


def test_a_last_line_that_was_cut_short_is_left_out(tmp_path: Path) -> None:
    found = table(tmp_path / "a.csv", "t_s,speed_mps,accel_z_mps2\n1,2,3\n2,3,4\n3,")
    assert found.is_torn
    assert found.columns["t"].tolist() == [1, 2]
    assert not table(tmp_path / "b.csv", "t_s,speed_mps,accel_z_mps2\n1,2,3\n2,3,4").is_torn


def test_named_columns() -> None:
    found = named_columns("t=Time, local:ms, x=a:b:g,y=(y) [m/s^2],z=z,speed=v:km/h")
    assert {role: (one.header, one.unit) for role, (one,) in found.items()} == {
        "t": ("Time, local", "ms"), "x": ("a:b", "g"), "y": ("(y) [m/s^2]", None), "z": ("z", None),
        "speed": ("v", "km/h")}
    assert len(named_columns("t=a:s,t=b:ms")["t"]) == 2
    for text in ("", "x", "w=3", "t=", "x=ax:furlongs/s", "speed=v:g"):
        with pytest.raises(BadInput, match="--columns"):
            named_columns(text)


def test_the_advice_is_an_option_that_can_be_given() -> None:
    names = ("timestamp", "acc_x", "acc_y", "acc_z", "Horizontal Accuracy (m)", "Latitude", "Longitude", "Speed (km/h)")
    said = advice(names)
    assert said == ('--columns "t=timestamp:UNIT,x=acc_x:UNIT,y=acc_y:UNIT,z=acc_z:UNIT,lat=Latitude,lon=Longitude,'
                    'speed=Speed (km/h)"')
