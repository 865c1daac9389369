"""The model building of the reference dissertation: its modes out of its matrices, and out of simulated records."""

from __future__ import annotations

from typing import Any


def five_storey() -> dict[str, Any]:
    """What the matrices and simulated records have, beside what is printed."""
    import numpy as np

    from logger.modal import five_storey
    from logger.modal.decay import decay_modes, proposals
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


def example_lines(example: dict[str, Any]) -> list[str]:
    """The same for a person."""
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
