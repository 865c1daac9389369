"""Frozen records that pass from the pipeline to the logs, the status and the reports."""

from dataclasses import dataclass


@dataclass(frozen=True)
class WindowRecord:
    """One window of a drive (25 ft of travelled distance by default). None: cannot be known; ``flags`` say why.

    Times are integer microseconds: ``t_us`` of the monotonic clock at the window's start, ``utc_us`` since
    1970-01-01 UTC of the same instant. Position is that of the window's middle. Intervals are half-open. ``a_w``, MTVV
    and VDV are of the ride alone, with their standard errors; ``raw`` ones of the readings, noise and rounding in them.
    The last three are the parts of the IRI's standard error that windows share (``streaming.WindowEstimate``).
    """

    segment: int
    drive: int
    t_us: int
    utc_us: int | None
    duration_s: float
    distance_start_m: float | None
    distance_end_m: float | None
    lat_deg: float | None
    lon_deg: float | None
    speed_mps: float | None
    iri_m_per_km: float | None
    iri_std_m_per_km: float | None
    iri_rms_m_per_km: float | None
    a_w_mps2: float | None
    mtvv_mps2: float | None
    vdv_mps175: float | None
    crest_factor: float | None
    comfort: str
    iri_class: str
    accel_rms_mps2: float | None
    samples: int
    clipped_samples: int
    flags: tuple[str, ...]
    a_w_std_mps2: float | None = None
    mtvv_std_mps2: float | None = None
    vdv_std_mps175: float | None = None
    a_w_raw_mps2: float | None = None
    mtvv_raw_mps2: float | None = None
    vdv_raw_mps175: float | None = None
    iri_level_std_m_per_km: float | None = None
    iri_common_std_m_per_km: float | None = None
    iri_place_std_m_per_km: float | None = None
