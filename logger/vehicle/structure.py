"""A car as linear equations of motion, their exact step in time, and what can be asked of them.

Every linear model of a car is the same problem with other matrices, so each model states only its masses and where its
wheels stand; here the matrices are built, and stepped. Conventions, stated once for all models:

    M q'' + C q' + K q = R z

- q[0] is the body at its centre of gravity, up positive, from rest under gravity; a pitch is nose up positive, a roll
  left side up positive; the wheels come last;
- places are counted from the centre of gravity of the body, ahead and to the left positive;
- z holds the road's elevation under each wheel, up positive, the front wheel first, left before right;
- tires are springs only, so R holds tire stiffnesses;
- a mass on a bench that stands on a moving base has its place over that base for a coordinate, and z holds the base's
  height, velocity and acceleration; a free axis is one without a spring;
- forces from outside are more inputs beside z, with columns of R of their own (``pushed``);
- the car drives forward: a wheel that stands ``behind_m`` behind the front wheel meets the road ``behind_m / speed``
  later (Eq 4.10 and 4.11 of Blum 2015), and each tire averages the road over the contact patch.

Between two samples the input is a straight line, so that a step is taken without error through the matrix exponential.
Stepping sample by sample in Python is slow; but a stretch of steps can be taken for all stretches of a drive at once,
and only the state at the end of each has to be carried on.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache

import numpy as np

from logger.arrays import Array
from logger.profiles.track import Alterations
from logger.vehicle.vehicle import Axle

_BLOCK = 16
_STEPS = np.arange(_BLOCK)


def matrix_exponential(a: Array) -> Array:
    """exp(a) of a square matrix, by scaling, a Taylor series to rounding error, and squaring."""
    if not np.isfinite(a).all():
        raise np.linalg.LinAlgError("expected finite parameters of a car")
    squarings = max(0, int(np.ceil(np.log2(max(np.abs(a).sum(axis=1).max(), 1e-300)))) + 2)
    scaled = a / 2.0**squarings
    result = term = np.eye(len(a))
    for order in range(1, 15):
        term = term @ scaled / order
        result = result + term
    for _ in range(squarings):
        result = result @ result
    return result


def straight_step(a: Array, b: Array, step_s: float) -> tuple[Array, Array, Array]:
    """F, G0, G1 of x[k+1] = F x[k] + G0 u[k] + G1 u[k+1], exact for an input that is a straight line over the step.

    For an input that is held over the step both ends are the same: F and G0 + G1.
    """
    n, m = b.shape
    rates = np.zeros((n + 2 * m, n + 2 * m))
    rates[:n, :n], rates[:n, n:n + m], rates[n:n + m, n + m:] = a, b, np.eye(m) / step_s
    whole = matrix_exponential(rates * step_s)
    end = whole[:n, n + m:]
    return whole[:n, :n], whole[:n, n:n + m] - end, end


def recursion(transition: Array, drive: Array, start: Array) -> Array:
    """States x[1] ... x[N] of x[k+1] = F x[k] + drive[k] from x[0] = start.

    transition (n, n), drive (N, n), start (n,); returns (N, n).

    The steps are cut into about sqrt(N) stretches of as many steps. What the drive alone does within a stretch is
    stepped through for all stretches at once; then the state is carried from stretch to stretch.
    """
    count, n = drive.shape
    length = max(1, int(np.sqrt(count)))
    stretches = -(-count // length)
    padded = np.zeros((stretches * length, n))
    padded[:count] = drive
    states = padded.reshape(stretches, length, n).swapaxes(0, 1).copy()  # (step, stretch, n)
    powers = np.empty((length, n, n))  # of the transition, transposed as rows are states
    onward = powers[0] = transition.T
    for step in range(1, length):
        states[step] += states[step - 1].dot(onward)
        powers[step - 1].dot(onward, out=powers[step])
    carried, over_stretch = np.empty((stretches, n)), powers[-1]
    state = start
    for stretch, end in enumerate(states[-1]):
        carried[stretch] = state
        state = end + state.dot(over_stretch)
    states += carried @ powers
    return states.swapaxes(0, 1).reshape(-1, n)[:count]


def driven_outputs(transition: Array, gain: Array, observe: Array, inputs: Array, start: Array) -> Array:
    """y[0] ... y[N] of x[k+1] = F x[k] + G v[k], y[k] = C x[k] from x[0] = start.

    transition (n, n), gain (n, m), observe (p, n), inputs v (N, m), start (n,); returns (N + 1, p).

    A block of L steps is one step of a bigger system with L times the inputs and outputs: one state in L is computed,
    and nearly all the work is three matrix products.
    """
    n, m = gain.shape
    p, count = len(observe), len(inputs)
    blocks = count // _BLOCK + 1
    padded = np.zeros((blocks * _BLOCK, m))
    padded[:count] = inputs
    rows = padded.reshape(blocks, _BLOCK * m)
    powers = np.empty((_BLOCK + 1, n, n))
    powers[0] = np.eye(n)
    for steps in range(_BLOCK):
        powers[steps].dot(transition, out=powers[steps + 1])
    driven = powers[:-1] @ gain  # what an input does to the state so many steps after the next one
    to_end = driven[::-1].swapaxes(1, 2)
    seen = (observe @ powers[:-1]).transpose(2, 0, 1)
    answers = np.concatenate([observe @ driven, np.zeros((_BLOCK, p, m))])  # an input that is still to come: nothing
    through = answers[(_STEPS - _STEPS[:, None] - 1) % (2 * _BLOCK)].transpose(0, 3, 1, 2)
    states = np.empty((blocks, n))
    states[0] = start
    states[1:] = recursion(powers[-1], rows[:-1] @ to_end.reshape(_BLOCK * m, n), start)
    result = states @ seen.reshape(n, -1) + rows @ through.reshape(_BLOCK * m, _BLOCK * p)
    return result.reshape(-1, p)[: count + 1]


@dataclass(frozen=True)
class Output:
    """A motion that can be read off a car: a weighted sum of its coordinates, or a time derivative of that.

    row         (n,) weights of the coordinates q
    road_row    (w,) weights of the elevations under the wheels, added to it, zero unless order is 0; of a mass on a
                base (3,) of the base's height and its two derivatives
    order       0 displacement [m], 1 velocity [m/s], 2 acceleration [m/s2]
    """

    row: Array
    road_row: Array
    order: int

    def __post_init__(self) -> None:
        if self.order not in (0, 1, 2):
            raise ValueError(f"order of an output: expected 0, 1 or 2, found {self.order}")
        if self.order and len(self.road_row) != len(BASE_INPUTS) and self.road_row.any():
            raise ValueError("the road has no velocity or acceleration here: only an output of order 0 may contain it")


@dataclass(frozen=True, eq=False)
class Structure:
    """Matrices of one car. n degrees of freedom, w wheels.

    mass, damping, stiffness    (n, n) [kg, N s/m, N/m; with lengths where a row or column is an angle]
    road                        (n, w) force per elevation under each wheel [N/m]; of a mass on a base (n, 3), and where
                                forces act (``pushed``) as many columns more
    behind_m                    (w,) how far behind the front wheel each wheel stands [m]
    left_m                      (w,) how far left of the middle each wheel stands [m]; 0 in a car of one track
    contact_patch_m             [m]
    body                        (n, 3) a point of the body moves up by ``(1, ahead_m, left_m) @ body.T @ q``
    wheels                      (w, n) each wheel's height is ``wheels @ q``
    travel                      (w, n) each suspension's extension, body end minus wheel, is ``travel @ q``
    springs, dampers, tires     (w,) what stands in the matrices for each wheel's spring [N/m], damper [N s/m] and
                                tire [N/m]
    sides                       how many times the masses that a person gives are in it: twice, where a half car was
                                made whole
    surface                     how the road that it meets differs from the profile that was written of it
    actuators                   how the forces that act on it differ from those that were recorded
    on_base                     it is a mass on a base: the one corner's wheel is the base
    held                        it is a part that its bench moves: its place is the first of its inputs, those of a mass
                                on a base, and its force is measured
    """

    mass: Array
    damping: Array
    stiffness: Array
    road: Array
    behind_m: Array
    left_m: Array
    contact_patch_m: float
    body: Array
    wheels: Array
    travel: Array
    springs: Array
    dampers: Array
    tires: Array
    sides: int = 1
    surface: Alterations = ()
    actuators: Alterations = ()
    on_base: bool = False
    held: bool = False

    def state_space(self) -> tuple[Array, Array]:
        """A (2n, 2n) and B (2n, u) of x' = A x + B z, with u inputs z and x = (q, q'). Row n is the body's
        acceleration."""
        return self._state_space

    @cached_property
    def _state_space(self) -> tuple[Array, Array]:
        n = len(self.mass)
        inverse = np.linalg.inv(self.mass)
        a = np.eye(2 * n, k=n)
        a[n:, :n], a[n:, n:] = -inverse @ self.stiffness, -inverse @ self.damping
        b = np.vstack([np.zeros_like(self.road), inverse @ self.road])
        return a, b

    @cached_property
    def slowest_decay_per_s(self) -> float:
        """By which the slowest of its free motions dies down; 0 of what nothing brings back or slows. Where no spring
        holds a place, each is a place of rest and no motion."""
        unheld = len(self.mass) - int(np.linalg.matrix_rank(self.stiffness))
        return -float(np.sort(np.linalg.eigvals(self._state_space[0]).real)[-1 - unheld])

    def output_matrices(self, outputs: Sequence[Output]) -> tuple[Array, Array]:
        """C (p, 2n) and D (p, u) of y = C x + D z, for p outputs and the state of ``state_space``."""
        n = len(self.mass)
        a, b = self.state_space()
        c_rows = np.zeros((len(outputs), 2 * n))
        d_rows = np.zeros((len(outputs), self.road.shape[1]))
        for index, output in enumerate(outputs):
            if output.order == 2:
                c_rows[index], d_rows[index] = output.row @ a[n:], output.row @ b[n:]
            else:
                c_rows[index, output.order * n:(output.order + 1) * n] = output.row
            d_rows[index, :len(output.road_row)] += output.road_row
        return c_rows, d_rows

    def at_rest(self, inputs: Array) -> Array:
        """The state (2n,) that stays where it is under these inputs (u,); at 0 in a direction without any spring."""
        if self.held:
            return inputs[:2]
        if not inputs.any():
            return np.zeros(2 * len(self.mass))
        still = np.linalg.lstsq(self.stiffness, self.road @ inputs)[0] if self.on_base else (
            np.linalg.solve(self.stiffness, self.road @ inputs))
        return np.concatenate([still, np.zeros(len(self.mass))])


@dataclass(frozen=True)
class Corner:
    """A wheel with its spring, damper and tire, and where they stand from the centre of gravity [m]."""

    axle: Axle
    ahead_m: float
    left_m: float


def assemble(body_inertias: Sequence[float], corners: Sequence[Corner], contact_patch_m: float) -> Structure:
    """The structure of a rigid body on independent wheels.

    body_inertias    mass [kg], then, of a body that pitches, its pitch inertia, and of one that also rolls its roll
                     inertia [kg m2]: the body's degrees of freedom, in this order
    corners          the wheels, a front one first; each adds one degree of freedom, its height

    M is diagonal. Springs and dampers act on the suspensions' extension J q, so by virtual work K = J' k J plus the
    tires, and C = J' c J.
    """
    motions, w = len(body_inertias), len(corners)
    body = np.eye(motions + w, 3)
    body[motions:] = 0.0
    wheels = np.eye(motions + w)[motions:]
    places = np.array([[1.0, corner.ahead_m, corner.left_m] for corner in corners])
    travel = places @ body.T - wheels
    axles = [corner.axle for corner in corners]
    springs = np.array([axle.suspension_stiffness_n_per_m for axle in axles])
    dampers = np.array([axle.suspension_damping_n_s_per_m for axle in axles])
    tires = np.array([axle.tire_stiffness_n_per_m for axle in axles])
    road = wheels.T * tires
    return Structure(mass=np.diag([*body_inertias, *(axle.unsprung_mass_kg for axle in axles)]),
                     damping=(travel.T * dampers) @ travel, stiffness=(travel.T * springs) @ travel + road @ wheels,
                     road=road, behind_m=places[0, 1] - places[:, 1], left_m=places[:, 2],
                     contact_patch_m=contact_patch_m, body=body, wheels=wheels, travel=travel, springs=springs,
                     dampers=dampers, tires=tires)


AT_REST = np.empty(0)
"""How states differ from those at rest: not at all."""
BASE_INPUTS = ("height", "velocity", "acceleration")
"""What a mass on a base is driven by, in the order of its ``Structure.road``."""


def held_to_ground(structure: Structure, by: str, body: float, wheel: float = 0.0) -> Structure:
    """The structure with springs (``by`` its stiffness, sizes in N/m) or dampers (by its damping, N s/m) of these sizes
    between the ground and the body's end of each suspension, and between the ground and each wheel."""
    wheels, ends = structure.wheels, structure.travel + structure.wheels
    held = {by: getattr(structure, by) + wheel * wheels.T @ wheels + body * ends.T @ ends}
    if structure.on_base:  # from which its place is counted, and which moves against the ground
        held["road"] = structure.road.copy()
        held["road"][0, BASE_INPUTS.index({"stiffness": "height", "damping": "velocity"}[by])] -= body
    return replace(structure, **held)


def mass_on_base(mass_kg: float, stiffness_n_per_m: float, damping_n_s_per_m: float) -> Structure:
    """The structure of one mass on a spring and a damper on a base, in its place x over the base:
    m x'' + c x' + k x = F - m z''."""
    one, none = np.ones((1, 1)), np.zeros((1, 1))
    return Structure(
        mass=mass_kg * one, damping=damping_n_s_per_m * one, stiffness=stiffness_n_per_m * one,
        road=np.array([[0.0, 0.0, -mass_kg]]), behind_m=np.zeros(1), left_m=np.zeros(1), contact_patch_m=0.0,
        body=np.eye(1, 3), wheels=none, travel=one, springs=np.array([stiffness_n_per_m]),
        dampers=np.array([damping_n_s_per_m]), tires=np.zeros(1), on_base=True)


_MOUNTAIN_KG = 1e15


CARRIED = replace(mass_on_base(_MOUNTAIN_KG, 0.0, 0.0), road=np.array([[0.0, 0.0, _MOUNTAIN_KG]]), held=True)
"""What moves as the bench of a part moves it, whatever the part's forces are: so heavy that they do not matter."""


GROUND = "ground"
"""What a force pushes off from where it acts on one part alone."""
_CORNERS = {1: {"": 0, "front_": 0}, 2: {"front_": 0, "rear_": 1},
            4: {"front_left_": 0, "front_right_": 1, "rear_left_": 2, "rear_right_": 3}}


def corner_of(structure: Structure, part: str) -> int:
    """The corner of a part of a car: ``front_wheel``, ``rear_suspension``; ``wheel`` where there is one alone.

    KeyError for one that the car does not have.
    """
    side, _, kind = part.rpartition("_")
    if structure.on_base and kind == "wheel":
        raise KeyError(part)
    sides = _CORNERS[len(structure.wheels)]
    return sides[f"{side}_" if side else ""]


def force_row(structure: Structure, parts: Sequence[str]) -> Array:
    """What a force does (n,) that pushes the first part up and the second down, or two apart.

    parts    ``body``, a wheel or, of one alone, a suspension; the second one is the ground where there is one only

    ValueError for a part that the car does not have.
    """
    try:
        if len(parts) == 1 and parts[0].endswith("suspension"):
            return structure.travel[corner_of(structure, parts[0])]
        wheels = [corner_of(structure, part) for part in parts if part.endswith("wheel")]
        rows = {GROUND: np.zeros(len(structure.mass)), "base": np.zeros(len(structure.mass)),
                **{part: structure.wheels[corner_of(structure, part)] for part in parts if part.endswith("wheel")}}
        # Beside a wheel, the body's end of its suspension is meant; else its centre of gravity.
        rows["body"] = (structure.travel + structure.wheels)[wheels[0]] if wheels else structure.body[:, 0]
        # The body is above its wheels, in whichever order the two are named that are pushed apart.
        first, second = (rows[part] for part in sorted((*parts, GROUND)[:2], key=lambda part: part != "body"))
    except KeyError as error:
        raise ValueError(f"this vehicle has no {str(error.args[0]).replace('_', ' ')}") from None
    return np.asarray(first - second)


Forces = tuple[tuple[str, ...], ...]
"""The parts that each of some forces acts on (``force_row``)."""


@lru_cache(maxsize=16)
def pushed(structure: Structure, forces: Forces) -> Structure:
    """The structure with forces on these parts as its last inputs. ValueError as ``force_row``."""
    if not forces:
        return structure
    columns = np.stack([force_row(structure, parts) for parts in forces], axis=1)
    return replace(structure, road=np.hstack([structure.road, columns]))


def over_ground(structure: Structure, order: int) -> Array:
    """What the height of the ground under the structure, or a derivative of it, adds to an output of its body."""
    return np.eye(len(BASE_INPUTS))[order] if structure.on_base else np.zeros(len(structure.wheels))


def body_point(structure: Structure, ahead_m: float = 0.0, left_m: float = 0.0, order: int = 2) -> Output:
    """Vertical motion of a point of the body, up positive; its acceleration unless ``order`` says otherwise.

    ValueError for a point away from the centre of gravity of a body that cannot pitch, or cannot roll.
    """
    for offset, motion, column in ((ahead_m, "pitch", 1), (left_m, "roll", 2)):
        if offset and not structure.body[:, column].any():
            raise ValueError(f"this body does not {motion}: expected a point at its centre of gravity")
    return Output(structure.body @ np.array([1.0, ahead_m, left_m]), over_ground(structure, order), order)


def wheel(structure: Structure, index: int, order: int = 2) -> Output:
    """Vertical motion of a wheel, up positive; its acceleration unless ``order`` says otherwise."""
    return Output(structure.wheels[index], np.zeros(len(structure.wheels)), order)


def suspension_travel(structure: Structure, index: int, order: int = 0) -> Output:
    """Extension of the suspension over a wheel, body end minus wheel: negative when it is compressed."""
    return Output(structure.travel[index], np.zeros(len(structure.wheels)), order)


def tire_deflection(structure: Structure, index: int) -> Output:
    """A wheel's height over the road under it, from rest [m]: negative when the tire is pressed."""
    return Output(structure.wheels[index], -np.eye(len(structure.wheels))[index], 0)


def hung(structure: Structure, mass: float, stiffness: float, damping: float, attached: Array,
         travel: Array | None = None) -> Structure:
    """The structure with one more degree of freedom on a spring and a damper.

    mass, stiffness, damping    of the newcomer
    attached                    (n,) its spring's other end moves as ``attached @ q``; all zero: it stands on nothing
    travel                      (w,) how much each suspension's body end moves with it; None: not at all
    """
    n, w = len(structure.mass), len(structure.wheels)
    column = np.zeros(w) if travel is None else travel
    wider = np.hstack([structure.travel, column[:, None]])
    relative = np.append(-attached, 1.0)

    def with_newcomer(matrix: Array, corners: Array, own: float) -> Array:
        """The matrix, with what the suspensions do along their new travel and the newcomer's own part."""
        with np.errstate(over="ignore", invalid="ignore"):  # a search tries sizes that nothing has
            plain = np.pad(matrix - (structure.travel.T * corners) @ structure.travel, (0, 1))
            return plain + (wider.T * corners) @ wider + own * np.outer(relative, relative)

    road = np.pad(structure.road, ((0, 1), (0, 0)))
    if structure.on_base:  # over which its place is counted
        road[-1, BASE_INPUTS.index("acceleration")] = -mass * attached.sum()
    return replace(structure, mass=np.pad(structure.mass, (0, 1)) + np.diag(np.append(np.zeros(n), mass)),
                   damping=with_newcomer(structure.damping, structure.dampers, damping),
                   stiffness=with_newcomer(structure.stiffness, structure.springs, stiffness), road=road,
                   body=np.pad(structure.body, ((0, 1), (0, 0))), wheels=np.pad(structure.wheels, ((0, 0), (0, 1))),
                   travel=wider)
