use thiserror::Error;

/// Most combinations.
const MOST: usize = 100_000;

/// A key of a scene with the values that it takes, as texts of TOML.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Variation {
    /// The key, such as `run.steps` or `bodies.chaser.mass`.
    pub key: String,
    /// Its values.
    pub values: Vec<String>,
}

/// A value for each key that varies.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Combination(Vec<(String, String)>);

/// Why there are no combinations.
#[derive(Clone, Debug, Error, PartialEq, Eq)]
pub enum SweepError {
    /// A key has no values.
    #[error("`{key}` has no values, expected at least one")]
    Empty {
        /// The key.
        key: String,
    },
    /// A key comes more than once.
    #[error("`{key}` comes twice, expected each key once")]
    Twice {
        /// The key.
        key: String,
    },
    /// There are more than can be flown.
    #[error("{count} combinations, expected at most {MOST}")]
    TooMany {
        /// How many there are.
        count: usize,
    },
}

impl Combination {
    /// Keys and values, in the order of the variations.
    pub fn settings(&self) -> &[(String, String)] {
        &self.0
    }

    fn and(&self, key: &str, value: &str) -> Self {
        let mut all = self.0.clone();
        all.push((key.to_owned(), value.to_owned()));
        Self(all)
    }
}

/// All combinations of the values, the last key varying fastest.
///
/// # Errors
/// A key without values or that comes twice, or more than 100 000 combinations.
pub fn combinations(vary: &[Variation]) -> Result<Vec<Combination>, SweepError> {
    for (index, Variation { key, values }) in vary.iter().enumerate() {
        let key = || key.clone();
        if values.is_empty() {
            return Err(SweepError::Empty { key: key() });
        }
        if vary[..index].iter().any(|other| other.key == key()) {
            return Err(SweepError::Twice { key: key() });
        }
    }
    let counts = vary.iter().map(|one| one.values.len());
    let count = counts.fold(1_usize, usize::saturating_mul);
    if count > MOST {
        return Err(SweepError::TooMany { count });
    }
    let mut all = vec![Combination::default()];
    for Variation { key, values } in vary {
        let extended = all
            .iter()
            .flat_map(|before| values.iter().map(|value| before.and(key, value)));
        all = extended.collect();
    }
    Ok(all)
}
