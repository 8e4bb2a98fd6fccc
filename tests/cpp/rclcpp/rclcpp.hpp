// As much of rclcpp as the listener of docs/interfaces.md uses, declared alone: there is no wheel of
// it. With this the compiler holds the page against the headers that pack_msgs generates.
#pragma once

#include <functional>
#include <memory>
#include <string>

#include <rosidl_runtime_cpp/traits.hpp>

namespace rclcpp
{
void init(int argc, char ** argv);

struct QoS
{
  explicit QoS(std::size_t depth);
  QoS & reliable();
  QoS & transient_local();
};

struct Logger
{
};

struct Node
{
  explicit Node(const std::string & name);
  Logger get_logger() const;

  template<typename Message>
  std::shared_ptr<void> create_subscription(
    const std::string &, const QoS &, std::function<void(const Message &)>)
  {
    static_assert(rosidl_generator_traits::is_message<Message>::value, "a message of ROS");
    return nullptr;
  }
};

void spin(std::shared_ptr<Node> node);
}  // namespace rclcpp

[[gnu::format(printf, 2, 3)]] void told(rclcpp::Logger, const char * format, ...);
#define RCLCPP_INFO told
#define RCLCPP_WARN told
