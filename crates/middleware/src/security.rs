//! DDS Security by the rules of SROS 2: whether it is asked for, and which files a node takes.

use std::{
    fs::{self, File},
    io,
    os::unix::fs::PermissionsExt,
    path::{Path, PathBuf},
};

/// Whether security is asked for, as `rcl` names it.
pub(crate) const ENABLE: &str = "ROS_SECURITY_ENABLE";
/// What happens where the files are not there.
pub(crate) const STRATEGY: &str = "ROS_SECURITY_STRATEGY";
/// The directory of all enclaves.
pub(crate) const KEYSTORE: &str = "ROS_SECURITY_KEYSTORE";
/// The enclave of a node, whatever its command line says.
pub(crate) const OVERRIDE: &str = "ROS_SECURITY_ENCLAVE_OVERRIDE";

/// The files of an enclave, as SROS 2 names them.
const FILES: [&str; 6] = [
    "identity_ca.cert.pem",
    "cert.pem",
    "key.pem",
    "permissions_ca.cert.pem",
    "governance.p7s",
    "permissions.p7s",
];

/// The list of certificates that are revoked, which RustDDS 0.15 does not read.
const REVOCATIONS: &str = "crl.pem";

/// What a node does that is to be secure and lacks the files for it.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum SecurityStrategy {
    /// It joins without security, with a warning.
    #[default]
    Permissive,
    /// It ends with an error.
    Enforce,
}

/// Whether nodes authenticate each other and encrypt what they say, as ROS 2 reads it from the environment.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Security {
    /// `ROS_SECURITY_STRATEGY`, if `ROS_SECURITY_ENABLE` is `true`.
    pub strategy: Option<SecurityStrategy>,
    /// `ROS_SECURITY_KEYSTORE`: the directory with `enclaves`.
    pub keystore: Option<PathBuf>,
    /// `ROS_SECURITY_ENCLAVE_OVERRIDE`: the enclave, whatever `--enclave` says.
    pub enclave_override: Option<String>,
}

/// Security that is asked for and cannot be had.
#[derive(Debug, thiserror::Error)]
pub enum SecurityError {
    /// The program was built without it.
    #[error(
        "ROS_SECURITY_ENABLE is true, and this program was built without DDS security: build it with --features security"
    )]
    NotBuilt,
    /// Nothing says where the files are.
    #[error("ROS_SECURITY_ENABLE is true and ROS_SECURITY_KEYSTORE is not set")]
    NoKeystore,
    /// The keystore has no such enclave, or a file of it is missing.
    #[error("enclave {enclave:?}{what}; ROS_SECURITY_KEYSTORE is {}", keystore.display())]
    Missing {
        /// The enclave.
        enclave: String,
        /// What is missing.
        what: String,
        /// `ROS_SECURITY_KEYSTORE`.
        keystore: PathBuf,
    },
    /// A file of the enclave cannot be read.
    #[error(
        "cannot read {} of enclave {enclave:?}: {source}; ROS_SECURITY_KEYSTORE is {}",
        path.display(),
        keystore.display()
    )]
    Read {
        /// The enclave.
        enclave: String,
        /// `ROS_SECURITY_KEYSTORE`.
        keystore: PathBuf,
        /// The file.
        path: PathBuf,
        /// Why.
        source: io::Error,
    },
    /// Certificates are revoked, which would not be heeded.
    #[error(
        "enclave {enclave:?} has a revocation list, {}, which DDS security here cannot heed: \
         make new certificates by a new certificate authority instead, and remove it",
        path.display()
    )]
    Revocations {
        /// The enclave.
        enclave: String,
        /// The list.
        path: PathBuf,
    },
}

/// The files of an enclave, all of which can be read.
#[derive(Debug, Clone, PartialEq, Eq)]
#[cfg_attr(not(feature = "transport"), allow(dead_code))]
pub(crate) struct Enclave {
    pub(crate) name: String,
    pub(crate) directory: PathBuf,
    /// Whether other users may read the private key.
    pub(crate) exposed: bool,
}

impl SecurityError {
    /// Whether something is not there, so that a permissive node does without.
    fn is_absence(&self) -> bool {
        matches!(self, Self::NoKeystore | Self::Missing { .. })
    }
}

impl Security {
    /// The enclave of a node whose command line names `enclave`; none if it is to join without security.
    ///
    /// # Errors
    /// What is missing, unless the node is permissive: then it is handed to `warn`. What is there and cannot be used, in
    /// any case.
    pub(crate) fn enclave(
        &self,
        enclave: &str,
        warn: impl FnOnce(&SecurityError),
    ) -> Result<Option<Enclave>, SecurityError> {
        self.enclave_if(cfg!(feature = "security"), enclave, warn)
    }

    fn enclave_if(
        &self,
        built: bool,
        enclave: &str,
        warn: impl FnOnce(&SecurityError),
    ) -> Result<Option<Enclave>, SecurityError> {
        let Some(strategy) = self.strategy else {
            return Ok(None);
        };
        if !built && strategy == SecurityStrategy::Enforce {
            return Err(SecurityError::NotBuilt);
        }
        match self.find(enclave) {
            Ok(_) if !built => Err(SecurityError::NotBuilt),
            Ok(found) => Ok(Some(found)),
            Err(error) if strategy == SecurityStrategy::Permissive && error.is_absence() => {
                warn(&error);
                Ok(None)
            }
            Err(error) => Err(error),
        }
    }

    fn find(&self, enclave: &str) -> Result<Enclave, SecurityError> {
        let keystore = self.keystore.as_ref().ok_or(SecurityError::NoKeystore)?;
        let (enclave, named_by) = match &self.enclave_override {
            Some(other) => (other.as_str(), OVERRIDE),
            None => (enclave, "--enclave"),
        };
        // The root enclave is the directory itself.
        let directory = keystore
            .join("enclaves")
            .join(enclave.trim_start_matches('/'));
        let missing = |what: String| SecurityError::Missing {
            enclave: enclave.to_owned(),
            what,
            keystore: keystore.clone(),
        };
        let refuse = |path: &Path, source| SecurityError::Read {
            enclave: enclave.to_owned(),
            keystore: keystore.clone(),
            path: path.to_owned(),
            source,
        };
        match fs::metadata(&directory) {
            Ok(found) if found.is_dir() => {}
            Err(error) if !is_absence(&error) => return Err(refuse(&directory, error)),
            _ => {
                let place = directory.display();
                let what = format!(", which {named_by} names, has no directory {place}");
                return Err(missing(what));
            }
        }
        let revocations = directory.join(REVOCATIONS);
        if fs::symlink_metadata(&revocations).is_ok() {
            return Err(SecurityError::Revocations {
                enclave: enclave.into(),
                path: revocations,
            });
        }
        for name in FILES {
            let path = directory.join(name);
            match File::open(&path).and_then(|file| file.metadata()) {
                Ok(found) if found.is_file() => {}
                Ok(_) => return Err(refuse(&path, io::Error::other("it is no file"))),
                Err(error) if is_absence(&error) => {
                    return Err(missing(format!(" lacks {}", path.display())));
                }
                Err(error) => return Err(refuse(&path, error)),
            }
        }
        Ok(Enclave {
            name: enclave.into(),
            exposed: is_exposed(&directory.join("key.pem")),
            directory,
        })
    }
}

fn is_absence(error: &io::Error) -> bool {
    matches!(
        error.kind(),
        io::ErrorKind::NotFound | io::ErrorKind::NotADirectory
    )
}

/// Whether the group or others may read a file, itself; the directories above are not looked at.
fn is_exposed(path: &Path) -> bool {
    fs::metadata(path).is_ok_and(|found| found.permissions().mode() & 0o044 != 0)
}

#[cfg(test)]
mod tests {
    use std::os::unix::fs::PermissionsExt;

    use tempfile::TempDir;

    use super::*;

    /// A keystore with empty files for the enclaves `/` and `/a/b`.
    fn keystore() -> TempDir {
        let keystore = tempfile::tempdir().unwrap();
        for enclave in ["enclaves", "enclaves/a/b"] {
            let directory = keystore.path().join(enclave);
            fs::create_dir_all(&directory).unwrap();
            for file in FILES {
                fs::write(directory.join(file), "").unwrap();
            }
        }
        keystore
    }

    fn security(strategy: SecurityStrategy, keystore: &TempDir) -> Security {
        Security {
            strategy: Some(strategy),
            keystore: Some(keystore.path().to_owned()),
            enclave_override: None,
        }
    }

    /// The enclave's directory, or what is wrong; what was warned of.
    fn found(
        security: &Security,
        built: bool,
        enclave: &str,
    ) -> (Result<Option<PathBuf>, String>, String) {
        let mut warning = String::new();
        let found = security
            .enclave_if(built, enclave, |error| warning = error.to_string())
            .map(|found| found.map(|found| found.directory))
            .map_err(|error| error.to_string());
        (found, warning)
    }

    #[test]
    fn without_being_asked_for_there_is_none() {
        let found = found(&Security::default(), false, "/a/b");
        assert_eq!(found, (Ok(None), String::new()));
    }

    #[test]
    fn enclaves_lie_as_ros_2_has_them() {
        let keystore = keystore();
        let mut security = security(SecurityStrategy::Enforce, &keystore);
        let at = |path: &str| (Ok(Some(keystore.path().join(path))), String::new());
        assert_eq!(found(&security, true, "/a/b"), at("enclaves/a/b"));
        assert_eq!(found(&security, true, "/"), at("enclaves/"));
        security.enclave_override = Some("/a/b".into());
        assert_eq!(found(&security, true, "/"), at("enclaves/a/b"));
    }

    #[test]
    fn a_program_without_security_never_pretends_to_have_it() {
        let keystore = keystore();
        let refused = (Err(SecurityError::NotBuilt.to_string()), String::new());
        let enforce = security(SecurityStrategy::Enforce, &keystore);
        assert_eq!(found(&enforce, false, "/a/b"), refused);
        assert_eq!(found(&enforce, false, "/c"), refused);
        let permissive = security(SecurityStrategy::Permissive, &keystore);
        assert_eq!(found(&permissive, false, "/a/b"), refused);
        let (joins, warning) = found(&permissive, false, "/c");
        assert_eq!(joins, Ok(None));
        assert!(warning.contains("\"/c\""), "{warning}");
    }

    #[test]
    fn what_is_missing_is_named_and_only_a_permissive_node_does_without() {
        let keystore = keystore();
        let path = keystore.path().display();
        let mut enforce = security(SecurityStrategy::Enforce, &keystore);
        let mut permissive = security(SecurityStrategy::Permissive, &keystore);
        let check = |enforce: &Security, permissive: &Security, enclave, expected: String| {
            assert_eq!(found(enforce, true, enclave).0, Err(expected.clone()));
            assert_eq!(found(permissive, true, enclave), (Ok(None), expected));
        };
        let expected = format!(
            "enclave \"/x\", which --enclave names, has no directory {path}/enclaves/x; ROS_SECURITY_KEYSTORE is {path}"
        );
        check(&enforce, &permissive, "/x", expected);
        for file in FILES {
            let file = keystore.path().join("enclaves/a/b").join(file);
            fs::rename(&file, file.with_extension("away")).unwrap();
            let expected = format!(
                "enclave \"/a/b\" lacks {}; ROS_SECURITY_KEYSTORE is {path}",
                file.display()
            );
            check(&enforce, &permissive, "/a/b", expected);
            fs::rename(file.with_extension("away"), &file).unwrap();
        }
        for security in [&mut enforce, &mut permissive] {
            security.keystore = None;
        }
        let expected = "ROS_SECURITY_ENABLE is true and ROS_SECURITY_KEYSTORE is not set";
        check(&enforce, &permissive, "/a/b", expected.into());
    }

    #[test]
    fn what_is_there_and_cannot_be_used_is_refused_by_both_strategies() {
        let keystore = keystore();
        let directory = keystore.path().join("enclaves/a/b");
        for strategy in [SecurityStrategy::Enforce, SecurityStrategy::Permissive] {
            let security = security(strategy, &keystore);
            let key = directory.join("key.pem");
            fs::remove_file(&key).unwrap();
            fs::create_dir(&key).unwrap();
            let error = found(&security, true, "/a/b").0.unwrap_err();
            let expected = format!(
                "cannot read {} of enclave \"/a/b\": it is no file",
                key.display()
            );
            assert!(error.starts_with(&expected), "{error}");
            fs::remove_dir(&key).unwrap();
            fs::write(&key, "").unwrap();

            let list = directory.join(REVOCATIONS);
            fs::write(&list, "").unwrap();
            let error = found(&security, true, "/a/b").0.unwrap_err();
            assert!(error.contains(&list.display().to_string()), "{error}");
            fs::remove_file(&list).unwrap();
        }
    }

    #[test]
    fn a_key_that_others_can_read_is_noticed() {
        let keystore = keystore();
        let security = security(SecurityStrategy::Enforce, &keystore);
        let key = keystore.path().join("enclaves/a/b/key.pem");
        for (mode, exposed) in [(0o600, false), (0o640, true), (0o604, true)] {
            fs::set_permissions(&key, fs::Permissions::from_mode(mode)).unwrap();
            let found = security.enclave_if(true, "/a/b", |_| {}).unwrap().unwrap();
            assert_eq!(found.exposed, exposed, "{mode:o}");
        }
    }
}
