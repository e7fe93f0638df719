// SPDX-License-Identifier: Apache-2.0
// Expected contacts as a critic of DWB (Nav2 Jazzy). Written from Nav2's documentation and
// interface; neither compiled nor run here.
#include <memory>
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
    get("contact_usd", prices_.contact_usd);
    get("counted_speed", prices_.counted_speed);
    get("speed_std", prices_.speed_std);
    get("touch_usd", prices_.touch_usd);
    get("position_std", prices_.position_std);
    get("drift_std", prices_.drift_std);
    source_ = std::make_unique<PeopleSource>(node, topic_, costmap_ros_->getGlobalFrameID());
  }

  bool prepare(
    const geometry_msgs::msg::Pose2D &, const nav_2d_msgs::msg::Twist2D &,
    const geometry_msgs::msg::Pose2D &, const nav_2d_msgs::msg::Path2D &) override
  {
    people_ = source_->people();
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
    double step = 0.0;
    if (trajectory.time_offsets.size() > 1) {
      step = (rclcpp::Duration(trajectory.time_offsets[1]) -
        rclcpp::Duration(trajectory.time_offsets[0])).seconds();
    }
    std::vector<State> states;
    states.reserve(poses.size());
    for (const auto & pose : poses) {
      states.push_back(
        {pose.x, pose.y, pose.theta, trajectory.velocity.x, trajectory.velocity.theta});
    }
    return expected_contacts(states, step, people_, body_, prices_);
  }

private:
  std::string topic_{"people"};
  ContactPrices prices_;
  RobotBox body_;
  std::vector<Person> people_;
  std::unique_ptr<PeopleSource> source_;
};

}  // namespace nav2_contact_critic

PLUGINLIB_EXPORT_CLASS(nav2_contact_critic::ExpectedContactCritic, dwb_core::TrajectoryCritic)
