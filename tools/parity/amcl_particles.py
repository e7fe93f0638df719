"""AMCL's particles: motion model, sample limits, resampling, clusters, the spread about a start.

The recordings' random numbers are POSIX ``drand48`` and Nav2's normal numbers made from it.
"""

import math
import re
from collections.abc import Iterator, Mapping
from itertools import islice
from typing import Any

import numpy as np

from navstack.costmap.occupancy_grid import OccupancyGrid
from navstack.localization.free_space import FreeSpace
from navstack.localization.kld import count_bins, resample, sample_limit
from navstack.localization.motion_model import MotionModel, motion_model_of
from navstack.localization.particle_filter import (
    Cluster,
    ParticleFilter,
    cluster_particles,
    stand_close,
)
from navstack.params.amcl import AmclParams
from navstack.params.strict import from_mapping
from navstack.types import FloatArray, Pose2D
from tools.parity.comparison import Comparison
from tools.parity.golden import GoldenFile
from tools.parity.part import Case, Shape

# [m, rad] of what the same random numbers give; covariances and weights: relative or absolute
EXACT = 1e-9
RANK_DECIMALS = 7
STANDARD_ERRORS = 4.0  # twelve moments a case: beyond three, one case in thirty would be by chance
BATCHES, BATCH = 50, 20_000  # particles of ours whose moments are taken
MOTION = re.compile(r"motion_seq_end_seed(\d+)_alphas_(.+)_pose(.+)_delta(.+)")
UNIFORM = re.compile(r"drand48_seed(\d+)_first(\d+)")
NORMAL = re.compile(r"ran_gaussian_sigma([\d.]+)_seed(\d+)_first(\d+)")
OUTPUT = re.compile(r"resample_(.+)_out_poses_seed(\d+)")


# particles ``motion_seq_start``, moved:
# ``motion_seq_end_seed<s>_alphas_<set>_pose<x_y_yaw>_delta<x_y_yaw>``
MOTIONS = Shape(("motion_seq_end_{}", "motion_seq_start"), (), (), None, "motion_seq_end_{}")
# for so many bins
LIMITS = Shape(("kld_limit_{}", "kld_k"), (), ("kld_{}",), "pop_err", "kld_limit_{}")
_FACTOR, _ADDEND, _MASK = 0x5DEECE66D, 0xB, (1 << 48) - 1  # POSIX.1-2017, drand48()
_SEED_LOW = 0x330E  # the low 16 bits that srand48() sets


def uniforms(seed: int) -> Iterator[float]:
    """Numbers in [0, 1): the sequence of ``drand48()`` after ``srand48(seed)``."""
    state = (seed << 16) + _SEED_LOW
    while True:
        state = (_FACTOR * state + _ADDEND) & _MASK
        yield state / (1 << 48)


def normals(seed: int) -> Iterator[float]:
    """Standard normal numbers made from them by the polar method (``pf_pdf.c``)."""
    symmetric = (2.0 * drawn - 1.0 for drawn in uniforms(seed) if drawn != 0.0)
    while True:
        first, second = next(symmetric), next(symmetric)
        squared = first * first + second * second
        if 0.0 < squared <= 1.0:
            yield second * math.sqrt(-2.0 * math.log(squared) / squared)


def _first(count: int, numbers: Iterator[float]) -> FloatArray:
    return np.fromiter(islice(numbers, count), np.float64)


def find_generators(file: GoldenFile) -> Iterator[Case]:
    """Sequences ``drand48_seed<s>_first<n>`` and ``ran_gaussian_sigma<x>_seed<s>_first<n>``."""
    for name in sorted(file.names):
        if UNIFORM.fullmatch(name) or NORMAL.fullmatch(name):
            yield Case(name, file, frozenset((name,)))


def check_generator(case: Case, comparison: Comparison) -> None:
    """The numbers that the comparisons of motion and resampling start from."""
    if uniform := UNIFORM.fullmatch(case.name):
        ours = _first(int(uniform[2]), uniforms(int(uniform[1])))
        comparison.near("numbers", ours, case.file[case.name], 1e-15)
    elif normal := NORMAL.fullmatch(case.name):
        ours = float(normal[1]) * _first(int(normal[3]), normals(int(normal[2])))
        comparison.near("numbers", ours, case.file[case.name], 1e-12)


def check_motion(case: Case, comparison: Comparison) -> None:
    """Every particle, with the recording's random numbers."""
    seed, alphas, *places = case.settings(MOTION)
    after, delta = (np.array([float(number) for number in place.split("_")]) for place in places)
    poses = case.file["motion_seq_start"].copy()
    draws = _first(poses.size, normals(int(seed))).reshape(poses.shape)
    _motion_model(_alpha_sets(case.file)[alphas])(
        poses, Pose2D(*(after - delta)), Pose2D(*after), draws
    )
    comparison.near("poses", poses, case.file[case.name], EXACT)


def find_moments(file: GoldenFile) -> Iterator[Case]:
    """Facts ``motion_moments``: mean, covariance and skewness of many particles after a motion."""
    for number, _ in enumerate(file.meta.get("motion_moments", ())):
        yield Case(f"motion_moments[{number}]", file, frozenset())


def check_moments(case: Case, comparison: Comparison) -> None:
    """Every moment, in standard errors."""
    number = int(case.name.partition("[")[2].rstrip("]"))
    facts = case.file.meta["motion_moments"][number]
    before, delta = np.array(facts["odom_old"]), np.array(facts["odom_delta"])
    poses = np.tile(np.array(facts["particle_start"], dtype=np.float64), (BATCHES * BATCH, 1))
    draws = np.random.default_rng(number).standard_normal(poses.shape)
    _motion_model(facts["alphas"])(poses, Pose2D(*before), Pose2D(*(before + delta)), draws)
    poses -= facts["particle_start"]
    recorded = np.concatenate(
        (facts["mean"], np.array(facts["cov"])[np.triu_indices(3)], facts["skew"])
    )
    comparison.near(
        "moments, in standard errors",
        _errors(poses, recorded, facts["n"]),
        0.0 * recorded,
        STANDARD_ERRORS,
    )


def check_limits(case: Case, comparison: Comparison) -> None:
    """Every limit."""
    ours = [_limit(int(bins), case.facts) for bins in case.file["kld_k"]]
    comparison.equal("particles", ours, case.file[case.name])


def find_resamplings(file: GoldenFile) -> Iterator[Case]:
    """Particles ``resample_<case>_in_poses`` with ``_in_w``; drawn ``_out_poses_seed<s>``."""
    for name in sorted(file.names):
        given = OUTPUT.fullmatch(name)
        arrays = (
            frozenset((name, *(f"resample_{given[1]}_in_{suffix}" for suffix in ("poses", "w"))))
            if given
            else None
        )
        if arrays and arrays <= file.names and file.facts("kld_costnav"):
            yield Case(name, file, arrays)


def check_resampling(case: Case, comparison: Comparison) -> None:
    """Every particle with the recording's random numbers, the clusters, the limits."""
    name, seed = case.settings(OUTPUT)
    poses, weights = (case.file[f"resample_{name}_in_{suffix}"] for suffix in ("poses", "w"))
    facts = case.file.facts("kld_costnav")
    # the first of each two: is it a random particle
    draws = _first(2 * facts["max"], uniforms(int(seed)))[1::2]
    none = np.zeros(len(draws), dtype=np.bool_)
    limits = (facts["min"], facts["pop_err"], facts["pop_z"])
    drawn = resample(poses, np.cumsum(weights), np.empty((len(draws), 3)), none, draws, *limits)
    comparison.near("poses", drawn, case.file[case.name], EXACT)
    for sweep in case.file.meta.get("resample_sweep", ()):
        _check_sweep(sweep, facts, comparison)
        if f"sp{sweep['spread']:g}" == name:
            comparison.equal("bins filled before", count_bins(poses), sweep["leaf_in"])
            comparison.equal("bins filled after", count_bins(drawn), sweep["leaf_out"])
            comparison.equal("converged", stand_close(drawn), bool(sweep["stats"]["converged"]))
    recorded = case.file.meta.get(f"resample_{name}_clusters", ())
    _check_clusters(
        cluster_particles(drawn, np.full(len(drawn), 1.0 / len(drawn))), recorded, comparison
    )


def _check_sweep(
    sweep: Mapping[str, Any],
    facts: Mapping[str, Any],
    comparison: Comparison,
) -> None:
    what, limit = f"spread {sweep['spread']}", _limit(sweep["leaf_out"], facts)
    comparison.equal(f"{what}: limit", limit, sweep["limit_of_leaf_out"])
    comparison.equal(f"{what}: particles", min(limit + 1, facts["max"]), sweep["n_out"])


def find_clusters(file: GoldenFile) -> Iterator[Case]:
    """Particles ``cluster_poses`` with weights ``cluster_w``, and the facts ``cluster_stats``."""
    arrays = frozenset(("cluster_poses", "cluster_w"))
    if arrays <= file.names and "clusters" in file.facts("cluster_stats"):
        yield Case("cluster", file, arrays)


def check_clusters(case: Case, comparison: Comparison) -> None:
    """Bins, the statistics of every cluster, and those of all particles."""
    poses, weights = case["poses"], case["w"]
    facts = case.file.facts("cluster_stats")
    if "cluster_leaf_count" in case.file.meta:
        comparison.equal("bins", count_bins(poses), case.file.meta["cluster_leaf_count"])
    _check_clusters(cluster_particles(poses, weights), facts["clusters"], comparison)
    overall = cluster_particles(poses, weights, as_one=True)
    _check_clusters(overall, [{**facts, "weight": float(weights.sum())}], comparison)


def find_spreads(file: GoldenFile) -> Iterator[Case]:
    """The facts ``pf_init``: moments of particles spread about a pose."""
    if "sample_cov" in file.facts("pf_init"):
        yield Case("pf_init", file, frozenset())


def check_spread(case: Case, comparison: Comparison) -> None:
    """Mean and covariance, in standard errors."""
    facts = case.facts
    count = facts["n"]
    nowhere = FreeSpace(OccupancyGrid(np.zeros((1, 1), dtype=np.int8), 1.0, Pose2D()))
    particles = ParticleFilter(AmclParams(max_particles=BATCHES * BATCH), nowhere)
    covariance = np.array(facts["cov"]).reshape(3, 3)
    particles.spread_normal(Pose2D(*facts["mean"]), covariance, np.random.default_rng(0))
    recorded = np.concatenate(
        (facts["sample_mean"], np.array(facts["sample_cov"])[np.triu_indices(3)])
    )
    errors = _errors(particles.poses, recorded, count)
    comparison.near("moments, in standard errors", errors, 0.0 * recorded, STANDARD_ERRORS)


def _errors(poses: FloatArray, recorded: FloatArray, count: int) -> FloatArray:
    """How far recorded moments of ``count`` particles are from ours, in standard errors."""
    batches = np.array([_moments(batch)[: len(recorded)] for batch in np.split(poses, BATCHES)])
    of_one = batches.var(axis=0, ddof=1) * BATCH  # variance of a moment of a single particle
    errors: FloatArray = (recorded - batches.mean(axis=0)) / np.sqrt(
        of_one / len(poses) + of_one / count
    )
    return errors


def _moments(poses: FloatArray) -> FloatArray:
    """Mean (3), covariance (6, upper triangle by rows) and skewness (3)."""
    centred = poses - poses.mean(axis=0)
    covariance = centred.T @ centred / len(poses)
    skewness = (centred**3).mean(axis=0) / np.diag(covariance) ** 1.5
    return np.concatenate((poses.mean(axis=0), covariance[np.triu_indices(3)], skewness))


def _check_clusters(ours: list[Cluster], recorded: Any, comparison: Comparison) -> None:
    """Weights, means and covariances, by weight; equal weights by place."""
    comparison.require(
        len(ours) == len(recorded), f"{len(ours)} clusters, recorded {len(recorded)}"
    )
    if len(ours) != len(recorded):
        return
    ours = sorted(ours, key=lambda cluster: _rank(cluster.weight, cluster.pose.x, cluster.pose.y))
    recorded = sorted(recorded, key=lambda cluster: _rank(cluster["weight"], *cluster["mean"][:2]))
    weights = [c["weight"] for c in recorded]
    means = np.array([c["mean"] for c in recorded])
    comparison.near("weights", [c.weight for c in ours], weights, EXACT)
    comparison.near("means", [(c.pose.x, c.pose.y) for c in ours], means[:, :2], EXACT)
    comparison.angles("yaws", [c.pose.yaw for c in ours], means[:, 2], EXACT)
    covariances = np.array([c["cov"] for c in recorded]).reshape(-1, 3, 3)
    comparison.near("covariances", [c.covariance for c in ours], covariances, EXACT)


def _rank(weight: float, x: float, y: float) -> tuple[float, ...]:
    """Heavier clusters first; what differs by rounding only counts as equal."""
    return -round(weight, RANK_DECIMALS), round(x, RANK_DECIMALS), round(y, RANK_DECIMALS)


def _limit(bins: int, facts: Mapping[str, Any]) -> int:
    return sample_limit(bins, facts["min"], facts["max"], facts["pop_err"], facts["pop_z"])


def _alpha_sets(file: GoldenFile) -> dict[str, list[float]]:
    """The alphas by the name of their set."""
    return {
        facts["set"]: facts["alphas"]
        for facts in file.meta.get("motion_moments", ())
        if "set" in facts
    }


def _motion_model(alphas: list[float]) -> MotionModel:
    given = {f"alpha{i}": alpha for i, alpha in enumerate(alphas, 1)}
    return motion_model_of(from_mapping(AmclParams, given, "alphas"))
