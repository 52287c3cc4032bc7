// Prints time, position and angular velocity of the spacecraft: C++ and Fast DDS, without ROS and without any code of lgvi.
//
//     apt-get install g++ libfastrtps-dev libfastcdr-dev
//     g++ -std=c++17 -O1 -o watch_odometry examples/cpp_fast_dds/watch_odometry.cpp -lfastrtps -lfastcdr
//     ./watch_odometry 101                                                                  # messages to wait for
//     cargo run --release -- run scenes/inclination_change.toml --real-time-factor 0.2      # in another terminal
//
// Without a number it goes on until Ctrl-C. For Fast DDS 2.9, Debian 12's; no code is generated.

#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <memory>
#include <string>
#include <thread>

#include <fastcdr/Cdr.h>
#include <fastdds/dds/domain/DomainParticipant.hpp>
#include <fastdds/dds/domain/DomainParticipantFactory.hpp>
#include <fastdds/dds/subscriber/DataReader.hpp>
#include <fastdds/dds/subscriber/SampleInfo.hpp>
#include <fastdds/dds/subscriber/Subscriber.hpp>
#include <fastdds/dds/topic/TopicDataType.hpp>
#include <fastdds/rtps/transport/UDPv4TransportDescriptor.h>
#include <fastrtps/utils/IPLocator.h>

using namespace eprosima::fastdds::dds;
namespace cdr = eprosima::fastcdr;
namespace rtps = eprosima::fastrtps::rtps;

// nav_msgs/msg/Odometry without its covariances.
struct Odometry {
    int32_t sec;
    uint32_t nanosec;
    std::string frame_id;
    std::string child_frame_id;
    double position[3];          // inertial frame (m)
    double orientation[4];       // body to inertial: x, y, z, w
    double linear_velocity[3];   // body frame (m/s)
    double angular_velocity[3];  // body frame (rad/s)
};

// Reads it from CDR. A ROS type package/msg/Type is called package::msg::dds_::Type_ in DDS.
class OdometryType : public TopicDataType {
public:
    OdometryType() {
        setName("nav_msgs::msg::dds_::Odometry_");
        m_typeSize = 4096;
        m_isGetKeyDefined = false;
    }
    bool deserialize(rtps::SerializedPayload_t* payload, void* data) override {
        auto& odometry = *static_cast<Odometry*>(data);
        double covariance[36];
        try {
            cdr::FastBuffer buffer(reinterpret_cast<char*>(payload->data), payload->length);
            cdr::Cdr in(buffer, cdr::Cdr::DEFAULT_ENDIAN, cdr::Cdr::DDS_CDR);
            in.read_encapsulation();
            in >> odometry.sec >> odometry.nanosec >> odometry.frame_id >> odometry.child_frame_id;
            in.deserializeArray(odometry.position, 3).deserializeArray(odometry.orientation, 4);
            in.deserializeArray(covariance, 36);
            in.deserializeArray(odometry.linear_velocity, 3).deserializeArray(odometry.angular_velocity, 3);
            in.deserializeArray(covariance, 36);
        } catch (const cdr::exception::Exception&) {
            return false;
        }
        return true;
    }
    void* createData() override { return new Odometry(); }
    void deleteData(void* data) override { delete static_cast<Odometry*>(data); }
    bool serialize(void*, rtps::SerializedPayload_t*) override { return false; }  // nothing is sent
    std::function<uint32_t()> getSerializedSizeProvider(void*) override { return [] { return 0u; }; }
    bool getKey(void*, rtps::InstanceHandle_t*, bool) override { return false; }
};

// The loopback interface alone, as `lgvi run` has it. With PARTICIPANT_QOS_DEFAULT it talks to other hosts too.
DomainParticipant* join(uint32_t domain) {
    DomainParticipantQos qos = PARTICIPANT_QOS_DEFAULT;
    auto transport = std::make_shared<eprosima::fastdds::rtps::UDPv4TransportDescriptor>();
    transport->interfaceWhiteList.push_back("127.0.0.1");
    qos.transport().use_builtin_transports = false;
    qos.transport().user_transports.push_back(transport);
    rtps::Locator_t peer;
    peer.kind = LOCATOR_KIND_UDPv4;
    rtps::IPLocator::setIPv4(peer, 127, 0, 0, 1);
    qos.wire_protocol().builtin.initialPeersList.push_back(peer);
    return DomainParticipantFactory::get_instance()->create_participant(domain, qos);
}

int main(int argc, char** argv) {
    const long wanted = argc > 1 ? std::strtol(argv[1], nullptr, 10) : 0;
    const char* domain = std::getenv("ROS_DOMAIN_ID");
    DomainParticipant* participant = join(domain ? std::strtoul(domain, nullptr, 10) : 0);
    if (!participant) {
        std::fprintf(stderr, "cannot join the domain\n");
        return 1;
    }
    TypeSupport type(new OdometryType());
    type.register_type(participant);
    // A ROS topic is called rt/... in DDS.
    Topic* topic = participant->create_topic("rt/lgvi_propagator/odometry/spacecraft", type.get_type_name(),
                                             TOPIC_QOS_DEFAULT);
    DataReaderQos qos = DATAREADER_QOS_DEFAULT;
    qos.reliability().kind = RELIABLE_RELIABILITY_QOS;
    qos.durability().kind = TRANSIENT_LOCAL_DURABILITY_QOS;  // from the first sample on, however late we are
    qos.history().kind = KEEP_ALL_HISTORY_QOS;
    DataReader* reader = participant->create_subscriber(SUBSCRIBER_QOS_DEFAULT)->create_datareader(topic, qos);
    std::fprintf(stderr, "listening\n");

    Odometry odometry;
    SampleInfo info;
    for (long received = 0; wanted == 0 || received < wanted;) {
        while (reader->take_next_sample(&odometry, &info) == ReturnCode_t::RETCODE_OK) {
            if (!info.valid_data) continue;
            const double *x = odometry.position, *rate = odometry.angular_velocity;
            std::printf("%d.%09u %.17g %.17g %.17g %.17g %.17g %.17g\n", odometry.sec, odometry.nanosec, x[0], x[1], x[2],
                        rate[0], rate[1], rate[2]);
            ++received;
        }
        std::fflush(stdout);
        std::this_thread::sleep_for(std::chrono::milliseconds(5));
    }
    participant->delete_contained_entities();
    DomainParticipantFactory::get_instance()->delete_participant(participant);
    return 0;
}
