//! DDS security with a keystore as SROS 2 lays it out, made here.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

#[path = "../suite/common/mod.rs"]
#[allow(dead_code, reason = "the suite has Python peers too")]
mod common;

use std::{
    fs,
    path::{Path, PathBuf},
    process::Command,
    time::Duration,
};

use common::{isolated, node};
use lgvi_middleware::{
    Environment, NodeArgs, SecuritySettings, SecurityStrategy,
    ros::{Publisher, Qos, RosError, RosNode, Subscription},
};
use lgvi_msgs::{
    std_msgs,
    std_srvs::srv::{Trigger, TriggerRequest, TriggerResponse},
};
use tempfile::TempDir;

const PATIENCE: Duration = Duration::from_secs(30);

/// What `ros2 security create_keystore` writes, but for the protection of data, which `docs/security.md` explains: what is
/// sent is encrypted all the same, and nobody unauthenticated may join.
const GOVERNANCE: &str = r#"<?xml version="1.0" encoding="UTF-8"?>
<dds xmlns:xsi="http://www.w3.org/2001/XMLSchema-instance" xsi:noNamespaceSchemaLocation="http://www.omg.org/spec/DDS-SECURITY/20170901/omg_shared_ca_governance.xsd">
  <domain_access_rules>
    <domain_rule>
      <domains><id_range><min>0</min><max>232</max></id_range></domains>
      <allow_unauthenticated_participants>false</allow_unauthenticated_participants>
      <enable_join_access_control>true</enable_join_access_control>
      <discovery_protection_kind>ENCRYPT</discovery_protection_kind>
      <liveliness_protection_kind>ENCRYPT</liveliness_protection_kind>
      <rtps_protection_kind>SIGN</rtps_protection_kind>
      <topic_access_rules>
        <topic_rule>
          <topic_expression>*</topic_expression>
          <enable_discovery_protection>true</enable_discovery_protection>
          <enable_liveliness_protection>true</enable_liveliness_protection>
          <enable_read_access_control>true</enable_read_access_control>
          <enable_write_access_control>true</enable_write_access_control>
          <metadata_protection_kind>ENCRYPT</metadata_protection_kind>
          <data_protection_kind>NONE</data_protection_kind>
        </topic_rule>
      </topic_access_rules>
    </domain_rule>
  </domain_access_rules>
</dds>
"#;

fn permissions(enclave: &str) -> String {
    format!(
        r#"<?xml version="1.0" encoding="UTF-8"?>
<dds xmlns:xsi="http://www.w3.org/2001/XMLSchema-instance" xsi:noNamespaceSchemaLocation="http://www.omg.org/spec/DDS-SECURITY/20170901/omg_shared_ca_permissions.xsd">
  <permissions>
    <grant name="{enclave}">
      <subject_name>CN={enclave}</subject_name>
      <validity><not_before>2020-01-01T00:00:00</not_before><not_after>2100-01-01T00:00:00</not_after></validity>
      <allow_rule>
        <domains><id_range><min>0</min><max>232</max></id_range></domains>
        <publish><topics><topic>*</topic></topics></publish>
        <subscribe><topics><topic>*</topic></topics></subscribe>
      </allow_rule>
      <default>DENY</default>
    </grant>
  </permissions>
</dds>
"#
    )
}

fn openssl(directory: &Path, arguments: &[&str]) {
    let output = Command::new("openssl")
        .args(arguments)
        .current_dir(directory)
        .output()
        .expect("openssl, which is needed for certificates");
    let error = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "openssl {arguments:?}: {error}");
}

/// A keystore with enclaves of one authority.
struct Keystore(TempDir);

impl Keystore {
    fn new(enclaves: &[&str]) -> Self {
        Self::governed_by(GOVERNANCE, enclaves)
    }

    fn governed_by(governance: &str, enclaves: &[&str]) -> Self {
        let keystore = Self(TempDir::new().unwrap());
        let root = keystore.0.path();
        openssl(
            root,
            &[
                "req",
                "-x509",
                "-newkey",
                "ec",
                "-pkeyopt",
                "ec_paramgen_curve:prime256v1",
                "-nodes",
                "-days",
                "2",
                "-subj",
                "/CN=sros2CA",
                "-keyout",
                "ca.key.pem",
                "-out",
                "ca.cert.pem",
            ],
        );
        fs::write(root.join("governance.xml"), governance).unwrap();
        keystore.sign("governance.xml", "governance.p7s");
        for enclave in enclaves {
            keystore.add(enclave);
        }
        keystore
    }

    fn sign(&self, document: &str, signed: &str) {
        openssl(
            self.0.path(),
            &[
                "smime",
                "-sign",
                "-text",
                "-in",
                document,
                "-out",
                signed,
                "-signer",
                "ca.cert.pem",
                "-inkey",
                "ca.key.pem",
            ],
        );
    }

    fn directory(&self, enclave: &str) -> PathBuf {
        self.0
            .path()
            .join("enclaves")
            .join(enclave.trim_start_matches('/'))
    }

    fn add(&self, enclave: &str) {
        let (root, directory) = (self.0.path(), self.directory(enclave));
        fs::create_dir_all(&directory).unwrap();
        let file = |name: &str| directory.join(name).to_str().unwrap().to_owned();
        let subject = format!("/CN={}", enclave.replace('/', "\\/"));
        openssl(
            root,
            &[
                "req",
                "-newkey",
                "ec",
                "-pkeyopt",
                "ec_paramgen_curve:prime256v1",
                "-nodes",
                "-subj",
                &subject,
                "-keyout",
                &file("key.pem"),
                "-out",
                "request.pem",
            ],
        );
        openssl(
            root,
            &[
                "x509",
                "-req",
                "-in",
                "request.pem",
                "-CA",
                "ca.cert.pem",
                "-CAkey",
                "ca.key.pem",
                "-CAcreateserial",
                "-days",
                "2",
                "-out",
                &file("cert.pem"),
            ],
        );
        fs::write(root.join("permissions.xml"), permissions(enclave)).unwrap();
        self.sign("permissions.xml", &file("permissions.p7s"));
        for name in ["identity_ca.cert.pem", "permissions_ca.cert.pem"] {
            fs::copy(root.join("ca.cert.pem"), file(name)).unwrap();
        }
        fs::copy(root.join("governance.p7s"), file("governance.p7s")).unwrap();
    }

    fn settings(&self, strategy: SecurityStrategy) -> SecuritySettings {
        SecuritySettings {
            strategy,
            keystore: Some(self.0.path().to_str().unwrap().into()),
            enclave_override: None,
        }
    }

    /// A node in an enclave.
    fn node(&self, name: &str, enclave: &str, domain: &Environment) -> Result<RosNode, RosError> {
        let environment = Environment {
            security: Some(self.settings(SecurityStrategy::Enforce)),
            ..domain.clone()
        };
        in_enclave(name, enclave, &environment)
    }
}

fn in_enclave(name: &str, enclave: &str, environment: &Environment) -> Result<RosNode, RosError> {
    let arguments = ["--ros-args", "--enclave", enclave].map(str::to_owned);
    let (args, _) = NodeArgs::parse(name, arguments).unwrap();
    RosNode::new(&args, environment)
}

fn text(data: &str) -> std_msgs::String {
    std_msgs::String { data: data.into() }
}

fn publisher(node: &RosNode) -> Publisher<std_msgs::String> {
    node.publisher("/command", &Qos::reliable(10)).unwrap()
}

fn subscription(node: &RosNode) -> Subscription<std_msgs::String> {
    node.subscription("/command", &Qos::reliable(10)).unwrap()
}

#[test]
fn who_is_authenticated_commands_and_nobody_else_hears_or_is_heard() {
    let domain = isolated();
    let (keystore, other) = (
        Keystore::new(&["/flight", "/operator"]),
        Keystore::new(&["/stranger"]),
    );
    let flight = keystore.node("flight", "/flight", &domain).unwrap();
    let operator = keystore.node("operator", "/operator", &domain).unwrap();
    let commands = subscription(&flight);
    let commander = publisher(&operator);

    let plain = node("plain", &domain);
    let stranger = other.node("stranger", "/stranger", &domain).unwrap();
    let outside = [&plain, &stranger].map(|node| (publisher(node), subscription(node)));

    assert!(commander.wait_for_subscriptions(1, PATIENCE));
    assert!(commands.wait_for_publishers(1, PATIENCE));
    for (publisher, _) in &outside {
        publisher.publish(&text("stop")).unwrap();
    }
    commander.publish(&text("go")).unwrap();
    let heard = commands.recv_timeout(PATIENCE).unwrap().expect("a command");
    assert_eq!(heard.message, text("go"));
    assert_eq!((commands.received(), commands.matched_publishers()), (1, 1));
    assert_eq!(commander.matched_subscriptions(), 1);
    for (publisher, subscription) in &outside {
        assert_eq!(publisher.matched_subscriptions(), 0);
        // It may hear itself.
        while let Some(heard) = subscription.take().unwrap() {
            assert_ne!(heard.message, text("go"));
        }
    }
}

#[test]
fn services_are_called_between_enclaves() {
    let domain = isolated();
    let keystore = Keystore::new(&["/flight", "/operator"]);
    let flight = keystore.node("flight", "/flight", &domain).unwrap();
    let operator = keystore.node("operator", "/operator", &domain).unwrap();
    let server = flight.service_server::<Trigger>("~/reset").unwrap();
    let client = operator.service_client::<Trigger>("/flight/reset").unwrap();
    std::thread::scope(|scope| {
        let call = scope.spawn(|| client.call(&TriggerRequest::default(), PATIENCE));
        let request = server.recv_timeout(PATIENCE).unwrap().expect("a request");
        let response = TriggerResponse {
            success: true,
            message: "done".into(),
        };
        server.reply(request.id, &response).unwrap();
        assert_eq!(call.join().unwrap().unwrap(), response);
    });
}

#[test]
fn missing_keys_are_named_or_warned_of() {
    let domain = isolated();
    let keystore = Keystore::new(&["/flight"]);
    let error = keystore.node("flight", "/nobody", &domain).unwrap_err();
    let error = error.to_string();
    assert!(
        error.contains("/nobody") && error.contains("identity_ca.cert.pem"),
        "{error}"
    );
    fs::remove_file(keystore.directory("/flight").join("key.pem")).unwrap();
    let error = keystore
        .node("flight", "/flight", &domain)
        .unwrap_err()
        .to_string();
    assert!(error.contains("key.pem"), "{error}");
    let permissive = Environment {
        security: Some(keystore.settings(SecurityStrategy::Permissive)),
        ..domain
    };
    assert!(in_enclave("flight", "/flight", &permissive).is_ok());
}

#[test]
fn a_governance_that_rustdds_cannot_keep_is_refused() {
    let encrypted = "<data_protection_kind>ENCRYPT</data_protection_kind>";
    let governance = GOVERNANCE.replace(
        "<data_protection_kind>NONE</data_protection_kind>",
        encrypted,
    );
    let keystore = Keystore::governed_by(&governance, &["/flight"]);
    let error = keystore
        .node("flight", "/flight", &isolated())
        .unwrap_err()
        .to_string();
    assert!(
        error.contains("data_protection_kind") && error.contains("governance.p7s"),
        "{error}"
    );
}
