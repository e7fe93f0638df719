// SPDX-License-Identifier: Apache-2.0
// Expected contacts as a critic of DWB (Nav2 Jazzy). Written from Nav2's documentation and
// interface; neither compiled nor run here.
#include <algorithm>
#include <cmath>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

#include "dwb_core/trajectory_critic.hpp"
#include "nav2_contact_critic/contact_risk.hpp"
#include "nav2_contact_critic/people_source.hpp"
#include "nav2_util/node_utils.hpp"
#include "pluginlib/class_list_macros.hpp"

namespace nav2_contact_critic
{

class ExpectedContactCritic : public dwb_core::TrajectoryCritic
{
public:
  void onInit() override
  {
    const auto node = node_.lock();
    const std::string prefix = dwb_plugin_name_ + "." + name_ + ".";
    const auto get = [&](const std::string & name, auto & value) {
        nav2_util::declare_parameter_if_not_declared(
          node, prefix + name, rclcpp::ParameterValue(value));
        node->get_parameter(prefix + name, value);
      };
    get("people_topic", topic_);
    get("max_tracks", max_tracks_);
    get("range", range_);
    node->get_parameter(dwb_plugin_name_ + ".sim_time", sim_time_);
    get("contact_usd", prices_.contact_usd);
    get("counted_speed", prices_.counted_speed);
    get("speed_std", prices_.speed_std);
    get("touch_usd", prices_.touch_usd);
    get("position_std", prices_.position_std);
    get("drift_std", prices_.drift_std);
    const std::string why = refusal(prices_);
    if (!why.empty()) {
      throw std::runtime_error(prefix + " " + why);
    }
    source_ = std::make_unique<PeopleSource>(node, topic_, costmap_ros_->getGlobalFrameID());
  }

  bool prepare(
    const geometry_msgs::msg::Pose2D & pose, const nav_2d_msgs::msg::Twist2D &,
    const geometry_msgs::msg::Pose2D &, const nav_2d_msgs::msg::Path2D &) override
  {
    people_ = nearest(source_->people(), pose.x, pose.y, max_tracks_, range_);
    body_ = box_of(costmap_ros_->getRobotFootprint());
    return true;
  }

  // Expected cost [USD]; DWB multiplies it by the parameter scale [1/USD].
  double scoreTrajectory(const dwb_msgs::msg::Trajectory2D & trajectory) override
  {
    const auto & poses = trajectory.poses;
    if (people_.empty() || poses.empty()) {
      return 0.0;
    }
    double step = sim_time_;
    std::vector<State> states;
    const auto & velocity = trajectory.velocity;
    const double fastest =
      std::max({std::abs(velocity.x), std::abs(velocity.y), std::abs(velocity.theta)});
    if (fastest < STANDS) {
      // a trajectory that stands has too few poses to see who comes
      const auto periods = std::max(1.0, std::ceil(sim_time_ / LOOK));
      const auto & pose = poses.front();
      states.assign(
        static_cast<std::size_t>(periods) + 1, State{pose.x, pose.y, pose.theta, 0.0, 0.0});
      return expected_contacts(states, sim_time_ / periods, people_, body_, prices_);
    }
    if (trajectory.time_offsets.size() > 1) {
      step = (rclcpp::Duration(trajectory.time_offsets[1]) -
        rclcpp::Duration(trajectory.time_offsets[0])).seconds();
    }
    states.reserve(poses.size());
    for (const auto & pose : poses) {
      states.push_back(
        {pose.x, pose.y, pose.theta, trajectory.velocity.x, trajectory.velocity.theta});
    }
    return expected_contacts(states, step, people_, body_, prices_);
  }

private:
  static constexpr double STANDS = 1e-6;  // [m/s], [rad/s] what samples of zero come to
  static constexpr double LOOK = 0.1;  // [s] at most between two looks, of a robot that stands
  std::string topic_{"tracked_people"};
  int max_tracks_{5};
  double range_{8.0};  // [m]
  double sim_time_{1.7};  // [s] DWB's
  ContactPrices prices_;
  RobotBox body_;
  std::vector<Person> people_;
  std::unique_ptr<PeopleSource> source_;
};

}  // namespace nav2_contact_critic

PLUGINLIB_EXPORT_CLASS(nav2_contact_critic::ExpectedContactCritic, dwb_core::TrajectoryCritic)
