"""Vehicle files (YAML) to vehicles, with complaints that name the line."""

from __future__ import annotations

from pathlib import Path

from logger.errors import BadInput
from logger.store.yaml_lines import Node, load_mapping
from logger.vehicle.vehicle import Axle, Vehicle

_AXLE_KEYS = (
    "unsprung_mass_kg", "suspension_stiffness_n_per_m", "suspension_damping_n_s_per_m", "tire_stiffness_n_per_m",
)
_COMMON_KEYS = ("name", "model", "sprung_mass_kg", "front", "contact_patch_m")
_HALF_CAR_KEYS = ("pitch_inertia_kg_m2", "rear")


def read_vehicle(path: Path | str) -> Vehicle:
    """Read a vehicle file. Raises BadInput (``file:line: expected ...``) for whatever is missing, unknown or wrong.

    A half car needs every key; a quarter car stands on ``front`` alone, without ``cg_distance_m``, and has neither
    ``rear`` nor ``pitch_inertia_kg_m2``.
    """
    top = load_mapping(path)
    model_node = top.mapping().get("model")
    if model_node is None:
        raise BadInput(f"{top.file}:{top.line}: expected the key 'model' here, it is missing")
    half = model_node.choice("half_car", "quarter_car") == "half_car"
    keys = top.mapping(required=_COMMON_KEYS + (_HALF_CAR_KEYS if half else ()), optional=("effects",))
    if "effects" in keys and keys["effects"].items():
        raise keys["effects"].wrong("an empty list (effects are not supported yet)")
    return Vehicle(
        name=keys["name"].text(),
        model=model_node.text(),
        sprung_mass_kg=keys["sprung_mass_kg"].number(above=0),
        pitch_inertia_kg_m2=keys["pitch_inertia_kg_m2"].number(above=0) if half else None,
        front=_read_axle(keys["front"], half),
        rear=_read_axle(keys["rear"], half) if half else None,
        contact_patch_m=keys["contact_patch_m"].number(low=0, high=1),
    )


def _read_axle(node: Node, half: bool) -> Axle:
    keys = node.mapping(required=("cg_distance_m", *_AXLE_KEYS) if half else _AXLE_KEYS)
    return Axle(
        cg_distance_m=keys["cg_distance_m"].number(low=0) if half else 0.0,
        unsprung_mass_kg=keys["unsprung_mass_kg"].number(above=0),
        suspension_stiffness_n_per_m=keys["suspension_stiffness_n_per_m"].number(above=0),
        suspension_damping_n_s_per_m=keys["suspension_damping_n_s_per_m"].number(low=0),
        tire_stiffness_n_per_m=keys["tire_stiffness_n_per_m"].number(above=0),
    )
