"""Natural frequencies, damping ratios and mode shapes of a vibration record, each with its standard deviation.

FILE is CSV with t_s and one column per sensor, evenly sampled: a free decay (push, let go, record) or the response to
random forces; --input names a column with a force or motion that was measured with it. Nobody has to pick poles: the
order and the modes are chosen by rule, and what the record does not support is listed as rejected, with the reason.

  ridelog modes push.csv --method era
  ridelog modes drive.csv --vehicle mycar.yaml
  ridelog modes --vehicle mycar.yaml --iri 6 --speed 20

A drive needs the vehicle: the road, and the second axle that follows the first, put peaks into its spectrum that are
no modes. Its springs, dampers and masses are fitted to the spectrum, and the modes are those of the numbers found;
wheelbase, contact patch and the sensor's place stay as its file says. A record without speed_mps takes --speed.

With --vehicle and no FILE they are those of a vehicle's file with its effects; the standard deviations follow from
the standard errors that the file carries. Laws that are not linear are what they come to on a road at a speed.
"""

from __future__ import annotations

import argparse
import json
from pathlib import Path
from typing import TYPE_CHECKING, Any

from logger.api.ranges import COMMON_IRI, COMMON_SPEED_MPS, IRI, MODAL_METHODS, RESPONSES, SPEED
from logger.commands.numbers import add_number
from logger.commands.pictures import add_out, check_pictures, write_pictures
from logger.errors import EXIT_DONE, BadInput
from logger.files import together, write_text

if TYPE_CHECKING:
    from logger.api.modal import Array

EXAMPLES = ("five-storey",)


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of ``ridelog modes``."""
    parser.add_argument("file", type=Path, nargs="?", metavar="FILE", help="CSV with t_s and one column per sensor")
    parser.add_argument("--vehicle", metavar="NAME|FILE",
                        help="the modes of a vehicle's file; with a FILE, the vehicle that was driven")
    add_number(parser, "--iri", *IRI, metavar="M_PER_KM",
               help=f"with --vehicle: road for laws that are not linear (default: {COMMON_IRI:g})")
    add_number(parser, "--speed", *SPEED, metavar="MPS",
               help=f"with --vehicle: speed on it (default: {COMMON_SPEED_MPS:g}); with a FILE: at which it was "
                    "driven, if it does not say so")
    parser.add_argument("--method", metavar="NAME",
                        help=f"{', '.join(MODAL_METHODS)}: era for a free decay, ssi for a random response, n4sid "
                             "beside a measured input (default: as the record is); decrement is Eq 5.2, for one mode "
                             "of a free decay")
    parser.add_argument("--columns", metavar="A,B,...",
                        help="columns of the sensors (default: all but t_s, the input, and a drive's speed, distance "
                             "and place)")
    parser.add_argument("--input", metavar="COLUMN", help="column of the measured input")
    parser.add_argument("--order", type=int, metavar="N",
                        help="states of the model (for a free decay the most that are tried) instead of the order "
                             "chosen by rule")
    parser.add_argument("--response", choices=RESPONSES, metavar="KIND",
                        help="decay or random; without it the record is looked at")
    parser.add_argument("--from", dest="from_s", type=float, metavar="S", help="leave out what is before this t_s [s]")
    parser.add_argument("--to", dest="to_s", type=float, metavar="S", help="leave out what is after this t_s [s]")
    parser.add_argument("--diagram", type=Path, metavar="FILE.csv",
                        help="write the poles of all orders, for a stabilisation diagram")
    parser.add_argument("--example", choices=EXAMPLES, metavar="NAME",
                        help="five-storey: the model building of the reference dissertation, instead of FILE")
    add_out(parser)
    parser.add_argument("--json", action="store_true", help="print one JSON object for a program")


def run(args: argparse.Namespace) -> int:
    """Carry out ``ridelog modes``."""
    from logger.api.modal import found_modes, modes_by
    from logger.api.vibration_records import Question

    if args.vehicle is not None and args.file is None:
        return _of_vehicle(args)
    if args.iri is not None or (args.speed is not None and args.vehicle is None):
        raise BadInput("--iri and --speed: expected --vehicle with them"
                       + (", and no FILE with --iri" if args.vehicle is not None else ""))
    if args.example is not None:
        _check_example(args)
        example = _five_storey()
        print(json.dumps(example) if args.json else "\n".join(_example_lines(example)))
        return EXIT_DONE
    if args.file is None:
        raise BadInput("modes: expected a FILE (try 'ridelog modes --help')")
    if args.diagram is not None and (args.method == "decrement" or args.vehicle is not None):
        raise BadInput("--diagram: expected a method with poles, not "
                       + (f"--method {args.method}" if args.vehicle is None else "--vehicle"))
    columns = None if args.columns is None else [name.strip() for name in args.columns.split(",")]
    question = Question(args.method, columns, args.input, args.order, args.response, args.from_s, args.to_s,
                        args.vehicle, args.speed, _option)
    check_pictures(args.out, [args.file], [("--diagram", args.diagram)])
    found = modes_by(question, found_modes(args.file, question), args.file.name)
    with together():
        if args.diagram is not None:
            write_text(args.diagram, _diagram_csv(found.poles), "ascii")
        write_pictures(args.out, "Modes", args.file.name, found.text, found.charts)
    print(json.dumps(found.as_json(), allow_nan=False) if args.json else found.text)
    return EXIT_DONE


def _option(name: str) -> str:
    """How an option is written."""
    return f"--{name.removesuffix('_s').removesuffix('_column')}"


def _of_vehicle(args: argparse.Namespace) -> int:
    from logger.api.modal import vehicle_modes
    from logger.api.vehicles import read_vehicle

    if args.example is not None:
        raise BadInput(f"--vehicle {args.vehicle}: expected no --example with it")
    _check_alone(args, f"--vehicle {args.vehicle}")
    found = vehicle_modes(read_vehicle(args.vehicle), COMMON_IRI if args.iri is None else args.iri,
                          COMMON_SPEED_MPS if args.speed is None else args.speed)
    print(json.dumps(found.as_json(), allow_nan=False) if args.json else str(found))
    return EXIT_DONE


def _check_example(args: argparse.Namespace) -> None:
    """BadInput for anything with an example but --json."""
    _check_alone(args, f"--example {args.example}")


def _check_alone(args: argparse.Namespace, said: str) -> None:
    """BadInput for a FILE, or options that need one."""
    if args.file is not None:
        raise BadInput(f"{said}: expected no FILE with it, found {args.file}")
    given = {"--method": args.method, "--columns": args.columns, "--input": args.input, "--order": args.order,
             "--response": args.response, "--from": args.from_s, "--to": args.to_s,
             "--diagram": args.diagram, "--out": args.out or None}
    if options := [option for option, value in given.items() if value is not None]:
        raise BadInput(f"{options[0]}: expected a FILE with it, not {said}")


def _diagram_csv(poles: Array) -> str:
    rows = [f"{order:.0f},{frequency_hz:.7g},{damping_ratio:.5g}\n"
            for order, frequency_hz, damping_ratio in poles.tolist()]
    return "order,frequency_hz,damping_ratio\n" + "".join(rows)


# --- the example ---


def _five_storey() -> dict[str, Any]:
    import numpy as np

    from logger.modal import five_storey
    from logger.modal.decay import decay_modes
    from logger.modal.era import proposals
    from logger.report.modal_text import mode_json

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
        "modes": [mode_json(mode, tuple(f"floor {n}" for n in range(1, 6))) for mode in found.modes],
        "sensors": [{"name": one.sensor.name, "rms_g": one.rms_g, "peaks_hz": list(one.peaks_hz),
                     "damping_ratio": one.decrement.damping_ratio, "damping_std": one.decrement.damping_std}
                    for one in compared],
        "rms_difference": abs(compared[1].rms_g - compared[0].rms_g) / compared[0].rms_g,
    }


def _example_lines(example: dict[str, Any]) -> list[str]:
    from logger.report.modal_text import with_error

    lines = ["Five-storey model building (section 5.3). The records were never published: simulated, 75 s at 100 Hz,",
             f"damping 1.34 %, first peak 0.198 g at the top. Storey stiffness {example['stiffness_n_per_m']:.1f} N/m, "
             "half way between 3 EI/h^3 and 12 EI/h^3.", "",
             "mode  matrices Hz  printed model  printed measured   from a simulated record of five PS-2119"]
    printed = [*zip(example["printed_model_hz"], example["printed_measured_hz"], strict=True), *[(None, None)] * 2]
    for number, (frequency, (model, measured)) in enumerate(zip(example["frequencies_hz"], printed, strict=True), 1):
        near = [mode for mode in example["modes"] if abs(mode["frequency_hz"] / frequency - 1) < 0.05]
        found = "not there" if not near else (
            f"{with_error(near[0]['frequency_hz'], near[0]['frequency_std_hz'])} Hz, "
            f"{with_error(100 * near[0]['damping_ratio'], 100 * near[0]['damping_std'])} %")
        texts = [f"{value:.4f}" if value else "-" for value in (model, measured)]
        lines.append(f"{number:4}  {frequency:11.4f}  {texts[0]:>13}  {texts[1]:>16}   {found}")
    lines += ["The printed 2.500 Hz is a misprint of 2.600: these matrices have it at 3.488 times the first whatever",
              "the stiffness, and the other two fit.", "",
              "sensor           r.m.s. g   FFT peaks Hz             damping by decrement %"]
    lines += [f"{one['name']:15}  {one['rms_g']:8.4f}   {', '.join(f'{peak:.3f}' for peak in one['peaks_hz']):23}  "
              f"{with_error(100 * one['damping_ratio'], 100 * one['damping_std'])}" for one in example["sensors"]]
    return [*lines, f"r.m.s. differs by {example['rms_difference']:.2%} (printed: 0.0458 and 0.0445, 2.85 %; 1.34 %)"]
