// SPDX-License-Identifier: Apache-2.0
// Expected contacts as a critic of MPPI (Nav2 Jazzy, whose trajectories are xtensor arrays).
// Written from Nav2's documentation and interface; neither compiled nor run here.
#include <algorithm>
#include <cmath>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

#include "nav2_contact_critic/contact_risk.hpp"
#include "nav2_contact_critic/people_source.hpp"
#include "nav2_mppi_controller/critic_function.hpp"
#include "pluginlib/class_list_macros.hpp"

// MPPI looks for its critics in this namespace only.
namespace mppi::critics
{

using nav2_contact_critic::ContactPrices;
using nav2_contact_critic::nearest;
using nav2_contact_critic::PeopleSource;
using nav2_contact_critic::RobotBox;
using nav2_contact_critic::State;

class ExpectedContactCritic : public mppi::critics::CriticFunction
{
public:
  void initialize() override
  {
    auto get = parameters_handler_->getParamGetter(name_);
    get(power_, "cost_power", 1);
    get(weight_, "cost_weight", 1.0);
    get(every_, "trajectory_point_step", 4);
    get(topic_, "people_topic", std::string("tracked_people"));
    get(max_tracks_, "max_tracks", 5);
    get(range_, "range", 8.0);
    get(prices_.contact_usd, "contact_usd", prices_.contact_usd);
    get(prices_.counted_speed, "counted_speed", prices_.counted_speed);
    get(prices_.speed_std, "speed_std", prices_.speed_std);
    get(prices_.touch_usd, "touch_usd", prices_.touch_usd);
    get(prices_.position_std, "position_std", prices_.position_std);
    get(prices_.drift_std, "drift_std", prices_.drift_std);
    const std::string why = nav2_contact_critic::refusal(prices_);
    if (!why.empty()) {
      throw std::runtime_error(name_ + ": " + why);
    }
    if (every_ < 1) {
      throw std::runtime_error(name_ + ": trajectory_point_step must be 1 or more");
    }
    power_ = std::max(power_, 1U);  // 0 is as 1, or every trajectory would cost the same
    const std::string frame = costmap_ros_->getGlobalFrameID();
    source_ = std::make_unique<PeopleSource>(parent_.lock(), topic_, frame);
  }

  void score(mppi::CriticData & data) override
  {
    if (!enabled_) {
      return;
    }
    const auto & state = data.state;
    const auto & place = state.pose.pose.position;
    const auto people = nearest(source_->people(), place.x, place.y, max_tracks_, range_);
    if (people.empty()) {
      return;
    }
    const auto & paths = data.trajectories;
    const RobotBox body = nav2_contact_critic::box_of(costmap_ros_->getRobotFootprint());
    const auto batch = paths.x.shape(0);
    const auto length = paths.x.shape(1);
    std::vector<State> states;
    for (std::size_t i = 0; i < batch; ++i) {
      states.clear();
      for (std::size_t k = 0; k < length; k += every_) {
        states.push_back(
          {paths.x(i, k), paths.y(i, k), paths.yaws(i, k), state.vx(i, k), state.wz(i, k)});
      }
      // the first pose is a step from now
      const double usd =
        expected_contacts(states, every_ * data.model_dt, people, body, prices_, data.model_dt);
      data.costs(i) += static_cast<float>(std::pow(weight_ * usd, power_));
    }
  }

private:
  unsigned int power_{1};
  float weight_{1.0F};  // [1/USD]
  int every_{4};  // poses
  int max_tracks_{5};
  double range_{8.0};  // [m]
  std::string topic_;
  ContactPrices prices_;
  std::unique_ptr<PeopleSource> source_;
};

}  // namespace mppi::critics

PLUGINLIB_EXPORT_CLASS(
  mppi::critics::ExpectedContactCritic, mppi::critics::CriticFunction)
