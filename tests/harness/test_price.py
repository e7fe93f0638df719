"""A finished run at other prices: as if it had been run at them."""

import dataclasses
import json
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from harness.analysis.repricing import choose, reprice, repricing_document
from harness.economics.accountings import accounted
from harness.economics.contact_costs import injury_cost, mais_probabilities, monotone_injury_costs
from harness.economics.cost_model import running
from harness.economics.measured import Measured
from harness.economics.optional_prices import load_optional_prices
from harness.economics.price import with_values
from harness.economics.prices import load_prices, price_sets
from harness.economics.valuation import Risk, valuation_document, value
from harness.metrics.columns import EVENT_COLUMNS
from harness.report.repriced import forgiven, risk_text
from harness.report.table_rows import RATES
from harness.statistics.interval import Interval
from harness.storage.parameters import parameter_folder
from harness.storage.shipped import shipped
from harness.storage.tables import read_rows, write_table
from harness.study.stored_run import load_run, repriced
from navbench.cli.app import main
from navbench.cli.price import price
from navbench.cli.values import names_of, settings_of
from navstack.errors import InputError
from navstack.params.nav2_file.yaml_text import load_text
from navstack.params.strict import dump_dataclass, load_yaml

# of a document of navbench run, beside what it cost
SPEEDS = ("real_time_factor_per_core", "km_per_core_hour")
SHIPPED = (shipped("params") / "prices" / "costnav.yaml").read_text(encoding="utf-8")
CHANGES = (
    ("value: 3.49", "value: 4.99"),
    ("value: 8487", "value: 9999"),
    ("value: 50\n  unit: kg", "value: 61\n  unit: kg"),
)


def print_price(
    run,
    prices=None,
    settings=None,
    terms=(),
    is_full=True,
    as_json=False,
):
    """Print what the command does."""
    others = {"is_sensitivity": False, "maps": [], "out": None}
    choices = {"is_full": is_full, "as_json": as_json, **others}
    price.callback(str(run), prices, settings or {}, terms, **choices)


@pytest.fixture
def other_prices(tmp_path):
    """A price file with another fee, injury cost and robot mass."""
    text = SHIPPED
    for old, new in CHANGES:
        assert text.count(old) == 1, old
        text = text.replace(old, new)
    (tmp_path / "other.yaml").write_text(text, encoding="utf-8")
    return str(tmp_path / "other.yaml")


def priced(
    run,
    prices=None,
    settings=(),
    terms=(),
):
    stored = load_run(str(run))
    choices = choose(stored, prices, settings_of(settings), names_of(terms))
    return json.loads(
        json.dumps(repricing_document(stored, reprice(stored, choices), choices), allow_nan=False)
    )["runs"]


def without(entry, *keys):
    return {key: item for key, item in entry.items() if key not in keys}


def test_the_result_is_that_of_a_run_at_these_prices(write_run, other_prices):
    before, there = (
        write_run("before", ("a", "b")),
        write_run("there", ("a", "b"), prices=other_prices),
    )
    again, direct = priced(before, other_prices), priced(there)
    assert [without(entry, "folder") for entry in again] == [
        without(entry, "folder") for entry in direct
    ]
    assert again != priced(before)


def test_rows_are_those_of_a_run_at_these_prices(write_run, other_prices):
    before, there = (
        load_run(str(write_run("before"))),
        load_run(str(write_run("there", prices=other_prices))),
    )
    prices = load_prices(other_prices)
    assert list(repriced(before.stacks[0], before.events, prices).rows) == list(
        there.stacks[0].rows
    )
    assert list(before.stacks[0].rows) != list(there.stacks[0].rows)


def test_at_its_own_prices_nothing_changes(write_run):
    run = load_run(str(write_run("run")))
    stack = run.stacks[0]
    own = valuation_document(value(stack.rows, stack, run.prices(), run.seed))
    assert {key: priced(run.folder)[0][key] for key in own} == json.loads(json.dumps(own))


@pytest.mark.parametrize("name", ["delivery_fee", "delivery_fee_usd_per_run"])
def test_a_single_price_is_set_with_or_without_its_unit(write_run, name):
    run = write_run("run")
    before, after = priced(run)[0], priced(run, settings=(f"{name}=4.99",))[0]
    assert after["economics"]["revenue"] == pytest.approx(4.99 * before["measured"]["sla"])
    assert after["measured"] == before["measured"]


def test_every_price_can_be_set(write_run):
    run = load_run(str(write_run("run", episodes=2)))
    choices = choose(
        run,
        None,
        {"property_damage.mailbox": 51.0, "injury.costs.mais_1": 9.0, "robot_life_year": 3.0},
        (),
    )
    assert choices.prices.property_damage.mailbox.value == 51
    assert choices.prices.injury.costs.mais_1.value == 9
    assert choices.prices.robot_life.value == 3
    assert choices.prices.robot_life.source.startswith("set by the user")


@pytest.mark.parametrize(
    ("settings", "terms", "message"),
    [
        (("delivery_fe=4",), (), "unknown price 'delivery_fe'; did you mean 'delivery_fee'"),
        (("delivery_fee=much",), (), "is not KEY=NUMBER"),
        (
            ("on_site_time=5",),
            (),
            "--set on_site_time has no effect without an optional term; add --with on_site_as",
        ),
        (("on_site_time_h=5",), ("operator",), "--set on_site_time_h has no effect"),
        (("delivery_fee",), (), "is not KEY=NUMBER"),
        (("delivery_fee=nan",), (), "delivery_fee: nan lies outside"),
        (("delivery_fee=40",), (), "refund 35.42 USD is less than the delivery_fee 40 USD"),
        (("delivery_fee=4", "delivery_fee=5"), (), "--set delivery_fee is given twice"),
        (("delivery_fee=4", "delivery_fee_usd_per_run=5"), (), "are the same price"),
        (("motor_efficiency=1.2",), (), "motor_efficiency: 1.2 lies outside 1e-09..1"),
        (("battery_cycles=0",), (), "battery_cycles: 0 lies outside"),
        ((), ("operater",), "unknown optional term 'operater'; did you mean 'operator'"),
        ((), ("operator,remote_assistance",), "give one of them"),
    ],
)
def test_what_cannot_be_used_is_refused_in_one_line(write_run, settings, terms, message):
    run = load_run(str(write_run("run", episodes=1)))
    with pytest.raises(InputError, match=message) as caught:
        choose(run, None, settings_of(settings), names_of(terms))
    assert "\n" not in str(caught.value)


def test_the_next_command_has_the_stack_and_the_prices(write_run, capsys):
    run = f"{write_run('run', stacks=('one', 'two'), episodes=6)}:one"
    print_price(run, "city_fleet", {"delivery_fee": 5.0}, ["operator", "idle_power"])
    options = "--prices city_fleet --set delivery_fee=5.0 --with operator,idle_power"
    last = capsys.readouterr().out.splitlines()[-1]
    assert last == f"next: navbench price {run} {options} --sensitivity"


def test_the_screen_breaks_even_by_the_accounting_of_the_prices(write_run, navbench):
    def arrive(row):
        row["outcome"] = "sla"

    run = write_run("run", crowd=0.3, change=arrive)
    entry = priced(run, "insurer")[0]["accountings"]
    assert entry["published"]["break_even_runs"] is None
    runs = entry["robot_at_fault"]["break_even_runs"]
    _, told, _ = navbench("price", run, "--prices", "insurer")
    assert "these prices go with the accounting 'robot at fault'" in told
    assert re.search(rf"Break-even \(runs\) +{runs:,.0f}\n", told)
    _, document, _ = navbench("price", run, "--prices", "insurer", "--json")
    assert json.loads(document)["accounting"] == "robot_at_fault"


def test_accounting_by_hand(write_run):
    """Each accounting of each contact added up in plain Python."""
    run = write_run("run")
    stored, prices = load_run(str(run)), load_prices()
    n = len(stored.stacks[0].rows)

    def injuries(kind, share):
        own = [
            event
            for event in stored.events
            if event["type"] == kind and event["partner"] == "pedestrian"
        ]
        return (
            sum(
                share(event) * float(injury_cost(event["impulse_ns"] / 50.0, prices))
                for event in own
            )
            / n
        )

    def whole(event):
        return 1.0

    def at_fault(event):
        return float(event["fault"] == "robot_into_person")

    def shared(event):
        if event["fault"] == "person_into_standing_robot":
            return 0.0
        robot, partner = max(event["robot_speed_mps"], 0.0), max(event["partner_speed_mps"], 0.0)
        return robot / (robot + partner)

    accountings = priced(run)[0]["accountings"]
    for prefix, kind in (("", "counted_contact"), ("no_threshold", "contact_event")):
        shares = {
            prefix or "published": whole,
            f"{prefix}_robot_at_fault": at_fault,
            f"{prefix}_shared_fault": shared,
        }
        for name, share in shares.items():
            entry = accountings[name.strip("_")]
            assert entry["pedestrian_safety"]["value"] == pytest.approx(injuries(kind, share)), name
    published = priced(run)[0]["economics"]
    assert accountings["published"]["opex"]["value"] == pytest.approx(published["opex"], abs=1e-4)
    costs = {name: entry["pedestrian_safety"]["value"] for name, entry in accountings.items()}
    assert 0.0 < costs["robot_at_fault"] < costs["published"] < costs["no_threshold"]
    assert 0.0 < costs["shared_fault"] < costs["published"]


def test_monotone_by_hand(write_run):
    """Counted contacts with people at a price that never falls.

    And every touch of a mailbox by its impulse.
    """
    run = write_run("run", crowd=4.0)
    stored, prices = load_run(str(run)), load_prices()
    rows, found = stored.stacks[0].rows, priced(run)[0]["accountings"]
    injuries = damage = 0.0
    for row in rows:
        own = [event for event in stored.events if event["episode"] == row["episode"]]
        people = [e for e in own if e["type"] == "counted_contact" and e["kind"] == "pedestrian"]
        injuries += sum(
            float(monotone_injury_costs(event["impulse_ns"], prices)) for event in people
        )
        touched = [e for e in own if e["type"] == "contact_event" and e["kind"] == "mailbox"]
        damage += 50.0 * max(
            sum(min(e["impulse_ns"] / 100.0, 1.0) for e in touched), row["mailbox_contacts"]
        )
    assert found["monotone"]["pedestrian_safety"]["value"] == pytest.approx(injuries / len(rows))
    assert found["monotone"]["property_damage"]["value"] == pytest.approx(damage / len(rows))
    published, monotone = (
        found[name]["contribution_margin"]["value"] for name in ("published", "monotone")
    )
    assert monotone < published
    told = Interval(**priced(run)[0]["forgiven_usd_per_run"])
    assert told.value == pytest.approx(published - monotone) and told.n == len(rows)
    assert forgiven(told).startswith(f"the published rule forgives {told.value:.2f} [")


def test_what_has_no_price_has_one_in_monotone():
    nothing = {
        "stack": "mine",
        "episode": 0,
        "robot_speed_mps": 1.0,
        "partner_speed_mps": 0.0,
        "fault": "robot_into_property",
    }
    events = [
        {**nothing, "type": "contact_event", "kind": kind, "impulse_ns": 40.0}
        for kind in ("unknown", "trash_bin")
    ]
    each = Measured(**{field.name: np.zeros(1) for field in dataclasses.fields(Measured)})
    found = accounted(each, [{"stack": "mine", "episode": 0}], events, "monotone", load_prices())
    assert (found.other_property_usd.tolist(), found.trash_bin_contacts.tolist()) == (
        [0.4 * 50.0],
        [0.4],
    )
    assert running(found, load_prices()).terms["property_damage"].tolist() == [40.0]


def test_property_keeps_its_own_threshold(write_run):
    run = write_run("run", crowd=4.0)
    stored = load_run(str(run))
    hard = [
        e
        for e in stored.events
        if e["type"] == "contact_event" and e["kind"] == "mailbox" and e["impulse_ns"] >= 100
    ]
    assert hard
    entry = priced(run)[0]["accountings"]["no_threshold"]["property_damage"]
    assert entry["value"] == pytest.approx(50.0 * len(hard) / len(stored.stacks[0].rows))


def test_optional_terms_are_off_and_marked_when_on(write_run):
    run = write_run("run")
    off = priced(run)[0]
    assert off["optional_terms"] == {}
    on = priced(
        run, settings=("on_site_time=2",), terms=("operator,on_site_assistance", "battery_wear")
    )[0]
    terms = on["optional_terms"]
    assert list(terms) == ["operator", "on_site_assistance", "battery_wear"]
    assert all(term["in_paper"] is False for term in terms.values())
    assert terms["operator"]["opex_usd_per_run"] == pytest.approx(
        24.0 / 4.0 * off["measured"]["avg_runtime_h"]
    )
    assert terms["on_site_assistance"]["opex_usd_per_run"] == pytest.approx(
        48 * off["measured"]["physical_assistance"]
    )
    assert terms["on_site_assistance"]["prices"]["on_site_time"]["source"].startswith(
        "set by the user"
    )
    energy = (
        off["measured"]["avg_mechanical_power_kw"] * off["measured"]["avg_runtime_h"] / 0.99 / 0.82
    )
    assert terms["battery_wear"]["opex_usd_per_run"] == pytest.approx(0.115 * energy)
    added = sum(term["opex_usd_per_run"] for term in terms.values())
    assert on["economics"]["opex"] == pytest.approx(off["economics"]["opex"] + added)
    margin = off["economics"]["contribution_margin"] - added
    assert on["economics"]["contribution_margin"] == pytest.approx(margin)
    assert on["intervals"]["contribution_margin"]["value"] == pytest.approx(margin, abs=1e-4)


@pytest.mark.parametrize(("localizer", "added"), [("amcl", 23.53 * 16), ("gps", 0.0)])
def test_only_localizers_with_a_map_pay_for_a_survey(write_run, localizer, added):
    run = write_run("run", localizer=localizer)
    off, on = priced(run)[0], priced(run, terms=("mapping_survey",))[0]
    assert on["economics"]["capex_usd"] == pytest.approx(off["economics"]["capex_usd"] + added)


def test_error_rows_are_counted_and_not_priced(write_run):
    def fail(row):
        if row["episode"] == 1:
            row["error"] = "it broke"

    entry = priced(write_run("run", episodes=4, change=fail))[0]
    assert (entry["episodes"], entry["errors"]) == (3, 1)


def test_cargo_not_modelled_stays_undefined(write_run, capsys):
    def arrive(row):
        row["outcome"] = "arrived" if row["episode"] else "timeout"

    run = write_run("run", episodes=4, change=arrive)
    entry = priced(run)[0]
    assert entry["economics"]["opex"] is None
    assert entry["risk"]["opex_cvar95_usd_per_run"] is None
    assert entry["accountings"]["no_threshold"]["contribution_margin"] is None
    print_price(run)
    assert "undefined" in capsys.readouterr().out


def test_the_worst_deliveries_and_the_odds(write_run):
    run = write_run("run")
    risk = priced(run)[0]["risk"]
    assert risk["opex_cvar95_usd_per_run"]["value"] > priced(run)[0]["economics"]["opex"]
    assert risk["break_even"] == {
        "within_runs": 18250.0,
        "probability": pytest.approx(0.0, abs=1e-6),
    }
    cheap = priced(
        run,
        settings=(
            "injury.costs.mais_0=0",
            "robot_cost=1",
            "lidar_cost=0",
            "gps_cost=0",
            "refund=3.49",
        ),
    )
    money, told = cheap[0]["economics"], cheap[0]["intervals"]["contribution_margin"]
    variance = 40.0 * ((told["high"] - told["low"]) / 3.92) ** 2  # of a delivery
    # a losing drift's first passage
    ever = np.exp(2.0 * money["contribution_margin"] * money["capex_usd"] / variance)
    assert 0.9 < ever < 0.99
    assert cheap[0]["risk"]["break_even"]["probability"] == pytest.approx(ever, abs=0.01)


def test_what_is_known_of_deliveries_that_earned_the_same_is_told():
    text = risk_text(Risk(Interval(1.25, None, None, 9), 18250.0, None))
    assert text.startswith(
        "the worst 5 % of deliveries cost 1.25 $ each (too few, or all alike: no interval); chance "
        "of break-even"
    )
    assert "all deliveries earned the same" in text


def test_events_of_another_state_of_the_run_are_refused(write_run):
    run = write_run("run", episodes=20)
    events = read_rows(run / "events.parquet", EVENT_COLUMNS)
    write_table(
        run / "events.parquet", EVENT_COLUMNS, [event for event in events if event["episode"] < 10]
    )
    with pytest.raises(
        InputError, match=r"contacts with people in episodes\.parquet and 0 in events\.parquet"
    ):
        priced(run)


def test_deliveries_without_a_result_are_counted_in_the_print(write_run, capsys):
    def fail(row):
        row["error"] = "it broke" if row["episode"] in (2, 5) else None

    run = write_run("run", episodes=12, change=fail)
    for is_full in (False, True):
        print_price(run, is_full=is_full)
        assert "mine: 2 deliveries ended in an error, left out" in capsys.readouterr().out


def test_tables(write_run, capsys):
    run = write_run("run", ("one", "two"))
    print_price(f"{run}:two", settings={"delivery_fee": 4.99}, terms=("operator",))
    text = capsys.readouterr().out
    assert (
        "two: the same contacts, accounted for in other ways" in text and "one" not in text.split()
    )
    assert "all, robot at fault" in text
    assert "optional term operator, not in the paper" in text
    assert "set: delivery_fee = 4.99" in text
    # intervals of 41 dollars are a column wider than a console of 120
    assert max(len(line.rstrip()) for line in text.splitlines()[:-1]) <= 121


@pytest.mark.parametrize(
    ("damage", "message"),
    [
        (lambda run: (run / "run.json").unlink(), "holds no run"),
        (lambda run: (run / "run.json").write_text("{}"), "run.json: is damaged"),
        (lambda run: (run / "run.json").write_text('{"stacks": [1]}'), "run.json: is damaged"),
        (
            lambda run: (run / "episodes.parquet").write_bytes(b"PAR1"),
            "episodes.parquet: is damaged",
        ),
        (lambda run: (run / "events.parquet").unlink(), "events.parquet: cannot be read"),
        (lambda run: (run / "episodes.parquet").unlink(), "has no episodes.parquet"),
        (lambda run: (run / "params" / "prices.yaml").unlink(), "prices.yaml' does not exist"),
    ],
)
def test_a_damaged_folder_is_refused_in_one_line(write_run, damage, message):
    run = write_run("run", episodes=2)
    damage(run)
    with pytest.raises(InputError, match=message) as caught:
        print_price(run, as_json=True)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("name", ["../../elsewhere", "a/b", "nul\0"])
def test_the_name_of_a_stack_leads_into_no_other_folder(write_run, navbench, tmp_path, name):
    run = write_run("run", (name,), episodes=6)
    before = sorted(tmp_path.rglob("*"))
    status, _, said = navbench("price", run, "--sensitivity", "--out", tmp_path / "a" / "b")
    assert status == 1 and "is not the name of a stack" in said and said.count("\n") == 1
    assert sorted(tmp_path.rglob("*")) == before


@pytest.mark.parametrize(
    ("key", "number"),
    [
        ("distance_m", None),
        ("distance_m", 1e300),
        ("pedestrian_contacts", None),
        ("pedestrian_injury_usd", None),
    ],
)
def test_what_cannot_have_been_measured_is_refused(write_run, key, number):
    def spoil(row):
        row[key] = number

    with pytest.raises(InputError, match=f"episodes.parquet: episode 0 has no sound '{key}'"):
        load_run(str(write_run("run", episodes=2, change=spoil)))


@pytest.mark.parametrize("key", ["pedestrian_contacts", "soft_contacts", "mailbox_contacts"])
def test_fewer_contacts_than_none_are_refused(write_run, key):
    def spoil(row):
        row[key] = -1

    with pytest.raises(InputError, match=f"row 1: {key} -1 is no measurement; it cannot be neg"):
        load_run(str(write_run("run", episodes=2, change=spoil)))


def test_an_impulse_below_zero_is_refused(write_run):
    folder = write_run("run", episodes=6)
    events = [{**event, "impulse_ns": -5.0} for event in load_run(str(folder)).events]
    write_table(folder / "events.parquet", EVENT_COLUMNS, events)
    with pytest.raises(InputError, match="events.parquet: episode 0 has an impulse of -5 N s"):
        load_run(str(folder))


def test_an_unknown_stack_offers_the_nearest(write_run):
    run = write_run("run", ("nav2-gps",), episodes=1)
    with pytest.raises(InputError, match="did you mean 'nav2-gps'"):
        load_run(f"{run}:nav2-gsp")


def test_values_follow_the_summary(write_run):
    """The vectorised means are those of the summary, the intervals hold them."""
    entry = priced(write_run("run", crowd=2.0))[0]
    followed = {key: each for key, each in entry["intervals"].items() if key not in RATES}
    assert len(followed) < len(entry["intervals"]), "rates are not means"
    for key, interval in followed.items():
        known = entry["measured"] | {
            k: v for k, v in entry["economics"].items() if k not in entry["measured"]
        }
        assert interval["value"] == pytest.approx(known[key], rel=1e-9, abs=1e-4), key
        if interval["low"] is not None:
            assert interval["low"] <= interval["value"] <= interval["high"], key
    assert entry["intervals"]["avg_min_time_to_collision_s"]["n"] == 26


@pytest.mark.slow
def test_a_real_run_repriced_is_that_run_at_these_prices(
    tmp_path,
    other_prices,
    in_process,
    capsys,
):
    """A short delivery in a thick crowd, every touch of which counts."""
    options = {}
    changes = (
        ("rules", "costnav", "timeout: 241.0", "timeout: 8.0"),
        ("worlds", "easy", "impulse: 50.0", "impulse: 10.0"),
    )
    for kind, file, old, new in changes:
        text = (shipped("params") / kind / f"{file}.yaml").read_text(encoding="utf-8")
        assert text.count(old) == 1
        options[kind] = tmp_path / f"{kind}.yaml"
        options[kind].write_text(text.replace(old, new), encoding="utf-8")
    common = [
        "run",
        "--stack",
        "parked",
        "--episodes",
        "1",
        "--seed",
        "5",
        "--pedestrians",
        "400",
        "--workers",
        "1",
    ]
    common += ["--rules", str(options["rules"]), "--world", str(options["worlds"])]
    documents = {}
    for name, prices in (("before", "costnav"), ("there", other_prices)):
        extra = ["--prices", prices, "--out", str(tmp_path / name), "--json"]
        with pytest.raises(SystemExit) as ended:
            main([*common, *extra])
        said = capsys.readouterr()
        assert ended.value.code == 0, said.err
        documents[name] = json.loads(said.out)["runs"][0]
    assert documents["there"]["measured"]["pedestrian_injury_usd_per_run"] > 0.0
    again = priced(tmp_path / "before", other_prices)[0]
    own = without(documents["there"], *SPEEDS, "wall_s", "folder", "digest")
    assert {key: again[key] for key in own} == own


def test_pricing_loads_nothing_that_simulates(write_run):
    run = write_run("run", episodes=2)
    heavy = ("pybullet", "numba", "ompl", "matplotlib", "casadi")
    code = (
        f"import sys; from navbench.cli.app import _status; status = _status(['price', "
        f"{str(run)!r}, '--json'])\n"
    )
    code += f"sys.exit(status or ' '.join(name for name in {heavy} if name in sys.modules) or 0)"
    done = subprocess.run(
        [sys.executable, "-c", code],
        capture_output=True,
        text=True,
        timeout=60,
        check=False,
    )
    assert (done.returncode, done.stderr) == (0, "")
    assert json.loads(done.stdout)["runs"][0]["episodes"] == 2


def test_deliveries_of_one_mission_are_one_cluster(write_run):
    """Half as many missions, each driven twice alike, give wider intervals.

    They are wider than those of as many missions driven once.
    """

    def twice(row):
        own = np.random.default_rng(row["episode"] // 2)
        row["distance_m"] = float(own.uniform(30.0, 150.0))
        row["start_x_m"], row["start_y_m"], row["start_yaw_rad"] = own.uniform(0.0, 9.0, 3).tolist()
        row["goal_x_m"], row["goal_y_m"] = own.uniform(0.0, 9.0, 2).tolist()

    def once(row):
        row["distance_m"] = float(np.random.default_rng(row["episode"] // 2).uniform(30.0, 150.0))

    spans = [
        priced(write_run(change.__name__, change=change))[0]["intervals"]
        for change in (twice, once)
    ]
    clustered, plain = (span["avg_distance_km"] for span in spans)
    assert clustered["value"] == plain["value"]
    ratio = (clustered["high"] - clustered["low"]) / (plain["high"] - plain["low"])
    assert ratio == pytest.approx(np.sqrt(2.0), abs=0.15)


def test_changed_prices_say_what_they_were(write_run):
    run = load_run(str(write_run("run", episodes=1)))
    assert (
        dataclasses.asdict(choose(run, None, {"refund": 36.0}, ()).prices.refund)["source"].count(
            "35.42"
        )
        == 1
    )


def test_every_set_is_the_published_one_but_for_what_it_says():
    published = load_prices()
    for name in price_sets():
        stored = load_prices(name)
        text = (shipped("params") / "prices" / f"{name}.yaml").read_text(encoding="utf-8")
        own = set(load_text(text, name)) - {"as_in"}
        for field in dataclasses.fields(stored):
            if field.name not in own and name != "costnav":
                assert getattr(stored, field.name) == getattr(published, field.name), (
                    name,
                    field.name,
                )
        assert name == "costnav" or (own - {"as_of"} and re.fullmatch(r"20\d\d-\d\d", stored.as_of))


def test_a_run_under_all_sets(write_run, capsys):
    run = write_run("run", ("one", "two"), crowd=3.0)
    print_price(run, "all", as_json=True)
    sets = json.loads(capsys.readouterr().out)["sets"]
    assert list(sets) == price_sets() and price_sets()[0] == "costnav"
    for name, found in sets.items():
        for stack in ("one", "two"):
            (alone,) = priced(f"{run}:{stack}", name)
            expected = alone["accountings"][found["accounting"]]["contribution_margin"]
            assert found["margins"][stack] == pytest.approx(expected), (name, stack)
            assert found["capex_usd"][stack] == alone["economics"]["capex_usd"]
            assert found["optional_terms"] == list(alone["optional_terms"])
            share = found["capex_usd"][stack] / alone["risk"]["break_even"]["within_runs"]
            assert found["profits"][stack]["low"] == pytest.approx(expected["low"] - share)
    assert sets["insurer"]["accounting"] == "robot_at_fault"
    print_price(run, "all")
    assert "order under costnav: " in capsys.readouterr().out
    with pytest.raises(InputError, match="takes none of --set, --with"):
        print_price(run, "all", {"delivery_fee": 4.0})


def test_the_curve_of_crash_tests_goes_through_what_was_measured():
    prices = load_prices("robot_crash_tests")
    assert (
        prices.injury_mass_factor == with_values(prices, {"robot_mass": 200.0}).injury_mass_factor
    )
    curves = prices.injury.logistic.curves
    at_least = 1.0 - np.cumsum(mais_probabilities(np.array([1.5, 3.1]), curves), axis=-1)
    tibia, chest = at_least[:, 1], at_least[:, 2]
    assert tibia == pytest.approx([0.05, 0.33], abs=0.005)
    odds = chest / (1.0 - chest) * 10.0  # of one bystander in ten
    assert odds / (1.0 + odds) == pytest.approx([0.05, 0.50], abs=0.01)


def test_contacts_beyond_the_peak_and_beyond_the_limit_are_counted(write_run):
    run = load_run(str(write_run("run", crowd=4.0)))
    squeezed = tuple({**each, "impulse_ns": 20.0 * each["impulse_ns"]} for each in run.events)
    (result,) = reprice(dataclasses.replace(run, events=squeezed), choose(run, None, {}, ()))
    people = [each for each in squeezed if each["kind"] == "pedestrian"]
    counted = [each["impulse_ns"] > 1042.25 for each in people if each["type"] == "counted_contact"]
    assert (result.turned.value, result.turned.n) == (pytest.approx(np.mean(counted)), len(counted))
    # [m/s] force over the root of stiffness times reduced mass
    limit = 260.0 / np.sqrt(60_000.0 * 50.0 * 75.0 / 125.0)
    closing = [
        e["robot_speed_mps"] + e["partner_speed_mps"] > limit
        for e in people
        if e["type"] == "contact_event"
    ]
    assert (result.beyond_limit.value, result.beyond_limit.n) == (
        pytest.approx(np.mean(closing)),
        len(closing),
    )


def test_a_set_has_terms_and_prices_of_its_own_and_is_kept_whole(tmp_path):
    """A stored study goes on only with the price file that it holds.

    So published prices are dumped as ever.
    """
    study = Path(__file__).parents[2] / "results" / "baseline" / "urban" / "sidewalk_1"
    stored = load_yaml(parameter_folder(study) / "prices.yaml")
    assert load_text(dump_dataclass(load_prices()), "dump") == stored
    for name in price_sets():
        prices = load_prices(name)
        (tmp_path / "kept.yaml").write_text(dump_dataclass(prices), encoding="utf-8")
        assert load_prices(str(tmp_path / "kept.yaml")) == prices
        optional = load_optional_prices(prices)
        assert all(getattr(optional, key) == each for key, each in prices.optional.items())
    assert load_prices("city_fleet").terms == ("operator", "on_site_assistance")


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("as_in: costnaf", "as_in 'costnaf'; did you mean 'costnav'"),
        (
            "as_in: campus\naccounting: at_fault",
            "accounting of prices 'at_fault'; did you mean 'robot_at_fault'",
        ),
        (
            "as_in: campus\nterms: [operater]",
            "unknown optional term 'operater'; did you mean 'operator'",
        ),
        (
            "as_in: campus\noptional: {operater_wage: {value: 1, unit: USD/h, source: x}}",
            "unknown optional price 'operater_wage'; did you mean 'operator_wage'",
        ),
        (
            "as_in: campus\noptional: {operator_wage: {value: 1, unit: EUR/h, source: x}}",
            "convert it to 'USD/h'",
        ),
    ],
)
def test_a_set_that_cannot_be_used_is_refused_before_anything_drives(tmp_path, text, message):
    file = tmp_path / "mine.yaml"
    file.write_text(text, encoding="utf-8")
    with pytest.raises(InputError, match=message) as caught:
        load_prices(str(file))
    assert str(caught.value).startswith(f"{file}: ")
    assert "\n" not in str(caught.value)
