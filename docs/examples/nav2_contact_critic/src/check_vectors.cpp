// SPDX-License-Identifier: Apache-2.0
// Reads situations from standard input and prints the expected cost of each; for the test.
#include <iomanip>
#include <iostream>

#include "nav2_contact_critic/contact_risk.hpp"

using nav2_contact_critic::ContactPrices;
using nav2_contact_critic::Person;
using nav2_contact_critic::RobotBox;
using nav2_contact_critic::State;

int main()
{
  ContactPrices prices;
  RobotBox body;
  std::size_t people_count = 0, states_count = 0;
  double step = 0.0;
  std::cout << std::setprecision(17);
  while (std::cin >> body.centre >> body.half_length >> body.half_width >> step >>
    people_count >> states_count)
  {
    std::vector<Person> people(people_count);
    for (auto & each : people) {
      std::cin >> each.x >> each.y >> each.vx >> each.vy >> each.radius >>
      each.place_variance >> each.velocity_variance;
    }
    std::vector<State> states(states_count);
    for (auto & each : states) {
      std::cin >> each.x >> each.y >> each.yaw >> each.v >> each.omega;
    }
    std::cout << expected_contacts(states, step, people, body, prices) << "\n";
  }
}
