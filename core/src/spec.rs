//! The frozen spec: all that an outcome depends on but its index. Its digest is the campaign's identity.
//!
//! The canonical form is JSON with the fields in the order of the structs here and numbers in their shortest
//! form that reads back to the same bits, so that the digest is the same on every host.

use crate::campaign::Model;
use crate::copula::Copula;
use crate::marginal::Marginal;
use crate::site::Property;
use serde::{Deserialize, Serialize};
use thiserror::Error;

/// Version of the meaning of a spec: raised whenever the same spec would give other bits.
pub const SPEC_FORMAT: u32 = 3;

/// A random property with its marginal.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RandomProperty {
    /// Which property.
    pub property: Property,
    /// Its distribution, in the property's edge unit.
    pub marginal: Marginal,
}

/// The frozen spec.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Spec {
    /// [`SPEC_FORMAT`] of the program that froze it.
    pub format: u32,
    /// Campaign seed.
    pub seed: u64,
    /// Random properties in the order of [`Property::ALL`].
    pub random: Vec<RandomProperty>,
    /// Dependence between them.
    pub copula: Copula,
    /// Everything else that moves an outcome.
    pub model: Model,
}

/// A spec that cannot be used.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum SpecError {
    /// Not the JSON of a spec.
    #[error("not a spec: {0}")]
    Form(String),
    /// Written by a program whose specs mean something else.
    #[error("spec format {found} is not {SPEC_FORMAT}, the one this build works with")]
    Format {
        /// Format found.
        found: u32,
    },
}

impl Spec {
    /// The canonical JSON text.
    pub fn to_json(&self) -> String {
        serde_json::to_string(self).expect("a spec holds only numbers, words and lists")
    }

    /// Reads a spec from its JSON text.
    ///
    /// # Errors
    /// Text that is no spec, or a spec of another format.
    pub fn from_json(text: &str) -> Result<Spec, SpecError> {
        let spec: Spec = serde_json::from_str(text).map_err(|e| SpecError::Form(e.to_string()))?;
        if spec.format != SPEC_FORMAT {
            return Err(SpecError::Format { found: spec.format });
        }
        Ok(spec)
    }

    /// The campaign's identity: BLAKE3 of the canonical JSON, 64 hexadecimal digits.
    pub fn digest(&self) -> String {
        blake3::hash(self.to_json().as_bytes()).to_hex().to_string()
    }
}
