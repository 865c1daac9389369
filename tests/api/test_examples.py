"""The examples of the public interface, run as they stand."""

from __future__ import annotations

import doctest
import importlib
import pkgutil
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest

import logger.api
import ridelog

MODULES = [importlib.import_module(f"logger.api.{one.name}") for one in pkgutil.iter_modules(logger.api.__path__)]


@pytest.fixture(scope="module")
def names(tmp_path_factory: pytest.TempPathFactory, short_dump: Path) -> dict[str, Any]:
    """What the examples take for given: a run's folder, with a log in it; a recorded dump; a car, and runs of it with a
    sensor that reads 15 % too much."""
    from logger.commands.main import main

    folder = tmp_path_factory.mktemp("run")
    road = ridelog.random_road(iso_class="B", length_m=200.0, spacing_m=0.1, seed=4)
    run = ridelog.simulate("rav4-2009", road, speed_mps=20.0, noise_mps2=0.05)
    ridelog.write_run(folder, run)
    assert main(["replay", str(short_dump), "--out", str(folder / "logs"), "--json"]) == 0
    car, bumpy = ridelog.read_vehicle("rav4-2009"), ridelog.random_road(iso_class="C", length_m=180.0, seed=2)
    wrong = car.with_effect("sensor_gain", gain=1.15)
    runs = [ridelog.simulate(wrong, bumpy, speed_mps, noise_mps2=0.03, name=f"at {speed_mps:g} mps")
            for speed_mps in (9.0, 15.0)]
    return {"folder": folder, "recording": short_dump, "car": car, "runs": runs, "np": np, **vars(ridelog)}


@pytest.mark.parametrize("module", MODULES, ids=lambda module: module.__name__)
def test_examples(module: ModuleType, names: dict[str, Any]) -> None:
    found = doctest.testmod(module, extraglobs=names, optionflags=doctest.ELLIPSIS)
    assert found.failed == 0


@pytest.mark.parametrize("name", [name for name in ridelog.__all__ if callable(getattr(ridelog, name))])
def test_each_name_is_documented(name: str) -> None:
    one = getattr(ridelog, name)
    assert one.__doc__
    assert isinstance(one, type) or ">>>" in one.__doc__
