//! Mutual TLS and access control, by Zenoh's own configuration: certificates are made here.

use std::{path::Path, process::Command, time::Duration};

use crate::common::{Router, connected, node};
use lgvi_middleware::{
    Environment,
    ros::{Publisher, Qos, Subscription},
};
use lgvi_msgs::std_msgs;
use tempfile::TempDir;

const PATIENCE: Duration = Duration::from_secs(20);
const TOPIC: &str = "/command";

/// Keys and certificates of one authority.
struct Authority<'d> {
    directory: &'d Path,
    name: &'static str,
}

fn openssl(directory: &Path, arguments: &str) {
    let output = Command::new("openssl")
        .args(arguments.split_whitespace())
        .current_dir(directory)
        .output()
        .expect("openssl, which is needed for certificates");
    let error = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "openssl {arguments}: {error}");
}

impl<'d> Authority<'d> {
    fn new(directory: &'d Path, name: &'static str) -> Self {
        let new = format!(
            "req -x509 -newkey ec -pkeyopt ec_paramgen_curve:prime256v1 -nodes -days 2 -subj /CN={name} -keyout {name}.key -out {name}.pem"
        );
        openssl(directory, &new);
        Self { directory, name }
    }

    /// A certificate of this authority for a node or a router on this host.
    fn sign(&self, name: &str) {
        let ca = self.name;
        let request = format!(
            "req -newkey ec -pkeyopt ec_paramgen_curve:prime256v1 -nodes -subj /CN={name} -addext subjectAltName=DNS:localhost -keyout {name}.key -out {name}.csr"
        );
        openssl(self.directory, &request);
        let sign = format!(
            "x509 -req -in {name}.csr -CA {ca}.pem -CAkey {ca}.key -CAcreateserial -days 2 -copy_extensions copy -out {name}.pem"
        );
        openssl(self.directory, &sign);
    }
}

/// A router that takes holders of the authority's certificates only; `rules` say what they may.
fn router(directory: &Path, rules: &[(&str, &str)]) -> Router {
    let authority = Authority::new(directory, "authority");
    for name in ["router", "commander", "observer"] {
        authority.sign(name);
    }
    Authority::new(directory, "other").sign("stranger");
    let file = |name: &str| directory.join(name).display().to_string();
    let tls = format!(
        "{{root_ca_certificate: {:?}, listen_certificate: {:?}, listen_private_key: {:?}, enable_mtls: true}}",
        file("authority.pem"),
        file("router.pem"),
        file("router.key")
    );
    let mut settings = vec![
        ("listen/endpoints", "[\"tls/localhost:0\"]"),
        ("transport/link/tls", tls.as_str()),
    ];
    settings.extend(rules);
    Router::start(&settings)
}

/// The environment of a node with a certificate; as a client it has no way but the router.
fn holder(directory: &Path, router: &Router, name: &str, authority: &str) -> Environment {
    let port = router.endpoint.rsplit_once(':').unwrap().1;
    let file = |name: String| directory.join(name).display().to_string();
    let tls = format!(
        "mode=\"client\";transport/link/tls={{root_ca_certificate: {:?}, connect_certificate: {:?}, connect_private_key: {:?}, enable_mtls: true}}",
        file(format!("{authority}.pem")),
        file(format!("{name}.pem")),
        file(format!("{name}.key"))
    );
    connected(7, &format!("tls/localhost:{port}"), &tls)
}

fn text(data: &str) -> std_msgs::String {
    std_msgs::String { data: data.into() }
}

fn publisher(environment: &Environment, name: &str) -> Publisher<std_msgs::String> {
    let qos = Qos::reliable(10);
    node(name, environment).publisher(TOPIC, &qos).unwrap()
}

fn subscription(environment: &Environment, name: &str) -> Subscription<std_msgs::String> {
    let qos = Qos::reliable(10);
    node(name, environment).subscription(TOPIC, &qos).unwrap()
}

fn next(subscription: &Subscription<std_msgs::String>) -> std_msgs::String {
    let sample = subscription.recv_timeout(PATIENCE).unwrap();
    sample.expect("a message in time").message
}

#[test]
fn who_has_no_certificate_of_the_authority_neither_hears_nor_is_heard() {
    let directory = TempDir::new().unwrap();
    let directory = directory.path();
    let router = router(directory, &[]);
    let good = |name| holder(directory, &router, name, "authority");
    let flight = subscription(&good("commander"), "flight");
    let commander = publisher(&good("commander"), "commander");
    assert!(commander.wait_for_subscriptions(1, PATIENCE));

    // One cannot join at all with a certificate of somebody else, or with none.
    let strangers = [
        holder(directory, &router, "stranger", "authority"),
        holder(directory, &router, "stranger", "other"),
        connected(
            7,
            &router.endpoint.replace("tls/", "tcp/"),
            "mode=\"client\"",
        ),
    ];
    for stranger in strangers {
        let (args, _) = lgvi_middleware::NodeArgs::parse("stranger", []).unwrap();
        assert!(lgvi_middleware::ros::RosNode::new(&args, &stranger).is_err());
    }
    commander.publish(&text("go")).unwrap();
    assert_eq!(next(&flight), text("go"));
    assert_eq!(flight.received(), 1);
}

/// The observer may subscribe; what it publishes goes nowhere.
#[test]
fn who_may_only_observe_commands_nothing() {
    let directory = TempDir::new().unwrap();
    let directory = directory.path();
    let rules = r#"{
        enabled: true,
        default_permission: "deny",
        rules: [
            {id: "all", permission: "allow", flows: ["ingress", "egress"], key_exprs: ["**", "**/@adv/**", "@ros2_lv/**"],
             messages: ["put", "delete", "declare_subscriber", "query", "reply", "declare_queryable",
                        "liveliness_token", "liveliness_query", "declare_liveliness_subscriber"]},
            {id: "observe", permission: "allow", flows: ["ingress"], key_exprs: ["**", "**/@adv/**", "@ros2_lv/**"],
             messages: ["declare_subscriber", "query", "liveliness_token", "liveliness_query",
                        "declare_liveliness_subscriber"]},
            {id: "hear", permission: "allow", flows: ["egress"], key_exprs: ["**", "**/@adv/**", "@ros2_lv/**"],
             messages: ["put", "delete", "reply", "declare_subscriber", "declare_queryable", "query",
                        "liveliness_token", "liveliness_query", "declare_liveliness_subscriber"]},
        ],
        subjects: [
            {id: "commander", cert_common_names: ["commander"]},
            {id: "observer", cert_common_names: ["observer"]},
        ],
        policies: [
            {rules: ["all"], subjects: ["commander"]},
            {rules: ["observe", "hear"], subjects: ["observer"]},
        ],
    }"#;
    let router = router(directory, &[("access_control", rules)]);
    let good = |name| holder(directory, &router, name, "authority");
    let flight = subscription(&good("commander"), "flight");
    let commander = publisher(&good("commander"), "commander");
    let observed = subscription(&good("observer"), "listener");
    let observer = publisher(&good("observer"), "observer");
    assert!(commander.wait_for_subscriptions(2, PATIENCE));
    assert!(observer.wait_for_subscriptions(2, PATIENCE));
    for _ in 0..10 {
        observer.publish(&text("stop")).unwrap();
    }
    commander.publish(&text("go")).unwrap();
    assert_eq!(next(&observed), text("go"));
    assert_eq!(next(&flight), text("go"));
    // A second exchange, after which what the observer has sent would be there.
    commander.publish(&text("on")).unwrap();
    assert_eq!(next(&flight), text("on"));
    assert_eq!(flight.received(), 2);
}
