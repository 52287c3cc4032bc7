//! The levels of what is logged, changed at run time.

use std::sync::{Arc, Mutex};

use lgvi_msgs::excerpt;
use lgvi_msgs::rcl_interfaces::{
    LoggerLevel, SetLoggerLevelsResult,
    srv::{GetLoggerLevels, GetLoggerLevelsResponse, SetLoggerLevels, SetLoggerLevelsResponse},
};
use tracing::warn;
use tracing_subscriber::{filter::LevelFilter, reload};

use crate::{
    LogSettings, ParameterError,
    log_settings::{LEVELS, filter},
    parameters::{Change, ParameterSpec, ParameterValue, Parameters},
    ros::{Executor, RosError, RosNode},
    sync::lock,
};

/// The parameter that holds the level of this project's messages.
const PARAMETER: &str = "log_level";

/// The names of loggers that stand for all of this project.
type Own = [String; 3];

pub(super) type Apply = Box<dyn Fn(&LogSettings) -> Result<(), reload::Error> + Send + Sync>;

/// A level that cannot be set.
#[derive(Debug, thiserror::Error)]
pub enum LevelError {
    /// Not the name of a level.
    #[error("log level {:?} is none of debug, info, warn, error, fatal", excerpt(.0))]
    Name(String),
    /// Not the number of a level.
    #[error(
        "log level {0} is none of 0 (unset), 10 (debug), 20 (info), 30 (warn), 40 (error), 50 (fatal)"
    )]
    Number(u32),
    /// The parameter `log_level` does not accept it.
    #[error(transparent)]
    Parameter(#[from] ParameterError),
    /// Logging has ended.
    #[error("logging is no longer set up")]
    Gone(#[from] reload::Error),
}

/// The levels of what is logged to the console and to `/rosout`. Clones are handles to the same levels.
#[derive(Clone)]
pub struct Levels(Arc<Inner>);

struct Inner {
    own: Own,
    initial: Option<LevelFilter>,
    settings: Mutex<LogSettings>,
    apply: Vec<Apply>,
}

/// The settings with one level of this project, whichever name it was given by: the more particular wins.
pub(super) fn settle(settings: &LogSettings, own: &Own) -> LogSettings {
    let mut settled = settings.clone();
    let (own, loggers): (Vec<_>, _) = settled
        .loggers
        .into_iter()
        .partition(|(logger, _)| own.contains(logger));
    settled.loggers = loggers;
    settled.level = own.last().map(|(_, level)| *level).or(settled.level);
    settled
}

impl Levels {
    pub(super) fn new(settings: LogSettings, own: Own, apply: Vec<Apply>) -> Self {
        Self(Arc::new(Inner {
            own,
            initial: settings.level,
            settings: Mutex::new(settings),
            apply,
        }))
    }

    /// The name of the level of this project's messages on the console.
    pub fn get(&self) -> &'static str {
        name(lock(&self.0.settings).level.unwrap_or(LevelFilter::INFO))
    }

    /// Sets the level of this project's messages, on the console and on `/rosout`, by its name.
    ///
    /// # Errors
    /// Not the name of a level, or the subscriber of [`init`](super::init) is gone.
    pub fn set(&self, level: &str) -> Result<(), LevelError> {
        let level = filter(level).ok_or_else(|| LevelError::Name(level.into()))?;
        self.change(|settings| settings.level = Some(level))
    }

    /// The parameter `log_level`; [`follow`](Self::follow) has it take effect.
    pub fn specification(&self) -> ParameterSpec {
        ParameterSpec::new(
            PARAMETER,
            self.get().to_string(),
            "lowest level of this node's messages on the console and /rosout",
        )
        .constraints("debug, info, warn, error or fatal")
        .check(|value| match value {
            ParameterValue::String(level) if filter(level).is_some() => Ok(()),
            _ => Err("expected debug, info, warn, error or fatal".into()),
        })
        .change(Change::Anytime)
    }

    /// Sets the level to the parameter `log_level` where that was given, and whenever it changes.
    ///
    /// # Errors
    /// The parameter is not declared, or the subscriber of [`init`](super::init) is gone.
    pub fn follow(&self, parameters: &Parameters) -> Result<(), LevelError> {
        let level: String = parameters.get(PARAMETER)?;
        if level != self.get() {
            self.set(&level)?;
        }
        let levels = self.clone();
        parameters.on_change(PARAMETER, move |level| {
            if let ParameterValue::String(level) = level
                && let Err(error) = levels.set(level)
            {
                warn!("{error}");
            }
        })?;
        Ok(())
    }

    /// Offers `~/get_logger_levels` and `~/set_logger_levels`.
    ///
    /// The name of the node stands for all of this project, as an empty name does: its level is the parameter
    /// `log_level`. Others are targets of `tracing`, such as `rustdds`.
    ///
    /// # Errors
    /// The services cannot be created.
    pub fn serve(
        &self,
        parameters: &Parameters,
        node: &RosNode,
        executor: &mut Executor,
    ) -> Result<(), RosError> {
        let levels = self.clone();
        executor.answer::<GetLoggerLevels>(node, "~/get_logger_levels", move |request| {
            let level = |name: String| LoggerLevel {
                level: levels.number_of(&name).into(),
                name,
            };
            let levels = request.names.into_iter().map(level).collect();
            GetLoggerLevelsResponse { levels }
        })?;
        let (levels, parameters) = (self.clone(), parameters.clone());
        executor.answer::<SetLoggerLevels>(node, "~/set_logger_levels", move |request| {
            let set = |level: LoggerLevel| {
                let set = levels.set_number(&parameters, level);
                SetLoggerLevelsResult {
                    successful: set.is_ok(),
                    reason: set.err().map(|error| error.to_string()).unwrap_or_default(),
                }
            };
            let results = request.levels.into_iter().map(set).collect();
            SetLoggerLevelsResponse { results }
        })
    }

    /// The number of a logger's level, 0 where it has none of its own.
    fn number_of(&self, logger: &str) -> u8 {
        let settings = lock(&self.0.settings);
        if self.is_own(logger) {
            return number(settings.level.unwrap_or(LevelFilter::INFO));
        }
        let mut loggers = settings.loggers.iter();
        loggers
            .rfind(|(name, _)| name == logger)
            .map_or(LoggerLevel::LOG_LEVEL_UNKNOWN, |(_, level)| number(*level))
    }

    fn set_number(&self, parameters: &Parameters, asked: LoggerLevel) -> Result<(), LevelError> {
        let unset = asked.level == u32::from(LoggerLevel::LOG_LEVEL_UNKNOWN);
        let level = LEVELS
            .into_iter()
            .find(|(_, number, _)| u32::from(*number) == asked.level);
        if level.is_none() && !unset {
            return Err(LevelError::Number(asked.level));
        }
        if self.is_own(&asked.name) {
            let initial = name(self.0.initial.unwrap_or(LevelFilter::INFO));
            let level = level.map_or(initial, |(name, ..)| name);
            Ok(parameters.set(PARAMETER, level.into())?)
        } else {
            self.set_logger(&asked.name, level.map(|(.., filter)| filter))
        }
    }

    pub(super) fn set_logger(
        &self,
        logger: &str,
        level: Option<LevelFilter>,
    ) -> Result<(), LevelError> {
        self.change(|settings| {
            settings.loggers.retain(|(other, _)| other != logger);
            let level = level.map(|level| (logger.into(), level));
            settings.loggers.extend(level);
        })
    }

    fn change(&self, change: impl FnOnce(&mut LogSettings)) -> Result<(), LevelError> {
        let mut settings = lock(&self.0.settings);
        change(&mut settings);
        for apply in &self.0.apply {
            apply(&settings)?;
        }
        Ok(())
    }

    fn is_own(&self, logger: &str) -> bool {
        logger.is_empty() || self.0.own.iter().any(|own| own == logger)
    }
}

fn name(level: LevelFilter) -> &'static str {
    of_filter(level).0
}

fn number(level: LevelFilter) -> u8 {
    of_filter(level).1
}

fn of_filter(level: LevelFilter) -> (&'static str, u8) {
    let mut levels = LEVELS.into_iter();
    levels.find(|(.., filter)| *filter == level).map_or(
        ("info", LoggerLevel::LOG_LEVEL_INFO),
        |(name, number, _)| (name, number),
    )
}
