"""What ``navbench COMMAND --help`` says."""

HELP = """Drive delivery robots through a physical sidewalk world, and price every delivery.

\b
Examples:
  navbench run --stack nav2-gps --episodes 20 --seed 0
  navbench run --stack nav2-gps --stack parked --episodes 10 --out results/first
  navbench run --stack my_robot_nav2.yaml --map my_map.yaml --episodes 5 --json
  navbench paper

Exit status: 0 done; 1 bad input; 2 unknown command or option; 3 done, but some deliveries ended in an error; 130
interrupted, finished deliveries kept.
"""
RUN_HELP = """Drive deliveries and print what they did and what they cost.

\b
Examples:
  navbench run --stack nav2-gps --episodes 20
  navbench run --stack nav2-gps --localizer ground_truth --pedestrians 0 --episodes 5
  navbench run --world social --pedestrians 40 --episodes 5
  navbench run --people recorded.csv --episodes 5
  navbench run --start -67.9,-71.9,0 --goal -89.7,-63.5,0 --episodes 3
  navbench run --resume results/latest
"""
SUITE_HELP = """Drive a declared study: every stack in every world, density of people and seed; and print the overview.

FILE names stacks, maps, worlds, pedestrians, seeds and episodes, as params/suites/example.yaml does; it may be a name
of params/suites. --out may name a folder that holds part of the suite: what is there is kept and added to. The folder's
index.md shows what there is, with tables and figures.

\b
Examples:
  navbench suite example
  navbench suite my_suite.yaml --out results/my_suite
  navbench suite my_suite.yaml --out results/my_suite --stack nav2-gps --episodes 100
  navbench suite --resume results/my_suite
"""
ABLATE_HELP = """Drive one stack with one localizer after the other on the same missions, people and noise.

The report tells what each knows of its position, what that earns, what its sensors cost, and which differences are
more than chance.

docs/ablation.md tells how to read the report and where its formulas are from.

\b
Examples:
  navbench ablate --localizers ground_truth,gps,amcl --episodes 200
  navbench ablate --localizers ground_truth,amcl,amcl@navigation_mesh --against amcl
  navbench ablate --inject position=0.1,0.3,1.0 heading=2,5 --episodes 100
  navbench ablate --localizers gps,gps-ekf --sensors rtk_urban --json
  navbench ablate --resume results/latest
"""
COMPARE_HELP = """Compare two runs, or two stacks of one run, on the missions that they have in common: B minus A.

A and B are run folders, or FOLDER:stack where a folder has several stacks.

\b
Examples:
  navbench compare results/before results/after
  navbench compare results/both:nav2-gps results/both:parked
  navbench compare results/before results/after --metric sla --metric contribution_margin --json
"""
PRICE_HELP = """Price a finished run again, without simulating: other prices, other ways to count contacts, more costs.

RUN is a run folder, or FOLDER:stack.

\b
Examples:
  navbench price results/latest --set delivery_fee_usd_per_run=4.99
  navbench price results/latest --prices my_prices.yaml --json
  navbench price results/latest --with operator,on_site_assistance,battery_wear --set on_site_time_h=0.5
"""
SENSITIVITY_HELP = """Show what the money of a finished run hangs on: every price, pairs of prices, chance.

RUN is a run folder, or FOLDER:stack.

\b
Examples:
  navbench sensitivity results/latest
  navbench sensitivity results/latest --out figures
  navbench sensitivity results/latest --map delivery_fee,property_damage --out figures --json
"""
PARITY_HELP = """Run recorded inputs of Nav2's own C++ through navstack and compare: a certificate, part by part.

\b
Examples:
  navbench parity
  navbench parity --golden my_vectors --json

Exit status: 0 all cases are equal or their deviations explained; 1 otherwise.
"""
LINT_HELP = """Check a Nav2 parameter file: errors, and combinations of values that hurt on a real robot.

FILE is a path or a name of params/nav2. What each finding means: docs/lint.md.

\b
Examples:
  navbench lint my_robot_nav2.yaml
  navbench lint my_robot_nav2.yaml --robot segway_e1
  navbench lint tuned --json

Exit status: 0 no errors (there may be warnings); 1 errors.
"""
SCENARIO_HELP = """Drive short situations in the physical world and check what comes of them.

A FILE says who stands where, what happens and what must come of it; docs/scenarios.md describes it.

\b
Examples:
  navbench scenario tests/scenarios/kiosk.yaml
  navbench scenario --all --json

Exit status: 0 everything came as the files expect; 1 something did not.
"""
MAP_HELP = """Make a sidewalk world, or show any map beside what is known of the paper's.

\b
Examples:
  navbench map new --seed 7 --name my_town --out my_maps
  navbench map show my_maps/my_town.yaml --out town.png
  navbench map show sidewalk --view navmesh --out mesh.png --json
"""
LOCALIZE_HELP = """Run one of the robot's localizers over a recorded ROS 1 or ROS 2 bag, without ROS.

Reads LaserScan, Imu, NavSatFix, Odometry and the frames of tf_static; writes the believed poses; prints the errors
(APE, RPE) against a reference. docs/recorded_logs.md describes it.

\b
Examples:
  navbench localize --bag drive.bag --params stock --localizer gps-ekf --out drive.tum --reference /fix --align start
  navbench localize --bag rosbag2_drive --map office.yaml --params my_nav2.yaml --localizer amcl --out drive.tum
  navbench localize --bag drive.mcap --params stock --localizer odom_imu --out drive.tum \\
      --static-tf "base_link imu_link 0 0 0.5 1.5708 0 -1.5708" --remap /imu/data:=/xsens/imu

Exit status: 0 done; 1 bad input, or a log that breaks off (what was computed is kept); 130 interrupted (likewise).
"""
PLAN_HELP = """Ask several planners for a path from one pose to another, and compare what they find.

Clearance is the least distance between the robot's body, turns on the way included, and what it must not touch; cost
counts a path through costs as longer, as NavFn does. docs/planning.md describes the planners.

\b
Examples:
  navbench plan --planner NavFn,RRTstar,InformedRRTstar --seed 3 --time 1 --picture plan.png
  navbench plan --start=-67.9,-71.9,0 --goal=-89.7,-63.5,0 --planner NavFn --smoother SimpleSmoother
  navbench plan --map my_map.yaml --params my_nav2.yaml --start 1,2,0 --goal 9,4,1.57 --planner PRMstar,FMT --json

Exit status: 0 a planner found a path; 1 none did, or bad input.
"""
BENCH_HELP = """Measure how fast everything is: components against plain numpy and against recorded times of Nav2's C++,
whole deliveries against real time, and where one simulated second goes.

Times are processor time of one core; ours and its reference are taken in turn. docs/speed.md tells how to read them.

\b
Examples:
  navbench bench
  navbench bench --only "DWB cycle" --only paper-gps --json
  navbench bench --quick --flame flame.svg
  navbench bench --history benchmarks/history.md
"""

TUNE_HELP = """Tune a Nav2 parameter file for what its deliveries earn, and prove the result on missions it never saw.

Every trial drives the same training missions; one that is worse than the best so far is dropped early. The best few
meet again on further ones, and original and result are compared on test missions. The study folder has the tuned file
with your comments, its lint, every trial, and the line that drives the test again. Ctrl-C keeps what is finished;
--resume goes on.

\b
Examples:
  navbench tune --stack my_nav2.yaml --localizer gps-ekf --space dwb_critics --trials 100
  navbench tune --stack nav2-stock --space dwb_critics --space local_layers --objective shared_margin --budget 2h
  navbench tune --stack nav2-stock --space dwb_sampling --objective cvar --budget 30m
  navbench tune --stack mpc-gps-ekf --space mpc_weights --objective "margin@sla>=0.9"
  navbench tune --stack nav2-gps --space inflation --objective margin,-pedestrian_delay_s --sampler tpe
  navbench tune --resume results/latest

Exit status: 0 finished; 1 bad input; 3 finished, but some deliveries ended in an error; 130 interrupted.
"""
