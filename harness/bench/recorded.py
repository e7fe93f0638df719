"""Times of Nav2's own C++, recorded once on another machine of this class: a bar, not a fair race.

Source: unmodified Nav2 sources (Jazzy f4108e5b1, main a3a97043e), compiled outside ROS by g++ 12.2 with -O2, one
thread of an AMD EPYC virtual machine with 2 cores; medians with a noise of 5 to 10 %. Most of them stand in the golden
vectors, too (``timing_ms`` in their facts).
"""

SOURCE = "Nav2's C++ (g++ 12.2 -O2), recorded on another machine of this class: indicative"

RECORDED_MS = {
    "obstacles and inflation, 480 x 480, 360 points": 2.02,
    "inflation, 480 x 480, 1.5 m": 2.29,  # main's rule; Jazzy's took 3.20
    "inflation, 4020 x 4020, 1 m": 191.0,  # main's rule; Jazzy's took 869
    "NavFn Dijkstra, 4020 x 4020": 120.0,
    "NavFn A*, 4020 x 4020": 110.0,
    "AMCL sensor update, 500 x 60": 0.95,
    "AMCL sensor update, 500 x 360": 4.82,
    "AMCL sensor update, 2000 x 60": 3.83,
    "AMCL sensor update, 2000 x 360": 19.1,
    "AMCL motion update, 500": 0.086,
    "AMCL motion update, 2000": 0.33,
    "AMCL resampling, 500": 0.23,
    "AMCL resampling, 2000": 1.15,
    "likelihood field, 4020 x 4020": 2510.0,  # 2510 to 2614
    "DWB cycle, 480 x 480, 419 samples": 22.0,
    "DWB cycle, 160 x 160": 3.57,
    "simple smoother, 1172 poses": 2.2,
    "collision monitor, approach, 360 points": 0.05,
}  # [ms] median
