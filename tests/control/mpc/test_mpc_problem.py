"""The jerk-limited MPC's quadratic program against another solver, compiled code against none."""

import math

import casadi as ca
import numpy as np
import pytest
from numpy.random import default_rng
from pytest import approx

from navstack.control.mpc import compiled as compiler
from navstack.control.mpc import mpc_problem
from navstack.control.mpc import stage_layout as at
from navstack.control.mpc.motion import rollout
from navstack.control.mpc.mpc_problem import MpcProblem, linearisation, residuals
from navstack.control.mpc.stage_layout import Sizes
from navstack.control.mpc.stages import cost_terms
from navstack.errors import NavstackWarning

from .given import horizon_times

needs_compiler = pytest.mark.skipif(
    compiler.find_compiler() is None, reason="there is no C compiler here"
)


def problem(rng, sizes):
    """A start, jerks, stages, times, shared numbers and bounds.

    The drive is past three people at a wall.
    """
    times = horizon_times(sizes.steps)
    start = np.array((0.0, 0.0, rng.uniform(-0.3, 0.3), rng.uniform(0.5, 1.8), 0.0, 0.0, 0.0))
    jerks = np.zeros((sizes.steps, 2))
    states = rollout(start, jerks, times)
    stages = np.zeros((sizes.steps, sizes.stage))
    stages[:, at.FOOT_X] = states[1:, 0]
    stages[:, at.TANGENT_X] = 1.0
    stages[:, at.CONTOUR] = 1.0
    stages[:, at.LEAD] = 0.3
    stages[:, at.SPEED] = 1.8
    wall = at.BASE + 3 * np.arange(sizes.circles)
    # the circles' y should exceed -0.9
    stages[:, wall + 1] = 1.0
    stages[:, wall + 2] = -0.9
    for j in range(sizes.people):
        place = at.BASE + 3 * sizes.circles + 3 * j
        x, y = rng.uniform((1.5, 0.4), (5.0, 1.5))
        stages[:, place : place + 3] = x, y, 1.0
    shared = np.array(
        (1.0, 4.0, 1.0, 0.5, 0.05, 100.0, 200.0, 100.0, 0.01, 0.002, 1.3, -0.52, -0.23, 0.05)
    )
    free = (math.inf,) * 3
    bounds = np.array(
        (
            (-5.0, -10.0, *(-f for f in free), 0.0, -1.2, -2.5, -2.5),
            (5.0, 10.0, *free, 2.0, 1.2, 1.5, 2.5),
        )
    )
    return start, jerks, stages, times, shared, bounds


def symbols_of(sizes):
    """State, stage and shared numbers of the residuals."""
    counts = {"state": 7, "stage": sizes.stage, "shared": sizes.shared}
    return [ca.SX.sym(name, count) for name, count in counts.items()]


def test_the_cost_of_a_trajectory_is_that_of_the_program():
    """The compiled terms against the symbolic residuals.

    The lateral one is held against its formula, in both turns.
    """
    rng = default_rng(19)
    sizes = Sizes(6, 3, 2)
    symbols = symbols_of(sizes)
    symbolic = ca.Function("residuals", symbols, residuals(*symbols, sizes))
    for turn in (-1.0, 1.0):
        start, _, stages, times, shared, _ = problem(rng, sizes)
        start[3:5] = 1.9, turn * 1.1
        jerks = rng.normal(size=(6, 2))
        states = rollout(start, jerks, times)
        stages[:, at.CONTOUR] = 0.25
        stages[:, at.BASE + 2] = 2.0  # into the margin of an obstacle
        stages[:, at.BASE + 9 : at.BASE + 12] = (*states[3, :2], 1.0)  # and of a person
        expected = np.zeros(10)
        for state, stage, jerk, dt in zip(states[1:], stages, jerks, times, strict=True):
            found = [np.array(term).ravel() for term in symbolic(state, stage, shared)]
            expected[:8] += [dt * term @ term for term in found]
            expected[8:] += dt * (jerk[0] - stage[at.JERK]) ** 2, dt * jerk[1] ** 2
        terms = cost_terms(states, jerks, at.Horizon(stages, times, shared))
        assert terms == approx(expected, rel=1e-9, abs=1e-12)
        excess = np.maximum(np.abs(states[1:, 3] * states[1:, 4]) - shared[at.LATERAL_LIMIT], 0.0)
        assert terms[at.W_LATERAL] == approx((times * excess**2).sum())
        assert excess.max() > 0.3
        assert (terms > 0.0).all()


def test_the_quadratic_program_is_solved_as_by_another_solver():
    """HPIPM against CasADi's own active-set solver on the same program."""
    rng = default_rng(13)
    sizes = Sizes(6, 2, 1)
    start, jerks, stages, times, shared, bounds = problem(rng, Sizes(6, 2, 1))
    shared = shared[:-1]
    states = rollout(start, jerks, times)
    ours = MpcProblem(sizes, generated_code=False)
    ours.step(states, jerks, at.Horizon(stages, times, shared), bounds)
    blocks = linearisation(sizes)
    z = []
    cost = 0.0
    rules = []
    before = ca.MX.zeros(7)
    for k in range(6):
        u = ca.MX.sym(f"u{k}", 2)
        x = ca.MX.sym(f"x{k}", 7)
        a, b, g, h, gu, hu = blocks(states[k], jerks[k], states[k + 1], stages[k], times[k], shared)
        cost += ca.dot(g, x) + 0.5 * ca.bilin(h, x, x) + ca.dot(gu, u) + 0.5 * ca.bilin(hu, u, u)
        rules.append(a @ before + b @ u - x)
        z += [u, x]
        before = x
    solver = ca.qpsol(
        "other",
        "qrqp",
        {"x": ca.vertcat(*z), "f": cost, "g": ca.vertcat(*rules)},
        {"print_iter": False, "print_header": False, "print_info": False},
    )
    at_states = np.hstack((jerks, states[1:]))
    low = (bounds[0] - at_states).ravel()
    high = (bounds[1] - at_states).ravel()
    expected = np.array(solver(lbx=low, ubx=high, lbg=0.0, ubg=0.0)["x"]).reshape(6, 9)
    assert ours._change == approx(expected, abs=5e-3)  # HPIPM stops at its own tolerance


def test_the_linearisation_is_that_of_finite_differences():
    """Of the model in numba, and of half the compiled cost.

    Curvatures are the products of the residuals' slopes.
    """
    rng = default_rng(14)
    sizes = Sizes(6, 2, 1)
    small = 1e-6
    start, _, stages, times, shared, _ = problem(rng, sizes)
    jerks = rng.normal(size=(6, 2))
    shared = shared[:-1]
    start[4:] = 1.1, 0.3, -0.4
    states = rollout(start, jerks, times)
    # in the margin of an obstacle
    stages[:, at.BASE + 2] = 2.0
    stages[:, at.CONTOUR] = 0.25
    stages[:, at.BASE + 6 : at.BASE + 9] = *(states[3, :2] + (0.2, 0.3)), 1.0  # and of a person
    symbols = symbols_of(sizes)
    charged = ca.Function("charged", symbols, [ca.vertcat(*residuals(*symbols, sizes))])
    weights = shared[[0, 1, 2, 3, 4, 5, 6, 6, 7, 7]]  # two circles, one person

    def slopes(function, place):
        steps = small * np.eye(len(place))
        return np.array(
            [(function(place + each) - function(place - each)) / (2.0 * small) for each in steps]
        ).T

    for k in range(6):
        part = at.Horizon(stages[k : k + 1], times[k : k + 1], shared)

        def cost(end, jerk, part=part):
            return 0.5 * shared[:10] @ cost_terms(np.stack((end, end)), jerk[None], part)

        def after(state, jerk, part=part):
            return rollout(state, jerk[None], part.times)[1]

        def charges(end, k=k):
            return np.array(charged(end, stages[k], shared)).ravel()

        here = states[k]
        end = states[k + 1]
        jerk = jerks[k]
        found = [
            np.array(each)
            for each in linearisation(sizes)(here, jerk, end, stages[k], times[k], shared)
        ]
        slope = slopes(charges, end)
        expected = (
            slopes(lambda state, jerk=jerk: after(state, jerk), here),
            slopes(lambda jerk, here=here: after(here, jerk), jerk),
            slopes(lambda end, jerk=jerk: cost(end, jerk), end)[:, None],
            times[k] * slope.T @ (weights[:, None] * slope) + 1e-6 * np.eye(7),
            slopes(lambda jerk, end=end: cost(end, jerk), jerk)[:, None],
            np.diag(times[k] * shared[[at.W_JERK, at.W_YAW_JERK]] + 1e-6),
        )
        for ours, theirs in zip(found, expected, strict=True):
            assert ours == approx(theirs, rel=1e-5, abs=1e-6)
    assert (cost_terms(states, jerks, at.Horizon(stages, times, shared)) > 0.0).sum() >= 9


@pytest.mark.parametrize("unsound", ["", "a stage", "a state", "bounds"])
def test_only_sound_numbers_are_evaluated(unsound):
    sizes = Sizes(6, 3, 2)
    start, jerks, stages, times, shared, bounds = problem(default_rng(3), sizes)
    states = rollout(start, jerks, times)
    if unsound == "bounds":
        bounds[0, 5] = bounds[1, 5] + 0.01  # the least speed above the greatest
    elif unsound:
        (stages if unsound == "a stage" else states)[3, 4] = math.nan
    ours = MpcProblem(sizes, generated_code=False)
    evaluate = ours._evaluate
    counted = []
    ours._evaluate = lambda: (counted.append(1), evaluate())
    assert (ours.step(states, jerks, at.Horizon(stages, times, shared), bounds) is None) == bool(
        unsound
    )
    assert len(counted) == (0 if unsound else 1)


@needs_compiler
def test_it_runs_the_same_without_a_compiler(monkeypatch):
    sizes = Sizes(12, 3, 2)
    given = problem(default_rng(17), sizes)
    start, jerks, stages, times, shared, bounds = given
    arguments = (rollout(start, jerks, times), jerks, at.Horizon(stages, times, shared), bounds)
    monkeypatch.setattr(compiler, "find_compiler", lambda: None)
    machine = MpcProblem(sizes, generated_code=True)
    assert not machine.is_compiled
    plain = machine.step(*arguments)
    monkeypatch.undo()
    mpc_problem._gauss_newton_step.cache_clear()
    fast = MpcProblem(sizes, generated_code=True)
    assert fast.is_compiled
    assert fast.step(*arguments) == approx(plain, abs=1e-6)


@needs_compiler
@pytest.mark.parametrize("kept", [0, 1000, -1])  # [bytes]
def test_a_damaged_library_is_compiled_anew(tmp_path, monkeypatch, kept):
    monkeypatch.setenv("NAVSTACK_CACHE", str(tmp_path))
    x = ca.SX.sym("x")
    square = ca.Function("square", [x], [x * x])
    assert float(compiler.compiled(square)(3.0)) == 9.0
    (library,) = tmp_path.glob("*.so")
    content = library.read_bytes()
    library.unlink()  # not overwritten in place: this process has it mapped
    library.write_bytes(content[:kept])
    assert float(compiler.compiled(square)(4.0)) == 16.0
    monkeypatch.setattr(compiler, "find_compiler", lambda: "/nowhere/cc")
    monkeypatch.setenv("NAVSTACK_CACHE", str(tmp_path / "other"))
    assert compiler.compiled(square) is None


@needs_compiler
@pytest.mark.parametrize("open_to_others", ["folder", "library"])
def test_a_library_that_others_may_have_put_there_is_not_loaded(
    tmp_path,
    monkeypatch,
    open_to_others,
):
    monkeypatch.setenv("NAVSTACK_CACHE", str(tmp_path))
    x = ca.SX.sym("x")
    square = ca.Function("power", [x], [x * x])
    cube = ca.Function("power", [x], [x * x * x])
    compiler.compiled(square)
    (library,) = tmp_path.glob("*.so")
    planted = library.read_bytes()
    compiler.compiled(cube)
    (other,) = set(tmp_path.glob("*.so")) - {library}
    other.unlink()
    other.write_bytes(planted)  # the square's code under the cube's name
    other.chmod(0o722 if open_to_others == "library" else 0o700)
    tmp_path.chmod(0o777 if open_to_others == "folder" else 0o700)
    compiler._own_folder.cache_clear()
    if open_to_others == "folder":
        with pytest.warns(NavstackWarning, match="can be written by others"):
            assert float(compiler.compiled(cube)(3.0)) == 27.0
    else:
        assert float(compiler.compiled(cube)(3.0)) == 27.0
