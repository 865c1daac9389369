"""What a recorder keeps of the motions of a linear car that is given by its matrices."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from logger.profiles.track import WheelTracks
from logger.vehicle.compose import linear_outputs
from logger.vehicle.simulate import FINE_RATE_HZ, Passage
from logger.vehicle.structure import Output, Structure


def drive(structure: Structure, outputs: Sequence[Output], track: WheelTracks, time_s: np.ndarray,
          distance_m: np.ndarray, fine_hz: float = FINE_RATE_HZ) -> np.ndarray:
    """Outputs (N, p) at the instants (N,), evenly spaced, at which the front tires stand at these places (N,)."""
    passage = Passage(track, (len(time_s) - 1) / float(time_s[-1] - time_s[0]), distance_m, fine_hz)
    return np.stack([passage.recorded(one, np.ones_like) for one in linear_outputs(structure, passage, outputs)], 1)
