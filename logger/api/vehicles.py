"""Vehicles with their effects, and the effects that there are."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from logger.api.shown import Shown, table
from logger.errors import BadInput
from logger.profiles.excitation import Excitation
from logger.profiles.track import Track
from logger.report.quantities import numbers_of, unit_of
from logger.shipped import vehicle_names, vehicle_path
from logger.store.formats import effect_file, vehicle_file
from logger.vehicle.compose import Car, compose, with_effect
from logger.vehicle.effect import Chosen, chosen
from logger.vehicle.models import structure_of
from logger.vehicle.named_parameters import changed, names, read
from logger.vehicle.structure import force_row
from logger.vehicle.vehicle import Vehicle


@dataclass(frozen=True, eq=False, repr=False)
class Model(vehicle_file.Model, Shown):
    """A vehicle with its effects, as in a vehicle's file.

    vehicle    the plain car: masses, springs, dampers and places
    effects    what it has besides, each with values and, where it was fitted, standard errors
    history    the steps that led to it, each with its error
    given      the car before any of its numbers was refitted; None: none was
    errors     standard errors of its numbers with their correlations; None: none are known
    """

    @property
    def numbers(self) -> dict[str, float]:
        """The car's numbers by the names of its file: ``front.suspension_damping_n_s_per_m``."""
        return {name: read(self.vehicle, name) for name in _names(self.vehicle)}

    def with_numbers(self, values: Mapping[str, float]) -> Model:
        """The same car with other numbers, named as in its file. BadInput for a name that there is not.

        >>> heavier = read_vehicle("rav4-2009").with_numbers({"front.unsprung_mass_kg": 60.0})
        >>> heavier.vehicle.front.unsprung_mass_kg
        60.0
        """
        if unknown := set(values) - set(self.numbers):
            raise BadInput(f"{self.vehicle.name}: no number {sorted(unknown)[0]!r}: expected one of "
                           f"{', '.join(self.numbers)}")
        return replace(self, vehicle=changed(self.vehicle, values))

    def with_effect(self, name: str, **values: float) -> Model:
        """The same car with one more effect, or another value of one that it has.

        name      of an effect that comes with ridelog, or the path of a Python file with one of your own
        values    of its parameters; those that are not said are at their usual value

        BadInput for an effect or a parameter that there is not, or that this car cannot have.

        >>> read_vehicle("rav4-2009").with_effect("dry_friction", friction_force_n=80.0).effects[0].values
        {'friction_force_n': 80.0, 'transition_velocity_m_per_s': 0.0}
        """
        effect, file = effect_file.effect_named(name)
        try:
            one = chosen(effect, effect.usual | values, file=file)
        except ValueError as error:
            raise BadInput(f"{name}: {error}") from None
        effect_file.check_on(self.vehicle, one, two_tracks=True)
        return replace(self, effects=with_effect(self.effects, one))

    def __repr__(self) -> str:
        rows = [(name, f"{value:.6g}", unit_of(name)) for name, value in self.numbers.items()]
        effects = [f"  with {one.effect.name} {numbers_of(one)}".rstrip() for one in self.effects]
        kind = self.vehicle.model.replace("_", " ")
        return "\n".join([table(f"{self.vehicle.name} ({kind})", rows), *effects])


def _names(vehicle: Vehicle) -> list[str]:
    return [name for name in names(vehicle) if not name.startswith("both.")]


def vehicles() -> list[str]:
    """Names of the vehicles that come with ridelog.

    >>> "rav4-2009" in vehicles()
    True
    """
    return vehicle_names()


def read_vehicle(vehicle: Path | str) -> Model:
    """A vehicle with its effects.

    vehicle    name of one that comes with ridelog, or the path of a YAML file (with a / or .yaml in its name)

    Raises BadInput (``file:line: expected ...``) for whatever is missing, unknown or wrong in the file. An effect of
    your own that it names is Python, which is run.

    >>> car = read_vehicle("rav4-2009")
    >>> car.vehicle.model, car.numbers["sprung_mass_kg"]
    ('half_car', 875.0)
    """
    return Model(**vars(vehicle_file.read_model(vehicle_path(str(vehicle)))))


def write_vehicle(path: Path | str, model: Model) -> None:
    """Write a vehicle as a file that ``read_vehicle`` reads back equal, to the last bit. OSError if that fails.

    >>> write_vehicle(folder / "mycar.yaml", read_vehicle("rav4-2009").with_effect("wheel_lift"))
    >>> [one.effect.name for one in read_vehicle(folder / "mycar.yaml").effects]
    ['wheel_lift']
    """
    vehicle_file.write_model(path, model)


def model_of(vehicle: vehicle_file.Model | Path | str) -> Model:
    """The model, or that of a name or a file."""
    if isinstance(vehicle, vehicle_file.Model):
        return vehicle if isinstance(vehicle, Model) else Model(**vars(vehicle))
    return read_vehicle(vehicle)


@dataclass(frozen=True, eq=False, repr=False)
class Effects(Mapping[str, "EffectInfo"], Shown):
    """The physical effects that ridelog knows, by name."""

    by_name: Mapping[str, EffectInfo]

    def __getitem__(self, name: str) -> EffectInfo:
        return self.by_name[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self.by_name)

    def __len__(self) -> int:
        return len(self.by_name)

    def __repr__(self) -> str:
        width = max(map(len, self.by_name), default=0)
        return "\n".join(f"{name:{width}}  {one.title}" for name, one in self.by_name.items())


@dataclass(frozen=True, repr=False)
class EffectInfo(Shown):
    """A physical effect.

    title         in a few words
    parameters    its numbers: name, which ends in its unit, and meaning
    signature     what it leaves in a measurement
    shown_by      the drive that would show it best
    source        of the law
    """

    name: str
    title: str
    parameters: Mapping[str, str]
    signature: str
    shown_by: str
    source: str

    def __repr__(self) -> str:
        numbers = [f"  {name}: {meaning}" for name, meaning in self.parameters.items()]
        return "\n".join([f"{self.name}: {self.title}", *numbers, f"  leaves: {self.signature}",
                          f"  to see it: {self.shown_by}", f"  source: {self.source}"])


def effects() -> Effects:
    """The physical effects that ridelog knows, by name.

    >>> effects()["dry_friction"].title
    'Coulomb friction in each suspension'
    """
    return Effects({name: EffectInfo(name, one.title, {p.name: p.meaning for p in one.parameters}, one.signature,
                                     one.shown_by, one.source) for name, one in effect_file.shipped_effects().items()})


def check_forces(vehicle: Vehicle, track: Track | Excitation, said: str) -> None:
    """BadInput where a force, ``said`` in this file, acts on a part that the vehicle does not have."""
    for one in track.forces if isinstance(track, Excitation) else ():
        try:
            force_row(structure_of(vehicle), one.parts)
        except ValueError as error:
            raise BadInput(f"{said}: {one.name}: {error}") from None


def car_on(vehicle: Vehicle, effects: Sequence[Chosen], said: Mapping[str, str],
           track: Track | Excitation) -> Car:
    """The vehicle with its effects, which are possible on this road; ``said`` where, by name. BadInput for one that is
    not, ValueError as ``compose``."""
    for one in effects:
        try:
            effect_file.check_on(vehicle, one, track.two_tracks, track.timed)
        except BadInput as error:
            raise BadInput(f"{said[one.effect.name]}: {error}") from None
    try:
        return compose(vehicle, effects)
    except ValueError as error:
        raise BadInput(f"{vehicle.name}: {error}") from None
