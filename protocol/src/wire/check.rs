//! Checks that several messages share. Each names the field, what it allows and what it holds.

use zerocopy::little_endian::{F32, U32};
use zerocopy::{Immutable, IntoBytes};

use crate::error::{Error, Result};
use crate::layout::EnumLayout;
use crate::limits::MAX_TIME_NS;
use crate::message::MessageKind;

/// An enum made by `wire_enum!`.
pub(crate) trait Coded: Sized {
    const LAYOUT: EnumLayout;
    fn from_code(code: u32) -> Option<Self>;
}

/// The checks of one message.
#[derive(Clone, Copy)]
pub(crate) struct Check(pub(crate) MessageKind);

impl Check {
    pub(crate) fn fail<T>(
        self,
        field: &'static str,
        expected: impl Into<String>,
        found: impl ToString,
    ) -> Result<T> {
        Err(Error::field(self.0, field, expected, found))
    }

    pub(crate) fn coded<E: Coded>(self, field: &'static str, code: U32) -> Result<E> {
        E::from_code(code.get()).map_or_else(
            || {
                let known: Vec<String> = E::LAYOUT
                    .values
                    .iter()
                    .map(|(code, name)| format!("{code} ({name})"))
                    .collect();
                self.fail(field, known.join(", "), code.get())
            },
            Ok,
        )
    }

    /// Bits outside `known` are refused.
    pub(crate) fn flags(self, field: &'static str, flags: U32, known: u32) -> Result<u32> {
        match flags.get() {
            bits if bits & !known == 0 => Ok(bits),
            bits => self.fail(field, format!("bits within {known:#x}"), format!("{bits:#x}")),
        }
    }

    pub(crate) fn zero<T: IntoBytes + Immutable + ?Sized>(
        self,
        field: &'static str,
        part: &T,
    ) -> Result<()> {
        let used = part.as_bytes().iter().enumerate().find(|&(_, &byte)| byte != 0);
        match used {
            None => Ok(()),
            Some((index, byte)) => {
                let found = format!("{byte} in byte {index}");
                self.fail(field, "zero bytes where the part is absent or reserved", found)
            }
        }
    }

    pub(crate) fn range(self, field: &'static str, value: u64, min: u64, max: u64) -> Result<()> {
        if (min..=max).contains(&value) {
            return Ok(());
        }
        self.fail(field, format!("{min} to {max}"), value)
    }

    pub(crate) fn time(self, field: &'static str, ns: u64) -> Result<u64> {
        self.range(field, ns, 0, MAX_TIME_NS)?;
        Ok(ns)
    }
}

pub(crate) fn floats<const N: usize>(raw: &[F32; N]) -> [f32; N] {
    raw.map(F32::get)
}

pub(crate) fn raw_floats<const N: usize>(values: &[f32; N]) -> [F32; N] {
    values.map(F32::new)
}
