"""What other people reported of receivers, ports, sticks, cards, phones, profiles and modal records, tried on ridelog:
a table of the situations and of the tests that show what it does with each.

    python -m tests.benchmarks.reported
"""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
from pathlib import Path
from xml.etree import ElementTree

ROOT = Path(__file__).resolve().parents[2]
SITUATIONS = {
    "a recording names a file of this machine": "commands/test_recording_is_data.py",
    "a reading of 1e-320": "fuzz/test_commands.py::test_readings_below_what_any_sensor_resolves_are_none",
    "a time step of 1e-8 s": "fuzz/test_commands.py::test_a_clock_that_no_recorder_has_takes_no_memory",
    "the disk is full under an older output": "commands/test_full_disk.py",
    "words of a log made to hurt": "commands/test_hostile_words.py",
    "an adapter answers EPROTO, EIO and others": "service/test_foreign_faults.py",
    "a line too slow for its receiver": "service/test_receiver_lines.py::test_a_full_line_is_reported_with_what_to_do",
    "a fix each two seconds; GLL alone": "service/test_receiver_lines.py::"
                                         "test_rows_have_the_place_and_time_of_their_instant",
    "sentences without a checksum": "service/test_process.py::test_a_receiver_that_is_set_wrong_is_said_to_be",
    "GGA and VTG, no date": "drivers/test_nmea.py::test_a_receiver_that_names_no_date_is_told_what_to_send",
    "lines and frames of another form": "drivers/test_wire_contents.py",
    "a card cloned for a second car": "commands/test_export_places.py::"
                                      "test_a_card_that_was_copied_for_a_second_car_is_another_logger",
    "export where no stick is mounted": "commands/test_export_places.py::"
                                        "test_a_copy_on_the_disk_of_the_logs_is_no_export",
    "logs in memory": "service/test_process.py::test_logs_in_memory_are_reported",
    "a USB disk that udev calls ata": "systemd/test_units.py::"
                                      "test_a_disk_on_usb_with_the_label_gets_the_logs_whatever_udev_calls_its_bus",
    "EPERM of the unit's device policy": "drivers/test_foreign_faults.py::"
                                         "test_a_port_that_may_not_be_opened_says_who_forbids_it",
    "a Pi 5's /dev/serial0": "drivers/test_board_serial_port.py",
    "a full disk and the last words": "service/test_disk_process.py::test_the_last_words_count_what_is_on_the_disk",
    "whole km/h at a steady speed": "commands/test_extract_csv.py::test_an_unchanged_speed_is_driven_all_the_way",
    "a sensor that stands for 20 of 60 s": "commands/test_extract_csv.py::test_a_sensor_that_stood_still_ends_a_run",
    "a reading a second, written at 100 Hz": "commands/test_extract_csv.py::"
                                             "test_a_reading_a_second_is_no_record_and_one_that_is_all_clipped_no_run",
    "linear acceleration whose mean is near 1": "commands/test_extract_csv.py::"
                                                "test_a_unit_that_was_said_holds_though_the_mean_is_near_1",
    "armax finds what is not there": "modal/test_shaken.py",
    "comfort of an extracted run": "commands/test_doubtful_records.py::"
                                   "test_what_a_run_says_of_itself_is_heard_of_its_folder_and_of_its_drive",
    "an axis that stands still": "commands/test_doubtful_records.py::"
                                 "test_an_axis_that_stands_still_has_no_verdict_and_is_named",
    "a profile in mm, a limit in in/mi": "roads/test_plausible.py",
    "no header, or one below other lines": "store/formats/test_csv_table.py",
    "a fleet of two cars with a drive each": "fleet/test_fleet.py::test_two_cars_with_a_drive_each_are_not_judged",
    "an option given four times": "commands/test_main.py::test_no_value_is_dropped",
    "dates, places and verdicts of pages": "commands/test_passes.py",
    "an uneven step after a gap": "commands/test_extract_is_read.py",
    "overflow where a car hits its stops": "identification/test_road_equations.py",
}
"""Each situation and what shows it: a file of tests, or one test."""


def main() -> int:
    """Run them and print the table. Exit 1 where a test fails or is not there."""
    with tempfile.TemporaryDirectory() as folder:
        report = Path(folder) / "report.xml"
        nodes = [f"tests/{one}" for one in SITUATIONS.values()]
        subprocess.run([sys.executable, "-m", "pytest", "-q", "-m", "", f"--junitxml={report}", *nodes], cwd=ROOT,
                       check=False, stdout=subprocess.DEVNULL, env=os.environ | {"OPENBLAS_NUM_THREADS": "1"})
        cases = list(ElementTree.parse(report).iter("testcase"))
    missed = 0
    print(f"{'situation':<44} {'cases':>5} {'right':>5}  test")
    for situation, shown_by in SITUATIONS.items():
        file, _, test = shown_by.partition("::")
        module = "tests." + file.removesuffix(".py").replace("/", ".")
        mine = [case for case in cases if case.get("classname") == module
                and test in ("", str(case.get("name")).split("[")[0])]
        right = [case for case in mine if not any(child.tag in ("failure", "error") for child in case)]
        missed += not mine or len(right) < len(mine)
        print(f"{situation:<44} {len(mine):>5} {len(right):>5}  {shown_by}")
    return 1 if missed else 0


if __name__ == "__main__":
    sys.exit(main())
