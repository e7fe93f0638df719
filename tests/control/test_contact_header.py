"""The C++ header for Nav2 says what our kernel says."""

import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest
from numpy.random import default_rng
from numpy.testing import assert_allclose

from navstack.control.contact_risk import FIELDS, ContactPricing, RobotBox, expected_contacts
from navstack.params.expected_contact import ContactPrices

FOLDER = Path(__file__).parents[2] / "docs" / "examples" / "nav2_contact_critic"
SITUATIONS, STATES, PEOPLE = 200, 20, 5


def situation(rng):
    """A box, a step [s], people (n, FIELDS) and states (T, 5) among them, some in contact."""
    body = RobotBox(rng.uniform(-0.4, 0.2), rng.uniform(0.2, 0.6), rng.uniform(0.2, 0.4))
    people = rng.uniform(-4.0, 4.0, (int(rng.integers(0, PEOPLE + 1)), FIELDS))
    people[:, 2:4] *= 0.5
    people[:, 4] = 0.3
    people[:, 5:] = rng.uniform(0.0, 0.2, (len(people), 2))
    states = np.cumsum(rng.normal(0.0, 0.15, (STATES, 5)), axis=0)
    states[:, 3] = rng.uniform(-1.0, 2.5)
    return body, float(rng.uniform(0.05, 0.2)), people, states


@pytest.fixture(scope="module")
def program(tmp_path_factory):
    """The compiled check of the header."""
    compiler = shutil.which("g++")
    if compiler is None:
        pytest.skip("no g++ here")
    file = tmp_path_factory.mktemp("critic") / "check_vectors"
    flags = ["-std=c++17", "-Wall", "-Wextra", "-Wpedantic", "-Werror", "-O1"]
    source = FOLDER / "src" / "check_vectors.cpp"
    include = f"-I{FOLDER / 'include'}"
    subprocess.run([compiler, *flags, include, source, "-o", file], check=True)
    return file


PRICES = """
#include <iostream>
#include "nav2_contact_critic/contact_risk.hpp"
int main()
{
  nav2_contact_critic::ContactPrices good, bad;
  std::cout << refusal(good) << ";";
  bad = good; bad.contact_usd = {30.0}; std::cout << refusal(bad) << ";";
  bad = good; bad.contact_usd = {}; std::cout << refusal(bad) << ";";
  bad = good; bad.contact_usd[1] = -1.0; std::cout << refusal(bad) << ";";
  bad = good; bad.speed_std = 0.0; std::cout << refusal(bad) << ";";
  bad = good; bad.drift_std = std::nan(""); std::cout << refusal(bad) << ";";
}
"""


def test_the_header_refuses_prices_that_the_kernel_refuses(tmp_path):
    compiler = shutil.which("g++")
    if compiler is None:
        pytest.skip("no g++ here")
    source = tmp_path / "prices.cpp"
    source.write_text(PRICES)
    flags = ["-std=c++17", "-Wall", "-Wextra", "-Wpedantic", "-Werror", f"-I{FOLDER / 'include'}"]
    subprocess.run([compiler, *flags, source, "-o", tmp_path / "prices"], check=True)
    printed = subprocess.run([tmp_path / "prices"], capture_output=True, text=True, check=True)
    two, least, positive = "contact_usd needs two", "must be 0 or more", "must be more than 0"
    said = printed.stdout.split(";")[:-1]
    assert said[0] == ""
    for line, expected in zip(said[1:], (two, two, least, positive, least), strict=True):
        assert expected in line


def test_the_header_and_the_kernel_agree(program):
    rng = default_rng(11)
    pricing = ContactPricing(ContactPrices())
    expected, lines = [], []
    for _ in range(SITUATIONS):
        body, step, people, states = situation(rng)
        x, y, yaw, v, w = (np.ascontiguousarray(each[None]) for each in states.T)
        length, steps = np.array([STATES]), np.array([step])
        prices = (pricing.rates, pricing.contact_usd)
        costs = expected_contacts(x, y, yaw, length, steps, v, w, people, body, *prices)
        expected.append(costs[0])
        numbers = [*body, step, len(people), STATES, *people.ravel(), *states.ravel()]
        lines.append(" ".join(map(repr, map(float, numbers[:4]))) + f" {len(people)} {STATES}")
        lines[-1] += " " + " ".join(map(repr, map(float, numbers[6:])))
    text = "\n".join(lines)
    printed = subprocess.run([program], input=text, capture_output=True, text=True, check=True)
    found = np.array(printed.stdout.split(), dtype=np.float64)
    assert_allclose(found, expected, rtol=1e-12, atol=1e-12)
    assert np.count_nonzero(expected) > SITUATIONS // 2
    assert max(expected) > 30.0
