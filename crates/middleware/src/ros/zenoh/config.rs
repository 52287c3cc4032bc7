//! The session's configuration: that of `rmw_zenoh_cpp`, by the same environment variables.

use ::zenoh::Config;

use crate::ZenohSettings;

/// A file in place of the defaults.
const FILE: &str = "ZENOH_SESSION_CONFIG_URI";

/// `key=value` pairs in JSON5, separated by semicolons, on top of it.
const OVERRIDE: &str = "ZENOH_CONFIG_OVERRIDE";

/// Where a session of `rmw_zenoh_cpp` differs from Zenoh's own defaults: it meets the others through a router on this
/// host, and never by multicast.
const DEFAULTS: [(&str, &str); 6] = [
    ("mode", "\"peer\""),
    ("connect/endpoints", "[\"tcp/localhost:7447\"]"),
    ("listen/endpoints", "[\"tcp/localhost:0\"]"),
    ("scouting/multicast/enabled", "false"),
    (
        "timestamping/enabled",
        "{router: true, peer: true, client: true}",
    ),
    ("queries_default_timeout", "600000"),
];

/// Reads the configuration.
pub(super) fn config(settings: &ZenohSettings) -> Result<Config, String> {
    let mut config = match &settings.file {
        Some(file) => Config::from_file(file).map_err(|error| format!("{FILE}={file}: {error}"))?,
        None => {
            let mut config = Config::default();
            for (key, value) in DEFAULTS {
                let inserted = config.insert_json5(key, value);
                inserted.map_err(|error| format!("{key}={value}: {error}"))?;
            }
            config
        }
    };
    for pair in settings.overrides.iter().flat_map(|pairs| pairs.split(';')) {
        let pair = pair.trim();
        if pair.is_empty() {
            continue;
        }
        let (key, value) = pair
            .split_once('=')
            .ok_or_else(|| format!("{OVERRIDE} has {pair:?}; expected key=value"))?;
        let inserted = config.insert_json5(key.trim(), value.trim());
        inserted.map_err(|error| format!("{OVERRIDE} has {pair:?}: {error}"))?;
    }
    Ok(config)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn overrides(pairs: &str) -> ZenohSettings {
        ZenohSettings {
            file: None,
            overrides: Some(pairs.into()),
        }
    }

    #[test]
    fn overrides_go_on_top() {
        let pairs = "mode=\"client\"; scouting/multicast/enabled=true;";
        let both = config(&overrides(pairs)).unwrap();
        assert_eq!(both.get_json("mode").unwrap(), "\"client\"");
        assert_eq!(both.get_json("scouting/multicast/enabled").unwrap(), "true");
        let endpoints = both.get_json("connect/endpoints").unwrap();
        assert!(endpoints.contains("tcp/localhost:7447"), "{endpoints}");
    }

    #[test]
    fn what_cannot_be_honored_is_named() {
        for bad in ["mode", "mode=7", "no/such/key=1"] {
            let error = config(&overrides(bad)).unwrap_err();
            assert!(error.contains(OVERRIDE) && error.contains(bad), "{error}");
        }
        let missing = ZenohSettings {
            file: Some("/no/such/file.json5".into()),
            overrides: None,
        };
        let error = config(&missing).unwrap_err();
        assert!(
            error.contains(FILE) && error.contains("/no/such"),
            "{error}"
        );
    }
}
