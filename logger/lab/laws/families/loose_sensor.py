"""A sensor that is not screwed down: it lies on the body, leaves it where that falls away, and lands.

A mass that is only pressed on with a force h m follows the body as long as its contact pushes, which takes an
acceleration above -h. Below, it falls behind with -h, until the gap closes again; landing without a bounce takes its
remaining speed away at once (B. Brogliato, Nonsmooth Mechanics, 2016, chapter 1: unilateral contact, impact with a
coefficient of restitution of 0). The blow is in the record as wide as the recorder's filter makes it.

When it lands goes with where it left, so that a fit has to begin within a few hundredths of what holds it: closely
spaced values are tried on the model's record. Blows are few and large, and upwards where flights are short; where they
last, the record is behind for longer than it is ahead. The residual's kurtosis shows the one, its skewness the other;
where it has neither, nothing is tried.
"""

from types import SimpleNamespace

import numpy as np

from logger.arrays import Array
from logger.lab.laws.draft import Draft, Family, FormatNumber, LawContext, rounded
from logger.vehicle.effect import Chosen, Parameter, RecordEffect, Recording, Scale

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
_WEAKEST, _TRIED, _CLOSER = 0.02, 200, np.linspace(-0.02, 0.02, 17)
"""Of the greatest fall of the body; how many are tried up to there, two hundredths apart; and around the best."""


class LooseSensor(Family):
    title = "a sensor that lies loose on the body"
    related_effects = ("sensor_mount_resonance", "sensor_gain")
    kind = "RecordEffect"
    source = "B. Brogliato, Nonsmooth Mechanics (2016), chapter 1: unilateral contact, impact without a bounce"
    signature = "the record never falls below a limit, and upward blows follow"
    shown_by = "screw the sensor down, and drive the same road again"

    def drafts(self, context: LawContext) -> list[Draft]:
        residual = np.concatenate([one[run.first:] for run, one in zip(context.runs, context.residuals, strict=True)])
        size = residual / np.sqrt(np.mean(residual**2))
        skewness, kurtosis = float(np.mean(size**3)), float(np.mean(size**4)) - 3
        shown = max(abs(skewness) / np.sqrt(6), kurtosis / np.sqrt(24)) * np.sqrt(len(size))
        predicted = [run.main(one) for run, one in zip(context.runs, context.state.predictions, strict=True)]
        greatest = max(float(-one.min()) for one in predicted)
        if shown < 10.0 or not greatest > 0:  # standard errors of white noise
            return []
        effect = self._draft(greatest, greatest).effect
        assert isinstance(effect, RecordEffect)
        best = greatest
        for shares in (np.geomspace(_WEAKEST, 1.0, _TRIED), 1 + _CLOSER):
            tried = best * shares
            best = float(tried[int(np.argmin([_squares(context, effect, predicted, held) for held in tried]))])
        return [self._draft(rounded(best, digits=4), greatest)]

    def _draft(self, held_mps2: float, greatest_mps2: float) -> Draft:
        number = Parameter("held_mps2", held_mps2, rounded(0.01 * greatest_mps2), rounded(5 * greatest_mps2),
                           float("inf"), Scale.RECIPROCAL, (held_mps2,),
                           "the sensor leaves its seat where the body falls faster", step=0.002 / held_mps2)
        return self.draft((number,), _METHOD, _FUNCTIONS)

    def words(self, draft: Draft, found: Chosen, say: FormatNumber) -> str:
        return f"a sensor that lies loose, and leaves its seat where the body falls faster than {say('held_mps2')}"


def _squares(context: LawContext, effect: RecordEffect, predicted: list[Array], held_mps2: float) -> float:
    """Sum of the squares of what is left of the residuals by a sensor that is held so."""
    p, found = SimpleNamespace(held_mps2=held_mps2), 0.0
    for run, one in zip(context.runs, predicted, strict=True):
        felt = effect.record(p, Recording(np.arange(run.count) / run.rate_hz, one, one, one))
        found += float(np.sum((run.measured_mps2 - felt)[run.first:] ** 2))
    return found


FAMILY = LooseSensor()
