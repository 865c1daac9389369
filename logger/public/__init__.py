"""ridelog in Python: read, simulate, compare, diagnose, identify, estimate, calibrate.

    import ridelog

    road = ridelog.random_road(iso_class="C", length_m=300.0)
    car = ridelog.read_vehicle("rav4-2009")
    run = ridelog.simulate(car, road, speed_mps=12.0, noise_mps2=0.05)
    print(ridelog.estimate(run, car))

Quantities are in SI units, which their names end in. What is wrong with an input is raised as ``BadInput``.
``docs/notebook.md`` goes through the lab.
"""

from importlib import import_module
from typing import Any

_HOMES = {
    "logger.api.conversion": "Conversion convert",
    "logger.api.calibration": "Calibration Slopes calibrate",
    "logger.api.drives": "Estimate estimate simulate",
    "logger.api.fleet": "FleetReport FleetSummary Ingested fleet_ingest fleet_report fleet_summarise",
    "logger.api.identify.answer": "Identification identify",
    "logger.api.inputs": "EffectInfo Effects Model Profile Run make_run read_profile read_run read_vehicle vehicles "
                         "write_profile write_run write_vehicle",
    "logger.api.lab.compare": "AddedEffect Comparison ShiftedNumber add_effect compare",
    "logger.api.lab.loop": "LabStory lab",
    "logger.api.lab.learn": "LearnedLaw learn",
    "logger.api.logs": "Dump Log Samples read_dump read_log",
    "logger.api.modal": "Channels Modes make_channels modes read_channels",
    "logger.api.passes": "RepeatedDrives passes",
    "logger.api.lab.plan": "NextDrive Plan plan",
    "logger.api.rides": "Comfort Record comfort read_record",
    "logger.api.roads": "Iri RoadClass classify iri random_road",
    "logger.api.lab.diagnose": "Candidate Diagnosis diagnose",
    "logger.api.sections": "Sections sections",
    "logger.errors": "BadInput",
    "logger.identification.identifiability": "NotIdentifiable",
}
"""Where each name lives. What it is, type checkers read in ``__init__.pyi``."""
_HOME = {name: module for module, names in _HOMES.items() for name in names.split()}
__all__ = [*_HOME, "effects"]


def __getattr__(name: str) -> Any:
    """Load what is asked for first, as all of it takes a second or more on a Pi (PEP 562)."""
    if name == "effects":
        return import_module("ridelog.effects")
    if name not in _HOME:
        raise AttributeError(f"module 'ridelog' has no attribute {name!r}")
    globals()[name] = found = getattr(import_module(_HOME[name]), name)
    return found


def __dir__() -> list[str]:
    return __all__
