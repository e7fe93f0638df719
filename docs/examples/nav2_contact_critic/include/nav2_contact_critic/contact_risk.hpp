// SPDX-License-Identifier: Apache-2.0
// Expected cost of the contacts between a robot and tracked people, along candidate trajectories.
// The formulas are those of docs/expected_cost.md and of navstack/control/contact_risk.py, against
// which this header is tested. C++17, without dependencies.
#ifndef NAV2_CONTACT_CRITIC__CONTACT_RISK_HPP_
#define NAV2_CONTACT_CRITIC__CONTACT_RISK_HPP_

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <string>
#include <vector>

namespace nav2_contact_critic
{

// A tracked person in the frame of the trajectories.
struct Person
{
  double x{0.0};  // [m]
  double y{0.0};
  double vx{0.0};  // [m/s]
  double vy{0.0};
  double radius{0.3};  // [m]
  double place_variance{0.0};  // [m2] per axis
  double velocity_variance{0.0};  // [m2/s2] per axis
};

// The robot's outline: a box about a point of the base frame's x axis.
struct RobotBox
{
  double centre{0.0};  // [m]
  double half_length{0.5};
  double half_width{0.25};
};

// Prices and spreads, as in navstack/params/expected_contact.py.
struct ContactPrices
{
  std::vector<double> contact_usd{31.3, 31.3, 37.0, 44.1, 52.9, 64.1};  // at 0, 1, .. m/s
  double counted_speed{1.0};  // [m/s] from which on a contact counts
  double speed_std{0.2};  // [m/s]
  double touch_usd{15.0};  // [USD] of a touch of any kind
  double position_std{0.1};  // [m]
  double drift_std{0.1};  // [m/s]
};

// Why prices cannot be used; empty where they can. The allowed values are those of the Python file.
inline std::string refusal(const ContactPrices & prices)
{
  if (prices.contact_usd.size() < 2) {
    return "contact_usd needs two prices or more, at 0, 1, .. m/s";
  }
  const double values[] = {
    prices.counted_speed, prices.touch_usd, prices.drift_std,
    *std::min_element(prices.contact_usd.begin(), prices.contact_usd.end())};
  for (const double value : values) {
    if (!(value >= 0.0)) {
      return "contact_usd, counted_speed, touch_usd and drift_std must be 0 or more";
    }
  }
  if (!(prices.speed_std > 0.0 && prices.position_std > 0.0)) {
    return "speed_std and position_std must be more than 0";
  }
  return "";
}

// A pose of a trajectory and the motion there.
struct State
{
  double x{0.0};  // [m]
  double y{0.0};
  double yaw{0.0};  // [rad]
  double v{0.0};  // [m/s]
  double omega{0.0};  // [rad/s]
};

// Probability that a standard normal variable exceeds z, by the logistic function of slope 1.702
// (Bowling et al. 2009, J. Industrial Engineering and Management 2).
inline double chance(double z)
{
  return 1.0 / (1.0 + std::exp(1.702 * z));
}

// Standard deviation [m] of the place of a person who walks on for t [s].
inline double spread_at(const Person & person, double t, const ContactPrices & prices)
{
  constexpr double kShareOfTrack = 0.6;
  constexpr double kShareOfShape = 0.4;
  constexpr double kMostSpread = 0.6;  // [m]
  constexpr double kKnown = 2.0;  // [s]
  const double held = std::min(t, kKnown);
  const double own = kShareOfTrack * prices.position_std;
  const double tracked =
    own * own + person.place_variance + person.velocity_variance * held * held;
  const double known = std::min(std::sqrt(tracked), kMostSpread);
  return known + kShareOfShape * prices.position_std + prices.drift_std * t;
}

// What a counted contact costs [USD] at a closing speed [m/s], by linear interpolation.
inline double contact_cost(double closing, const std::vector<double> & contact_usd)
{
  const auto last = static_cast<double>(contact_usd.size() - 1);
  const double place = std::min(std::max(closing, 0.0), last);
  const std::size_t i = std::min(static_cast<std::size_t>(place), contact_usd.size() - 2);
  return contact_usd[i] + (place - static_cast<double>(i)) * (contact_usd[i + 1] - contact_usd[i]);
}

// What touching somebody costs [USD] at a predicted closing speed [m/s].
inline double touch_price(double closing, const ContactPrices & prices)
{
  const double counted = chance((prices.counted_speed - closing) / prices.speed_std);
  const double speed = std::max(closing, prices.counted_speed);
  return prices.touch_usd + counted * contact_cost(speed, prices.contact_usd);
}

// Distance from a box about the origin to a point, negative inside, and its direction.
struct Gap
{
  double distance;  // [m]
  double nx;
  double ny;
};

inline Gap gap_to(double rx, double ry, const RobotBox & body)
{
  constexpr double kTouching = 1e-6;  // [m]
  const double ex = std::abs(rx) - body.half_length;
  const double ey = std::abs(ry) - body.half_width;
  const double ax = std::max(ex, 0.0);
  const double ay = std::max(ey, 0.0);
  const double gap = std::sqrt(ax * ax + ay * ay);
  if (gap > kTouching) {
    return {gap, std::copysign(ax, rx) / gap, std::copysign(ay, ry) / gap};
  }
  if (ey > ex) {
    return {ey, 0.0, std::copysign(1.0, ry)};
  }
  return {ex, std::copysign(1.0, rx), 0.0};
}

// Expected cost [USD] of touching one person, t [s] from now, with the robot in a state.
inline double expected_contact(
  const State & state, double t, const Person & person, const RobotBox & body,
  const ContactPrices & prices)
{
  constexpr double kUnlikely = 4.0;  // standard deviations
  const double cosine = std::cos(state.yaw);
  const double sine = std::sin(state.yaw);
  const double dx = person.x + t * person.vx - state.x;
  const double dy = person.y + t * person.vy - state.y;
  const double rx = cosine * dx + sine * dy - body.centre;
  const double ry = cosine * dy - sine * dx;
  const Gap gap = gap_to(rx, ry, body);
  const double std = spread_at(person, t, prices);
  const double free = gap.distance - person.radius;
  if (free > kUnlikely * std) {
    return 0.0;
  }
  const double px =
    std::min(std::max(rx, -body.half_length), body.half_length) + body.centre;
  const double py = std::min(std::max(ry, -body.half_width), body.half_width);
  const double along = cosine * person.vx + sine * person.vy;
  const double across = cosine * person.vy - sine * person.vx;
  const double closing = (state.v - state.omega * py - along) * gap.nx +
    (state.omega * px - across) * gap.ny;
  return chance(free / std) * touch_price(closing, prices);
}

// Expected cost [USD] of the contacts on a trajectory whose states are step [s] apart, the first
// one start [s] from now: for each person the worst moment counts.
inline double expected_contacts(
  const std::vector<State> & trajectory, double step, const std::vector<Person> & people,
  const RobotBox & body, const ContactPrices & prices, double start = 0.0)
{
  double cost = 0.0;
  for (const Person & person : people) {
    double worst = 0.0;
    for (std::size_t k = 0; k < trajectory.size(); ++k) {
      const double t = start + static_cast<double>(k) * step;
      worst = std::max(worst, expected_contact(trajectory[k], t, person, body, prices));
    }
    cost += worst;
  }
  return cost;
}

}  // namespace nav2_contact_critic

#endif  // NAV2_CONTACT_CRITIC__CONTACT_RISK_HPP_
