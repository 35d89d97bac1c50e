//! The values of a column before they are written to a file.

use arrow_array::builder::{BooleanBuilder, PrimitiveBuilder, StringBuilder};
use arrow_array::types::{ArrowPrimitiveType, Float32Type, Int32Type, Int64Type};
use arrow_array::{ArrayRef, FixedSizeListArray};
use arrow_schema::{ArrowError, DataType, Field};
use serde::Serialize;
use std::sync::Arc;

/// Type of a value.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Kind {
    /// Text.
    Text,
    /// True or false.
    Bool,
    /// 32-bit integer.
    I32,
    /// 64-bit integer.
    I64,
    /// 32-bit float.
    F32,
}

impl Kind {
    fn data_type(self) -> DataType {
        match self {
            Self::Text => DataType::Utf8,
            Self::Bool => DataType::Boolean,
            Self::I32 => DataType::Int32,
            Self::I64 => DataType::Int64,
            Self::F32 => DataType::Float32,
        }
    }

    /// Bytes of a value in memory; of a text about so many.
    pub(crate) fn bytes(self) -> usize {
        match self {
            Self::Bool => 1,
            Self::I32 | Self::F32 => 4,
            Self::I64 | Self::Text => 8,
        }
    }
}

/// Field of a column in the schema of Arrow.
pub(crate) fn field(name: &str, kind: Kind, length: Option<usize>) -> Field {
    match length {
        None => Field::new(name, kind.data_type(), true),
        Some(length) => {
            let length = i32::try_from(length).unwrap_or(i32::MAX);
            Field::new(name, DataType::FixedSizeList(item(kind), length), false)
        }
    }
}

fn item(kind: Kind) -> Arc<Field> {
    Arc::new(Field::new("item", kind.data_type(), false))
}

/// Values of a column for some rows.
pub(crate) struct Store {
    values: Values,
    kind: Kind,
    length: Option<usize>,
    marks: Vec<bool>,
}

enum Values {
    Text(StringBuilder),
    Bool(BooleanBuilder),
    I32(PrimitiveBuilder<Int32Type>),
    I64(PrimitiveBuilder<Int64Type>),
    F32(PrimitiveBuilder<Float32Type>),
}

impl Store {
    pub(crate) fn new(kind: Kind, length: Option<usize>) -> Self {
        Self {
            values: match kind {
                Kind::Text => Values::Text(StringBuilder::new()),
                Kind::Bool => Values::Bool(BooleanBuilder::new()),
                Kind::I32 => Values::I32(PrimitiveBuilder::new()),
                Kind::I64 => Values::I64(PrimitiveBuilder::new()),
                Kind::F32 => Values::F32(PrimitiveBuilder::new()),
            },
            kind,
            length,
            marks: Vec::new(),
        }
    }

    /// Adds a text.
    pub(crate) fn text(&mut self, value: &str) {
        if let Values::Text(values) = &mut self.values {
            values.append_value(value);
        }
    }

    /// Adds true or false.
    pub(crate) fn flag(&mut self, value: bool) {
        if let Values::Bool(values) = &mut self.values {
            values.append_value(value);
        }
    }

    /// Adds a list of what `mark` marks.
    pub(crate) fn mark(&mut self, mark: impl FnOnce(&mut Vec<bool>)) {
        mark(&mut self.marks);
        if let Values::Bool(values) = &mut self.values {
            values.append_slice(&self.marks);
        }
    }

    /// Adds a whole number, which the spec's limits keep within the type.
    pub(crate) fn integer(&mut self, value: u64) {
        self.signed(i64::try_from(value).unwrap_or(i64::MAX));
    }

    /// Adds a whole number.
    pub(crate) fn signed(&mut self, value: i64) {
        match &mut self.values {
            Values::I32(values) => values.append_value(i32::try_from(value).unwrap_or(i32::MAX)),
            Values::I64(values) => values.append_value(value),
            _ => {}
        }
    }

    /// Adds a list of whole numbers.
    pub(crate) fn integers(&mut self, values: impl Iterator<Item = i64>) {
        for value in values {
            self.signed(value);
        }
    }

    /// Adds a number.
    pub(crate) fn number(&mut self, value: f64) {
        self.numbers(&[value]);
    }

    /// Adds a number, if there is one.
    pub(crate) fn maybe(&mut self, value: Option<f64>) {
        match value {
            Some(value) => self.number(value),
            None => self.null(),
        }
    }

    /// Adds a list of numbers.
    #[expect(clippy::cast_possible_truncation, reason = "files hold single precision")]
    pub(crate) fn numbers(&mut self, new: &[f64]) {
        if let Values::F32(values) = &mut self.values {
            for value in new {
                values.append_value(*value as f32);
            }
        }
    }

    /// Adds that there is no value.
    pub(crate) fn null(&mut self) {
        match &mut self.values {
            Values::Text(values) => values.append_null(),
            Values::Bool(values) => values.append_null(),
            Values::I32(values) => values.append_null(),
            Values::I64(values) => values.append_null(),
            Values::F32(values) => values.append_null(),
        }
    }

    /// The values so far as an array, after which there are none.
    ///
    /// # Errors
    /// [`ArrowError`] when a row had a list of another length.
    pub(crate) fn take(&mut self) -> Result<ArrayRef, ArrowError> {
        fn finish<T: ArrowPrimitiveType>(values: &mut PrimitiveBuilder<T>) -> ArrayRef {
            Arc::new(values.finish())
        }
        let flat: ArrayRef = match &mut self.values {
            Values::Text(values) => Arc::new(values.finish()),
            Values::Bool(values) => Arc::new(values.finish()),
            Values::I32(values) => finish(values),
            Values::I64(values) => finish(values),
            Values::F32(values) => finish(values),
        };
        let Some(length) = self.length else { return Ok(flat) };
        let length = i32::try_from(length).unwrap_or(i32::MAX);
        Ok(Arc::new(FixedSizeListArray::try_new(
            item(self.kind),
            length,
            flat,
            None,
        )?))
    }
}
