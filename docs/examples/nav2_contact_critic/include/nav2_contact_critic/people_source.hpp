// SPDX-License-Identifier: Apache-2.0
// The tracked people of a topic, in the frame of the costmap. Not compiled in this repository.
#ifndef NAV2_CONTACT_CRITIC__PEOPLE_SOURCE_HPP_
#define NAV2_CONTACT_CRITIC__PEOPLE_SOURCE_HPP_

#include <algorithm>
#include <cmath>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "nav2_contact_critic/contact_risk.hpp"
#include "nav2_costmap_2d/costmap_2d_ros.hpp"
#include "nav2_dynamic_msgs/msg/obstacle_array.hpp"
#include "rclcpp/rclcpp.hpp"

namespace nav2_contact_critic
{

// Keeps the newest message, whose frame must be the costmap's; others are left out with a warning.
class PeopleSource
{
public:
  template<typename NodePtr>
  PeopleSource(const NodePtr & node, const std::string & topic, const std::string & frame)
  : clock_(node->get_clock()), logger_(node->get_logger()), topic_(topic), frame_(frame)
  {
    using Message = nav2_dynamic_msgs::msg::ObstacleArray;
    subscription_ = node->template create_subscription<Message>(
      topic, rclcpp::SensorDataQoS(), [this](const Message::ConstSharedPtr message) {
        const std::lock_guard<std::mutex> lock(mutex_);
        message_ = message;
      });
  }

  // The people now; none, with a warning, where the last message is older than stale [s], or as far
  // ahead.
  std::vector<Person> people(double stale = 0.5)
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    std::vector<Person> found;
    if (!message_) {
      RCLCPP_WARN_THROTTLE(
        logger_, *clock_, 5000, "no people on %s so far: contacts are not priced", topic_.c_str());
      return found;
    }
    if (message_->header.frame_id != frame_) {
      RCLCPP_WARN_THROTTLE(
        logger_, *clock_, 5000, "people in frame %s, the costmap is in %s: not looked at",
        message_->header.frame_id.c_str(), frame_.c_str());
      return found;
    }
    const double age = (clock_->now() - rclcpp::Time(message_->header.stamp)).seconds();
    if (std::abs(age) > stale) {
      RCLCPP_WARN_THROTTLE(
        logger_, *clock_, 5000, "people on %s are %.2f s old: not looked at; do the clocks agree?",
        topic_.c_str(), age);
      return found;
    }
    const double passed = std::max(age, 0.0);
    for (const auto & each : message_->obstacles) {
      Person person;
      person.vx = each.velocity.x;
      person.vy = each.velocity.y;
      person.x = each.position.x + passed * person.vx;
      person.y = each.position.y + passed * person.vy;
      person.radius = 0.5 * std::max(each.size.x, each.size.y);
      found.push_back(person);
    }
    return found;
  }

private:
  rclcpp::Clock::SharedPtr clock_;
  rclcpp::Logger logger_;
  std::string topic_;
  std::string frame_;
  std::mutex mutex_;
  nav2_dynamic_msgs::msg::ObstacleArray::ConstSharedPtr message_;
  rclcpp::Subscription<nav2_dynamic_msgs::msg::ObstacleArray>::SharedPtr subscription_;
};

// The nearest of some people within a range [m] of a place, at most so many of them.
inline std::vector<Person> nearest(
  std::vector<Person> people, double x, double y, int most, double range)
{
  const auto distance = [&](const Person & each) {return std::hypot(each.x - x, each.y - y);};
  const auto is_far = [&](const Person & each) {return distance(each) > range;};
  people.erase(std::remove_if(people.begin(), people.end(), is_far), people.end());
  std::sort(
    people.begin(), people.end(), [&](const Person & one, const Person & other) {
      return distance(one) < distance(other);
    });
  people.resize(std::min<std::size_t>(people.size(), std::max(most, 0)));
  return people;
}

// The bounding box of a footprint in the base frame.
template<typename Points>
RobotBox box_of(const Points & footprint)
{
  double left = footprint.front().x, right = left, low = footprint.front().y, high = low;
  for (const auto & point : footprint) {
    left = std::min<double>(left, point.x);
    right = std::max<double>(right, point.x);
    low = std::min<double>(low, point.y);
    high = std::max<double>(high, point.y);
  }
  return {0.5 * (left + right), 0.5 * (right - left), 0.5 * (high - low)};
}

}  // namespace nav2_contact_critic

#endif  // NAV2_CONTACT_CRITIC__PEOPLE_SOURCE_HPP_
