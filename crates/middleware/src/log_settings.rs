//! What a node logs, as its command line says.

use lgvi_msgs::rcl_interfaces::LoggerLevel;
use tracing_subscriber::filter::LevelFilter;

/// The levels of ROS by name and number, the most frequent messages first. Nothing here is logged as fatal.
pub(crate) const LEVELS: [(&str, u8, LevelFilter); 5] = [
    ("debug", LoggerLevel::LOG_LEVEL_DEBUG, LevelFilter::DEBUG),
    ("info", LoggerLevel::LOG_LEVEL_INFO, LevelFilter::INFO),
    ("warn", LoggerLevel::LOG_LEVEL_WARN, LevelFilter::WARN),
    ("error", LoggerLevel::LOG_LEVEL_ERROR, LevelFilter::ERROR),
    ("fatal", LoggerLevel::LOG_LEVEL_FATAL, LevelFilter::OFF),
];

/// The level of this name.
pub(crate) fn filter(level: &str) -> Option<LevelFilter> {
    let mut levels = LEVELS.into_iter();
    levels.find_map(|(name, _, filter)| (name == level).then_some(filter))
}

/// What is logged, and where.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct LogSettings {
    /// `--log-level LEVEL`; `None` if not given, or unset.
    pub level: Option<LevelFilter>,
    /// `--log-level LOGGER:=LEVEL`, in order.
    pub loggers: Vec<(String, LevelFilter)>,
    /// The console (`--disable-stdout-logs` as ROS 2 calls it; it is stderr).
    pub console: bool,
    /// The topic `/rosout`.
    pub rosout: bool,
    /// Messages of the libraries underneath.
    pub external: bool,
}

impl Default for LogSettings {
    fn default() -> Self {
        Self {
            level: None,
            loggers: Vec::new(),
            console: true,
            rosout: true,
            external: true,
        }
    }
}

impl LogSettings {
    /// Takes `LEVEL` or `LOGGER:=LEVEL`; returns whether it is one.
    pub(crate) fn set_level(&mut self, text: &str) -> bool {
        let (logger, level) = match text.split_once(":=") {
            Some((logger, level)) if !logger.is_empty() => (Some(logger), level),
            Some(_) => return false,
            None => (None, text),
        };
        let level = match level.to_ascii_lowercase().as_str() {
            "unset" => None,
            name => match filter(name) {
                None => return false,
                level => level,
            },
        };
        let Some(logger) = logger else {
            self.level = level;
            return true;
        };
        self.loggers.retain(|(other, _)| other != logger);
        self.loggers
            .extend(level.map(|level| (logger.to_owned(), level)));
        true
    }

    /// Takes `--enable-…-logs` and `--disable-…-logs`; returns whether it is one of them.
    pub(crate) fn set_switch(&mut self, argument: &str) -> bool {
        let (on, what) = if let Some(what) = argument.strip_prefix("--enable-") {
            (true, what)
        } else if let Some(what) = argument.strip_prefix("--disable-") {
            (false, what)
        } else {
            return false;
        };
        match what {
            "rosout-logs" => self.rosout = on,
            "stdout-logs" => self.console = on,
            "external-lib-logs" => self.external = on,
            _ => return false,
        }
        true
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn log_levels_are_those_of_rcutils() {
        for (text, expected) in [
            ("debug", Some(LevelFilter::DEBUG)),
            ("Info", Some(LevelFilter::INFO)),
            ("ERROR", Some(LevelFilter::ERROR)),
            ("fatal", Some(LevelFilter::OFF)),
            ("unset", None),
        ] {
            let mut settings = LogSettings {
                level: Some(LevelFilter::WARN),
                ..LogSettings::default()
            };
            assert!(settings.set_level(text), "{text}");
            assert_eq!(settings.level, expected, "{text}");
        }
        for bad in [
            "warning",
            "trace",
            "10",
            "x:debug",
            "x:=",
            ":=debug",
            "a:=b:=debug",
            "x:=loud",
        ] {
            let mut settings = LogSettings::default();
            assert!(!settings.set_level(bad), "{bad}");
            assert_eq!(settings, LogSettings::default(), "{bad}");
        }
    }
}
