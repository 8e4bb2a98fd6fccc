// Reads one serialized pack_msgs/msg/PlacementDecision from standard input and prints what it says.
#include <cstdio>
#include <cstring>
#include <iterator>
#include <iostream>
#include <vector>

#include <pack_msgs/msg/placement_decision.hpp>
#include <rmw/rmw.h>
#include <rmw/serialized_message.h>
#include <rosidl_typesupport_cpp/message_type_support.hpp>

int main()
{
  using Decision = pack_msgs::msg::PlacementDecision;
  std::vector<char> bytes{std::istreambuf_iterator<char>(std::cin), {}};
  rcutils_allocator_t allocator = rcutils_get_default_allocator();
  rmw_serialized_message_t serialized = rmw_get_zero_initialized_serialized_message();
  if (rmw_serialized_message_init(&serialized, bytes.size(), &allocator) != RMW_RET_OK) {
    return 2;
  }
  std::memcpy(serialized.buffer, bytes.data(), bytes.size());
  serialized.buffer_length = bytes.size();
  Decision decision;
  const auto * support = rosidl_typesupport_cpp::get_message_type_support_handle<Decision>();
  if (rmw_deserialize(&serialized, support, &decision) != RMW_RET_OK) {
    return 1;
  }
  const auto & order = decision.placement;
  std::printf(
    "%s %s %s %.3f %.3f %.3f %d %zu\n", order.box.id.c_str(), order.bin_id.c_str(),
    order.orientation.c_str(), order.planned_corner.x, order.planned_corner.y,
    order.planned_corner.z, decision.status == Decision::STATUS_REJECT,
    order.box.attributes.size());
  return rmw_serialized_message_fini(&serialized) == RMW_RET_OK ? 0 : 2;
}
