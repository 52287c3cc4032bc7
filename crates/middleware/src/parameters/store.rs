//! The parameters of a node and their values.

use std::{
    collections::BTreeMap,
    fmt,
    sync::{
        Arc, Mutex,
        atomic::{AtomicU64, Ordering},
    },
};

use tracing::warn;

use super::{
    Change, Given, ParameterError, ParameterSpec,
    value::{ParameterType, ParameterValue},
};
use crate::sync::lock;

/// A parameter of `rclcpp` nodes that lgvi's do not have.
const IGNORED: &str = "start_type_description_service";

/// The same, which a user may expect to have an effect.
const WITHOUT_EFFECT: &str = "qos_overrides.";

/// The parameters of a node. Clones are handles to the same set.
#[derive(Clone)]
pub struct Parameters(Arc<Shared>);

struct Shared {
    /// How often something has changed.
    generation: AtomicU64,
    specs: BTreeMap<String, ParameterSpec>,
    values: Mutex<Values>,
    /// Locked by whoever sets a parameter, before [`Self::values`]: all hear of changes in the same order.
    listeners: Mutex<Listeners>,
}

struct Values {
    values: BTreeMap<String, ParameterValue>,
    configured: bool,
}

type Hear = Box<dyn FnMut(&ParameterValue) + Send>;
type Record = Box<dyn FnMut(&[(String, ParameterValue)]) -> bool + Send>;

#[derive(Default)]
struct Listeners {
    of: BTreeMap<String, Vec<Hear>>,
    all: Vec<Record>,
}

impl Parameters {
    /// Declares the parameters of a node with the values given to it.
    ///
    /// Of what else is given, `start_type_description_service` is passed over, and `qos_overrides.*` with a warning.
    ///
    /// # Errors
    /// A value that is not accepted, a parameter that is unknown, a declaration that contradicts itself.
    pub fn declare(mut given: Given, specs: Vec<ParameterSpec>) -> Result<Self, ParameterError> {
        let mut values = BTreeMap::new();
        let mut declared = BTreeMap::new();
        for spec in specs {
            let value = spec.begin(given.remove(&spec.name))?;
            values.insert(spec.name.clone(), value);
            if let Some(twice) = declared.insert(spec.name.clone(), spec) {
                return Err(twice.wrong("twice"));
            }
        }
        for name in given.into_keys() {
            if name.starts_with(WITHOUT_EFFECT) {
                warn!("parameter {name:?} has no effect: the QoS of lgvi's topics is fixed");
            } else if name != IGNORED {
                let known = declared.into_keys().collect();
                return Err(ParameterError::Unknown { name, known });
            }
        }
        Ok(Self(Arc::new(Shared {
            generation: AtomicU64::new(0),
            specs: declared,
            values: Mutex::new(Values {
                values,
                configured: false,
            }),
            listeners: Mutex::default(),
        })))
    }

    /// The value of a parameter.
    ///
    /// # Errors
    /// A parameter that is not declared, not set, or of another type.
    pub fn get<T: ParameterType>(&self, name: &str) -> Result<T, ParameterError> {
        self.get_optional(name)?
            .ok_or_else(|| ParameterError::NotSet {
                name: name.into(),
                expected: T::KIND.expected(),
            })
    }

    /// The value of a parameter, `None` if it is not set.
    ///
    /// # Errors
    /// A parameter that is not declared or of another type.
    pub fn get_optional<T: ParameterType>(&self, name: &str) -> Result<Option<T>, ParameterError> {
        let value = self.value(name)?;
        if value == ParameterValue::NotSet {
            return Ok(None);
        }
        let text = value.to_string();
        T::from_value(value)
            .map(Some)
            .ok_or_else(|| ParameterError::not_of(T::KIND, name, text))
    }

    /// Has `hear` told of every change of a parameter after it has taken effect, on the thread that sets it.
    ///
    /// `hear` may read parameters; it must neither set one nor listen to one. A parameter that is set to the value that
    /// it has does not change.
    ///
    /// # Errors
    /// A parameter that is not declared.
    pub fn on_change(
        &self,
        name: &str,
        hear: impl FnMut(&ParameterValue) + Send + 'static,
    ) -> Result<(), ParameterError> {
        self.spec(name)?;
        let mut listeners = lock(&self.0.listeners);
        let of = listeners.of.entry(name.into()).or_default();
        of.push(Box::new(hear));
        Ok(())
    }

    /// Has `record` told of all that is set at once, as [`on_change`](Self::on_change) does; it begins with `first`,
    /// which gets the values of all parameters that are set, and ends when `record` says no.
    pub(super) fn on_any_change(
        &self,
        first: impl FnOnce(Vec<(String, ParameterValue)>),
        record: impl FnMut(&[(String, ParameterValue)]) -> bool + Send + 'static,
    ) {
        let mut listeners = lock(&self.0.listeners);
        let values = lock(&self.0.values).values.clone();
        let set = |(_, value): &(String, ParameterValue)| *value != ParameterValue::NotSet;
        first(values.into_iter().filter(set).collect());
        listeners.all.push(Box::new(record));
    }

    /// Another number after each change of a parameter. Does not lock.
    pub fn generation(&self) -> u64 {
        self.0.generation.load(Ordering::Acquire)
    }

    /// Says whether the node is configured, which decides on [`Change::Unconfigured`]. It is not at first.
    pub fn configured(&self, configured: bool) {
        lock(&self.0.values).configured = configured;
    }

    /// Sets a parameter.
    ///
    /// # Errors
    /// A parameter that is not declared or cannot change now, a value that is not accepted.
    pub fn set(&self, name: &str, value: ParameterValue) -> Result<(), ParameterError> {
        self.set_all(vec![(name.into(), value)])
    }

    /// Sets all of these parameters, or none if one of them cannot be set.
    ///
    /// # Errors
    /// As [`set`](Self::set).
    pub fn set_all(&self, values: Vec<(String, ParameterValue)>) -> Result<(), ParameterError> {
        let mut listeners = lock(&self.0.listeners);
        let mut accepted = Vec::with_capacity(values.len());
        for (name, value) in values {
            let spec = self.spec(&name)?;
            if spec.change == Change::Never {
                return Err(ParameterError::ReadOnly { name, value });
            }
            accepted.push((spec.change, name, spec.accept(value)?));
        }
        let set = lock(&self.0.values).apply(accepted)?;
        self.0
            .generation
            .fetch_add(u64::from(!set.changed.is_empty()), Ordering::Release);
        for (name, value) in &set.changed {
            for hear in listeners.of.get_mut(name).into_iter().flatten() {
                hear(value);
            }
        }
        listeners.all.retain_mut(|record| record(&set.all));
        Ok(())
    }

    pub(super) fn names(&self) -> impl Iterator<Item = &str> {
        self.0.specs.keys().map(String::as_str)
    }

    pub(super) fn spec(&self, name: &str) -> Result<&ParameterSpec, ParameterError> {
        self.0
            .specs
            .get(name)
            .ok_or_else(|| ParameterError::NotDeclared {
                name: name.into(),
                known: self.names().map(Into::into).collect(),
            })
    }

    pub(super) fn value(&self, name: &str) -> Result<ParameterValue, ParameterError> {
        self.spec(name)?;
        Ok(lock(&self.0.values)
            .values
            .get(name)
            .cloned()
            .unwrap_or_default())
    }
}

/// What has been set.
struct Set {
    all: Vec<(String, ParameterValue)>,
    changed: Vec<(String, ParameterValue)>,
}

impl Values {
    fn apply(
        &mut self,
        accepted: Vec<(Change, String, ParameterValue)>,
    ) -> Result<Set, ParameterError> {
        // Here, where nobody can configure the node meanwhile.
        if self.configured
            && let Some((_, name, value)) = accepted
                .iter()
                .find(|(change, ..)| *change == Change::Unconfigured)
        {
            return Err(ParameterError::Configured {
                name: name.clone(),
                value: value.clone(),
            });
        }
        let mut set = Set {
            all: Vec::new(),
            changed: Vec::new(),
        };
        for (_, name, value) in accepted {
            let former = self.values.insert(name.clone(), value.clone());
            if former.as_ref() != Some(&value) {
                set.changed.push((name.clone(), value.clone()));
            }
            set.all.push((name, value));
        }
        Ok(set)
    }
}

impl fmt::Debug for Parameters {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_tuple("Parameters")
            .field(&lock(&self.0.values).values)
            .finish()
    }
}
