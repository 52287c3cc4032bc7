//! Keystores as `ros2 security` lays them out, made with the command line of OpenSSL.

use std::fs;
use std::os::unix::fs::{PermissionsExt, symlink};
use std::path::{Path, PathBuf};
use std::process::Command;

use crate::{Process, World, binary};

/// The governance that `ros2 security create_keystore` writes, for all domains.
const GOVERNANCE: &str = r#"<?xml version="1.0" encoding="UTF-8"?>
<dds xmlns:xsi="http://www.w3.org/2001/XMLSchema-instance"
    xsi:noNamespaceSchemaLocation="http://www.omg.org/spec/DDS-SECURITY/20170901/omg_shared_ca_governance.xsd">
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
          <data_protection_kind>ENCRYPT</data_protection_kind>
        </topic_rule>
      </topic_access_rules>
    </domain_rule>
  </domain_access_rules>
</dds>
"#;

/// The topics that `ros2 security create_enclave` allows.
const ALL_TOPICS: [&str; 4] = ["rq/*Request", "rr/*Reply", "rt/*", "ros_discovery_info"];

/// A certificate authority, and the enclaves that it has made.
#[derive(Debug)]
pub struct Keystore {
    root: PathBuf,
}

impl Keystore {
    /// A keystore with a certificate authority of its own.
    #[track_caller]
    pub fn new(world: &World, name: &str) -> Self {
        let keystore = Self {
            root: world.path(name),
        };
        for directory in ["enclaves", "private", "public"] {
            fs::create_dir_all(keystore.root.join(directory)).expect("a directory");
        }
        let authority = ["req", "-x509", "-newkey", "ec", "-pkeyopt"];
        let curve = ["ec_paramgen_curve:prime256v1", "-nodes", "-days", "10"];
        let place = ["-subj", "/CN=sros2CA", "-keyout", "private/ca.key.pem"];
        let certificate = ["-out", "public/ca.cert.pem"];
        keystore.openssl(&[&authority[..], &curve, &place, &certificate].concat());
        keystore.sign("enclaves/governance", GOVERNANCE);
        keystore
    }

    /// Its directory, which `ROS_SECURITY_KEYSTORE` names.
    pub fn path(&self) -> &Path {
        &self.root
    }

    /// The directory of an enclave.
    pub fn directory(&self, enclave: &str) -> PathBuf {
        self.root.join("enclaves").join(&enclave[1..])
    }

    /// Makes an enclave that may use all topics, but for the root one.
    #[track_caller]
    pub fn enclave(self, enclave: &str) -> Self {
        self.enclave_for(enclave, &ALL_TOPICS, &ALL_TOPICS)
    }

    /// Makes an enclave that may use these DDS topics.
    #[track_caller]
    pub fn enclave_for(self, enclave: &str, publish: &[&str], subscribe: &[&str]) -> Self {
        let directory = self.directory(enclave);
        fs::create_dir_all(&directory).expect("a directory");
        let within = |file: &str| format!("enclaves{enclave}/{file}");
        let (key, request, certificate) =
            (within("key.pem"), within("request.pem"), within("cert.pem"));
        // A slash parts names in the subject, unless it is escaped.
        let subject = format!("/CN={}", enclave.replace('/', "\\/"));
        let made = ["req", "-newkey", "ec", "-pkeyopt"];
        let curve = ["ec_paramgen_curve:prime256v1", "-nodes"];
        let place = ["-subj", &subject, "-keyout", &key, "-out", &request];
        self.openssl(&[&made[..], &curve, &place].concat());
        let signed = ["x509", "-req", "-days", "10", "-in", &request];
        let by = ["-CA", "public/ca.cert.pem", "-CAkey", "private/ca.key.pem"];
        let to = ["-set_serial", "1", "-out", &certificate];
        self.openssl(&[&signed[..], &by, &to].concat());
        let owner = fs::Permissions::from_mode(0o600);
        fs::set_permissions(self.root.join(&key), owner).expect("a key");
        let authority = fs::canonicalize(self.root.join("public/ca.cert.pem")).expect("a path");
        for link in ["identity_ca.cert.pem", "permissions_ca.cert.pem"] {
            symlink(&authority, directory.join(link)).expect("a link");
        }
        let governance = fs::canonicalize(self.root.join("enclaves/governance.p7s"));
        let link = directory.join("governance.p7s");
        symlink(governance.expect("a path"), link).expect("a link");
        let permissions = permissions(enclave, publish, subscribe);
        self.sign(&within("permissions"), &permissions);
        self
    }

    /// Signs a document, as `<path>.p7s`.
    fn sign(&self, path: &str, document: &str) {
        let (xml, p7s) = (format!("{path}.xml"), format!("{path}.p7s"));
        fs::write(self.root.join(&xml), document).expect("a file");
        let sign = ["smime", "-sign", "-text", "-in", &xml, "-out", &p7s];
        let by = [
            "-signer",
            "public/ca.cert.pem",
            "-inkey",
            "private/ca.key.pem",
        ];
        self.openssl(&[&sign[..], &by].concat());
    }

    fn openssl(&self, arguments: &[&str]) {
        let output = Command::new("openssl")
            .args(arguments)
            .current_dir(&self.root)
            .output()
            .expect("openssl, which the tests of security need");
        let stderr = String::from_utf8_lossy(&output.stderr);
        assert!(output.status.success(), "openssl {arguments:?}:\n{stderr}");
    }
}

impl World {
    /// A command that runs a program of the package `lgvi` with DDS security, which is enforced.
    pub fn secured_command(&self, program: &str, keystore: &Keystore) -> Command {
        let mut command = self.command(&binary(program));
        command
            .env("ROS_SECURITY_ENABLE", "true")
            .env("ROS_SECURITY_STRATEGY", "Enforce")
            .env("ROS_SECURITY_KEYSTORE", keystore.path());
        command
    }

    /// The same of a node under supervision, in an enclave, with parameters as `name:=value`.
    pub fn secured_node_command(
        &self,
        kind: &str,
        keystore: &Keystore,
        enclave: &str,
        parameters: &[&str],
    ) -> Command {
        let mut command = self.secured_command(&format!("lgvi_{kind}"), keystore);
        command.args(["--supervised", "--ros-args", "--enclave", enclave]);
        for parameter in parameters {
            command.args(["-p", parameter]);
        }
        command
    }

    /// Starts it.
    pub fn secured_node(
        &self,
        kind: &str,
        keystore: &Keystore,
        enclave: &str,
        parameters: &[&str],
    ) -> Process {
        let command = self.secured_node_command(kind, keystore, enclave, parameters);
        self.start(kind, command)
    }
}

/// As `ros2 security create_permission` writes it, for all domains.
fn permissions(enclave: &str, publish: &[&str], subscribe: &[&str]) -> String {
    let list = |topics: &[&str]| -> String {
        let topics = topics.iter().map(|topic| format!("<topic>{topic}</topic>"));
        topics.collect()
    };
    format!(
        "<dds xmlns:xsi=\"http://www.w3.org/2001/XMLSchema-instance\"
  xsi:noNamespaceSchemaLocation=\"http://www.omg.org/spec/DDS-SECURITY/20170901/omg_shared_ca_permissions.xsd\">
  <permissions>
    <grant name=\"{enclave}\">
      <subject_name>CN={enclave}</subject_name>
      <validity>
        <not_before>2020-01-01T00:00:00</not_before>
        <not_after>2090-01-01T00:00:00</not_after>
      </validity>
      <allow_rule>
        <domains><id_range><min>0</min><max>232</max></id_range></domains>
        <publish><topics>{}</topics></publish>
        <subscribe><topics>{}</topics></subscribe>
      </allow_rule>
      <default>DENY</default>
    </grant>
  </permissions>
</dds>
",
        list(publish),
        list(subscribe)
    )
}
