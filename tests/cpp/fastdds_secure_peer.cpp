// A stranger on Fast DDS with DDS Security as rmw_fastrtps sets it up, over the loopback interface.
//
//     fastdds_secure_peer DOMAIN ENCLAVE listen TOPIC TYPE COUNT   prints COUNT messages, as CDR in hexadecimal
//     fastdds_secure_peer DOMAIN ENCLAVE latched TOPIC TYPE COUNT  the same, reliably, and what was published before
//     fastdds_secure_peer DOMAIN ENCLAVE send TOPIC TYPE FILE      publishes the CDR in a file, until it is acknowledged
//
// ENCLAVE is the directory with its files, or "none"; TOPIC and TYPE are DDS's: rt/chatter, std_msgs::msg::dds_::String_.
// Says "joined", then "matched" on standard error. Exits with 1 after 20 s without a match or a message.
//
// Needs Debian's libfastrtps-dev 2.9:  g++ -O1 -o fastdds_secure_peer fastdds_secure_peer.cpp -lfastrtps -lfastcdr

#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <iterator>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include <fastdds/dds/domain/DomainParticipant.hpp>
#include <fastdds/dds/domain/DomainParticipantFactory.hpp>
#include <fastdds/dds/domain/DomainParticipantListener.hpp>
#include <fastdds/dds/log/Log.hpp>
#include <fastdds/dds/publisher/DataWriter.hpp>
#include <fastdds/dds/publisher/Publisher.hpp>
#include <fastdds/dds/subscriber/DataReader.hpp>
#include <fastdds/dds/subscriber/SampleInfo.hpp>
#include <fastdds/dds/subscriber/Subscriber.hpp>
#include <fastdds/dds/topic/TopicDataType.hpp>
#include <fastdds/rtps/transport/UDPv4TransportDescriptor.h>
#include <fastrtps/utils/IPLocator.h>

using namespace eprosima::fastdds::dds;
using eprosima::fastrtps::rtps::InstanceHandle_t;
using eprosima::fastrtps::rtps::IPLocator;
using eprosima::fastrtps::rtps::Locator_t;
using eprosima::fastrtps::rtps::ParticipantAuthenticationInfo;
using eprosima::fastrtps::rtps::ParticipantDiscoveryInfo;
using eprosima::fastrtps::rtps::SerializedPayload_t;
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
        m_typeSize = 200000;
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

// Says what becomes of others.
class Reporter : public DomainParticipantListener {
public:
    void on_participant_discovery(DomainParticipant*, ParticipantDiscoveryInfo&& info) override {
        std::fprintf(stderr, "participant: status %d\n", static_cast<int>(info.status));
    }
    void onParticipantAuthentication(DomainParticipant*, ParticipantAuthenticationInfo&& info) override {
        const bool authorized = info.status == ParticipantAuthenticationInfo::AUTHORIZED_PARTICIPANT;
        std::fprintf(stderr, "%s\n", authorized ? "authenticated" : "refused");
    }
};

DomainParticipant* join(uint32_t domain, const std::string& enclave, Reporter& reporter) {
    DomainParticipantQos qos = PARTICIPANT_QOS_DEFAULT;
    auto transport = std::make_shared<eprosima::fastdds::rtps::UDPv4TransportDescriptor>();
    transport->interfaceWhiteList.push_back("127.0.0.1");
    qos.transport().use_builtin_transports = false;
    qos.transport().user_transports.push_back(transport);
    Locator_t peer;
    peer.kind = LOCATOR_KIND_UDPv4;
    IPLocator::setIPv4(peer, 127, 0, 0, 1);
    qos.wire_protocol().builtin.initialPeersList.push_back(peer);
    if (enclave != "none") {
        auto& properties = qos.properties().properties();
        const auto set = [&](const char* name, const std::string& value) { properties.emplace_back(name, value); };
        const std::string file = "file://" + enclave + "/";
        const std::string identity = "dds.sec.auth.builtin.PKI-DH.";
        const std::string access = "dds.sec.access.builtin.Access-Permissions.";
        set("dds.sec.auth.plugin", "builtin.PKI-DH");
        set((identity + "identity_ca").c_str(), file + "identity_ca.cert.pem");
        set((identity + "identity_certificate").c_str(), file + "cert.pem");
        set((identity + "private_key").c_str(), file + "key.pem");
        set("dds.sec.crypto.plugin", "builtin.AES-GCM-GMAC");
        set("dds.sec.access.plugin", "builtin.Access-Permissions");
        set((access + "permissions_ca").c_str(), file + "permissions_ca.cert.pem");
        set((access + "governance").c_str(), file + "governance.p7s");
        set((access + "permissions").c_str(), file + "permissions.p7s");
    }
    return DomainParticipantFactory::get_instance()->create_participant(domain, qos, &reporter, StatusMask::none());
}

template <typename Condition>
void wait_for(const char* what, Condition condition) {
    const auto deadline = Clock::now() + patience;
    while (!condition()) {
        if (Clock::now() > deadline) {
            std::fprintf(stderr, "fastdds_secure_peer: %s\n", what);
            Log::Flush();
            std::_Exit(1);
        }
        std::this_thread::sleep_for(cycle);
    }
}

void listen(DomainParticipant* participant, Topic* topic, int count, bool latched) {
    DataReaderQos qos = DATAREADER_QOS_DEFAULT;
    qos.history().kind = KEEP_ALL_HISTORY_QOS;
    if (latched) {
        qos.reliability().kind = RELIABLE_RELIABILITY_QOS;
        qos.durability().kind = TRANSIENT_LOCAL_DURABILITY_QOS;
    }
    qos.endpoint().history_memory_policy = eprosima::fastrtps::rtps::PREALLOCATED_WITH_REALLOC_MEMORY_MODE;
    auto* reader = participant->create_subscriber(SUBSCRIBER_QOS_DEFAULT)->create_datareader(topic, qos);
    wait_for("no publisher found", [&] {
        SubscriptionMatchedStatus status;
        reader->get_subscription_matched_status(status);
        return status.current_count > 0;
    });
    std::fprintf(stderr, "matched\n");
    for (int index = 0; index < count; ++index) {
        Bytes bytes;
        SampleInfo info;
        wait_for("no message", [&] {
            return reader->take_next_sample(&bytes, &info) == ReturnCode_t::RETCODE_OK && info.valid_data;
        });
        for (unsigned char byte : bytes) std::printf("%02x", byte);
        std::printf("\n");
        std::fflush(stdout);
    }
}

void send(DomainParticipant* participant, Topic* topic, const char* path) {
    DataWriterQos qos = DATAWRITER_QOS_DEFAULT;
    qos.reliability().kind = RELIABLE_RELIABILITY_QOS;
    qos.durability().kind = TRANSIENT_LOCAL_DURABILITY_QOS;
    qos.endpoint().history_memory_policy = eprosima::fastrtps::rtps::PREALLOCATED_WITH_REALLOC_MEMORY_MODE;
    auto* writer = participant->create_publisher(PUBLISHER_QOS_DEFAULT)->create_datawriter(topic, qos);
    wait_for("no subscription found", [&] {
        PublicationMatchedStatus status;
        writer->get_publication_matched_status(status);
        return status.current_count > 0;
    });
    std::fprintf(stderr, "matched\n");
    std::ifstream file(path, std::ios::binary);
    Bytes bytes{std::istreambuf_iterator<char>(file), {}};
    writer->write(&bytes);
    wait_for("no acknowledgment",
             [&] { return writer->wait_for_acknowledgments({0, 100000000}) == ReturnCode_t::RETCODE_OK; });
}

}  // namespace

int main(int argc, char** argv) {
    if (argc != 7) {
        std::fprintf(stderr, "usage: fastdds_secure_peer DOMAIN ENCLAVE listen|latched|send TOPIC TYPE COUNT|FILE\n");
        return 2;
    }
    Reporter reporter;
    auto* participant = join(static_cast<uint32_t>(std::atoi(argv[1])), argv[2], reporter);
    if (participant == nullptr) {
        std::fprintf(stderr, "fastdds_secure_peer: cannot join\n");
        return 3;
    }
    std::fprintf(stderr, "joined\n");
    TypeSupport support(new Raw(argv[5]));
    support.register_type(participant);
    auto* topic = participant->create_topic(argv[4], argv[5], TOPIC_QOS_DEFAULT);
    if (std::strcmp(argv[3], "send") == 0) {
        send(participant, topic, argv[6]);
    } else {
        listen(participant, topic, std::atoi(argv[6]), std::strcmp(argv[3], "latched") == 0);
    }
    participant->set_listener(nullptr);
    participant->delete_contained_entities();
    DomainParticipantFactory::get_instance()->delete_participant(participant);
    return 0;
}
