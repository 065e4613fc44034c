"""Document 002's tables on the simulated robot: pose numbers, errors, uncertainties."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int
from numpy import ndarray as Array

from robocal.kinematics.forward import forward_kinematics
from robocal.kinematics.jacobian import pose_jacobian
from robocal.planning.chosen_set import Selection
from robocal.planning.curve import IndexCurve, index_curve
from robocal.planning.document_002 import document_rows
from robocal.planning.pose_rows import scale_columns
from robocal.planning.selectors import SELECTORS, merit
from robocal.progress import counted
from robocal.robots.library import load_robot
from robocal.uncertainty.many_cells import many_targets
from robocal.uncertainty.tool_draws import normal_draws
from service.reproduce.optimal_poses_paper import POSE_NUMBER, TABLE_3, PaperErrors
from service.reproduce.optimal_poses_world import (
    FREE,
    Poses,
    World,
    calibrate,
    draw_poses,
    draw_world,
    mean_distance,
)

_REPEATS = 10
"""How often the document measures a set anew, table 3"""
_RANDOM_POSES = 50
_COUNTS = (30, 50, 70, 90, 110, 130, 150)
_REGIONS = 4
_MODEL = load_robot("staubli_tx60").geometry
_NO_ROWS = np.zeros((0, 3, len(FREE)))


@dataclass(frozen=True)
class Sizes:
    """How much is drawn; the document's own numbers."""

    candidates: int = 1000
    worlds: int = 10
    """Robots with other true errors, over which tables 1 and 2 are averaged"""
    random_sets: int = 10
    """In each of these: 100 in all, as in the document"""
    curve_draws: int = 50
    draws: int = 10_000
    """Of the Monte Carlo method."""


@dataclass(frozen=True)
class Spread:
    """Table 3: standard uncertainty of the 24 parameters from each cause [m, rad]."""

    best_repeat: Float[Array, "parameter"]
    repeat: Float[Array, "parameter"]
    number: Float[Array, "parameter"]
    region: Float[Array, "parameter"]
    best_stated: Float[Array, "parameter"]
    """Of the best set as one fit states it."""
    random_stated: Float[Array, "parameter"]
    """The same of random sets of as many poses, root mean square."""
    best_covariance: Float[Array, "parameter parameter"]
    random_covariance: Float[Array, "parameter parameter"]

    @property
    def random(self) -> Float[Array, "parameter"]:
        """The document's u_rand, eq. (9)."""
        return np.asarray(np.sqrt(self.repeat**2 + self.number**2 + self.region**2))


@dataclass(frozen=True)
class ToolSpread:
    """Standard uncertainty of the end's distance from the base, best and random [m]."""

    zero: tuple[float, float]
    tests: tuple[float, float]


@dataclass(frozen=True)
class Outcome:
    """Everything that is set beside the document for one simulated robot."""

    world: World
    """The first of them: tables 3 and the tool."""
    errors: dict[tuple[str, int], PaperErrors]
    spread: Spread
    tool: ToolSpread
    """With the document's u of each cause, parameters independent."""
    tool_alike: ToolSpread
    """Repeatability alone, sets of as many poses, parameters as they go together."""


@dataclass(frozen=True)
class Study:
    """What does not depend on the robot's errors, and the robots."""

    poses: Poses
    rank: int
    curve: IndexCurve
    best: dict[int, Int[Array, "chosen"]]
    noise_alone: Outcome
    with_waves: Outcome
    paper_tool: ToolSpread
    """Monte Carlo with the printed table 3, at our test points."""


def study(seed: int, sizes: Sizes, wave: float, repeatability: float) -> Study:
    """Run the whole experiment on two robots: link errors alone, and with what links cannot do."""
    poses = draw_poses(seed, sizes.candidates)
    J, _ = scale_columns(document_rows(_MODEL, poses.candidates))
    curve = index_curve(J, seed, draws=sizes.curve_draws)
    six, _ = scale_columns(six_rows(poses.candidates))
    best = {
        count: SELECTORS["detmax"](Selection(six, count, merit(index, _NO_ROWS), seed))
        for index, count in POSE_NUMBER.items()
    }
    outcomes = []
    for size, scatter in ((0.0, 0.0), (wave, repeatability)):
        worlds = [draw_world(poses, seed + number, size, scatter) for number in range(sizes.worlds)]
        outcomes.append(_outcome(worlds, poses, best, sizes, seed))
    unit = np.where(_is_length(), 1e-3, np.pi / 180.0)
    printed = np.array(list(TABLE_3.values()))[:, 4:].T * unit
    return Study(
        poses=poses,
        rank=int(np.linalg.matrix_rank(J.reshape(-1, len(FREE)))),
        curve=curve,
        best=best,
        noise_alone=outcomes[0],
        with_waves=outcomes[1],
        paper_tool=_tool(np.diag(printed[0] ** 2), np.diag(printed[1] ** 2), poses, sizes, seed),
    )


def six_rows(q: Float[Array, "pose joint"]) -> Float[Array, "pose 6 24"]:
    r"""Six rows that say of the parameters what the document's twelve say.

    A small turn :math:`\delta` moves the axes by :math:`\delta \times n` and so on, and
    :math:`|\delta \times n|^2 + |\delta \times o|^2 + |\delta \times a|^2 = 2 |\delta|^2`.
    """
    _, J = pose_jacobian(_MODEL, q)
    rows = J[FREE].transpose(2, 1, 0)
    return np.concatenate([rows[:, :3], np.sqrt(2.0) * rows[:, 3:]], axis=1)


def _outcome(
    worlds: list[World],
    poses: Poses,
    best: dict[int, Int[Array, "chosen"]],
    sizes: Sizes,
    seed: int,
) -> Outcome:
    rng = np.random.default_rng([seed, 3])
    errors = {}
    for count, chosen in best.items():
        errors["best", count] = _errors(poses, [(world, chosen) for world in worlds], rng)
        drawn = [
            (world, _random(rng, len(poses.candidates), count))
            for world in worlds
            for _ in range(sizes.random_sets)
        ]
        errors["random", count] = _errors(poses, drawn, rng)
    spread = _spread(worlds[0], poses, best[POSE_NUMBER["O2"]], sizes, rng)
    best_u, random_u = np.diag(spread.best_repeat**2), np.diag(spread.random**2)
    return Outcome(
        worlds[0],
        errors,
        spread,
        _tool(best_u, random_u, poses, sizes, seed),
        _tool(spread.best_covariance, spread.random_covariance, poses, sizes, seed),
    )


def _random(rng: np.random.Generator, n: int, count: int) -> Int[Array, "chosen"]:
    return rng.choice(n, size=count, replace=False)


def _errors(
    poses: Poses, sets: list[tuple[World, Int[Array, "chosen"]]], rng: np.random.Generator
) -> PaperErrors:
    """Tables 1 and 2, mean over robots and sets [mm]."""
    found = []
    for world, chosen in counted("document 002, calibrations", sets, len(sets)):
        q = poses.candidates[chosen]
        fits, readings = calibrate(world, q, rng)
        tested = world.read(poses.tests, rng, 1)
        after = fits.vectors[:, 0]
        found.append([
            mean_distance(_MODEL.vector, q, readings),
            mean_distance(after, q, readings),
            mean_distance(_MODEL.vector, poses.tests, tested),
            mean_distance(after, poses.tests, tested),
        ])
    return PaperErrors(*(float(value) * 1e3 for value in np.mean(found, axis=0)))


def _spread(
    world: World,
    poses: Poses,
    best: Int[Array, "chosen"],
    sizes: Sizes,
    rng: np.random.Generator,
) -> Spread:
    """Table 3, eq. (7): standard deviation over repeats, pose numbers, regions."""
    q = poses.candidates
    n = len(q)
    best_fits, _ = calibrate(world, q[best], rng, _REPEATS)
    repeated, _ = calibrate(world, q[_random(rng, n, _RANDOM_POSES)], rng, _REPEATS)
    by_number = [calibrate(world, q[_random(rng, n, count)], rng)[0] for count in _COUNTS]
    by_region = [calibrate(world, q[some], rng)[0] for some in _regions(q, rng)]
    sets = sizes.worlds * sizes.random_sets
    alike = [
        calibrate(world, q[_random(rng, n, len(best))], rng)[0].covariance[0]
        for _ in counted("document 002, random sets", range(sets), sets)
    ]
    random_covariance = np.mean(alike, axis=0)
    best_covariance = best_fits.covariance[0]
    return Spread(
        best_repeat=best_fits.vectors[FREE].std(axis=1, ddof=1),
        repeat=repeated.vectors[FREE].std(axis=1, ddof=1),
        number=np.stack([fit.vectors[FREE, 0] for fit in by_number]).std(axis=0, ddof=1),
        region=np.stack([fit.vectors[FREE, 0] for fit in by_region]).std(axis=0, ddof=1),
        best_stated=np.sqrt(np.diag(best_covariance)),
        random_stated=np.sqrt(np.diag(random_covariance)),
        best_covariance=best_covariance,
        random_covariance=random_covariance,
    )


def _regions(q: Float[Array, "pose joint"], rng: np.random.Generator) -> list[Int[Array, "some"]]:
    """50 random poses in each quarter of the workspace: near and far, left and right."""
    place = forward_kinematics(_MODEL, q)[:, :3, 3]
    quarter = 2 * (place[:, 0] > np.median(place[:, 0])) + (place[:, 1] > 0.0)
    return [
        rng.choice(np.flatnonzero(quarter == number), size=_RANDOM_POSES, replace=False)
        for number in range(_REGIONS)
    ]


def _tool(
    best: Float[Array, "free free"],
    random: Float[Array, "free free"],
    poses: Poses,
    sizes: Sizes,
    seed: int,
) -> ToolSpread:
    """Section 3.2: Monte Carlo of the end's distance from the base, about the nominal robot."""
    found = []
    for covariance in (best, random):
        moves = np.zeros((_MODEL.n_parameters, sizes.draws))
        moves[FREE] = normal_draws(covariance, np.random.default_rng([seed, 4]), sizes.draws)
        vectors = _MODEL.vector[:, None] + moves
        tests = (np.zeros(6), *poses.tests)
        points = counted("document 002, the tool", tests, len(tests))
        u = [_distance_std(vectors, joints) for joints in points]
        found.append((u[0], float(np.mean(u[1:]))))
    return ToolSpread((found[0][0], found[1][0]), (found[0][1], found[1][1]))


def _distance_std(vectors: Float[Array, "parameter draw"], joints: Float[Array, "joint"]) -> float:
    target = many_targets(_MODEL, vectors, joints[None]).target
    return float(np.linalg.norm(target.p, axis=0).std(ddof=1))


def _is_length() -> Array:
    return np.array([name.startswith(("d_", "a_")) for name in TABLE_3])
