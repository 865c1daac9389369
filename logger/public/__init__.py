"""ridelog in Python: read, simulate, compare, diagnose, identify, estimate, calibrate.

    import ridelog

    road = ridelog.random_road(iso_class="C", length_m=300.0)
    car = ridelog.read_vehicle("rav4-2009")
    run = ridelog.simulate(car, road, speed_mps=12.0, noise_mps2=0.05)
    print(ridelog.estimate(run, car))

Quantities are in SI units, which their names end in. What is wrong with an input is raised as ``BadInput``.
``docs/notebook.md`` goes through the lab.
"""

from logger.api.calibration import Calibration, Slopes, calibrate
from logger.api.conversion import Conversion, convert
from logger.api.drives import Estimate, Run, estimate, make_run, read_run, simulate, write_run
from logger.api.fleet import FleetReport, FleetSummary, Ingested, fleet_ingest, fleet_report, fleet_summarise
from logger.api.identification import Identification, identify
from logger.api.lab import AddedEffect, Candidate, Comparison, Diagnosis, ShiftedNumber, add_effect, compare, diagnose
from logger.api.lab_loop import LabStory, lab
from logger.api.learning import LearnedLaw, learn
from logger.api.logs import Dump, Log, Samples, read_dump, read_log
from logger.api.modal import Modes, modes
from logger.api.passes import RepeatedDrives, passes
from logger.api.plan import NextDrive, Plan, plan
from logger.api.rides import Comfort, Record, comfort, read_record
from logger.api.roads import Iri, Profile, RoadClass, classify, iri, random_road, read_profile, write_profile
from logger.api.same_road import SameRoadDiagnosis, diagnose_same_road
from logger.api.sections import Sections, sections
from logger.api.vehicles import EffectInfo, Effects, Model, effects, read_vehicle, vehicles, write_vehicle
from logger.api.vibration_records import Channels, make_channels, read_channels
from logger.errors import BadInput
from logger.identification.identifiability import NotIdentifiable

__all__ = [
    "AddedEffect",
    "BadInput",
    "Calibration",
    "Candidate",
    "Channels",
    "Comfort",
    "Comparison",
    "Conversion",
    "Diagnosis",
    "Dump",
    "EffectInfo",
    "Effects",
    "Estimate",
    "FleetReport",
    "FleetSummary",
    "Identification",
    "Ingested",
    "Iri",
    "LabStory",
    "LearnedLaw",
    "Log",
    "Model",
    "Modes",
    "NextDrive",
    "NotIdentifiable",
    "Plan",
    "Profile",
    "Record",
    "RepeatedDrives",
    "RoadClass",
    "Run",
    "SameRoadDiagnosis",
    "Samples",
    "Sections",
    "ShiftedNumber",
    "Slopes",
    "add_effect",
    "calibrate",
    "classify",
    "comfort",
    "compare",
    "convert",
    "diagnose",
    "diagnose_same_road",
    "effects",
    "estimate",
    "fleet_ingest",
    "fleet_report",
    "fleet_summarise",
    "identify",
    "iri",
    "lab",
    "learn",
    "make_channels",
    "make_run",
    "modes",
    "passes",
    "plan",
    "random_road",
    "read_channels",
    "read_dump",
    "read_log",
    "read_profile",
    "read_record",
    "read_run",
    "read_vehicle",
    "sections",
    "simulate",
    "vehicles",
    "write_profile",
    "write_run",
    "write_vehicle",
]
