// A stranger that speaks the service mapping of rmw_fastrtps_cpp, over the loopback interface, on Fast DDS alone.
//
//     fastdds_peer DOMAIN client NAME COUNT   calls the service COUNT times, action_msgs/srv/CancelGoal, for all goals
//     fastdds_peer DOMAIN server NAME COUNT   answers COUNT such calls: with the goal that each is about
//
// The client prints the bytes of each reply in hexadecimal. Exits with 1 after 20 s. Written from rmw_fastrtps's rules:
// a request names the client's reader as related sample identity, a reply that reader and the request's number.
//
// Needs Debian's libfastrtps-dev 2.9:  g++ -O1 -o fastdds_peer fastdds_peer.cpp -lfastrtps -lfastcdr

#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include <fastdds/dds/domain/DomainParticipant.hpp>
#include <fastdds/dds/domain/DomainParticipantFactory.hpp>
#include <fastdds/dds/publisher/DataWriter.hpp>
#include <fastdds/dds/publisher/Publisher.hpp>
#include <fastdds/dds/subscriber/DataReader.hpp>
#include <fastdds/dds/subscriber/SampleInfo.hpp>
#include <fastdds/dds/subscriber/Subscriber.hpp>
#include <fastdds/dds/topic/TopicDataType.hpp>
#include <fastdds/rtps/common/WriteParams.h>
#include <fastdds/rtps/transport/UDPv4TransportDescriptor.h>
#include <fastrtps/utils/IPLocator.h>

using namespace eprosima::fastdds::dds;
using eprosima::fastrtps::rtps::GUID_t;
using eprosima::fastrtps::rtps::InstanceHandle_t;
using eprosima::fastrtps::rtps::IPLocator;
using eprosima::fastrtps::rtps::Locator_t;
using eprosima::fastrtps::rtps::SampleIdentity;
using eprosima::fastrtps::rtps::SerializedPayload_t;
using eprosima::fastrtps::rtps::WriteParams;
using Bytes = std::vector<unsigned char>;
using Clock = std::chrono::steady_clock;

namespace {

const auto patience = std::chrono::seconds(20);
const auto cycle = std::chrono::milliseconds(2);

// CDR as it is, encapsulation included.
class Raw : public TopicDataType {
public:
    explicit Raw(const char* name) {
        setName(name);
        m_typeSize = 70000;
        m_isGetKeyDefined = false;
    }
    bool serialize(void* data, SerializedPayload_t* payload) override {
        const auto& bytes = *static_cast<Bytes*>(data);
        std::memcpy(payload->data, bytes.data(), bytes.size());
        payload->length = static_cast<uint32_t>(bytes.size());
        payload->encapsulation = CDR_LE;
        return true;
    }
    bool deserialize(SerializedPayload_t* payload, void* data) override {
        static_cast<Bytes*>(data)->assign(payload->data, payload->data + payload->length);
        return true;
    }
    std::function<uint32_t()> getSerializedSizeProvider(void* data) override {
        return [data] { return static_cast<uint32_t>(static_cast<Bytes*>(data)->size()); };
    }
    void* createData() override { return new Bytes(); }
    void deleteData(void* data) override { delete static_cast<Bytes*>(data); }
    bool getKey(void*, InstanceHandle_t*, bool) override { return false; }
};

DomainParticipant* join(uint32_t domain) {
    DomainParticipantQos qos = PARTICIPANT_QOS_DEFAULT;
    auto transport = std::make_shared<eprosima::fastdds::rtps::UDPv4TransportDescriptor>();
    transport->interfaceWhiteList.push_back("127.0.0.1");
    qos.transport().use_builtin_transports = false;
    qos.transport().user_transports.push_back(transport);
    Locator_t peer;
    peer.kind = LOCATOR_KIND_UDPv4;
    IPLocator::setIPv4(peer, 127, 0, 0, 1);
    qos.wire_protocol().builtin.initialPeersList.push_back(peer);
    return DomainParticipantFactory::get_instance()->create_participant(domain, qos);
}

struct Endpoints {
    DataWriter* writer;
    DataReader* reader;
};

Endpoints endpoints(DomainParticipant* participant, bool client, const std::string& service) {
    const auto topic = [&](const std::string& name, const char* type) {
        TypeSupport support(new Raw(type));
        support.register_type(participant);
        return participant->create_topic(name, type, TOPIC_QOS_DEFAULT);
    };
    auto* requests = topic("rq" + service + "Request", "action_msgs::srv::dds_::CancelGoal_Request_");
    auto* replies = topic("rr" + service + "Reply", "action_msgs::srv::dds_::CancelGoal_Response_");
    DataWriterQos sent = DATAWRITER_QOS_DEFAULT;
    sent.reliability().kind = RELIABLE_RELIABILITY_QOS;
    sent.durability().kind = VOLATILE_DURABILITY_QOS;
    sent.history().depth = 10;
    sent.endpoint().history_memory_policy = eprosima::fastrtps::rtps::PREALLOCATED_WITH_REALLOC_MEMORY_MODE;
    DataReaderQos taken = DATAREADER_QOS_DEFAULT;
    taken.reliability().kind = RELIABLE_RELIABILITY_QOS;
    taken.history().depth = 10;
    taken.endpoint().history_memory_policy = eprosima::fastrtps::rtps::PREALLOCATED_WITH_REALLOC_MEMORY_MODE;
    auto* publisher = participant->create_publisher(PUBLISHER_QOS_DEFAULT);
    auto* subscriber = participant->create_subscriber(SUBSCRIBER_QOS_DEFAULT);
    return {publisher->create_datawriter(client ? requests : replies, sent),
            subscriber->create_datareader(client ? replies : requests, taken)};
}

template <typename Condition>
void wait_for(const char* what, Condition condition) {
    const auto deadline = Clock::now() + patience;
    while (!condition()) {
        if (Clock::now() > deadline) {
            std::fprintf(stderr, "fastdds_peer: %s\n", what);
            std::exit(1);
        }
        std::this_thread::sleep_for(cycle);
    }
}

void find(const Endpoints& ends) {
    wait_for("no peer found", [&] {
        PublicationMatchedStatus published;
        SubscriptionMatchedStatus subscribed;
        ends.writer->get_publication_matched_status(published);
        ends.reader->get_subscription_matched_status(subscribed);
        return published.current_count > 0 && subscribed.current_count > 0;
    });
}

bool take(DataReader* reader, Bytes& bytes, SampleInfo& info) {
    return reader->take_next_sample(&bytes, &info) == ReturnCode_t::RETCODE_OK && info.valid_data;
}

void call(const Endpoints& ends, int count) {
    Bytes request(4 + 24, 0);
    request[1] = 1;
    for (int index = 0; index < count; ++index) {
        WriteParams params;
        params.related_sample_identity().writer_guid() = ends.reader->guid();
        ends.writer->write(&request, params);
        const auto number = params.sample_identity().sequence_number();
        Bytes reply;
        wait_for("no reply", [&] {
            SampleInfo info;
            const auto& related = info.related_sample_identity;
            return take(ends.reader, reply, info) && related.sequence_number() == number &&
                   (related.writer_guid() == ends.reader->guid() || related.writer_guid() == ends.writer->guid());
        });
        for (unsigned char byte : reply) std::printf("%02x", byte);
        std::printf("\n");
        std::fflush(stdout);
    }
}

void serve(const Endpoints& ends, int count) {
    for (int index = 0; index < count; ++index) {
        Bytes request;
        SampleInfo info;
        wait_for("no request", [&] { return take(ends.reader, request, info); });
        SampleIdentity identity = info.sample_identity;
        const GUID_t reader = info.related_sample_identity.writer_guid();
        if (reader != GUID_t::unknown()) identity.writer_guid() = reader;
        // Code 0, and a sequence of one GoalInfo: the request's.
        Bytes reply = {0, 1, 0, 0, 0, 0, 0, 0, 1, 0, 0, 0};
        reply.insert(reply.end(), request.begin() + 4, request.begin() + 28);
        WriteParams params;
        params.related_sample_identity(identity);
        ends.writer->write(&reply, params);
    }
    ends.writer->wait_for_acknowledgments({5, 0});
}

}  // namespace

int main(int argc, char** argv) {
    if (argc != 5) {
        std::fprintf(stderr, "usage: fastdds_peer DOMAIN client|server NAME COUNT\n");
        return 2;
    }
    const bool client = std::strcmp(argv[2], "client") == 0;
    const Endpoints ends = endpoints(join(static_cast<uint32_t>(std::atoi(argv[1]))), client, argv[3]);
    find(ends);
    (client ? call : serve)(ends, std::atoi(argv[4]));
    return 0;
}
