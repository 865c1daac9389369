"""Natural frequencies, damping ratios and mode shapes of a vibration record, each with its standard deviation.

FILE is CSV with t_s and one column per sensor, evenly sampled: a free decay (push, let go, record) or the response to
random forces; --input names a column with a force or motion that was measured beside it. Nobody has to pick poles: the
order and the modes are chosen by rule, and what the record does not support is listed as rejected, with the reason.
"""

from __future__ import annotations

import argparse
import json
from math import isfinite
from pathlib import Path
from typing import TYPE_CHECKING, Any

from logger.errors import EXIT_DONE, BadInput
from logger.files import write_text

if TYPE_CHECKING:
    from logger.modal.mode import FoundMode, ModalResult
    from logger.store.formats.channel_file import ChannelRecord

SPECTRUM = "fft"
DECREMENT = "decrement"
METHODS = ("era", "ssi", "ssi-cov", "n4sid", "ar", "arx", "armax", SPECTRUM, DECREMENT)
EXAMPLES = ("five-storey",)
_METHOD, _SEGMENTS = "ssi", 8
_REJECTED_SHOWN = 12
_IN_STEP = 0.02  # a shape whose parts are nearer to in step than this is shown with signs alone


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("file", type=Path, nargs="?", metavar="FILE", help="CSV with t_s and one column per sensor")
    parser.add_argument("--method", choices=METHODS, metavar="NAME",
                        help=f"{', '.join(METHODS)} (default: ssi). era suits a free decay, ssi a random response, "
                             "n4sid a measured input; decrement is Eq 5.2, for one mode")
    parser.add_argument("--columns", metavar="A,B,...",
                        help="columns of the sensors (default: all but t_s and the input)")
    parser.add_argument("--input", metavar="COLUMN", help="column of the measured input, for n4sid, arx and armax")
    parser.add_argument("--order", type=int, metavar="N",
                        help="states of the model (lags for ar, arx and armax; for a free decay the most that are "
                             "tried) instead of the order chosen by rule")
    parser.add_argument("--response", choices=("decay", "random"), metavar="KIND",
                        help="decay or random; without it the record is looked at")
    parser.add_argument("--from", dest="from_s", type=float, metavar="S", help="leave out what is before this t_s [s]")
    parser.add_argument("--to", dest="to_s", type=float, metavar="S", help="leave out what is after this t_s [s]")
    parser.add_argument("--segments", type=int, metavar="N", help="even segments for fft (default: 8)")
    parser.add_argument("--diagram", type=Path, metavar="FILE.csv",
                        help="write the poles of all orders, for a stabilisation diagram")
    parser.add_argument("--example", choices=EXAMPLES, metavar="NAME",
                        help="five-storey: the model building of the reference dissertation, instead of FILE")
    parser.add_argument("--json", action="store_true", help="print one JSON object for a program")


def run(args: argparse.Namespace) -> int:
    """Carry out ``ridelog modes``."""
    if args.example is not None:
        _check_example(args)
        example = _five_storey()
        print(json.dumps(example) if args.json else "\n".join(_example_lines(example)))
        return EXIT_DONE
    if args.file is None:
        raise BadInput("modes: expected a FILE (try 'ridelog modes --help')")
    args.method = args.method or _METHOD
    _check_options(args)
    record, inputs = _read(args)
    try:
        result = _find(args, record, inputs)
    except ValueError as error:
        raise BadInput(f"{args.file}: {error}") from None
    if args.diagram is not None:
        write_text(args.diagram, _diagram_csv(result), "ascii")
    if args.json:
        print(json.dumps(as_json(result, record, args.method), allow_nan=False))
    else:
        print("\n".join(screen(result, record, args.file.name)))
    return EXIT_DONE


def _check_example(args: argparse.Namespace) -> None:
    """BadInput for anything beside an example but --json."""
    if args.file is not None:
        raise BadInput(f"--example {args.example}: expected no FILE beside it, found {args.file}")
    given = {"--method": args.method, "--columns": args.columns, "--input": args.input, "--order": args.order,
             "--response": args.response, "--from": args.from_s, "--to": args.to_s, "--segments": args.segments,
             "--diagram": args.diagram}
    if options := [option for option, value in given.items() if value is not None]:
        raise BadInput(f"{options[0]}: expected a FILE with it, not --example {args.example}")


def _check_options(args: argparse.Namespace) -> None:
    """BadInput for an option that the method has no use for."""
    if args.method in (SPECTRUM, DECREMENT):
        for option, value in (("--order", args.order), ("--response", args.response), ("--diagram", args.diagram)):
            if value is not None:
                raise BadInput(f"{option}: expected a method with poles, not --method {args.method}")
    if args.segments is not None and args.method != SPECTRUM:
        raise BadInput(f"--segments: expected --method {SPECTRUM} with it, found {args.method}")
    if args.response is not None and args.input is not None:
        raise BadInput("--response: expected no --input, which says what moves the structure")
    if args.input is not None and args.method not in ("n4sid", "arx", "armax"):
        raise BadInput(f"--input: expected --method n4sid, arx or armax with it, found {args.method}")
    if args.method == "arx" and args.input is None:
        raise BadInput("--method arx: expected --input COLUMN with it")


def _read(args: argparse.Namespace) -> tuple[ChannelRecord, Any]:
    """The sensors' record, cut to the wished stretch, and the input's samples (n, 1) or None."""
    from dataclasses import replace

    import numpy as np

    from logger.store.formats.channel_file import read_channels

    file = str(args.file)
    wished = () if args.columns is None else tuple(name.strip() for name in args.columns.split(","))
    if not all(wished) or len(set(wished)) < len(wished) or args.input in wished:
        raise BadInput(f"--columns {args.columns}: expected names with commas between them, each once, the input not "
                       "among them")
    record = read_channels(args.file, (*wished, args.input) if wished and args.input else wished)
    if args.input is not None and args.input not in record.names:
        raise BadInput(f"{file}:1: expected a column {args.input}, found {','.join(record.names)[:80]}")
    t_s = record.start_s + np.arange(len(record.samples)) / record.rate_hz
    inside = (t_s >= (t_s[0] if args.from_s is None else args.from_s)) & (
        t_s <= (t_s[-1] if args.to_s is None else args.to_s))
    if not inside.any():
        raise BadInput(f"{file}: expected --from before --to, within {t_s[0]:g} to {t_s[-1]:g} s")
    samples = record.samples[inside]
    outputs = [place for place, name in enumerate(record.names) if name != args.input]
    if not outputs:
        raise BadInput(f"{file}:1: expected a column beside t_s and the input {args.input}")
    if not (samples.std(axis=0) > 0).all():
        raise BadInput(f"{file}: expected every column to move between --from and --to")
    inputs = None if args.input is None else samples[:, [record.names.index(args.input)]]
    names = tuple(record.names[place] for place in outputs)
    return replace(record, names=names, start_s=float(t_s[inside][0]), samples=samples[:, outputs]), inputs


def _find(args: argparse.Namespace, record: ChannelRecord, inputs: Any) -> ModalResult:
    from logger.modal.analysis import find_modes
    from logger.modal.spectral_peaks import peak_modes

    if args.method == SPECTRUM:
        return peak_modes(record.samples, record.rate_hz, _SEGMENTS if args.segments is None else args.segments)
    if args.method == DECREMENT:
        return _by_decrement(record)
    if args.order is not None and args.order < 2:
        raise ValueError(f"expected an order of 2 or more, found {args.order}")
    decay = None if args.response is None else args.response == "decay"
    return find_modes(record.samples, record.rate_hz, args.method, inputs, args.order, decay)


def _by_decrement(record: ChannelRecord) -> ModalResult:
    import numpy as np

    from logger.modal.decrement import log_decrement
    from logger.modal.mode import FoundMode, ModalResult

    if len(record.names) > 1:
        raise ValueError(f"expected one column for the decrement (--columns), found {','.join(record.names)}")
    found = log_decrement(record.samples[:, 0], record.rate_hz)
    mode = FoundMode(found.frequency_hz, found.damping_ratio, found.frequency_std_hz, found.damping_std,
                     np.ones(1, np.complex128))
    return ModalResult((mode,), (), 0, f"logarithmic decrement (Eq 5.2) over {len(found.peak_s)} peaks")


def as_json(result: ModalResult, record: ChannelRecord, method: str) -> dict[str, Any]:
    """The agreed fields of each mode first, then its shape; null where the method cannot tell."""
    return {
        "modes": [_mode_json(mode, record.names) for mode in result.modes],
        "rejected": [{"frequency_hz": one.frequency_hz, "damping_ratio": _known(one.damping_ratio),
                      "reason": one.reason} for one in result.rejected],
        "method": method, "how": result.how, "order": result.order, "rate_hz": record.rate_hz,
        "samples": len(record.samples),
    }


def _mode_json(mode: FoundMode, names: tuple[str, ...]) -> dict[str, Any]:
    from cmath import phase
    from math import degrees

    return {
        "frequency_hz": mode.frequency_hz, "damping_ratio": _known(mode.damping_ratio),
        "frequency_std_hz": mode.frequency_std_hz, "damping_std": _known(mode.damping_std),
        "shape": [{"channel": name, "amplitude": float(abs(part)), "phase_deg": degrees(phase(part))}
                  for name, part in zip(names, mode.shape.tolist(), strict=True)],
    }


def _known(value: float) -> float | None:
    return value if isfinite(value) else None


def screen(result: ModalResult, record: ChannelRecord, name: str) -> list[str]:
    """The lines a person sees; ``name`` is that of the file."""
    seconds = len(record.samples) / record.rate_hz
    order = f", order {result.order}" if result.order else ""
    lines = [f"{name}: {seconds:.4g} s at {record.rate_hz:.6g} Hz, {len(record.names)} channels",
             f"{result.how}{order}", ""]
    if result.modes:
        lines.append("mode   frequency Hz           damping %             shape")
        lines += [f"{number:4}   {_with_error(mode.frequency_hz, mode.frequency_std_hz):22} "
                  f"{_with_error(100 * mode.damping_ratio, 100 * mode.damping_std):21} {_shape_words(mode)}"
                  for number, mode in enumerate(result.modes, start=1)]
        lines += ["", f"+- is one standard deviation. Shape: {', '.join(record.names)[:200]}; the largest is 1."]
    else:
        lines.append("No mode: nothing in this record stands out of what noise would do.")
    if result.rejected:
        lines += ["", "Found and not believed:"]
        lines += [f"  {one.frequency_hz:9.4g} Hz  {one.reason}" for one in result.rejected[:_REJECTED_SHOWN]]
        if len(result.rejected) > _REJECTED_SHOWN:
            lines.append(f"  and {len(result.rejected) - _REJECTED_SHOWN} more")
    return lines


def _with_error(value: float, std: float) -> str:
    """A value with as many decimals as its error allows."""
    if not isfinite(value):
        return "not told"
    if not isfinite(std) or std <= 0:
        return f"{value:.4g}"
    from math import floor, log10

    decimals = min(9, max(0, 1 - floor(log10(std))))
    return f"{value:.{decimals}f} +- {std:.{decimals}f}"


def _shape_words(mode: FoundMode) -> str:
    if max(abs(part.imag) for part in mode.shape.tolist()) < _IN_STEP * len(mode.shape):
        return " ".join(f"{part.real:6.3f}" for part in mode.shape.tolist())
    from cmath import phase
    from math import degrees

    return " ".join(f"{abs(part):.3f}@{degrees(phase(part)):.0f}°" for part in mode.shape.tolist())


def _diagram_csv(result: ModalResult) -> str:
    from logger.modal.mode import damping_ratio, frequency_hz

    rows = [f"{one.order},{float(frequency_hz(pole)):.7g},{float(damping_ratio(pole)):.5g}\n"
            for one in result.diagram for pole in one.poles]
    return "order,frequency_hz,damping_ratio\n" + "".join(rows)


# --- the example ---


def _five_storey() -> dict[str, Any]:
    import numpy as np

    from logger.modal import five_storey
    from logger.modal.decay import decay_modes
    from logger.modal.era import proposals

    building = five_storey.structure()
    released = five_storey.released(building)
    sensor = five_storey.SENSORS[0]
    floors = np.stack([five_storey.recorded(released[:, floor], sensor, 10 + floor) for floor in range(5)], axis=1)
    found = decay_modes(floors, five_storey.RATE_HZ, proposals, "free decay")
    compared = five_storey.compare_sensors()
    return {
        "masses_kg": np.diag(building.mass).tolist(), "stiffness_n_per_m": -float(building.stiffness[0, 1]),
        "frequencies_hz": five_storey.frequencies_hz(building).tolist(),
        "printed_model_hz": list(five_storey.PRINTED_MODEL_HZ),
        "printed_measured_hz": list(five_storey.PRINTED_MEASURED_HZ),
        "modes": [_mode_json(mode, tuple(f"floor {n}" for n in range(1, 6))) for mode in found.modes],
        "sensors": [{"name": one.sensor.name, "rms_g": one.rms_g, "peaks_hz": list(one.peaks_hz),
                     "damping_ratio": one.decrement.damping_ratio, "damping_std": one.decrement.damping_std}
                    for one in compared],
        "rms_difference": abs(compared[1].rms_g - compared[0].rms_g) / compared[0].rms_g,
    }


def _example_lines(example: dict[str, Any]) -> list[str]:
    lines = ["Five-storey model building (section 5.3). The records were never published: simulated, 75 s at 100 Hz,",
             f"damping 1.34 %, first peak 0.198 g at the top. Storey stiffness {example['stiffness_n_per_m']:.1f} N/m, "
             "half way between 3 EI/h^3 and 12 EI/h^3.", "",
             "mode  matrices Hz  printed model  printed measured   from a simulated record of five PS-2119"]
    printed = [*zip(example["printed_model_hz"], example["printed_measured_hz"], strict=True), *[(None, None)] * 2]
    for number, (frequency, (model, measured)) in enumerate(zip(example["frequencies_hz"], printed, strict=True), 1):
        near = [mode for mode in example["modes"] if abs(mode["frequency_hz"] / frequency - 1) < 0.05]
        found = "not there" if not near else (
            f"{_with_error(near[0]['frequency_hz'], near[0]['frequency_std_hz'])} Hz, "
            f"{_with_error(100 * near[0]['damping_ratio'], 100 * near[0]['damping_std'])} %")
        texts = [f"{value:.4f}" if value else "-" for value in (model, measured)]
        lines.append(f"{number:4}  {frequency:11.4f}  {texts[0]:>13}  {texts[1]:>16}   {found}")
    lines += ["The printed 2.500 Hz is a misprint of 2.600: these matrices have it at 3.488 times the first whatever",
              "the stiffness, and the other two fit.", "",
              "sensor           r.m.s. g   FFT peaks Hz             damping by decrement %"]
    lines += [f"{one['name']:15}  {one['rms_g']:8.4f}   {', '.join(f'{peak:.3f}' for peak in one['peaks_hz']):23}  "
              f"{_with_error(100 * one['damping_ratio'], 100 * one['damping_std'])}" for one in example["sensors"]]
    return [*lines, f"r.m.s. differs by {example['rms_difference']:.2%} (printed: 0.0458 and 0.0445, 2.85 %; 1.34 %)"]
