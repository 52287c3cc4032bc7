// A controller in C++: reads the odometry of a body and answers each message with a wrench that stops the rotation.
//
//     source /opt/ros/jazzy/setup.bash        # nothing of lgvi needs to be built: all messages are standard ones
//     export ROS_AUTOMATIC_DISCOVERY_RANGE=LOCALHOST
//     cmake -S examples/cpp_rclcpp -B target/cpp_rclcpp && cmake --build target/cpp_rclcpp
//     target/cpp_rclcpp/detumble_live
//     cargo run --release -- run scenes/free_body.toml --await-wrench body --control-period 0.1     # in another terminal
//
// In a ROS 2 workspace: colcon build --packages-up-to lgvi_examples_rclcpp, ros2 run lgvi_examples_rclcpp detumble_live
//
// The flight waits for each answer: it does not matter how long the controller takes. The name of the body and the gain
// are parameters: --ros-args -p body:=satellite -p gain:=2.0

#include <memory>
#include <string>

#include <geometry_msgs/msg/wrench_stamped.hpp>
#include <nav_msgs/msg/odometry.hpp>
#include <rclcpp/rclcpp.hpp>

using geometry_msgs::msg::WrenchStamped;
using nav_msgs::msg::Odometry;

class Detumble : public rclcpp::Node {
public:
    Detumble() : Node("detumble"), gain_(declare_parameter("gain", 0.5)) {
        const std::string body = declare_parameter("body", "body");
        wrench_ = create_publisher<WrenchStamped>("/lgvi_propagator/wrench/" + body, rclcpp::QoS(10).reliable());
        odometry_ = create_subscription<Odometry>(
            "/lgvi_propagator/odometry/" + body, rclcpp::QoS(1000).reliable(),
            [this](const Odometry& odometry) { answer(odometry); });
    }

private:
    void answer(const Odometry& odometry) {
        WrenchStamped message;
        // The stamp says which state it answers, the frame that torques are in the axes of the body.
        message.header.stamp = odometry.header.stamp;
        message.header.frame_id = odometry.child_frame_id;
        const auto& rate = odometry.twist.twist.angular;
        message.wrench.torque.x = -gain_ * rate.x;
        message.wrench.torque.y = -gain_ * rate.y;
        message.wrench.torque.z = -gain_ * rate.z;
        wrench_->publish(message);
    }

    const double gain_;  // N m s
    rclcpp::Publisher<WrenchStamped>::SharedPtr wrench_;
    rclcpp::Subscription<Odometry>::SharedPtr odometry_;
};

int main(int argc, char** argv) {
    rclcpp::init(argc, argv);
    rclcpp::spin(std::make_shared<Detumble>());
    rclcpp::shutdown();
}
