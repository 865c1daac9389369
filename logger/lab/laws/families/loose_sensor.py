"""A sensor that is not screwed down: it lies on the body, leaves it where that falls away, and lands.

A mass that is only pressed on with a force h m follows the body as long as its contact pushes, which takes an
acceleration above -h. Below, it falls behind with -h, until the gap closes again; landing without a bounce takes its
remaining speed away at once (B. Brogliato, Nonsmooth Mechanics, 2016, chapter 1: unilateral contact, impact with a
coefficient of restitution of 0). The blow is in the record as wide as the recorder's filter makes it.
"""

from __future__ import annotations

import numpy as np

from logger.lab.laws.draft import Draft
from logger.lab.laws.families.family import Family, FormatNumber, LawContext, rounded
from logger.vehicle.effect import Chosen, Parameter, Scale

_FUNCTIONS = """
FINER = 8  # steps in which the flight is followed, of each of the record's


def lies(accel, held_mps2, step_s):
    # What a mass feels (n,) that is pressed onto a body with this acceleration (n,).
    felt = accel.copy()
    below = np.flatnonzero(accel < -held_mps2)
    done = 0
    while True:
        place = np.searchsorted(below, done)
        if place == len(below):
            return felt
        first, length = below[place], 64
        while True:
            apart_mps = np.cumsum(-held_mps2 - accel[first:first + length]) * step_s
            landed = np.flatnonzero(np.cumsum(apart_mps) <= 0)
            if len(landed) or first + length >= len(accel):
                break
            length *= 2
        last = first + landed[0] if len(landed) else len(accel)
        felt[first:last] = -held_mps2
        if last < len(accel):
            felt[last] = accel[last] - apart_mps[last - first] / step_s
        done = last + 1
"""
_METHOD = """def record(self, p, recording):
    accel, n = recording.accel_z_mps2, len(recording.accel_z_mps2)
    step_s = (recording.time_s[1] - recording.time_s[0]) / FINER
    fine = FINER * np.fft.irfft(np.fft.rfft(accel), FINER * n)
    changed = np.fft.rfft(lies(fine, p.held_mps2, step_s) - fine)[: n // 2 + 1] / FINER
    # The recorder's filter is flat up to 0.38 of the rate, and leaves nothing at half of it.
    beyond = np.clip((np.arange(len(changed)) / n - 0.38) / 0.12, 0.0, 1.0)
    return accel + np.fft.irfft(changed * np.cos(0.5 * np.pi * beyond) ** 2, n)
"""
_SHARES = (0.5, 0.1, 0.02)
"""Of the time that the body falls faster than what is tried holds the sensor."""


class LooseSensor(Family):
    name = "loose_sensor"
    title = "a sensor that lies loose on the body"
    related_effects = ("sensor_mount_resonance", "sensor_gain")
    shown_by = "screw the sensor down, and drive the same road again"

    def drafts(self, context: LawContext) -> list[Draft]:
        predictions = context.state.predictions
        falls = -np.concatenate([run.main(one) for run, one in zip(context.runs, predictions, strict=True)])
        greatest = float(falls.max())
        held = sorted({rounded(max(float(np.quantile(falls, 1 - share)), 0.02 * greatest)) for share in _SHARES})
        number = Parameter("held_mps2", held[-1], rounded(0.01 * greatest), rounded(5 * greatest), float("inf"),
                           Scale.RECIPROCAL, tuple(held), "the sensor leaves its seat where the body falls faster")
        return [Draft(
            family=self.name, kind="RecordEffect", title=self.title, shown_by=self.shown_by, parameters=(number,),
            source="B. Brogliato, Nonsmooth Mechanics (2016), chapter 1: unilateral contact, impact without a bounce",
            signature="downwards the record goes no farther than a limit, and blows upwards follow",
            functions=_FUNCTIONS, method=_METHOD)]

    def words(self, draft: Draft, found: Chosen, say: FormatNumber) -> str:
        return f"a sensor that lies loose, and leaves its seat where the body falls faster than {say('held_mps2')}"


FAMILY = LooseSensor()
