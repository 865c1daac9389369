"""Cases as files: what the lab may see in one folder, the truth in another."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np

from ..simulator.cars import Axle, Car
from ..simulator.outsiders import Outsider
from ..simulator.roads import Road
from .random_case import Case, Recording


def write_case(case: Case, folder: Path | str) -> dict[str, object]:
    """Write ``vehicle.yaml`` and ``run1/drive.csv``, ``run1/profile.csv`` ... into a folder; return the truth."""
    folder = Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "vehicle.yaml").write_text(_vehicle_text(case.nominal), "utf-8")
    for number, (run, road) in enumerate(zip(case.recordings, case.profiles, strict=True), 1):
        place = folder / f"run{number}"
        place.mkdir(exist_ok=True)
        (place / "drive.csv").write_text(_drive_text(run), "utf-8")
        (place / "profile.csv").write_text(_profile_text(road, case.both_tracks), "utf-8")
    return truth(case)


def _vehicle_text(car: Car) -> str:
    lines = ["name: examined", f"model: {car.model}", f"sprung_mass_kg: {car.sprung_mass_kg!r}"]
    if car.rear:
        lines.append(f"pitch_inertia_kg_m2: {car.pitch_inertia_kg_m2!r}")
    for name, axle in (("front", car.front), ("rear", car.rear)):
        if axle:
            lines.append(f"{name}:")
            lines += [f"  {key}: {value!r}" for key, value in _axle(axle, bool(car.rear)).items()]
    lines += [f"contact_patch_m: {car.contact_patch_m!r}", "effects: []", ""]
    return "\n".join(lines)


def _axle(axle: Axle, placed: bool) -> dict[str, float]:
    keys = dict(vars(axle))
    if not placed:
        del keys["cg_distance_m"]
    return keys


def _drive_text(run: Recording) -> str:
    rows = zip(run.t_s, run.accel_z_mps2, run.speed_mps, run.distance_m, strict=True)
    lines = (f"{t:.2f},{a:.4f},{v:.3f},{d:.4f}\n" for t, a, v, d in rows)
    return "t_s,accel_z_mps2,speed_mps,distance_m\n" + "".join(lines)


def _profile_text(road: Road, both: bool) -> str:
    if both:
        rows = zip(road.distance_m, road.left_m, road.right_m, strict=True)
        return "distance_m,elevation_m,elevation_right_m\n" + "".join(f"{d:.2f},{a:.6f},{b:.6f}\n" for d, a, b in rows)
    rows = zip(road.distance_m, road.left_m, strict=True)
    return "distance_m,elevation_m\n" + "".join(f"{d:.2f},{a:.6f}\n" for d, a in rows)


def truth(case: Case) -> dict[str, object]:
    """The answer. Errors are r.m.s. over r.m.s. of the measurement, as the formats define ``error``.

    ``noise_floor_error`` is the noise alone; ``attainable_error`` is the true car driven along the recorded distance,
    which is as near as anyone can come who believes that distance; ``error_without_effects`` is the true car without
    its effects.
    """
    answer: dict[str, object] = {
        "kind": case.kind, "seed": case.seed, "effects": [], "outsiders": [],
        "noise": {"rms_mps2": case.noise_rms_mps2, "white_mps2": case.noise.white_mps2,
                  "step_mps2": case.noise.step_mps2},
        **case.error,
        "vehicle": _car(case.scene.car), "vehicle_file": _car(case.nominal),
        "runs": [
            {"duration_s": drive.duration_s, "speed_mps": drive.speed_mps, "varies": bool(drive.swings),
             "road_class": drive.road.grade, "waviness": drive.road.waviness, "spacing_m": drive.road.spacing_m,
             "accel_rms_mps2": float(np.std(run.clean_mps2))}
            for drive, run in zip(case.scene.drives, case.recordings, strict=True)],
    }
    for each in case.hidden:
        entry = {
            "name": each.effect.name,
            "parameters": {name: value for name, value in each.parameters.items() if not name.startswith("_")},
            "strength": each.strength, "wanted_strength": each.wanted,
        }
        if isinstance(each.effect, Outsider):
            answer["outsiders"].append({**entry, "akin": list(each.effect.akin)})
        else:
            answer["effects"].append(entry)
        if each.effect.name == "dry_friction":
            entry["law"] = case.scene.physics.friction_law
    return answer


def _car(car: Car) -> dict[str, object]:
    keys: dict[str, object] = {"model": car.model, "sprung_mass_kg": car.sprung_mass_kg}
    if car.rear:
        keys["pitch_inertia_kg_m2"] = car.pitch_inertia_kg_m2
    keys["front"] = _axle(car.front, bool(car.rear))
    if car.rear:
        keys["rear"] = _axle(car.rear, placed=True)
    return {**keys, "contact_patch_m": car.contact_patch_m}


def write_truth(answer: dict[str, object], path: Path | str) -> None:
    Path(path).parent.mkdir(parents=True, exist_ok=True)
    Path(path).write_text(json.dumps(answer, indent=1) + "\n", "utf-8")
