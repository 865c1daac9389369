"""The headers: what the command writes compiles as C99 and gives the bits of Python."""

from __future__ import annotations

import json
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest

from logger.commands.main import main
from logger.dsp.filters import BlockFilter
from logger.dsp.fixed_point import FULL_SCALE_MPS2, FULL_SCALE_SLOPE, FixedFilter, fixed_cascade
from logger.dsp.weightings.wk import WEIGHTING
from logger.errors import BadInput
from logger.roads.iri import golden_car_sections

from ..support.slow import slow

COMPILER = shutil.which("cc") or shutil.which("gcc") or shutil.which("clang")
STRICT = ["-std=c99", "-pedantic", "-Wall", "-Wextra", "-Werror"]
SANITIZER = ["-fsanitize=undefined", "-fno-sanitize-recover=all"]

# Resets to the first number of stdin, then filters the others; 32-bit words of the machine.
PROGRAM = """
#include <stdio.h>
#include "NAME.h"
int main(void)
{
    static NAME_state state;
    const double steps[2] = {MACRO_INPUT_STEP, MACRO_OUTPUT_STEP};
    int32_t word;
    if (!(steps[0] > 0.0 && steps[1] > 0.0))
        return 1;
    if (fread(&word, sizeof word, 1, stdin) == 1)
        NAME_reset(&state, word);
    while (fread(&word, sizeof word, 1, stdin) == 1) {
        word = NAME_step(&state, word);
        fwrite(&word, sizeof word, 1, stdout);
    }
    return 0;
}
"""
SOS = {"ridelog_wk": (WEIGHTING.sections[100], FULL_SCALE_MPS2),
       "ridelog_golden_car": (golden_car_sections(0.25), FULL_SCALE_SLOPE)}


def program(folder: Path, name: str, *options: str) -> Path:
    """The program of a header; skips where it cannot be compiled for lack of a compiler or sanitizer."""
    if COMPILER is None:
        pytest.skip("no C compiler (cc, gcc or clang) on this machine")
    (folder / "main.c").write_text(PROGRAM.replace("MACRO", name.upper()).replace("NAME", name), encoding="ascii")
    built = subprocess.run([COMPILER, *STRICT, *options, "main.c", "-o", name], cwd=folder, capture_output=True,
                           text=True, check=False)
    if built.returncode and "ubsan" in built.stderr:
        pytest.skip("the C compiler has no undefined-behaviour sanitizer")
    assert built.returncode == 0, built.stderr
    return folder / name


def hard_input(name: str, bits: int) -> np.ndarray:
    """Noise small and large, full-scale squares, and the signs that drive the output to its bound."""
    sos, full_scale = SOS[name]
    largest = fixed_cascade(sos, full_scale, bits).largest_input
    impulse = np.zeros(4000)
    impulse[0] = 1.0
    worst = np.where(BlockFilter(sos).process(impulse)[::-1] < 0, -1, 1)
    rng = np.random.default_rng(1)
    noise = [rng.uniform(-size, size, 700) for size in (2, 0.01 * largest, largest)]
    square = np.repeat([1, -1] * 10, 37) * largest
    return np.rint(np.concatenate([*noise, worst * largest, square, np.zeros(1000)])).astype(np.int64)


@pytest.mark.parametrize("options", [
    pytest.param(["-O2"], id="fast"), pytest.param(["-O0", *SANITIZER], id="sanitized", marks=pytest.mark.slow)])
@pytest.mark.parametrize(("name", "bits"), [("ridelog_wk", 32), ("ridelog_golden_car", 16),
                                            *slow(("ridelog_wk", 16), ("ridelog_golden_car", 32))])
def test_c_gives_the_bits_of_python(tmp_path: Path, name: str, bits: int, options: list[str]) -> None:
    assert main(["fixed-point", "--data-bits", str(bits), "--out", str(tmp_path)]) == 0
    executable = program(tmp_path, name, *options)
    sos, full_scale = SOS[name]
    cascade = fixed_cascade(sos, full_scale, bits)
    start, counts = cascade.largest_input // 16, hard_input(name, bits)
    ran = subprocess.run([executable], input=np.array([start, *counts], dtype=np.int32).tobytes(),
                         capture_output=True, check=False)
    assert ran.returncode == 0, ran.stderr.decode()
    fixed = FixedFilter(cascade)
    fixed.reset(start * cascade.input_step)
    assert np.frombuffer(ran.stdout, dtype=np.int32).tolist() == fixed.process_counts(counts).tolist()


@pytest.mark.slow
def test_the_headers_stand_side_by_side(tmp_path: Path) -> None:
    assert main(["fixed-point", "--out", str(tmp_path)]) == 0
    assert main(["fixed-point", "--weighting", "wd", "--data-bits", "16", "--out", str(tmp_path)]) == 0
    headers = sorted(path.name for path in tmp_path.iterdir())
    assert headers == ["ridelog_golden_car.h", "ridelog_wd.h", "ridelog_wk.h"]
    program_c = PROGRAM.replace("MACRO", "RIDELOG_WD").replace("NAME", "ridelog_wd")
    main_c = "".join(f'#include "{header}"\n' for header in headers) + program_c
    program(tmp_path, "ridelog_wd")
    (tmp_path / "main.c").write_text(main_c, encoding="ascii")
    assert COMPILER is not None
    subprocess.run([COMPILER, *STRICT, "main.c", "-o", "all"], cwd=tmp_path, check=True)


def test_json_names_files_and_scales(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = tmp_path / "deep" / "er"
    assert main(["fixed-point", "--out", str(out), "--json"]) == 0
    reported = json.loads(capsys.readouterr().out)
    assert reported["data_bits"] == 32
    weighting, car = reported["filters"]
    assert Path(weighting["file"]).is_file()
    assert weighting["input_step"] == pytest.approx(16 * 9.80665 / 2**31)
    assert weighting["sections"] == 7
    assert car["unit"] == "m/m"
    assert f"OUTPUT_STEP {car['output_step']!r}" in Path(car["file"]).read_text(encoding="ascii")


@pytest.mark.parametrize(("arguments", "complaint"), [
    (["--weighting", "wx"], r"weighting 'wx': expected one of .*wk"),
    (["--rate", "50"], r"--rate 50: .*from 80 Hz"),
    (["--rate", "100000"], r"--rate 100000: expected"),
    (["--rate", "100.5"], r"--rate 100.5: expected a whole number"),
    (["--data-bits", "8"], r"--data-bits 8: expected 32 or 16"),
])
def test_wrong_use_is_reported(tmp_path: Path, arguments: list[str], complaint: str) -> None:
    with pytest.raises(BadInput, match=complaint):
        main(["fixed-point", *arguments, "--out", str(tmp_path / "out")])
    assert not (tmp_path / "out").exists()
